"""Text of a starter case: a commented case file for any robot."""

from __future__ import annotations

import itertools
import json
import math
import textwrap
from collections.abc import Sequence

import casadi as ca
import numpy as np

from ...models import Dimension, FloatArray, Model, Parameter, Screw, homogenised, model_names
from ..case.case import Case
from ..case.limits.clearance import squared_distance
from ..case.pose import Free, Value
from ..case.robots import model_options
from ..case.settings import Search
from ..case.task import Sense, Task
from ..case.toml import option_text, plain_value, toml_key, toml_text
from ..case.workspace import TURNS, TurnKind, Turns, Workspace
from ..evidence.dependent import dependent_of
from ..units import Units
from .home import TURN, Home, free_widths, read_home, round_number, starter_values

_UNITS = Units("cm", "deg")

#: Smallest and largest leg length, relative to the shortest and the longest leg at home.
_LEG = (0.8, 1.2)
#: Half range of a revolute actuator, and half angle of a joint's cone, degrees.
_SWING, _CONE = 45, 30
#: Largest number of cones in a starter case.
_CONES = 6
#: Largest condition number, relative to that at home.
_CONDITION = 1.5
#: Half range of the workspace: of a position, relative to that of the pose; and of a rotation, degrees.
_BOX, _BOX_TURN = 0.2, 5
#: Largest bound of the smallest singular value in a comment of a starter case: leg forces are then at most five times
#: the load that they balance, in Euclidean norm.
_SMALLEST = 0.2
#: Longest line whose comment is aligned with those of other lines.
_WIDTH = 50
#: Longest line of a comment about the lines below it.
_COMMENT = 110


def starter_case(model: Model, robot_file: str | None = None) -> str:
    """Return the text of a case file for a robot at its typical dimensions, with the pose and one dimension free.

    The case can be solved without changes. Comments in the text explain its keys.

    Args:
        model: the robot.
        robot_file: name of the robot file in the folder of the case; None for a robot by name or definition.
    """
    units, home = units_of(model), home_of(model)
    workspace = _workspace_lines(model, home, units)
    torques = _torque_lines(model, home)
    lines = [
        f'title = "My {model.name}"',
        "",
        *robot_lines(model, robot_file, home.arm),
        "",
        "# A number is a fixed value; { min = a, max = b } is a free variable, with an optional start.",
        "[robot.parameters]",
        *(parameter_line(item, units, is_free=index == home.free) for index, item in enumerate(model.parameters)),
        "",
        *_pose_lines(model, home),
        "",
        *_task_lines(model, home),
        "",
        commented("[limits]", "limits of a buildable design; the documentation lists all"),
        *limit_lines(model, home),
        "",
        *(f"# {line}".rstrip() for line in torques),
        *([""] if torques else []),
        *(f"# {line}" for line in workspace),
        *([""] if workspace else []),
        *search_lines(),
    ]
    return text_of(lines)


def home_of(model: Model) -> Home:
    """Return a robot in its home configuration, with the values that a starter case states."""
    lengths = [abs(value) for item in model.parameters if item.dimension is Dimension.LENGTH for value in item.typical]
    return read_home(model, math.hypot(*model.home) or max(lengths, default=0.0) or _size(model) or 1 / 0.25)


def text_of(lines: Sequence[str]) -> str:
    """Return the text of a case file from its lines."""
    return "\n".join(_aligned(lines)) + "\n"


def search_lines() -> list[str]:
    """Return the lines of the table ``[solve]``."""
    search = Search()
    starts = commented(f"starts = {search.starts}", "starting points; more are more likely to find the best optimum")
    return ["[solve]", starts, f"seed = {search.seed}"]


def commented(text: str, comment: str) -> str:
    """Return a line with a comment, separated by a tabulator."""
    return f"{text}\t# {comment}"


def _aligned(lines: Sequence[str]) -> list[str]:
    """Return lines with the comments of each table aligned; empty lines separate tables."""
    found: list[str] = []
    for _, table in itertools.groupby(lines, bool):
        rows = [line.split("\t") for line in table]
        width = max([len(text) for text, *comment in rows if comment and len(text) <= _WIDTH], default=0)
        for text, *comment in rows:
            found.append("   ".join([text.ljust(width), *comment]) if comment else text)
    return found


