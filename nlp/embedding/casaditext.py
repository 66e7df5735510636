"""C as CasADi generates it, without the functions by which CasADi loads a library.

Beside each function CasADi writes a dozen that return names, sizes and sparsities. A controller calls none of them, and
together they are a fifth of the machine code.
"""

from __future__ import annotations

import re

#: Ends of the names of these functions.
_QUERIES = (
    "alloc_mem|init_mem|free_mem|checkout|release|incref|decref|n_in|n_out|default_in|name_in|name_out|"
    "sparsity_in|sparsity_out|work|work_bytes"
)
#: One of them: its body has no empty line.
_DEFINITION = re.compile(rf"^CASADI_SYMBOL_EXPORT [^\n]*_(?:{_QUERIES})\([^\n]*\) \{{\n(?:[^\n]+\n)+\n?", re.MULTILINE)
_DECLARATION = re.compile(rf"^CASADI_SYMBOL_EXPORT [^\n]*_(?:{_QUERIES})\([^\n]*\);\n", re.MULTILINE)
#: Sparsities, which only these functions read.
_SPARSITY = re.compile(r"^(?:#define casadi_s\d+ |static const casadi_int casadi_s\d+\[)[^\n]*\n", re.MULTILINE)


def without_queries(text: str) -> str:
    """Return the text of a source or of a header without these functions and their tables."""
    for pattern in (_DEFINITION, _DECLARATION, _SPARSITY):
        text = pattern.sub("", text)
    return text
