"""The largest factor by which a workspace can grow about its centre with everything proved."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...case.case import Case
from ...case.pose import Free
from ...case.workspace import LARGEST_TURN, Workspace
from ...interruption import is_requested, one_call, seconds_left, why_stopped, within
from ..statement.machine import workspace_of_case
from .judge import judge_workspace
from .judgement import Judgement
from .robot.pose_box import PoseNumbers, scaled
from .verdict import Outcome

#: Accuracy of the factor.
ACCURACY = 0.01
#: Largest factor that is tried, and the smallest, which is tried first.
_MOST, _LEAST = 64.0, 2.0**-10
#: Times as long as the longest proved box that a box may take, where an even share of the time is less.
_LONGER = 8.0


@dataclass(frozen=True, eq=False)
class Scale:
    """The largest box of poses that is proved.

    Attributes:
        factor: everything is proved for the box that is larger by this factor; None where no such factor is found.
        failed: the smallest factor known at which it is not; infinite without one.
        refuted: whether something is refuted there, and not only open.
        claim: the claim that fails there; empty without one.
        pose: a pose of it; None without one.
        reason: why the search ended before the factor was known to 1 %; empty where it is.
    """

    factor: float | None
    failed: float
    refuted: bool
    claim: str
    pose: PoseNumbers | None
    reason: str = ""


@one_call
def largest_scale(
    case: Case, *, time_limit: float | None = None, jobs: int | None = None, judged: Judgement | None = None
) -> Scale:
    """Return the largest factor of a case's workspace for which J is regular and every limit holds, to 1 %.

    A box within a proven one is proved, so that the factor is found by bisection. The smallest box is judged first: it
    takes little time, and where it fails, every box does.

    Args:
        case: a case with fixed dimensions.
        time_limit: seconds for all searches together, of which each box but the first takes half of what is left at
            most, so that a box that stays open leaves time for smaller ones; None for those of each judgement alone.
        jobs: threads.
        judged: verdicts on the workspace itself; proved or refuted, it is not judged again.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
    """
    workspace = workspace_of_case(case)
    proved, failed, fault, reason, longest = 0.0, math.inf, None, "", 0.0
    if judged is not None and judged.is_proved:
        proved = 1.0
    elif judged is not None and judged.is_refuted:  # one that is open may be proved where limits alone are judged
        failed, fault = 1.0, judged
    most = largest_factor(workspace)
    with within(time_limit):
        while (factor := _next(proved, failed, most)) is not None:
            if is_requested():
                reason = why_stopped()
                break
            larger = scaled(workspace, factor)
            left = seconds_left()
            with within(_share(left, longest, _trials(proved, min(failed, most)))):
                found = judge_workspace(case, workspace=larger, jobs=jobs, with_objective=False, until_fault=True)
            if found.is_proved:
                proved = factor
                longest = 0.0 if left == math.inf else max(longest, left - seconds_left())
            elif is_requested() and not found.is_refuted:  # a search that was stopped shows no fault
                reason = why_stopped()
                break
            else:
                failed, fault = factor, found
    known = proved or None
    if fault is None:
        return Scale(known, failed, False, "", None, reason)
    # A refuted claim before an open one.
    worst = min((each for each in fault.verdicts if each.fails), key=lambda each: each.outcome is not Outcome.REFUTED)
    name = worst.name if worst.is_rank else f"{worst.name}: {worst.key}"
    is_refuted = worst.outcome is Outcome.REFUTED
    return Scale(known, failed, is_refuted, f"{name}, {worst.outcome.value}", worst.pose, reason)


def _next(proved: float, failed: float, most: float) -> float | None:
    """Return the next factor to try, at most the given one; None where the factor is known."""
    if proved == 0:
        return _LEAST if failed > _LEAST else None
    if failed == math.inf:
        return min(max(2 * proved, 1.0), most) if proved < most else None
    return (proved * failed) ** 0.5 if failed - proved > ACCURACY * failed else None


def _trials(proved: float, failed: float) -> int:
    """Return how many boxes are judged until the factor is known, at most: those of a bisection of its logarithm.

    Below the first box, with nothing proved, there is no other.
    """
    return 1 if proved == 0 else 1 + math.ceil(math.log2(max(math.log(failed / proved) / ACCURACY, 1.0)))


def _share(left: float, longest: float, trials: int) -> float:
    """Return the seconds of the time left that a box may take.

    Args:
        left: the seconds left.
        longest: that a proved box took: a larger one takes more.
        trials: boxes that are judged from now on, at most.
    """
    return left if trials == 1 else min(left / 2, max(left / trials, _LONGER * longest))


def largest_factor(workspace: Workspace) -> float:
    """Return the largest factor at which every angle has coordinates."""
    factors = [_MOST]
    for angle in workspace.turns.angles:
        if isinstance(angle, Free):
            centre, half = (angle.lower + angle.upper) / 2, (angle.upper - angle.lower) / 2
            factors.append((LARGEST_TURN - abs(centre)) / half)
    return min(factors)
