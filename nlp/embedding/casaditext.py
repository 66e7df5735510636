"""C as CasADi generates it, without what a controller does not need.

Beside each function CasADi writes a dozen that return names, sizes and sparsities, by which it loads a library. A
controller calls none of them, and together they are a fifth of the machine code. Each number of an input is read after
a test whether the input is given at all. Here every input is given, and the tests are a tenth of the machine code.
"""

from __future__ import annotations

import re

#: Ends of the names of these functions.
_QUERIES = (
    "alloc_mem|init_mem|free_mem|checkout|release|incref|decref|n_in|n_out|default_in|name_in|name_out|"
    "sparsity_in|sparsity_out|work|work_bytes"
)
#: One of them: its body has no empty line, and may end on the first line.
_DEFINITION = re.compile(
    rf"^CASADI_SYMBOL_EXPORT [^\n]*_(?:{_QUERIES})\([^\n]*\) \{{[^\n]*\n(?:[^\n]+\n)*\n?", re.MULTILINE
)
_DECLARATION = re.compile(rf"^CASADI_SYMBOL_EXPORT [^\n]*_(?:{_QUERIES})\([^\n]*\);\n", re.MULTILINE)
#: Sparsities, which only these functions read.
_SPARSITY = re.compile(r"^(?:#define casadi_s\d+ |static const casadi_int casadi_s\d+\[)[^\n]*\n", re.MULTILINE)
#: A number of an input, with its test.
_TESTED = re.compile(r"(arg\[\d+\])\? (\1\[\d+\]) : 0;")


#: First line of a function that is left. Not every one uses all of its parameters, and none of them its memory.
_BEGIN = re.compile(
    r"^((?:static|CASADI_SYMBOL_EXPORT) int \w+\(const casadi_real\*\* arg, casadi_real\*\* res, casadi_int\* iw, "
    r"casadi_real\* w, int mem\) ?\{)$",
    re.MULTILINE,
)
_USED = "(void)arg, (void)res, (void)iw, (void)w, (void)mem;"


def for_controllers(text: str) -> str:
    """Return the text of a source or of a header without these functions, their tables, and tests of inputs.

    Parameters are used in name, so that no compiler warns of those that are not.
    """
    for pattern in (_DEFINITION, _DECLARATION, _SPARSITY):
        text = pattern.sub("", text)
    return _TESTED.sub(r"\2;", _BEGIN.sub(rf"\1\n{_USED}", text))
