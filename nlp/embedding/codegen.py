"""C for embedding: the objective and the solver of a case as a folder of C99 without Python libraries.

CasADi generates the functions. The templates in ``nlp/embedding/c`` add a header with name, unit, bounds and default of
all variables and parameters, readable wrappers, the solver, a self-test against values from Python, timings, and build
files. The same case and versions give the same bytes.
"""

from __future__ import annotations

from collections.abc import Mapping
from string import Template

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray
from .. import __version__
from ..case.case import Case
from ..case.task import Sense
from ..errors import InputError
from ..program.formulation import formulate_whole
from ..program.nlp import Nlp
from ..program.sampling import starting_points
from ..system.markdown import markdown_text
from .ctext import (
    Macros,
    comment_text,
    identifier,
    index_macros,
    integer_table,
    matrix_table,
    number_table,
    string_literal,
    string_table,
    version_texts,
)
from .kinematicsfiles import combined_kinematics
from .loops import find_loops
from .manifest import MANIFEST, NumberColumns, manifest_text, number_columns
from .measure import NOT_MEASURED
from .runtimelimits import fixed_condition_texts, fixed_conditions, limit_texts, run_time_limits
from .stages import StagedFunctions, loop_texts, stage_functions
from .subject import Subject, find_subject, magnitude_of, objective_words, turning_joints
from .templates import TEMPLATES, casadi_texts, fill_template
from .worstcase import worst_case_texts

#: Suffixes of the files whose names begin with the case's prefix, and their templates.
_PARTS = {
    ".h": "api.h",
    ".c": "api.c",
    "-solver.c": "solver.c",
    "-scaled.h": "scaled.h",
    "-scaled.c": "scaled.c",
    "-functions.h": "functions.h",
    "-limits.c": "limits.c",
    "-batch.c": "batch.c",
    ".hpp": "api.hpp",
}
#: Suffixes of the files of the search, which are complete C: the extension of ``nlp/screening`` is built from them too.
#: A folder replaces their prefix by that of the case.
_CORE = ("-sqp.h", "-search.h", "-sqp.c", "-step.c", "-restore.c", "-qp.c")
_CORE_PREFIX = "screwsynth"
#: Files of every folder without the prefix in their names.
_OTHERS = (
    *("selftest.c", "stack.c", "bench.c", "example.c", "example.cpp", "realtime.c", "sfunction.c"),
    *("Makefile", "CMakeLists.txt", "README.md"),
)
#: Number of starting points in the solver's table.
_SEEDS = 16
#: Number of points of the self-test, and the seed of their random choice.
_POINTS = 8
_SEED = 1
#: Size of generated C, bytes, above which it is announced with its reason: compilers take a minute for it.
_LARGE = 800_000
_NO_CASE_FILE = "# This case was built in Python: it has no case file.\n"


def generate_c(case: Case, source: str = _NO_CASE_FILE) -> dict[str, str]:
    """Generate the files of a case's C folder.

    Twists and weights of tasks are run-time arguments, as are all fixed parameters.

    Args:
        case: the case.
        source: text of the case file, which is included as ``case.toml``.

    Returns:
        Text by file name.

    Raises:
        CaseError: the case is inconsistent, or C cannot be generated for its tasks or its poses.
        InputError: the functions of the case have no finite value at any trial point.
    """
    return c_of_subject(find_subject(case), source)


