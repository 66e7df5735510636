"""Verification of a robot along a tool path that is read from a file or from the case."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...case.case import Case
from ...path.options import PathOptions
from ...path.path import ProgrammedPath
from ...path.reader import path_of_case, read_path
from ...path.settings import changing_of
from .judgement import Judgement
from .path_judge import GAP, TIME_LIMIT, judge_path


def check_path(
    case: Case,
    path: ProgrammedPath | str | Path | None = None,
    *,
    options: PathOptions | None = None,
    gap: float = GAP,
    time_limit: float | None = TIME_LIMIT,
    progress: Callable[[str], None] | None = None,
) -> Judgement:
    """Verify a robot at every point of a tool path: no singularity and no violated limit of the case.

    Args:
        case: the robot with fixed dimensions, and its limits.
        path: the tool path, or its file: a G-code program, or a table of poses whose name ends in ``.csv``.
            None for the path of the case.
        options: reading options that the file leaves open. If left out, the path of the case is read with the case's
            options.
        gap: largest relative gap of a quantity without a limit.
        time_limit: seconds for all searches together; None for no limit.
        progress: function that is called with the name of the next step.

    Returns:
        A verdict on each claim: proved at every point, refuted with a point and its pose, or open with the reason.
        ``is_proved`` tells whether all ranks and limits are proved.

    Raises:
        CaseError: a dimension of the robot is free, or the case has no path.
        InputError: the file cannot be read or has unsupported words, the rotations of the path are not supported, or
            the C kernel was not built.
    """
    if path is None:
        path = path_of_case(case, options)
    elif not isinstance(path, ProgrammedPath):
        path = read_path(path, case.units, options, changing_of(case))
    return judge_path(case, path, gap=gap, time_limit=time_limit, progress=progress)
