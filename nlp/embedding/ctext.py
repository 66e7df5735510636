"""C text: tables, string literals, comments, identifiers and macros, valid for any names in a case.

CasADi's C has more than a controller needs. For each function CasADi writes a dozen others with names, sizes and
sparsities for loading a library, together a fifth of the machine code. Tests for missing inputs are another tenth. Both
are removed here: a controller calls none of these functions, and gives every input.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from typing import ClassVar

from ...models import FloatArray
from ..errors import one_line
from ..program.program import Program

#: Value of a missing bound in tables of C.
NO_BOUND = 1e300


def identifier(name: str) -> str:
    """Return the prefix of a case's C names, an identifier of C for any name of a case.

    Generated names continue the prefix by a single word or a capitalised word, and names of files by a hyphen. So two
    cases with different prefixes have no name in common.
    """
    plain = re.sub(r"[^0-9a-z]+", "_", name.lower(), flags=re.ASCII).strip("_")
    return f"screwsynth_{plain or 'case'}"


def c_name(name: str) -> str:
    """Return the suffix of a C name for any name in a case: letters, digits and underscores stay unchanged."""
    return re.sub(r"[^0-9A-Za-z]+", "_", name).strip("_") or "unnamed"


def c_names(names: Iterable[str]) -> list[str]:
    """Return the suffixes of C names for names in a case; equal suffixes get an index at the end."""
    found: list[str] = []
    for index, name in enumerate(names):
        plain = c_name(name)
        while plain in found:
            plain = f"{plain}_{index}"
        found.append(plain)
    return found


def string_table(name: str, size: str, values: Iterable[str]) -> str:
    """Return a constant table of strings."""
    return _table(f"char *const {name}", size, [*map(string_literal, values), "0"])


def number_table(name: str, size: str, values: Iterable[float]) -> str:
    """Return a constant table of numbers; infinite bounds become :data:`NO_BOUND`."""
    return _table(f"double {name}", size, [repr(max(-NO_BOUND, min(float(each), NO_BOUND))) for each in [*values, 0]])


def integer_table(name: str, size: str, values: Iterable[int]) -> str:
    """Return a constant table of whole numbers."""
    return _table(f"int {name}", size, map(str, [*values, 0]))


def _table(name: str, size: str, cells: Iterable[str]) -> str:
    """Return a constant table, one entry a line, with an additional last entry so that it is never empty."""
    lines = ",\n    ".join(cells)
    return f"static const {name}[{size} + 1] = {{\n    {lines}}};"


def short_table(name: str, values: Iterable[int]) -> str:
    """Return a constant table of small whole numbers, with a final zero so that it is never empty."""
    return f"static const short {name}[] = {{{', '.join(map(str, [*values, 0]))}}};"


def matrix_table(declaration: str, rows: Iterable[FloatArray]) -> str:
    """Return a constant table of rows of numbers; each row has a final zero."""
    cells = (", ".join(repr(float(value)) for value in [*row, 0.0]) for row in rows)
    body = ",\n    ".join(f"{{{cell}}}" for cell in cells)
    return f"static const double {declaration} = {{\n    {body}}};\n"


def comment_text(text: str) -> str:
    """Return a text for a C comment: without comment marks and line breaks, and with control characters escaped."""
    return one_line(re.sub(r"\s+", " ", text)).replace("*/", "* /").replace("/*", "/ *")


def string_literal(text: str) -> str:
    """Return a C string literal, with three-digit octal escapes for UTF-8 bytes outside ASCII."""
    plain = (chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in text.encode())
    return f'"{"".join(plain)}"'


def name_cases(names: Iterable[str]) -> str:
    """Return the cases of a switch over an index, which return names: a table of pointers would be data to relocate."""
    return "\n".join(f"        case {k}: return {string_literal(name)};" for k, name in enumerate(names))


def index_macros(program: Program, prefix: str) -> str:
    """Return a macro for the index of every entry of x and p, such as ``PREFIX_x_p_z``.

    These macros continue the prefix by a small letter, unlike all others, so they never collide with macros of another
    case.
    """
    lines = ["/* Indices of the entries of x and of p. */"]
    for vector, scalars in (("x", program.variables), ("p", program.arguments)):
        names = c_names(scalar.name for scalar in scalars)
        lines += [f"#define {prefix.upper()}_{vector}_{name} {index}" for index, name in enumerate(names)]
    return "\n".join(lines) + "\n"


class Macros:
    """Macros of C texts with whole-number values: sums, products and comparisons of macros and of parameters.

    For two macros with the same name, the macro of the later text counts.
    """

    _DEFINITION = re.compile(r"^#define (\w+)(?:\(([\w, ]+)\))?[ \t]+(.+?)[ \t]*$", re.MULTILINE)
    _OPERATIONS: ClassVar[Mapping[type, Callable[[int, int], int]]] = {
        ast.Add: operator.add,
        ast.Mult: operator.mul,
        ast.Gt: operator.gt,
    }

    def __init__(self, *texts: str) -> None:
        joined = re.sub(r"/\*.*?\*/", "", "\n".join(texts), flags=re.DOTALL).replace("\\\n", " ")
        self._found = {name: (each.split(", "), body) for name, each, body in self._DEFINITION.findall(joined)}

    def value(self, name: str, *arguments: int) -> int:
        """Return the value of a macro for given arguments."""
        parameters, body = self._found[name]
        return self._evaluated(body, dict(zip(parameters, arguments, strict=False)))

    def sum_of_parts(self, name: str) -> int:
        """Return the sum of the counts in a macro with a list such as ``part(values, 3 * N) part(rows, N)``."""
        return sum(self._evaluated(count, {}) for count in re.findall(r"\w+\(\w+, ([^()]+)\)", self._found[name][1]))

    def _evaluated(self, expression: str, given: Mapping[str, int]) -> int:
        def of(node: ast.expr) -> int:
            match node:
                case ast.Constant(int(number)):
                    return number
                case ast.Name(name):
                    return given[name] if name in given else self.value(name)
                case ast.Call(ast.Name(name), arguments):
                    return self.value(name, *map(of, arguments))
                case ast.BinOp(left, operation, right) | ast.Compare(left, [operation], [right]):
                    return int(self._OPERATIONS[type(operation)](of(left), of(right)))
            raise ValueError(f"{expression!r} is not a supported expression of whole numbers")

        return of(ast.parse(expression, mode="eval").body)


def version_texts(version: str) -> dict[str, str]:
    """Return the texts of the placeholders for a version such as ``1.2.3``; missing parts are 0."""
    parts = [*(match.group() for match in re.finditer(r"\d+", version)), "0", "0", "0"]
    named = dict(zip(("version_major", "version_minor", "version_patch"), parts, strict=False))
    # Semantic versioning: a minor version may break compatibility only if the major version is 0.
    named["compatibility"] = "SameMinorVersion" if int(parts[0]) == 0 else "SameMajorVersion"
    number = (int(parts[0]) * 1000 + int(parts[1])) * 1000 + int(parts[2])
    return {"version": version, "version_number": str(number)} | named


#: Suffixes of the functions that CasADi adds for loading a library.
_QUERIES = (
    "alloc_mem|init_mem|free_mem|checkout|release|incref|decref|n_in|n_out|default_in|name_in|name_out|"
    "sparsity_in|sparsity_out|work|work_bytes"
)
#: Definition of such a function: its body has no empty line, and may end on the first line.
_DEFINITION = re.compile(
    rf"^CASADI_SYMBOL_EXPORT [^\n]*_(?:{_QUERIES})\([^\n]*\) \{{[^\n]*\n(?:[^\n]+\n)*\n?", re.MULTILINE
)
_DECLARATION = re.compile(rf"^CASADI_SYMBOL_EXPORT [^\n]*_(?:{_QUERIES})\([^\n]*\);\n", re.MULTILINE)
#: Sparsities, which only these functions read.
_SPARSITY = re.compile(r"^(?:#define casadi_s\d+ |static const casadi_int casadi_s\d+\[)[^\n]*\n", re.MULTILINE)
#: Value of an input, with its test.
_TESTED = re.compile(r"(arg\[\d+\])\? (\1\[\d+\]) : 0;")


#: First line of a remaining function, which may not use all of its parameters, and none of their memory.
_BEGIN = re.compile(
    r"^((?:static|CASADI_SYMBOL_EXPORT) int \w+\(const casadi_real\*\* arg, casadi_real\*\* res, casadi_int\* iw, "
    r"casadi_real\* w, int mem\) ?\{)$",
    re.MULTILINE,
)
_USED = "(void)arg, (void)res, (void)iw, (void)w, (void)mem;"


def for_controllers(text: str) -> str:
    """Return the text of a source or header without the functions for loading, their tables, and tests of inputs.

    Unused parameters are cast to void, so that no compiler warns of them.
    """
    for pattern in (_DEFINITION, _DECLARATION, _SPARSITY):
        text = pattern.sub("", text)
    return _TESTED.sub(r"\2;", _BEGIN.sub(rf"\1\n{_USED}", text))