def c_of_subject(subject: Subject, source: str = _NO_CASE_FILE) -> dict[str, str]:
    """Generate the files of :func:`generate_c` from the program of a case.

    Args:
        subject: program of the case, and its optimal value.
        source: text of the case file.
    """
    nlp = subject.nlp
    case, prefix = nlp.case, identifier(nlp.case.name)
    held = fixed_conditions(nlp)
    staged = stage_functions(nlp.program, magnitude_of(nlp), f"{prefix}_CASADI", held)
    limits = run_time_limits(nlp, f"{prefix}_CASADI")
    columns = number_columns(nlp, limits.limits, prefix)
    names = _substitutions(subject, staged, columns)
    names |= fixed_condition_texts(held, limits)
    names |= limit_texts(limits, prefix, columns.limits)
    core = {ending: _core_text(ending, prefix) for ending in _CORE}
    names |= _stated_texts(names, core)
    parts = _PARTS | ({"-home.c": "home.c"} if "signs" in staged.functions else {})
    parts |= {"-loops.c": "loops.c"} if staged.loops else {}
    parts |= {"-spectrum.c": "spectrum.c"} if staged.loops.spectra else {}
    own = [f"{prefix}{ending}" for ending in (*parts, *_CORE, "-casadi.c", "-casadi.h")]
    kinematics = combined_kinematics(case)
    own += [name for name in kinematics.files if name.startswith(prefix)]
    names |= kinematics.names
    sources = [name for name in own if name.endswith(".c")]
    names |= {"sources": " ".join(sources), "objects": " ".join(f"{name[:-2]}.o" for name in sources)}
    names["headers"] = " ".join(name for name in own if name.endswith(".h"))
    files = {f"{prefix}{ending}": fill_template(f"{part}.in", names) for ending, part in parts.items()}
    files |= {f"{prefix}{ending}": text for ending, text in core.items()}
    files |= kinematics.files
    files |= {name: fill_template(f"{name}.in", names) for name in _OTHERS}
    title = markdown_text(" ".join((case.title or case.name).split()))
    files["README.md"] = fill_template("README.md.in", names | {"title": title})
    casadi = casadi_texts((*staged.all, *limits.functions), f"{prefix}_CASADI")
    files |= {f"{prefix}-casadi{end}": text for end, text in casadi.items()} | {"case.toml": source}
    return files | {MANIFEST: manifest_text(nlp, columns, names, files)}


def size_words(case: Case, files: Mapping[str, str]) -> str:
    """Return the size of generated C in words; for large C, also the limit that causes most of the code.

    Args:
        case: the case.
        files: text by file name, as :func:`generate_c` returns it.
    """
    size = sum(len(text.encode()) for name, text in files.items() if name.endswith((".c", ".h")))
    words = f"{size / 1000:.0f} kB of C"
    if size <= _LARGE:
        return words
    program = formulate_whole(case).program
    operations: dict[str, int] = {}
    for place in find_loops(program).plain:
        constraint = program.constraints[place]
        slopes = ca.Function("slopes", [program.x, program.p], [ca.jacobian(constraint.expression, program.x)])
        key = next((key.partition(".")[0] for key in constraint.keys if key), constraint.name)
        operations[key] = operations.get(key, 0) + slopes.n_instructions()
    key = max(operations, key=lambda name: operations[name], default="F")
    return f"{words}, most of it for {key} and its derivatives; compilation may take a minute"


def budget_files(prefix: str) -> dict[str, str]:
    """Return C for separate budgets of many problems, for the library that Python loads."""
    return {f"{prefix}-deadline.c": fill_template("deadline.c.in", {"id": prefix})}


def _core_text(ending: str, prefix: str) -> str:
    """Return the text of a search file, with the prefix of a case."""
    text = (TEMPLATES / f"{_CORE_PREFIX}{ending}").read_text(encoding="utf-8")
    return text.replace(_CORE_PREFIX, prefix).replace(_CORE_PREFIX.upper(), prefix.upper())


def _stated_texts(names: Mapping[str, str], core: Mapping[str, str]) -> dict[str, str]:
    """Return the texts of the placeholders for sizes of work arrays and for the worst case, from the macros of the C.

    Args:
        names: all other texts.
        core: texts of the search.
    """

    def macros(*templates: str, **further: str) -> Macros:
        texts = ((TEMPLATES / f"{each}.in").read_text(encoding="utf-8") for each in templates)
        return Macros(*core.values(), *(Template(each).safe_substitute(names, **further) for each in texts))

    functions = macros("api.h", "functions.h", "loops.c")
    of_loops = functions.sum_of_parts("WORKSPACE") if int(names["has_loops"]) else 0
    work = str(max(of_loops, functions.value(f"{names['ID']}_POSESWORK")))
    solver = macros("api.h", "scaled.h", "solver.c", work=work)
    doubles, integers, signs = solver.value("DOUBLES"), solver.value("INTS"), int(names["nsigns"])
    passes = solver.value(f"{names['ID']}_QPPASSES", int(names["n"]), int(names["nc"]) + signs)
    worst = worst_case_texts(_SEEDS + 1, 1 + (signs > 0), solver.value("TRIALS"), solver.value("PARTS") + 1)
    workspaces = {"work": work, "solver_work": str(doubles), "solver_iwork": str(integers)}
    return {**workspaces, "solver_bytes": str(8 * doubles + 4 * integers), "passes": str(passes), **worst}


