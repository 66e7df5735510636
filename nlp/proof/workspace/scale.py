"""The largest factor by which a workspace can grow about its centre with everything proved."""

from __future__ import annotations

from dataclasses import dataclass

from ...case.case import Case
from ...case.pose import Free
from ...case.workspace import LARGEST_TURN, Workspace
from ...interruption import is_requested, one_call, within
from ..statement.machine import workspace_of_case
from .judge import Judgement, judge_workspace
from .robot.pose_box import PoseNumbers, scaled
from .verdict import Outcome

#: Accuracy of the factor.
ACCURACY = 0.01
#: Largest factor that is tried, and the smallest: below it nothing is proved.
_MOST, _LEAST = 64.0, 2.0**-10


@dataclass(frozen=True, eq=False)
class Scale:
    """The largest box of poses that is proved.

    Attributes:
        factor: everything is proved for the box that is larger by this factor; 0 where nothing is.
        failed: the smallest factor known at which it is not; infinite without one.
        refuted: whether something is refuted there, and not only open.
        claim: the claim that fails there; empty without one.
        pose: a pose of it; None without one.
    """

    factor: float
    failed: float
    refuted: bool
    claim: str
    pose: PoseNumbers | None


@one_call
def largest_scale(case: Case, *, time_limit: float | None = None, jobs: int | None = None) -> Scale:
    """Return the largest factor of a case's workspace for which J is regular and every limit holds, to 1 %.

    A box within a proven one is proved, so that the factor is found by bisection.

    Args:
        case: a case with fixed dimensions.
        time_limit: seconds for all searches together; None for those of each judgement alone.
        jobs: threads.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
    """
    with within(time_limit):
        return _largest(case, workspace_of_case(case), jobs)


def _largest(case: Case, workspace: Workspace, jobs: int | None) -> Scale:
    """Return the largest factor within the time left."""
    proved, failed, fault = 0.0, float("inf"), None
    factor, most = 1.0, min(_MOST, largest_factor(workspace))
    while (failed == float("inf") or failed - proved > ACCURACY * failed) and not is_requested():
        judged = judge_workspace(
            case,
            workspace=scaled(workspace, factor),
            jobs=jobs,
            with_objective=False,
            until_fault=True,
        )
        if judged.is_proved:
            proved = factor
        elif is_requested() and not judged.is_refuted:  # a search that was stopped shows no fault
            break
        else:
            failed, fault = factor, judged
        if failed == float("inf"):
            if factor >= most:
                break
            factor = min(2 * factor, most)
        elif proved == 0:
            factor = failed / 2
            if factor < _LEAST:
                break
        else:
            factor = (proved * failed) ** 0.5
    claim, pose, refuted = "", None, False
    if fault is not None:
        claim, pose, refuted = _fault(fault)
    return Scale(proved, failed, refuted, claim, pose)


def _fault(judged: Judgement) -> tuple[str, PoseNumbers | None, bool]:
    """Return the claim that fails, a pose of it, and whether it is refuted: a refuted one before an open one."""
    faults: list[tuple[Outcome, str, PoseNumbers | None]] = []
    for name, found in zip(("regular", "constraints regular"), judged.ranks, strict=False):
        if found.outcome is not Outcome.PROVED:
            faults.append((found.outcome, name, None if found.y is None else found.box.pose(found.y)))
    faults += [(each.outcome, f"{each.name}: {each.key}", each.pose) for each in judged.extremes if each.fails]
    if not faults:
        return "regular poses", None, False
    outcome, name, pose = min(faults, key=lambda each: each[0] is not Outcome.REFUTED)
    is_refuted = outcome is Outcome.REFUTED
    return f"{name}, {outcome.value}", pose, is_refuted


def largest_factor(workspace: Workspace) -> float:
    """Return the largest factor at which every angle has coordinates."""
    factors = [_MOST]
    for angle in workspace.turns.angles:
        if isinstance(angle, Free):
            centre, half = (angle.lower + angle.upper) / 2, (angle.upper - angle.lower) / 2
            factors.append((LARGEST_TURN - abs(centre)) / half)
    return min(factors)
