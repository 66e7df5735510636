"""C for embedding: the objective of a case as a folder of C99 that needs nothing of ours at run time.

CasADi generates the functions; around them stand a header with every number's name, unit, bounds and default, readable
wrappers, a test against values from Python, timings, and build files, all from the templates in ``nlp/c``. The same
case and versions give the same bytes.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from string import Template

import casadi as ca
import numpy as np

from screwsynth.models import Dimension, FloatArray
from screwsynth.nlp.case import Case
from screwsynth.nlp.errors import InputError
from screwsynth.nlp.formulation import formulate
from screwsynth.nlp.program import Nlp, Program
from screwsynth.nlp.sampling import starting_points

_TEMPLATES = Path(__file__).parent / "c"
#: Points of the self-test, and the seed that they are drawn with.
_POINTS = 8
_SEED = 1


def identifier(name: str) -> str:
    """The prefix of a case's C names: valid in C whatever the case is called."""
    return "screwsynth_" + re.sub(r"[^0-9a-z]+", "_", name.lower(), flags=re.ASCII).strip("_")


def generate_c(case: Case, source: str) -> dict[str, str]:
    """The files of a case's C folder.

    The task whose twist is the default is the case's first; the twist is a run-time argument like everything fixed.

    Args:
        case: the case.
        source: text of its case file, which goes into the folder.

    Returns:
        Text by file name.

    Raises:
        InputError: the case contradicts itself, or its functions have no finite value anywhere.
    """
    nlp = formulate(case)
    functions = _functions(nlp.program, identifier(case.name))
    names = _names(nlp, functions)
    files = {f"{names['id']}{ending}": _filled(f"api{ending}.in", names) for ending in (".h", ".c")}
    for name in ("selftest.c", "bench.c", "Makefile", "CMakeLists.txt", "README.md"):
        files[name] = _filled(f"{name}.in", names)
    return files | _casadi_files(functions, f"{names['id']}_casadi") | {"case.toml": source}


def _filled(template: str, names: dict[str, str]) -> str:
    return Template((_TEMPLATES / template).read_text(encoding="utf-8")).substitute(names)


def _functions(program: Program, prefix: str) -> tuple[ca.Function, ...]:
    """The functions of the interface, dense, in the order that the README lists them."""
    x, p, F, g = program.x, program.p, program.objective, program.g
    hessian, gradient = ca.hessian(F, x)
    outputs = {
        "F": [F],
        "F_gradient": [F, gradient],
        "F_hessian": [F, gradient, hessian],
        "jacobian": [program.robot.jacobian],
        "rates": [program.robot.rates],
        "limits": [g, ca.jacobian(g, x)],
        "rotation": [program.robot.rotation],
    }
    return tuple(
        ca.Function(f"{prefix}_casadi_{name}", [x, p], [ca.densify(each) for each in expressions])
        for name, expressions in outputs.items()
    )


def _casadi_files(functions: Iterable[ca.Function], name: str) -> dict[str, str]:
    generator = ca.CodeGenerator(f"{name}.c", {"with_header": True, "casadi_int": "int"})
    for function in functions:
        generator.add(function)
    # CasADi writes files only.
    with tempfile.TemporaryDirectory() as folder:
        generator.generate(folder + os.sep)
        return {f"{name}{end}": (Path(folder) / f"{name}{end}").read_text(encoding="utf-8") for end in (".c", ".h")}


def _names(nlp: Nlp, functions: Sequence[ca.Function]) -> dict[str, str]:
    """What stands in the templates' places."""
    case, program = nlp.case, nlp.program
    prefix = identifier(case.name)
    size = len(prefix) + len("_casadi_")
    points, references = _references(nlp, functions)
    return {
        "id": prefix,
        "ID": prefix.upper(),
        "title": _comment(case.title or case.name),
        "version": version("screwsynth"),
        "casadi": ca.CasadiMeta.version(),
        "length": _comment(case.units.length),
        "n": str(nlp.n),
        "np": str(len(program.arguments)),
        "m": str(len(program.model.wrenches)),
        "nc": str(len(program.constraints)),
        "ntasks": str(len(case.tasks)),
        "twist": str([argument.name for argument in program.arguments].index("twist_0")),
        "work": str(max(1, *(function.sz_w() for function in functions))),
        "sz_arg": str(max(function.sz_arg() for function in functions)),
        "sz_res": str(max(function.sz_res() for function in functions)),
        "tables": _tables(nlp, prefix),
        "count": str(points),
        "references": references,
        "operations": "\n".join(f"| `{f.name()[size:]}` | {f.n_instructions()} |" for f in functions),
    }


