"""Option ``--range`` of the command ``path``: free travel from a pose along each coordinate."""

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
    """Write the free travel along each coordinate of a pose, and exit.

    Args:
        case: case with fixed dimensions.
        start: pose: position, and roll, pitch and yaw in degrees; None for the pose of the case.
        most: text of ``--most``: largest length, comma, largest angle in degrees; None for robot size and 90 degrees.
        time: time limit, seconds; None for the default.
        files: files to write.
        report: function that is called with the name of each next step.
        whole: If true, everything is printed, not only the answer.

    Raises:
        InputError: a value is not allowed.
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
        InputError: the text is not two positive numbers.
    """
    from ..errors import InputError

    if text is None:
        return None
    try:
        length, angle = (float(part) for part in text.split(","))
    except ValueError:
        length = angle = math.nan
    if not (0 < length < math.inf and 0 < angle < math.inf):
        raise InputError(f"--most {text}: must be LENGTH,ANGLE: two positive numbers, the angle in degrees")
    return length, math.radians(angle)
