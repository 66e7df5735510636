"""Starter cases whose robot changes: a dimension from task to task, or the turn about the tool along a path.

The pose is that of home, so that both cases can be solved without changes. The path is a circle about home, with a tool
that leans outwards.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...models import Model, Screw
from ...models.joints.model.closedform import closed_form
from ..errors import InputError
from .home import Home, free_widths, objective_at_home, round_number, starter_values
from .text import (
    commented,
    home_of,
    limit_lines,
    number,
    parameter_line,
    robot_lines,
    search_lines,
    text_of,
    units_of,
    vector,
)

#: Radius of the circle relative to the reach of home, and lean of the tool, degrees: of robots on straight legs, and of
#: others, whose joints move less.
_CIRCLE, _CIRCLE_OF_OTHERS = (1.0, 15), (0.3, 10)
#: Number of points of the circle.
_POINTS = 40
#: Time of the circle, seconds; largest turn about the tool, degrees, and its rate, degrees per second.
_TIME, _TURN, _RATE = 30, 60, 5
#: Smallest F of a task, relative to the square of the robot's arm for a rotation.
_SMALLEST = 1e-6


class PathStarter(NamedTuple):
    """Starter case of a path: text of the case file, and table of poses."""

    text: str
    table: str


def task_starter(model: Model, robot_file: str | None = None) -> str:
    """Return the text of a case file for a robot with two tasks and a dimension that changes from task to task.

    Args:
        model: the robot.
        robot_file: name of the robot file in the folder of the case; None for a robot by name or definition.

    Raises:
        InputError: the robot has no dimension that changes F, or fewer than two motions with work at home.
    """
    home, units = home_of(model), units_of(model)
    if home.free is None:
        raise InputError(f"--per task: {model.name!r} has no dimension that changes F; use its plain starter")
    motions = _two_motions(model, home)
    if len(motions) < 2:
        raise InputError(f"--per task: needs two motions, but {model.name!r} can make fewer at all poses around home")
    item = model.parameters[home.free]
    ends = [units.shown(value, item.dimension) for value in starter_values(item)]
    listed = _holes(ends, [units.shown(width, item.dimension) for width in free_widths(item)])
    lines = [
        f'title = "My {model.name}, reset for each task"',
        "",
        *robot_lines(model, robot_file, home.arm),
        "",
        '# A number is a fixed value. per = "task" resets the dimension for every task, as pins in a plate do.',
        f"# For the holes of a plate, list the values: {listed}",
        "[robot.parameters]",
        *(
            parameter_line(each, units, is_free=index == home.free, further=', per = "task"')
            for index, each in enumerate(model.parameters)
        ),
        "",
        commented("[pose]", "pose of the platform in the base frame; all axes are parallel at home"),
        f"position = {vector(model.home)}",
        '# per = "task"   # with ranges { min = a, max = b } in the position: the search chooses a pose for each task',
        "",
    ]
    for motion, F in motions:
        lines += [
            *_motion_lines(motion),
            commented(f"weight = {1 / F:.4g}", "1 / F at home: both tasks then count alike"),
            "",
        ]
    lines += [
        "[combine]",
        commented('method = "weighted-sum"', 'of F; or "worst-case", of F / weight'),
        "",
        commented("[limits]", "limits of a buildable design; they hold at the settings of every task"),
        *limit_lines(model, home),
        "",
        *search_lines(),
    ]
    return text_of(lines)


def path_starter(model: Model, path_file: str, robot_file: str | None = None) -> PathStarter:
    """Return a case file for a robot whose turn about the tool changes along a path, and the path.

    Args:
        model: the robot.
        path_file: name of the table of poses in the folder of the case.
        robot_file: name of the robot file in the folder of the case; None for a robot by name or definition.

    Raises:
        InputError: the robot has fewer than six degrees of freedom, or joints that the pose does not give in closed
            form.
    """
    home, units = home_of(model), units_of(model)
    if home.mobility < 6:
        fault = f"{model.name!r} has {home.mobility} of the six degrees of freedom that a turn about the tool needs"
        raise InputError(f"--per path: {fault}")
    if closed_form(model).model.unknowns:
        raise InputError(f"--per path: joints of {model.name!r} do not follow from the pose in closed form")
    part, lean = _CIRCLE if model.legs else _CIRCLE_OF_OTHERS
    radius = round_number(part * home.reach)
    speed = float(f"{2 * math.pi * radius / _TIME:.2g}")
    x, y, z = model.home
    lines = [
        f'title = "My {model.name}, with a turn along a path"',
        "",
        *robot_lines(model, robot_file, home.arm),
        "",
        "# A number is a fixed value; { min = a, max = b } is a free variable, the same at all points of the path.",
        "[robot.parameters]",
        *(parameter_line(each, units, is_free=False) for each in model.parameters),
        "",
        commented("[pose]", "first pose of the path; it must be fixed"),
        f"position = {vector([x + radius, y, z])}",
        f"rotation = {{ axis = [0, 1, 0], angle = {lean} }}",
        "",
        "[[task]]",
        'sense = "max"',
        commented('follows = "feed"', 'F of the feed direction; or "tool", rotation about the tool; or "thrust"'),
        "",
        "[objective]",
        'over = "path"',
        commented('as = "mean"', 'mean F along the path; or "worst"'),
        "",
        "[path]",
        commented(f'file = "{path_file}"', "t, position and quaternion; a circle with a tool that leans outwards"),
        commented(
            f"tool = {{ axis = [0, 0, 1], turn = {{ min = {-_TURN}, max = {_TURN}, rate = {_RATE} }} }}",
            "the turn about the tool is free, deg and deg/s",
        ),
        "",
        commented("[limits]", "limits of a buildable design; the documentation lists all"),
        '# over = "path"   # proves the limits between the points too',
        *limit_lines(model, home),
    ]
    return PathStarter(text_of(lines), _circle((x, y, z), radius, speed, lean))


def _two_motions(model: Model, home: Home) -> list[tuple[Screw, float]]:
    """Return two feasible motions with their F at home, a translation and a rotation if there are both."""
    found = [(each, objective_at_home(model, home, each)) for each in home.motions]
    found = [(each, F) for each, F in found if _SMALLEST * (1.0 if math.isinf(each.pitch) else home.arm**2) < F]
    first = next((pair for pair in found if math.isinf(pair[0].pitch)), None)
    second = next((pair for pair in found if not math.isinf(pair[0].pitch)), None)
    return [first, second] if first is not None and second is not None else found[:2]


def _motion_lines(motion: Screw) -> list[str]:
    """Return the lines of a task with a motion, without a weight."""
    is_translation = math.isinf(motion.pitch)
    lines = [
        "[[task]]",
        f'name = "{"push" if is_translation else "turn"} {_letter(motion)}"',
        'sense = "max"',
        commented(f"axis = {vector(motion.axis)}", "direction of the screw axis, of any length but zero"),
    ]
    if is_translation:
        return [*lines, commented("pitch = inf", "translation along the axis; 0: rotation about it")]
    return [
        *lines,
        commented(f"point = {vector(motion.point)}", "any point on the screw axis"),
        commented(f"pitch = {number(motion.pitch)}", "translation per radian; 0: rotation; inf: translation"),
    ]


def _letter(motion: Screw) -> str:
    """Return the nearest coordinate axis of a motion."""
    return "xyz"[int(np.argmax(np.abs(motion.axis)))]


def _holes(values: list[float], widths: list[float]) -> str:
    """Return a dimension with one of three values for each task, as TOML."""
    k = next(index for index, width in enumerate(widths) if width)
    value, width = values[k], widths[k]
    listed = ", ".join(number(float(f"{each:.4g}")) for each in (value - width / 2, value, value + width / 2))
    return f'{{ values = [{listed}], per = "task" }}'


def _circle(centre: tuple[float, float, float], radius: float, speed: float, lean: float) -> str:
    """Return the table of a circle at constant speed, with a tool that leans outwards.

    The tool is reached from the vertical by a rotation about a horizontal axis.
    """
    lines = ["t,x,y,z,qw,qx,qy,qz"]
    c, s = math.cos(math.radians(lean) / 2), math.sin(math.radians(lean) / 2)
    for k in range(_POINTS):
        angle = 2 * math.pi * k / (_POINTS - 1)
        x, y = math.cos(angle), math.sin(angle)
        row = (radius * angle / speed, centre[0] + radius * x, centre[1] + radius * y, centre[2], c, -y * s, x * s, 0)
        lines.append(",".join(f"{value if abs(value) > 1e-12 * radius else 0:.10g}" for value in row))
    return "\n".join(lines) + "\n"