def robot_lines(model: Model, robot_file: str | None, arm: float) -> list[str]:
    """Return the lines of the tables ``[units]`` and ``[robot]``, without the parameters."""
    units = units_of(model)
    definition = model.options.get("definition")
    options = _option_lines(model)
    robot = f'model = "{model.name}"' if definition is None else f"definition = {toml_text(plain_value(definition))}"
    if robot_file is not None:
        robot = f"file = {json.dumps(robot_file, ensure_ascii=False)}"
    length = commented(f"characteristic_length = {arm:g}", "makes unit couples comparable with unit forces")
    return [
        "[units]",
        commented(f"length = {json.dumps(units.length, ensure_ascii=False)}", "name of the length unit in all output"),
        commented(f'angle = "{units.angle}"', 'or "rad"'),
        "",
        "[robot]",
        robot,
        *options,
        *([length] if model.has_couples else []),
    ]


def _option_lines(model: Model) -> list[str]:
    """Return a line for each option of a robot, below a comment with the meaning of its values."""
    lines = []
    options = {key: value for key, value in model.options.items() if key != "definition"}
    known = model_options(model.name) if options and model.name in model_names() else ()
    meanings = {option.name: option.meaning for option in known}
    for key, value in options.items():
        lines += [f"# {each}" for each in textwrap.wrap(meanings.get(key, ""), _COMMENT - 2)]
        lines.append(f"{key} = {option_text(value)}")
    return lines


def _pose_lines(model: Model, home: Home) -> list[str]:
    """Return the lines of the table ``[pose]``, with the coordinates free that the robot can change."""
    turning = home.turning
    lines = [
        commented("[pose]", "pose of the platform in the base frame; all axes are parallel at home"),
        *_range_lines(model, home),
        _position_line(model, home, home.reach),
    ]
    if home.moves[2]:
        height = _free_number(model.home[2], home.reach)
        lines.append(f"# fixed height: write {number(model.home[2])} in place of {height}")
    degrees = round(math.degrees(turning.largest))
    angle = f"angle = {{ min = {-degrees}, max = {degrees} }}"
    if turning.numbers == 3:
        lines.append(commented(f"rotation = {{ {angle} }}", f"rotation about any axis by at most {degrees} deg"))
    if turning.numbers == 1:
        lines.append(
            commented(f"rotation = {{ axis = {vector(turning.axis)}, {angle} }}", "rotation about this axis only")
        )
    if home.mobility == 6:
        other = f"# rotation = {{ axis = [0, 0, 1], {angle} }}"
        lines.append(commented(other, "rotation about this axis only; without rotation: none"))
    count = sum(home.moves) + turning.numbers
    if count > home.mobility:
        lines.append(f"# {home.mobility} of these {count} coordinates are independent; the loops determine the rest.")
    return lines


def _range_lines(model: Model, home: Home) -> list[str]:
    """Return the comment that separates ranges of the pose from a workspace; none for robots without a workspace."""
    if not _has_workspace(model, home):
        return []
    return [
        "# ranges here: the search chooses ONE pose. For a robot that works at ALL poses of a box,",
        '# use [workspace] below, and over = "workspace" in [limits].',
        '# per = "task"   # with several [[task]] tables: the search chooses a pose for each task',
    ]


def _has_workspace(model: Model, home: Home) -> bool:
    """Return whether a case of the robot can have a workspace: several poses, and no free actuator coordinates."""
    return not model.free_joints and bool(any(home.moves) or home.turning.numbers)


