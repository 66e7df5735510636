"""The largest factor by which a workspace can grow about its centre with everything proved."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...case.case import Case
from ...case.pose import Free
from ...case.workspace import LARGEST_TURN, Workspace
from ...interruption import is_requested, one_call, within
from ..statement.claims import CONSTRAINTS, REGULAR
from ..statement.machine import workspace_of_case
from .judge import judge_workspace
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
    workspace = workspace_of_case(case)
    proved, failed, fault = 0.0, math.inf, None
    with within(time_limit):
        while (factor := _next(proved, failed, largest_factor(workspace))) is not None and not is_requested():
            larger = scaled(workspace, factor)
            judged = judge_workspace(case, workspace=larger, jobs=jobs, with_objective=False, until_fault=True)
            if judged.is_proved:
                proved = factor
            elif is_requested() and not judged.is_refuted:  # a search that was stopped shows no fault
                break
            else:
                failed, fault = factor, judged
    if fault is None:
        return Scale(proved, failed, False, "", None)
    names = [REGULAR, CONSTRAINTS][: len(fault.ranks)] + [f"{each.name}: {each.key}" for each in fault.extremes]
    faults = [(name, each) for name, each in zip(names, fault.verdicts, strict=True) if each.fails]
    # A refuted claim before an open one.
    name, worst = min(faults, key=lambda each: each[1].outcome is not Outcome.REFUTED)
    return Scale(proved, failed, worst.outcome is Outcome.REFUTED, f"{name}, {worst.outcome.value}", worst.pose)


def _next(proved: float, failed: float, most: float) -> float | None:
    """Return the next factor to try, at most the given one; None where the factor is known."""
    if failed == math.inf:
        return min(2 * proved or 1.0, most) if proved < most else None
    if proved == 0:
        return failed / 2 if failed / 2 >= _LEAST else None
    return (proved * failed) ** 0.5 if failed - proved > ACCURACY * failed else None


def largest_factor(workspace: Workspace) -> float:
    """Return the largest factor at which every angle has coordinates."""
    factors = [_MOST]
    for angle in workspace.turns.angles:
        if isinstance(angle, Free):
            centre, half = (angle.lower + angle.upper) / 2, (angle.upper - angle.lower) / 2
            factors.append((LARGEST_TURN - abs(centre)) / half)
    return min(factors)