def _substitutions(subject: Subject, staged: StagedFunctions, columns: NumberColumns) -> dict[str, str]:
    """Return the texts of the templates' placeholders."""
    nlp, optimum = subject
    case, program = nlp.case, nlp.program
    prefix = identifier(case.name)
    size = len(prefix) + len("_CASADI_")
    functions = staged.all
    points, references = _references(nlp)
    seeds = (starting_points(nlp, _SEEDS, case.search.seed) - nlp.centre) / nlp.scale
    level = -1 if program.places.epigraph is None else program.places.epigraph.level
    if level >= 0:
        seeds[:, level] = 0.0
    signs = staged.functions["signs"].numel_out(0) if "signs" in staged.functions else 0
    poses = case.pose_count
    return {
        "id": prefix,
        "ID": prefix.upper(),
        "title": comment_text(case.title or case.name),
        **version_texts(__version__),
        "indices": index_macros(program, prefix),
        "casadi": ca.CasadiMeta.version(),
        "length": comment_text(case.units.length),
        "n": str(nlp.n),
        "np": str(len(program.arguments)),
        "m": str(len(program.model.frame_rows)),
        "nc": str(len(program.constraints)),
        "ntasks": str(len(case.tasks)),
        "nposetasks": str(program.robot.F.numel()),
        "nweights": str(len(program.places.weights)),
        "nposes": str(poses),
        "nlegs": str(len(program.robot.legs)),
        "level": str(level),
        "nturns": str(len(turning_joints(nlp))),
        "nsigns": str(signs),
        "ninputs": str(program.robot.inputs.numel()),
        "pose_parameter": "int pose, " if poses > 1 else "",
        "pose_or_first": "pose" if poses > 1 else "0",
        "first_pose": "0, " if poses > 1 else "",
        "objective": comment_text(objective_words(nlp)),
        "F_by_loops": str(int(poses > 1 and staged.loops.has_objective)),
        "twist": str(program.places.twists[0].start),
        "sz_arg": str(max(function.sz_arg() for function in functions)),
        "sz_res": str(max(function.sz_res() for function in functions)),
        **loop_texts(staged, prefix),
        "nk": str(staged.prepare.numel_out(0)),
        "maximise": str(int(nlp.sense is Sense.MAX)),
        "nseeds": str(_SEEDS),
        "measured_macros": f"/* {NOT_MEASURED} */",
        "measured_rows": NOT_MEASURED,
        "seeds": "/* Starting points of the solver, in half ranges from the middle of the bounds. */\n"
        + matrix_table(f"{prefix}_seeds[{prefix.upper()}_SEEDS][{prefix.upper()}_N + 1]", seeds),
        "tables": _tables(nlp, prefix, columns),
        "count": str(points),
        "has_optimum": str(int(optimum is not None)),
        # Fewer digits than Ipopt's rounding error has, so that they are the same on every computer.
        "optimum": "0" if optimum is None else f"{optimum:.9g}",
        "optimum_scale": f"{nlp.objective_size:.9g}",
        "references": references,
        "operations": "\n".join(f"| `{f.name()[size:]}` | {f.n_instructions()} |" for f in functions),
    }


def _kinds_of_joints(nlp: Nlp) -> list[int]:
    """Return 1 for each joint coordinate from closed loops, 2 for a free actuator coordinate, 0 for other variables."""
    places = nlp.program.places
    free = {index for at_pose in places.joints for index in at_pose}
    return [1 if i in places.inner else 2 if i in free else 0 for i in range(nlp.n)]


