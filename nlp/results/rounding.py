"""Rounding errors of numbers: numbers below their error bound are shown as 0.

The error of a sum is proportional to its terms, and the error of a search to the range. JSON has all digits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from ...models import Dimension
from ..evidence.state import ZERO_F
from ..units import Units

if TYPE_CHECKING:
    from .parts import Jacobian, RobotData, TaskData

#: Error bound of a number, as a fraction of its terms, its neighbours or its range: a thousand times a search's error.
NOISE = 1e-9
#: Error bound of a variable of an optimum, as a fraction of its range: where F is flat, a search ends within the square
#: root of the rounding error, 1.5e-8 of the range, and a few times this where the flat direction has several variables.
FLAT = 1e-7
#: Error bound of a stated number, as a fraction of the largest stated with it: a few times the rounding of a sine.
STATED = 1e-14
#: Significant digits by which numbers are sorted, so that rounding errors do not decide on the order.
_ORDERED = 6
#: Smallest rotation with a significant axis, radians.
TURNED = 1e-9


def settled(value: float, size: float, part: float = NOISE) -> float:
    """Return a number, or 0 if it is below a fraction of ``size``."""
    return 0.0 if abs(value) <= part * size else value + 0.0


def ordered(value: float) -> float:
    """Return the sorting key of a number; numbers within rounding error have the same key."""
    return float(f"{value:.{_ORDERED}g}")


def size_of(dimension: Dimension, values: Iterable[float], units: Units) -> float:
    """Return the magnitude to which rounding errors of values are relative; for angles, half a turn."""
    return units.shown(math.pi, dimension) if dimension is Dimension.ANGLE else max(map(abs, values), default=0.0)


def rate_sizes(jacobian: Jacobian, twist: Sequence[float], position: Sequence[float]) -> list[float]:
    """Return the magnitude of the terms of each row's rate, ``|m| |omega| + |f| |v|``, with moments about a point.

    Args:
        jacobian: the rows, force, then moment about the world origin.
        twist: (6,) twist of the motion.
        position: (3,) origin of the platform; moments about it avoid cancellation, as in the objective.
    """
    omega, v = twist[:3], twist[3:]
    turn = math.hypot(*omega)
    way = math.hypot(*(a + b for a, b in zip(v, _cross(omega, position), strict=True)))
    sizes = []
    for row in jacobian:
        arm = (a - b for a, b in zip(row[3:], _cross(position, row[:3]), strict=True))
        sizes.append(math.hypot(*arm) * turn + math.hypot(*row[:3]) * way)
    return sizes


def settled_rates(rates: Sequence[float], sizes: Sequence[float], *, is_free: bool = False) -> list[float]:
    """Return rates; a rate within the rounding error of its terms is 0.

    Args:
        rates: work rates of the rows.
        sizes: sizes of their terms.
        is_free: If true, F counts as zero.
    """
    return [0.0 if is_free else settled(rate, size) for rate, size in zip(rates, sizes, strict=True)]


def settled_F(F: float, sizes: Sequence[float]) -> float:  # noqa: N802 - the objective's name
    """Return F, or 0 if F is within the rounding error of its rates."""
    return settled(F, math.fsum(size**2 for size in sizes), ZERO_F)


def _cross(a: Sequence[float], b: Sequence[float]) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def size_of_F(robot: RobotData, F: float = 0.0, task: TaskData | None = None) -> float:  # noqa: N802 - the objective's name
    """Return the magnitude of the terms of F over all poses; the absolute value of F if the task is unknown.

    Args:
        robot: robot at the point.
        F: objective.
        task: task of F; None for the task of the robot.
    """
    task = task or robot.task
    if task is None:
        return abs(F)
    twist = task.motion.twist
    poses = [robot] if robot.several is None else robot.several.poses
    sizes = [size for each in poses for size in rate_sizes(each.jacobian, twist, each.pose.position)]
    return math.fsum(size**2 for size in sizes)


def task_F(robot: RobotData | None, F: float) -> float:  # noqa: N802 - the objective's name
    """Return F of a robot's task over its poses, or 0 if F is within the rounding error."""
    return F + 0.0 if robot is None or robot.task is None else settled(F, size_of_F(robot), ZERO_F)


def robot_size(robot: RobotData) -> float:
    """Return the length to which rounding errors of a robot's positions are relative: the longest moment arm."""
    lengths = [abs(part) for row in robot.jacobian for part in row[3:] if any(row[:3])]
    return max([*lengths, *map(abs, robot.pose.position)]) or 1.0
