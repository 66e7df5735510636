"""Largest proved workspace: the factor by which a box of poses, or the radius of a set of positions, can grow."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...case.case import Case
from ...case.pose import Free
from ...case.positionsets import KEY, PositionSet
from ...case.workspace import LARGEST_TURN, Workspace
from ...errors import CaseError
from ...interruption import is_requested, one_call, seconds_left, why_stopped, within
from ..statement.fixed_robot import workspace_of_case
from .judge import judge_workspace
from .judgement import Judgement
from .robot.pose_box import PoseNumbers, scaled
from .verdict import Outcome

#: Accuracy of the factor of a box, and of a radius.
ACCURACY, ACCURACY_OF_RADIUS = 0.01, 5e-4
#: Largest and smallest factor. The smallest is judged first.
_MOST, _LEAST = 64.0, 2.0**-10
#: Time for one box, as a multiple of the longest time of a proved box, if an even share of the time is less.
_LONGER = 8.0


@dataclass(frozen=True, eq=False)
class Scale:
    """Largest proved box of poses, or set of positions.

    Attributes:
        factor: scale factor of the largest proved box; None if no box was proved.
        failed: smallest known scale factor of a box that is not proved; infinite without such a box.
        refuted: If true, a claim about the failed box is refuted; otherwise it is undecided.
        claim: claim that fails in the failed box; empty without a failed box.
        pose: pose at which the claim fails; None without a pose.
        reason: reason why the search ended before the factor was known to its accuracy; otherwise empty.
        positions: largest proved set of positions; None without a set with a radius, or if none was proved.
    """

    factor: float | None
    failed: float
    refuted: bool
    claim: str
    pose: PoseNumbers | None
    reason: str = ""
    positions: PositionSet | None = None


@one_call
def largest_scale(
    case: Case, *, time_limit: float | None = None, jobs: int | None = None, judged: Judgement | None = None
) -> Scale:
    """Return the largest scale factor of a case's workspace with full rank of J and all limits proved.

    The factor of a box is computed to 1 %, that of a radius to 0.05 %, by bisection: a box within a proved box is
    proved. The smallest box is judged first: it takes little time, and if it fails, every box fails. If the positions
    are a set with a radius, only this radius is scaled; for a ring, the width between both radii.

    Args:
        case: case with fixed dimensions.
        time_limit: seconds for all searches together; None for the default time of each judgement. Each box but the
            first takes at most half of the time left, so that an open box leaves time for smaller boxes.
        jobs: number of threads.
        judged: verdicts on the workspace at factor 1. The workspace is not judged again if all claims are proved or one
            is refuted.

    Raises:
        CaseError: the case has no workspace, or a free dimension; or half spaces exclude the smallest set of positions.
    """
    workspace = workspace_of_case(case)
    accuracy = _accuracy_of(case, workspace)
    proved, failed, fault, reason, longest = 0.0, math.inf, None, "", 0.0
    if judged is not None and judged.is_proved:
        proved = 1.0
    elif judged is not None and judged.is_refuted:  # an open workspace may be proved if only limits are judged
        failed, fault = 1.0, judged
    most = largest_factor(workspace)
    with within(time_limit):
        while (factor := _next(proved, failed, most, accuracy)) is not None:
            if is_requested():
                reason = why_stopped()
                break
            larger = scaled(workspace, factor)
            left = seconds_left()
            with within(_share(left, longest, _trials(proved, min(failed, most), accuracy))):
                found = judge_workspace(case, workspace=larger, jobs=jobs, with_objective=False, until_fault=True)
            if found.is_proved:
                proved = factor
                longest = 0.0 if left == math.inf else max(longest, left - seconds_left())
            elif is_requested() and not found.is_refuted:  # a stopped search shows no failed claim
                reason = why_stopped()
                break
            else:
                failed, fault = factor, found
    known = proved or None
    positions = workspace.position_set
    positions = positions.scaled(proved) if proved and positions is not None and positions.has_radius else None
    if fault is None:
        return Scale(known, failed, False, "", None, reason, positions)
    # Refuted claims are reported before open ones.
    worst = min((each for each in fault.verdicts if each.fails), key=lambda each: each.outcome is not Outcome.REFUTED)
    name = worst.name if worst.is_rank else f"{worst.name}: {worst.key}"
    is_refuted = worst.outcome is Outcome.REFUTED
    return Scale(known, failed, is_refuted, f"{name}, {worst.outcome.value}", worst.pose, reason, positions)


def _accuracy_of(case: Case, workspace: Workspace) -> float:
    """Return the accuracy of the factor of a workspace.

    Raises:
        CaseError: half spaces exclude the smallest set of positions that is examined.
    """
    positions = workspace.position_set
    if positions is None:
        return ACCURACY
    try:
        _ = positions.scaled(_LEAST).middle
    except CaseError:
        fault = (
            "exclude the smallest set that --scale examines (a disc, ball or box shrinks to its centre, a cylinder to "
            "its axis, a cone to its apex, a ring to its inner circle); move the planes so that a part of it remains"
        )
        raise CaseError(f"{KEY}.half_spaces", fault, source=case.source) from None
    return ACCURACY_OF_RADIUS if positions.has_radius else ACCURACY


def _next(proved: float, failed: float, most: float, accuracy: float) -> float | None:
    """Return the next factor to judge, at most ``most``; None if the largest proved factor is known to the accuracy."""
    if proved == 0:
        return _LEAST if failed > _LEAST else None
    if failed == math.inf:
        return min(max(2 * proved, 1.0), most) if proved < most else None
    return (proved * failed) ** 0.5 if failed - proved > accuracy * failed else None


def _trials(proved: float, failed: float, accuracy: float) -> int:
    """Return the largest number of boxes until the factor is known, by bisection of its logarithm.

    Without a proved box this number is 1, because no box is smaller than the first.
    """
    return 1 if proved == 0 else 1 + math.ceil(math.log2(max(math.log(failed / proved) / accuracy, 1.0)))


def _share(left: float, longest: float, trials: int) -> float:
    """Return the seconds that the next box may take.

    Args:
        left: seconds left.
        longest: longest time of a proved box; a larger box takes more.
        trials: largest number of boxes still to judge.
    """
    return left if trials == 1 else min(left / 2, max(left / trials, _LONGER * longest))


def largest_factor(workspace: Workspace) -> float:
    """Return the largest scale factor at which the search has coordinates for every rotation of the box."""
    factors = [_MOST]
    if workspace.position_set is not None and workspace.position_set.has_radius:
        return _MOST  # ranges of angles stay
    for angle in workspace.turns.angles:
        if isinstance(angle, Free):
            centre, half = (angle.lower + angle.upper) / 2, (angle.upper - angle.lower) / 2
            factors.append((LARGEST_TURN - abs(centre)) / half)
    return min(factors)