def _task_lines(model: Model, home: Home) -> list[str]:
    """Return the lines of a task with a feasible motion of the robot."""
    motion = home.motion
    sense = commented('sense = "max"', 'maximise F, the squared work rates in this motion; or "min"')
    if motion is None:
        pitch = 2 * 10.0 ** round(math.log10(math.hypot(*model.home) / 35)) if any(model.home) else 1.0
        name, motion = "screw motion", Screw(np.array([0.0, 1.0, 2.0]), np.array(model.home), pitch, 1.0)
    elif math.isinf(motion.pitch):
        name = f"translation along {_direction(motion.axis)}"
    else:
        kind = "rotation" if abs(motion.pitch) < 1e-9 * home.reach else "screw motion"
        name = f"{kind} about {_direction(motion.axis)}"
    lines = [
        commented("[[task]]", f"motion of the platform, which has {_degrees(home.mobility)} of freedom"),
        f'name = "{name}"',
        sense,
    ]
    if home.is_flat:
        lines.append("# F of this motion is the same at all poses: all designs within the limits are equally good.")
    lines.append(commented(f"axis = {vector(motion.axis)}", "direction of the screw axis, of any length but zero"))
    if math.isinf(motion.pitch):
        return [*lines, commented("pitch = inf", "translation along the axis; 0: rotation about it")]
    return [
        *lines,
        commented(f"point = {vector(motion.point)}", "any point on the screw axis"),
        commented(f"pitch = {number(motion.pitch)}", "translation per radian; 0: rotation; inf: translation"),
    ]


def limit_lines(model: Model, home: Home) -> list[str]:
    """Return the lines of limits that the robot satisfies at home."""
    lines = [*_actuator_lines(model, home), *_free_joint_lines(model, home), *_joint_lines(model, home)]
    is_singular = home.state.is_singular
    if "base_joint_angle" in home.state.quantities and not is_singular:
        # Cones keep the robot away from singularities, and are faster to prove.
        return [*lines, *_singular_value_lines(model, home)]
    if math.isfinite(home.condition):
        largest = float(f"{_CONDITION * home.condition:.2g}")
        place = "near home, which is singular" if is_singular else "at home"
        table = f"condition_number = {{ max = {largest:g}, length = {home.arm:g} }}"
        lines.append(
            commented(table, f"of J, with moments divided by length; {float(f'{home.condition:.2g}'):g} {place}")
        )
    return lines