def _tables(nlp: Nlp, prefix: str) -> str:
    """Names, units, bounds and defaults as constant tables, each ended by a zero so that none is empty."""
    case, program = nlp.case, nlp.program
    units = {Dimension.LENGTH: case.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: ""}
    lower, upper = (np.nan_to_num(bound, neginf=-1e300, posinf=1e300) for bound in (nlp.g_lower, nlp.g_upper))
    N, P, M, C, T = (f"{prefix.upper()}_{each}" for each in ("N", "P", "M", "C", "TASKS"))
    blocks = [
        "/* Free variables: names, units, bounds, and where a search may begin. */",
        _texts(f"{prefix}_variable_names", N, [each.name for each in program.variables]),
        _texts(f"{prefix}_variable_units", N, [units[each.dimension] for each in program.variables]),
        _numbers(f"{prefix}_variable_lower", N, nlp.lower),
        _numbers(f"{prefix}_variable_upper", N, nlp.upper),
        _numbers(f"{prefix}_variable_starts", N, nlp.start),
        "/* Fixed numbers: names, units, and the case's values. */",
        _texts(f"{prefix}_parameter_names", P, [each.name for each in program.arguments]),
        _texts(f"{prefix}_parameter_units", P, [units[each.dimension] for each in program.arguments]),
        _numbers(f"{prefix}_parameter_defaults", P, nlp.arguments),
        "/* Rows of the Jacobian: the limb of each, and whether it applies a force or a couple. */",
        _texts(f"{prefix}_row_limbs", M, [row.limb for row in program.model.wrenches]),
        _texts(f"{prefix}_row_kinds", M, [row.kind.value for row in program.model.wrenches]),
        "/* Constraints: names and bounds; 1e300 is none. */",
        _texts(f"{prefix}_constraint_names", C, [each.name for each in program.constraints]),
        _numbers(f"{prefix}_constraint_lower", C, lower),
        _numbers(f"{prefix}_constraint_upper", C, upper),
        "/* Tasks: names, and twists of six numbers each. */",
        _texts(f"{prefix}_task_names", T, [task.name for task in case.tasks]),
        _numbers(f"{prefix}_task_twists", f"6 * {T}", np.concatenate([np.asarray(task.twist) for task in case.tasks])),
    ]
    return "\n".join(blocks) + "\n"


def _texts(name: str, size: str, texts: Iterable[str]) -> str:
    quoted = ", ".join([*(_quoted(text) for text in texts), "0"])
    return f"static const char *const {name}[{size} + 1] = {{{quoted}}};"


def _numbers(name: str, size: str, values: Iterable[float]) -> str:
    listed = ", ".join([*(repr(float(value)) for value in values), "0.0"])
    return f"static const double {name}[{size} + 1] = {{{listed}}};"


def _quoted(text: str) -> str:
    """A C string literal: UTF-8 bytes outside of ASCII as octal escapes, which end after three digits."""
    plain = (chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in text.encode())
    return f'"{"".join(plain)}"'


def _comment(text: str) -> str:
    """A text that cannot end a C comment or begin another line."""
    return re.sub(r"\s+", " ", text).replace("*/", "* /").replace("/*", "/ *")


def _references(nlp: Nlp, functions: Sequence[ca.Function]) -> tuple[int, str]:
    """Number of points of the self-test, and the C tables of its points and values."""
    rows: list[list[FloatArray]] = []
    for x in starting_points(nlp, 4 * _POINTS + 1, _SEED)[1:]:
        values = [_called(function, x, nlp) for function in functions]
        flat = [x, values[0][0], values[1][1], values[2][2], values[3][0], values[4][0], values[5][0], values[6][0]]
        if all(np.isfinite(each).all() for each in flat):
            rows.append([np.asarray(each) for each in flat])
        if len(rows) == (_POINTS if nlp.n else 1):
            break
    if not rows:
        raise InputError(f"{nlp.case.source or nlp.case.name}: F has no finite value at any point that was tried")
    results = ("F", "gradient", "hessian", "jacobian", "rates", "limits", "rotation")
    tables = ("points", *(f"reference_{result}" for result in results))
    lines = []
    for column, name in enumerate(tables):
        cells = [", ".join(repr(float(v)) for v in [*row[column].ravel(), 0.0]) for row in rows]
        body = ",\n    ".join(f"{{{cell}}}" for cell in cells)
        lines.append(f"static const double {name}[{len(rows)}][{rows[0][column].size + 1}] = {{\n    {body}}};\n")
    return len(rows), "\n".join(lines)


def _called(function: ca.Function, x: FloatArray, nlp: Nlp) -> list[FloatArray]:
    """Results of a function as arrays, row after row."""
    results = function.call([ca.DM(x), ca.DM(nlp.arguments)])
    return [result.full() for result in results]
