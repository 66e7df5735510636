"""The front of a case as a function of Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..case.case import Case
from ..errors import InputError
from .front import Front, find_front
from .goals import read_goals

#: Points of a front where no number is asked for.
POINTS = 16


def pareto(
    case: Case,
    goals: Sequence[str],
    *,
    points: int = POINTS,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    certified: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Front:
    """Find the front of two or more goals of a case.

    Args:
        case: the case, all of whose limits hold at each point.
        goals: as on the command line, such as ``["max F:drive", "min limits.leg_length.max"]``.
        points: number of points, at least 2; fewer where the front has gaps or is one point.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads; the result does not depend on it.
        certified: whether the optimum of each point is proved too.
        progress: called after each solve with the numbers of points found and wanted.

    Raises:
        CaseError: the case contradicts itself.
        InputError: a goal is none of the case, is given twice, or is a limit that cannot move; or there is one only.
        EvaluationError: a goal alone has no optimum.
        UncoveredError: an optimum is to be proved, and an expression has an operation without a rule.
    """
    if points < 2:
        raise InputError(f"pareto: points = {points}: must be at least 2")
    search = case.search.but(starts, seed)
    return find_front(
        case, read_goals(goals, case), points, search=search, jobs=jobs, certify=certified, progress=progress
    )
