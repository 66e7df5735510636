"""C files of kinematics: functions, header, self-test, example and description."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray
from .. import __version__
from ..case.case import Case
from ..case.controller import Controller
from ..errors import InputError
from ..evidence.inverse import inverse
from ..system.markdown import markdown_text
from .ctext import comment_text, identifier, matrix_table, name_cases
from .driveaxes import direction_texts
from .kinematics import Kinematics, matrix_of_rpy
from .kinematicsjoints import LimbCoordinates, coordinate_texts, limb_coordinates
from .kinematicslimits import KinematicLimit, limit_texts, limits_of
from .templates import casadi_texts, fill_template, prototype

#: Number of poses of the self-test, the seed of their random choice, and their largest distances from home, in parts
#: of the robot's size and radians: of most poses, and of a quarter of them.
_POSES, _SEED, _NEAR, _FAR = 48, 3, 0.08, 0.6
#: Part of the determinant at home above which a pose of the self-test counts as reached without a singularity.
_REGULAR = 0.05
#: Constants of C in double, and names of the coordinates of a pose.
_NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:[eE][+-]?\d+)?)(?![\w.])")
#: Macros of CasADi's.
_MACRO = re.compile(r"^ *#define (\w+)", re.MULTILINE)
#: Kind of an actuator coordinate, by whether the actuator turns.
_KINDS = {True: "angle", False: "length"}
#: Largest coordinate at home that counts as rounding, in parts of the robot's size or radians.
_ROUNDING = 1e-10
#: Meaning of the column ``axis`` of the table of actuators.
_AXES = """\
  An angle grows if the actuator turns about its axis by the right-hand rule, and a length grows if it slides along its
  axis. Axes are given at home, in the world frame above."""
_COORDINATES = ("x", "y", "z", "a", "b", "c")
#: Functions of the mathematics library that generated C may call.
_LIBM = (
    "sin",
    "cos",
    "tan",
    "asin",
    "acos",
    "atan2",
    "atan",
    "sqrt",
    "floor",
    "fabs",
    "fmax",
    "fmin",
    "exp",
    "log",
    "pow",
)


class KinematicsFiles(NamedTuple):
    """Texts of the kinematics of a case.

    Attributes:
        files: library, header and sources by file name.
        names: texts for the placeholders of further templates.
    """

    files: Mapping[str, str]
    names: Mapping[str, str]


def kinematics_prefix(name: str) -> str:
    """Return the prefix of the C names of the kinematics of a case.

    No name of the solver of another case begins with this prefix.
    """
    return identifier(name).replace("screwsynth_", "kinematics_", 1)


def generate_kinematics(case: Case, source: str, *, single: bool = False, coordinates: str = "pose") -> dict[str, str]:
    """Generate the files of a folder with the kinematics of a case.

    Args:
        case: case with fixed dimensions.
        source: text of its case file, which goes into the folder as ``case.toml``.
        single: If true, positions, rates and torques are in single precision.
        coordinates: ``pose``, or the name of a limb whose joint coordinates are used too.

    Returns:
        Text by file name.

    Raises:
        CaseError: a dimension is free, a unit is unknown, or no closed configuration is known.
        InputError: an actuator coordinate is not known.
    """
    files, names = kinematics_files(case, single=single, coordinates=coordinates)
    title = markdown_text(" ".join((case.title or case.name).split()))
    whole = {**names, "title": title, "id": identifier(case.name)}
    whole["conventions"] = fill_template("kinematics/conventions.md.in", whole).rstrip()
    objects = " ".join(f"{name[:-2]}.o" for name in files if name.endswith(".c"))
    others = ("selftest.c", "bench.c", "example.c", "Makefile", "README.md")
    texts = {name: fill_template(f"kinematics/{name}.in", whole | {"objects": objects}) for name in others}
    return {**files, **texts, "case.toml": source}


def kinematics_files(case: Case, *, single: bool = False, coordinates: str = "pose") -> KinematicsFiles:
    """Return the library of the kinematics of a case, and the texts for its test, example and description.

    Raises:
        CaseError: as for :func:`generate_kinematics`.
        InputError: as for :func:`generate_kinematics`.
    """
    case.refuse_settings("the rates of the motors assume dimensions that stand still")
    robot = Kinematics(case)
    limits = limits_of(robot)
    joints = None if coordinates == "pose" else limb_coordinates(robot, coordinates)
    kin, file = kinematics_prefix(case.name), f"{identifier(case.name)}-kinematics"
    names = {"kin": kin, "KIN": kin.upper(), "file": file, "single": str(int(single))}
    functions = _functions(robot, kin, limits, joints)
    names |= _substitutions(robot, functions)
    names |= _motor_texts(robot, names)
    names |= limit_texts(limits, names)
    names |= coordinate_texts(robot, joints, coordinates, names)
    names["prototypes"] += f"\n{names['limits_prototype']}\n{names['coordinates_prototype']}"
    sources = {
        "-casadi.c": casadi_texts(functions.of_results, f"{kin}_CASADI")[".c"],
        "-newton.c": casadi_texts(functions.of_newton, f"{kin}_NEWTON")[".c"],
    }
    sources["-casadi.c"] = _NUMBER.sub(r"((casadi_real)\1)", sources["-casadi.c"])
    heads = {
        "-casadi.c": f"#if {names['KIN']}_SINGLE\n#include <tgmath.h>\n#endif\n#define casadi_real {kin}_real\n",
        "-newton.c": "#define casadi_real double\n",
    }
    sources = {end: _part(file, names["KIN"], heads[end], text) for end, text in sources.items()}
    names["libm"] = " ".join(each for each in _LIBM if re.search(rf"\b{each}\(", "".join(sources.values()))) or "none"
    files = {f"{file}{end}": fill_template(f"kinematics/kinematics{end}.in", names) for end in (".h", ".c")}
    return KinematicsFiles({**files, **{f"{file}{end}": text for end, text in sources.items()}}, names)


def combined_kinematics(case: Case) -> KinematicsFiles:
    """Return the kinematics for the folder of a solver: files, and texts for its build files and description.

    If a dimension is free, or no closed configuration is known, there are no files, and the description says so.
    """
    none = ("programs", "test", "cmake", "header", "rows")
    try:
        files, names = kinematics_files(case)
    except InputError as error:
        reason = markdown_text(str(error))
        section = f"## Kinematics\n\nThis folder has no functions of the kinematics: {reason}."
        return KinematicsFiles({}, {f"kinematics_{each}": "" for each in none} | {"kinematics_section": section})
    kin, file, prefix = names["kin"], names["file"], identifier(case.name)
    program = "selftest-kinematics"
    test = fill_template("kinematics/selftest.c.in", names)
    conventions = (
        fill_template("kinematics/conventions.md.in", names).rstrip().replace("## Conventions", "## Kinematics", 1)
    )
    texts = {
        "programs": f" {program}",
        "test": f"\n\t./{program}",
        "cmake": (
            f"  add_executable({prefix}-{program} {program}.c)\n"
            f"  set_target_properties({prefix}-{program} PROPERTIES OUTPUT_NAME {program} C_STANDARD 99)\n"
            f"  target_link_libraries({prefix}-{program} {prefix})\n"
            f"  add_test(NAME {prefix}-{program} COMMAND {prefix}-{program})\n"
        ),
        "header": f" {file}.h",
        "rows": f"| `{file}.h`, `.c`, `-casadi.c`, `-newton.c`, `{program}.c` | `{kin}_motors` and others |\n",
        "section": conventions,
    }
    return KinematicsFiles({**files, f"{program}.c": test}, {f"kinematics_{key}": text for key, text in texts.items()})


def _part(file: str, KIN: str, head: str, text: str) -> str:
    """Return a C source from CasADi with a separate number type; at the end of the source, its macros are undefined.

    So a module of one source file can include all sources, with the mathematics library of its controller.
    """
    mathematics = f"#ifdef {KIN}_MATH\n#include {KIN}_MATH\n#else\n#include <math.h>\n#endif"
    macros = dict.fromkeys(["casadi_real", *_MACRO.findall(text)])
    ends = "".join(f"#undef {name}\n" for name in macros)
    return f'#include "{file}.h"\n{head}{text.replace("#include <math.h>", mathematics)}\n{ends}'


class _Functions(NamedTuple):
    of_results: tuple[ca.Function, ...]
    of_newton: tuple[ca.Function, ...]

    @property
    def all(self) -> tuple[ca.Function, ...]:
        return (*self.of_results, *self.of_newton)


def _functions(
    robot: Kinematics, kin: str, limits: Sequence[KinematicLimit], joints: LimbCoordinates | None
) -> _Functions:
    """Return the functions that C calls, with dense results."""

    def made(name: str, inputs: Sequence[SX], outputs: Sequence[SX]) -> ca.Function:
        return ca.Function(f"{kin}_{name}", list(inputs), ca.cse([ca.densify(each) for each in outputs]))

    z, results = robot.z, [robot.q, robot.equations, robot.signs]
    of_results = [made("CASADI_motors", [z], results), made("CASADI_rates", [z], [robot.rates.T])]
    if not robot.unknowns:
        of_results += [made(f"CASADI_motor{i}", [z], [robot.q[i]]) for i in range(len(robot.drives))]
    if limits:
        of_results.append(made("CASADI_limits", [z], [ca.vertcat(*[each.margin for each in limits])]))
    if joints is not None:
        of_results.append(made("CASADI_pose", [joints.values], [joints.pose, joints.twists]))
        of_results.append(made("CASADI_joints", [z], [joints.measured]))
    chosen = robot.equations[: robot.independent, :]
    # In closed form the rates are the derivatives wherever the loops are closed, with half of the operations.
    own = robot.by_step(robot.q) if robot.unknowns else robot.rates
    slopes = ca.vertcat(own, robot.by_step(chosen), robot.held)
    values = ca.vertcat(chosen, SX(robot.held.shape[0], 1))
    of_newton = [made("NEWTON_check", [z], results), made("NEWTON_step", [z], [robot.q, values, robot.signs, slopes.T])]
    if robot.unknowns:
        own = robot.equations[list(robot.loops.rows), :]
        columns = [6 + k for k in robot.loops.columns]
        by_joints = robot.by_step(own)[:, columns] @ ca.diag(ca.DM(robot.step_sizes[columns]))
        of_newton.append(made("NEWTON_loops", [z], [own, by_joints.T]))
    return _Functions(tuple(of_results), tuple(of_newton))


def _row(values: Sequence[float] | FloatArray) -> str:
    return ", ".join([*(repr(float(each)) for each in values), "0"])


def _integers(values: Sequence[int]) -> str:
    return ", ".join(str(int(each)) for each in [*values, 0])


def _substitutions(robot: Kinematics, functions: _Functions) -> dict[str, str]:
    """Return the texts for the placeholders of the templates."""
    case, controller, drives, f = robot.case, robot.controller, robot.drives, robot.unknowns
    kin = functions.of_results[0].name().removesuffix("_CASADI_motors")
    KIN, a = kin.upper(), len(drives)
    forward = robot.forward
    completes = robot.complete is not None
    square = forward is not None
    length = comment_text(controller.length or case.units.length)
    turning = [each.dimension is Dimension.ANGLE for each in drives]
    labels = [controller.angle if each else length for each in turning]
    complete = robot.complete or forward
    tables = [
        f"static const double home[] = {{{_row(robot.home)}}};",
        f"static const int turns[] = {{{_integers(turning)}}};",
    ]
    if forward is not None or robot.complete is not None or f:
        tables.append(f"static const double unknown_sizes[] = {{{_row(robot.sizes)}}};")
    if forward is not None:
        tables += [
            f"static const int chosen_rows[] = {{{_integers(forward.rows)}}};",
            f"static const int chosen_columns[] = {{{_integers(forward.columns)}}};",
        ]
    if robot.complete is not None:
        tables += [
            f"static const int complete_rows[] = {{{_integers(robot.complete.rows)}}};",
            f"static const int complete_columns[] = {{{_integers(robot.complete.columns)}}};",
        ]
    if f:
        tables.append(f"static const int moving[] = {{{_integers(robot.loops.columns)}}};")
    frame = _frame_words(controller, case)
    # Rounding of Newton's method and of trigonometric functions is printed as 0.
    at_home = np.where(np.abs(robot.home_coordinates) < _ROUNDING * robot.motor_sizes, 0.0, robot.home_coordinates)
    directions = direction_texts(robot)
    lines = [
        f" *           {i}: {comment_text(each.name)}, {_KINDS[turns]} in {label}, {value:.10g} at home"
        for i, (each, turns, label, value) in enumerate(zip(drives, turning, labels, at_home, strict=True))
    ]
    rows = ["| actuator | coordinate | unit | sense | at home |", "|---|---|---|---|---|"]
    if all(directions):
        rows = ["| actuator | coordinate | unit | sense | at home | axis |", "|---|---|---|---|---|---|"]
    rows += [
        f"| {i}: {markdown_text(each.name)} | {measure.replace('_', ' ')} | {label} "
        f"| {'+' if controller.sign_of(each.name) > 0 else '-'} | {value:.10g} |{direction and f' {direction} |'}"
        for i, (each, measure, label, value, direction) in enumerate(
            zip(drives, robot.robot.measures, labels, at_home, directions, strict=True)
        )
    ]
    if all(directions):
        rows += ["", *_AXES.split("\n")]
    given = " ".join(_COORDINATES[k] for k in robot.coordinates)
    freedom = (
        f"the platform has {robot.freedoms} degree{'s' * (robot.freedoms != 1)} of freedom; all coordinates are given."
    )
    if completes:
        freedom = (
            f"the platform has {robot.freedoms} degrees of freedom. The caller gives a full pose whose dependent "
            f"coordinates fit; `{kin}_complete` computes them from {given}. Another value gives `LOOPS_OPEN`."
        )
    limbs = f"{f} joint coordinates are followed by Newton's method from a state." if f else "Loops have a closed form."
    notes = (
        f"A state `double u[{KIN}_STATE]` belongs to the caller, one for each thread; `{kin}_start(u)` is home. Each\n"
        "call follows the joints along a straight path from the pose of the state, in at most 85 steps of at most 15\n"
        "iterations, and keeps the new state if its status is OK."
    )
    return {
        "title": comment_text(case.title or case.name),
        "robot": comment_text(case.model.description or case.model.name),
        "version": __version__,
        "casadi": ca.CasadiMeta.version(),
        "frame": frame,
        "length": length,
        "angle": controller.angle,
        "actuator_table": " * Actuators, with their values at home:\n" + "\n".join(lines),
        "actuator_rows": "\n".join(rows),
        "freedom": freedom,
        "limbs": limbs,
        "notes": notes if f else "",
        "na": str(a),
        "nf": str(f),
        "nstate": str(12 + f if f else 1),
        "dof": str(robot.freedoms),
        "ne": str(robot.equations.numel()),
        "nn": str(robot.independent + robot.held.shape[0]),
        "ng": str(robot.signs.numel()),
        "nm": str(len(forward.rows) if forward else 1),
        "nh": str(len(robot.loops.rows)),
        "nc": str(len(complete.rows) if complete else 1),
        "moves": str(int(square or completes or f > 0)),
        "square": str(int(square)),
        "completes": str(int(completes)),
        "has_forward": str(int(square)),
        "has_torques": str(int(not robot.no_torques)),
        "no_forward": "" if square else ", because actuators and loops do not determine the pose",
        "no_torques": f": {comment_text(robot.no_torques)}" if robot.no_torques else "",
        "angle_unit": repr(robot.transform.degrees),
        "size": f"{robot.size!r}",
        "independent": given,
        "tables": "\n".join(tables),
        "names": name_cases([each.name for each in drives]),
        "sz_arg": str(max(each.sz_arg() for each in functions.all)),
        "sz_res": str(max(each.sz_res() for each in functions.all)),
        "work": str(max(each.sz_w() for each in functions.all)),
        "moved": str(next((k for k in (2, 0, 1) if k in robot.coordinates), 2)),
        "motor_step": repr(1e-5 * float(robot.motor_sizes[0])),
        **_state_texts(f, kin),
        **_reference_texts(robot),
    }


def _frame_words(controller: Controller, case: Case) -> str:
    """Return a sentence about the world frame."""
    if not any((*controller.rpy, *controller.origin)):
        return "The world frame is that of the case."
    shown = [case.units.text(each, Dimension.LENGTH) for each in controller.origin]
    turned = [case.units.text(each, Dimension.ANGLE) for each in controller.rpy]
    return (
        f"The world frame of the controller has its origin at {', '.join(shown)} in the world frame of the case, "
        f"and is turned by roll, pitch and yaw of {', '.join(turned)}."
    )


def _motor_texts(robot: Kinematics, names: Mapping[str, str]) -> dict[str, str]:
    """Return the texts about a single motor, from the texts of the other placeholders."""
    keys = {"motor": "motor.h", "motor_body": "motor.c", "test_motor": "motor-test.c", "bench_motor": "motor-bench.c"}
    if robot.unknowns:
        return dict.fromkeys((*keys, "prototypes"), "")
    kin, count = names["kin"], range(len(robot.drives))
    calls = (f"        case {i}: failed = {kin}_CASADI_motor{i}(arg, res, 0, w, 0); break;" for i in count)
    own = {"motor_cases": "\n".join(calls), **names}
    texts = {key: fill_template(f"kinematics/{template}.in", own) for key, template in keys.items()}
    return {**texts, "prototypes": "\n".join(prototype(kin, f"motor{i}") for i in count)}


def _state_texts(unknowns: int, kin: str) -> dict[str, str]:
    """Return the texts about the state of joint coordinates without closed form."""
    if not unknowns:
        keys = ("u", "u_end", "pass_u", "start", "state_declaration", "state_start", "void_u")
        return dict.fromkeys(keys, "")
    return {
        "u": "double *u, ",
        "u_end": ", double *u",
        "pass_u": "u, ",
        "void_u": ", (void)u",
        "start": (
            "\n/* State at home. A state belongs to the caller: each call follows the joints from the pose of the\n"
            " * state to the given one, and keeps the new state if its status is OK. */\n"
            f"void {kin}_start(double u[{kin.upper()}_STATE]);\n"
        ),
        "state_declaration": f"    double u[{kin.upper()}_STATE];",
        "state_start": f"    {kin}_start(u);",
    }


def _reference_texts(robot: Kinematics) -> dict[str, str]:
    """Return the poses of the self-test with the results of inverse kinematics in Python."""
    rng = np.random.default_rng(_SEED)
    near, any_pose = np.arange(_POSES) % 4 != 3, np.arange(_POSES) % 8 == 7
    spread = np.where(near, _NEAR, _FAR)[:, None]
    # The robot may not change all coordinates of the pose; one pose in eight changes all.
    free = np.isin(range(6), robot.coordinates) | any_pose[:, None]
    steps = np.where(free, rng.uniform(-1, 1, (_POSES, 6)) * spread, 0.0)
    steps[0] = 0.0
    home = robot.home
    poses = np.hstack([np.zeros((_POSES, 9)), home[9:12] + robot.size * steps[:, :3]])
    for pose, (a, b, c) in zip(poses, 2 * steps[:, 3:], strict=True):
        pose[:9] = (matrix_of_rpy(a, b, c) @ home[:9].reshape(3, 3)).ravel()
    p, R = robot.transform.world_poses(poses)
    found = inverse(robot.case, p, R)
    p, R, closed = found.positions, found.rotations, found.closed
    poses = robot.transform.poses(p, R)
    q = np.where(closed[:, None], robot.transform.coordinates(found.coordinates), 0.0)
    rates = np.where(closed[:, None, None], robot.transform.rates(found.rates), 0.0)
    twists, loads = np.zeros((_POSES, 6)), rng.uniform(-1, 1, (_POSES, 6))
    for k in np.flatnonzero(closed):
        z, motion = robot.point(poses[k], found.unknowns[k]), rng.uniform(-1, 1, len(robot.step_sizes))
        twists[k] = robot.feasible(z, motion)
        # Between home and a pose with another sign lies a singularity; before it may be another pose with the motors.
        near[k] &= robot.side(z) > _REGULAR
    singular = found.singular | ~closed

    def table(name: str, values: FloatArray) -> str:
        return matrix_table(f"{name}[COUNT][{values.shape[1] + 1}]", list(values))

    flags = "\n".join(
        f"static const int {name}[] = {{{_integers([int(each) for each in values])}}};"
        for name, values in (("is_closed", closed), ("is_singular", singular), ("is_near", near))
    )
    sizes = f"static const double motor_sizes[] = {{{_row(robot.motor_sizes)}}};"
    turning = [each.dimension is Dimension.ANGLE for each in robot.drives]
    units = [robot.transform.degrees if each else 1.0 for each in turning]
    return {
        "count": str(_POSES),
        "references": "\n".join(
            [
                flags,
                sizes,
                f"static const double angle_units[] = {{{_row(units)}}}, angle_unit = {robot.transform.degrees!r};",
                table("poses", poses),
                table("motors", q),
                table("rates", rates.reshape(_POSES, -1)),
                table("twists", twists),
                table("loads", loads),
            ]
        ),
    }