def _tables(nlp: Nlp, prefix: str, columns: NumberColumns) -> str:
    """Return constant tables of names, units, bounds and defaults, each with a final zero so that none is empty."""
    program, turning = nlp.program, turning_joints(nlp)
    _, variables, parameters, _, constraints, rows, tasks = columns
    kinds = [list(Dimension).index(each.dimension) for each in program.variables]
    if program.places.epigraph is not None:
        kinds[program.places.epigraph.level] = len(Dimension)
    N, P, M, C, T = (f"{prefix.upper()}_{each}" for each in ("N", "P", "M", "C", "TASKS"))
    blocks = [
        "/* Free variables: names, units, kinds (with one scale each), bounds, and a starting point. */",
        string_table(f"{prefix}_variable_names", N, variables["name"]),
        string_table(f"{prefix}_variable_units", N, variables["unit"]),
        integer_table(f"{prefix}_variable_kinds", N, kinds),
        integer_table(f"{prefix}_variable_is_joint", N, _kinds_of_joints(nlp)),
        integer_table(f"{prefix}_variable_turns", N, [int(i in turning) for i in range(nlp.n)]),
        number_table(f"{prefix}_variable_lower", N, variables["lower"]),
        number_table(f"{prefix}_variable_upper", N, variables["upper"]),
        number_table(f"{prefix}_variable_starts", N, variables["start"]),
        "/* Fixed parameters: names, units, and values of the case. */",
        string_table(f"{prefix}_parameter_names", P, parameters["name"]),
        string_table(f"{prefix}_parameter_units", P, parameters["unit"]),
        number_table(f"{prefix}_parameter_defaults", P, parameters["default"]),
        "/* Units of F, of each task's rates, and of multipliers of variables' bounds, for the twists of the case. */",
        f"static const char *const {prefix}_F_unit = {string_literal(columns.F_unit)};",
        string_table(f"{prefix}_rate_units", T, tasks["rate_unit"]),
        string_table(f"{prefix}_multiplier_units", N, variables["multiplier_unit"]),
        "/* Rows of the Jacobian: limb and kind of each (force, couple or other wrench). */",
        string_table(f"{prefix}_row_limbs", M, rows["limb"]),
        string_table(f"{prefix}_row_kinds", M, rows["kind"]),
        "/* Constraints: names, units of their multipliers, and bounds; 1e300 is no bound. */",
        string_table(f"{prefix}_constraint_names", C, constraints["name"]),
        string_table(f"{prefix}_constraint_multiplier_units", C, constraints["multiplier_unit"]),
        number_table(f"{prefix}_constraint_lower", C, constraints["lower"]),
        number_table(f"{prefix}_constraint_upper", C, constraints["upper"]),
        "/* Tasks: names and twists, 6 components each. */",
        string_table(f"{prefix}_task_names", T, tasks["name"]),
        number_table(f"{prefix}_task_twists", f"6 * {T}", np.concatenate(tasks["twist"])),
    ]
    if program.places.weights:
        blocks.append("/* Indices in p of the tasks' weights. */")
        blocks.append(integer_table(f"{prefix}_weights", T, program.places.weights))
    return "\n".join(blocks) + "\n"


def _references(nlp: Nlp) -> tuple[int, str]:
    """Return points and values of the self-test.

    The values are those of the program, independent of the functions from which the C is generated.

    Raises:
        InputError: no trial point has finite values.
    """
    kernels, p, robot = nlp.program.kernels, nlp.arguments, nlp.program.robot
    centres = ca.horzcat(SX(6, 0), *[ca.vertcat(leg.base, leg.platform) for leg in robot.legs])
    legs = ca.Function("legs", [nlp.program.x, nlp.program.p], [ca.densify(centres)])
    rows: list[dict[str, FloatArray]] = []
    for x in starting_points(nlp, 4 * _POINTS + 1, _SEED)[1:]:
        F, gradient, g, slopes = kernels.derivatives(x, p)
        hessian = kernels.hessian(x, p, 1.0, np.zeros(len(nlp.program.constraints)))
        state = kernels.robot_state(x, p)
        row = {"points": x, "F": F, "gradient": gradient, "hessian": hessian, "jacobian": state.jacobian}
        row |= {"rates": state.rates, "limits": g, "slopes": slopes, "rotation": state.rotation}
        joints = legs(x, p).full()
        platform = state.position + state.rotation @ joints[3:]
        row |= {"lengths": np.linalg.norm(platform - joints[:3], axis=0), "base": joints[:3].T, "platform": platform.T}
        row["matrix"] = np.vstack([np.hstack([state.rotation, state.position]), [[0.0, 0.0, 0.0, 1.0]]])
        if all(np.isfinite(each).all() for each in row.values()):
            rows.append(row)
        if len(rows) == (_POINTS if nlp.n else 1):
            break
    if not rows:
        raise InputError(f"{nlp.case.source or nlp.case.name}: F has no finite value at any trial point")
    tables = []
    for name, first in rows[0].items():
        table = name if name == "points" else f"reference_{name}"
        tables.append(matrix_table(f"{table}[{len(rows)}][{first.size + 1}]", [row[name].ravel() for row in rows]))
    return len(rows), "\n".join(tables)
