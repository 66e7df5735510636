"""A machine along a path of a file or of its case: read, and judged."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...case.case import Case
from ...path.options import PathOptions
from ...path.path import ProgrammedPath
from ...path.reader import path_of_case, read_path
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
    """Judge a machine at every point of a path: regular, and within every limit of the case.

    Args:
        case: the machine; its dimensions are fixed.
        path: a path, or the name of its file: a program of G-code, or a table of poses whose name ends in ``.csv``.
            None for the path of the case.
        options: choices that the file leaves open; those of the case's own path are the case's if left out.
        gap: largest relative gap of a number without a limit.
        time_limit: seconds of all searches; None for no limit.
        progress: called with what is done next.

    Returns:
        A verdict on each claim: proved at every point, refuted with a point and its pose, or open with the reason.
        ``is_proved`` says whether all are proved.

    Raises:
        CaseError: a dimension of the robot is free, or the case has no path.
        InputError: the file cannot be read or holds what is not read, the path has angles that are not covered, or
            there is no C kernel.
    """
    if path is None:
        path = path_of_case(case, options)
    elif not isinstance(path, ProgrammedPath):
        path = read_path(path, case.units, options)
    return judge_path(case, path, gap=gap, time_limit=time_limit, progress=progress)