def _singular_value_lines(model: Model, home: Home) -> list[str]:
    """Return the comment with a limit on the smallest singular value of a hexapod; none for other robots."""
    if not model.legs or home.mobility < 6:
        return []
    values = np.array([value for item in model.parameters for value in starter_values(item)])
    centres = ca.Function("centres", [model.symbols], [ca.horzcat(*[leg.platform for leg in model.legs])])(values)
    radius = float(f"{math.sqrt(np.mean(np.sum(centres.full()[:2] ** 2, axis=0))):.2g}")
    rows = np.array(homogenised(home.state.jacobian, home.state.position, radius))
    smallest = float(np.linalg.svd(rows, compute_uv=False)[-1])
    # The limit is satisfied at home: the value at home is rounded down to one digit.
    digit = 10.0 ** math.floor(math.log10(smallest))
    least = min(_SMALLEST, round(smallest // digit * digit, 9))
    table = f"smallest_singular_value = {{ min = {least:g}, length = {radius:g} }}"
    return [f"# {table}   # keeps the design away from singularities"]


def _torque_lines(model: Model, home: Home) -> list[str]:
    """Return another objective as comments, the torques of motors that turn cranks; nothing for other robots."""
    if all(quantity.name != "actuator_angle" for quantity in model.quantities):
        return []
    is_rod = any(each.wrenches == 1 for each in model.structure)
    subject = "the forces of the rods" if is_rod else "the limbs with their motors locked"
    load = "force = [0, 0, -10]"
    if home.motion is not None:
        is_slide = math.isinf(home.motion.pitch)
        load = f"force = {vector(-10 * home.motion.axis)}" if is_slide else f"moment = {vector(home.motion.axis)}"
    return [
        f"F is about {subject}. The torque of a motor also depends on its crank and on the load:",
        commented("[[load]]", "that the motors hold"),
        'name = "load"',
        commented(load, "on the platform, along the axes of the world"),
        commented("[objective]", 'in the place of F; set sense = "min" in the task, or leave the task out'),
        commented('minimise = "actuator_force"', "the largest torque of a motor; or actuator_speed, actuator_power"),
    ]


def _actuator_lines(model: Model, home: Home) -> list[str]:
    """Return the lines of limits on straight legs, or on the actuators of other robots."""
    if not model.legs:
        lines = []
        for quantity in model.quantities:
            if quantity.name == "actuator_angle":
                range_ = f"{{ min = {-_SWING}, max = {_SWING} }}"
                lines.append(commented(f"actuator_angle = {range_}", "of every revolute actuator, from home"))
            if quantity.name == "actuator_length":
                range_ = f"{{ min = {-home.reach:g}, max = {home.reach:g} }}"
                lines.append(commented(f"actuator_length = {range_}", "of every prismatic actuator, from home"))
        return lines
    ends = [ca.horzcat(*[getattr(leg, plate) for leg in model.legs]).T for plate in ("base", "platform")]
    values = np.array([value for item in model.parameters for value in starter_values(item)])
    base, platform = (each.full() for each in ca.Function("ends", [model.symbols], ends).call([values]))
    lengths = np.linalg.norm(platform + model.home - base, axis=1)
    low, high = (float(f"{each:.2g}") for each in (_LEG[0] * lengths.min(), _LEG[1] * lengths.max()))
    # Legs with a common joint, and crossing legs, have no clearance.
    segments = [(ca.SX(start), ca.SX(end - start)) for start, end in zip(base, platform + model.home, strict=True)]
    squares = [float(ca.evalf(squared_distance(*one, *two))) for one, two in itertools.combinations(segments, 2)]
    apart = math.sqrt(min(squares, default=0.0))
    clearance = float(f"{0.02 * lengths.max():.1g}")
    return [
        commented(f"leg_length = {{ min = {low:g}, max = {high:g} }}", "between joint centres"),
        *([commented(f"leg_clearance = {{ min = {clearance:g} }}", "between legs")] if apart > clearance else []),
    ]


def _free_joint_lines(model: Model, home: Home) -> list[str]:
    """Return the lines of limits on free actuator coordinates of a robot with legs."""
    lines = []
    for each in model.unknowns if model.legs else ():
        if each.is_free:
            most = _SWING if each.dimension is Dimension.ANGLE else home.reach
            table = f"joint.{toml_key(each.joint)} = {{ min = {-most:g}, max = {most:g} }}"
            lines.append(commented(table, "of an actuator that the pose does not determine, from home"))
    return lines


def _joint_lines(model: Model, home: Home) -> list[str]:
    """Return the lines of limits on the cones of passive joints."""
    angles = home.state.quantities.get("base_joint_angle")
    if angles is not None:
        cone = max(_CONE, 5 * math.ceil((math.degrees(float(angles.max())) + 10) / 5))
        return [
            commented(f"{plate}_joint_angle = {cone}", f"largest angle of each leg to the z axis of the {plate}")
            for plate in ("base", "platform")
        ]
    balls = [joint for joint in model.joints if joint.type == "S" and joint.cone is not None]
    keys = list(dict.fromkeys(joint.name or joint.label for joint in balls))
    if len(keys) > _CONES:
        return []
    comment = "half angle of the ball joint's cone, about its direction at home"
    return [commented(f"joint.{toml_key(key)}.cone = {_CONE}", comment) for key in keys]


def _workspace_lines(model: Model, home: Home, units: Units) -> list[str]:
    """Return the lines of a workspace around home; none for robots with a single pose or free actuator coordinates."""
    if not _has_workspace(model, home):
        return []
    reach = round_number(_BOX * home.reach)
    position = _position_line(model, home, reach)
    turning = home.turning
    degrees = _BOX_TURN * round(turning.largest / TURN)
    angle = f"{{ min = {-degrees}, max = {degrees} }}"
    rotation = {
        0: [],
        1: [f"rotation = {{ axis = {vector(turning.axis)}, angle = {angle} }}"],
        3: [f"rotation = {{ angle = {angle} }}"],
    }[turning.numbers]
    if turning.numbers == 3 and home.mobility < 6:
        turn = math.radians(degrees)
        parts = [f"{name} = {angle}" for name in _turning_about(model, home, reach, turn)]
        rotation = [f"rotation = {{ {', '.join(parts)} }}"]
    fixed = ""
    if home.free is not None:
        item = model.parameters[home.free]
        value = [number(units.shown(each, item.dimension)) for each in starter_values(item)]
        fixed = f" --set {item.name}={','.join(value)}"
    question = f"screwsynth workspace{fixed} verifies all limits at all these poses"
    return [commented("[workspace]", question), position, *rotation]


def _turning_about(model: Model, home: Home, reach: float, turn: float) -> list[str]:
    """Return which of roll, pitch and yaw a robot changes over a workspace about home; other angles stay 0.

    Args:
        model: the robot.
        home: the robot at home.
        reach: half range of the free components of the position, length.
        turn: half range of the angles, radians.
    """
    parameters = {item.name: starter_values(item) for item in model.parameters}
    case = Case(model, parameters, model.home, [Task.screw(Sense.MAX, axis=(0, 0, 1), pitch=math.inf)])
    moves = zip(model.home, home.moves, strict=True)
    position = [Free(value - reach, value + reach) if is_free else value for value, is_free in moves]
    found = []
    for k, name in enumerate(TURNS):
        angles: list[Value] = [Free(-turn, turn)] * 3
        angles[k] = 0.0
        moved = dependent_of(case, Workspace(position, Turns(TurnKind.ROLL_PITCH_YAW, tuple(angles))))
        if k + 3 in {*moved.held, *(each.index for each in moved.dependent)}:
            found.append(name)
    return found or list(TURNS)


def _position_line(model: Model, home: Home, half: float) -> str:
    """Return the line of a position with its movable components free within a half range around home."""
    parts = zip(model.home, home.moves, strict=True)
    texts = [_free_number(value, half) if is_free else f"{value:.10g}" for value, is_free in parts]
    return f"position = [{', '.join(texts)}]"


def _size(model: Model) -> float:
    """Return the largest distance of a point of a robot's drawing from the origin of its body, at typical dimensions.

    The result is 0 for a robot without a drawing, or with a drawing that does not depend on the dimensions only.
    """
    symbols, typical = model.symbols, ca.DM(model.typical)
    sizes = []
    for point in model.scene.points:
        size = ca.norm_2(point.position)
        if not ca.symvar(ca.substitute(size, symbols, ca.SX(typical))):
            sizes.append(float(ca.Function("size", [symbols], [size])(typical)))
    return max((each for each in sizes if math.isfinite(each)), default=0.0)


def units_of(model: Model) -> Units:
    """Return the units of a starter case; the length unit of a robot file without one is called ``unit``."""
    return _UNITS if not model.structure else Units(model.length_unit or "unit", "deg")


def parameter_line(parameter: Parameter, units: Units, *, is_free: bool, further: str = "") -> str:
    """Return the line of a parameter, free around its value in a starter case or fixed.

    Args:
        parameter: the parameter.
        units: units of the case.
        is_free: If true, the parameter has a range.
        further: further keys of the range, such as ``, per = "task"``.
    """
    values = [units.shown(value, parameter.dimension) for value in starter_values(parameter)]
    widths = [units.shown(each, parameter.dimension) if is_free else 0.0 for each in free_widths(parameter)]
    domain = [units.shown(end, parameter.dimension) for end in (parameter.lower, parameter.upper)]
    texts = [
        _free_number(value, width, domain).replace(" }", f"{further} }}") if width else number(value)
        for value, width in zip(values, widths, strict=True)
    ]
    text = texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"
    unit = units.label(parameter.dimension) or "a plain number"
    return commented(f"{parameter.name} = {text}", f"{parameter.description}, {unit}")


def _free_number(middle: float, width: float, domain: Sequence[float] = (-math.inf, math.inf)) -> str:
    """Return a rounded range around a number as TOML; the number itself if its domain allows no range."""
    digits = 1 - math.floor(math.log10(width))
    ends = [round(end, digits) + 0.0 for end in (middle - width, middle + width)]
    lower, upper = max(ends[0], domain[0]), min(ends[1], domain[1])
    return f"{{ min = {number(lower)}, max = {number(upper)} }}" if lower < upper else number(middle)


def _degrees(count: int) -> str:
    """Return a number of degrees in words."""
    return f"{count} degree{'' if count == 1 else 's'}"


def number(value: float) -> str:
    """Return a number as TOML; rounding errors of 0 become 0."""
    return f"{value if abs(value) > 1e-9 else 0:.10g}"


def vector(values: Sequence[float] | FloatArray) -> str:
    """Return three numbers as TOML."""
    return f"[{', '.join(number(float(each)) for each in values)}]"


def _direction(axis: FloatArray) -> str:
    """Return the name of a coordinate axis; ``an axis`` for any other."""
    for k, name in enumerate("xyz"):
        if abs(axis[k]) > 1 - 1e-9:
            return name
    return "an axis"
