"""The option ``--range`` of the command ``path``: how far each coordinate can move from a pose."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NoReturn

from . import contents, options

if TYPE_CHECKING:
    from ..case.case import Case


def show_ranges(
    case: Case,
    start: Sequence[float] | None,
    most: str | None,
    time: float | None,
    files: options.Outputs,
    report: Callable[[str], None],
    *,
    whole: bool,
) -> NoReturn:
    """Write how far each coordinate of a pose can move, and exit.

    Args:
        case: with fixed dimensions.
        start: the pose: position, and roll, pitch and yaw in degrees; None for the case's.
        most: length and angle in degrees, with a comma, that coordinates are moved by; None for the size of the robot
            and a right angle.
        time: seconds; None for the usual ones.
        files: that are written.
        report: called with what is done next.
        whole: whether everything is printed, and not the answer alone.

    Raises:
        InputError: a number is not allowed.
    """
    from ..proof.workspace.axis_ranges import TIME_LIMIT, axis_ranges
    from ..results.axisranges import axis_ranges_result
    from ..words.axisranges import axis_ranges_summary, axis_ranges_tables

    pose = None if start is None else [*start[:3], *map(math.radians, start[3:])]
    limit = TIME_LIMIT if time is None else time
    found = axis_ranges(case, pose, most=_largest(most), time_limit=limit, progress=report)
    result = axis_ranges_result(found)
    files.deliver(
        lambda: axis_ranges_summary(case, result),
        whole=whole,
        done=result.proved,
        json=lambda: result,
        csv=lambda: contents.tables_as_csv(axis_ranges_tables(result)),
    )


def _largest(text: str | None) -> tuple[float, float] | None:
    """Return the largest length and angle of ``--most``.

    Raises:
        InputError: they are not two positive numbers.
    """
    from ..errors import InputError

    if text is None:
        return None
    try:
        length, angle = (float(part) for part in text.split(","))
    except ValueError:
        length = angle = math.nan
    if not (0 < length < math.inf and 0 < angle < math.inf):
        raise InputError(f"--most {text}: must be two positive numbers with a comma: a length, and an angle in degrees")
    return length, math.radians(angle)
