"""Claims that have searches of their own: singular values, distances between legs, errors of the pose."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .....models import Dimension
from ....case.case import Case
from ....case.limits.clearance import LegClearance
from ....case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ....case.task import Sense
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox
from ..verdict import Outcome
from .bound_search import Minimum, Oracle, prove_minimum
from .clearance import Clearance
from .extremes import CLOSE, Extreme, slack_of
from .pose_error import PoseErrors, WorstError, displaced, with_rest
from .singular import SingularValues

if TYPE_CHECKING:
    from ...boxes.tree import TreeRecord
    from ..proof_record import PaperRecord

#: Values in parts of which gaps count where the smallest value is near 0, as parts of the limit.
_NEAR_ZERO = 0.1
#: Gap of an error of the pose as a part of that at the middle of the workspace: a finer one takes many more boxes.
_ERROR_GAP = 0.1


def own_searches(
    case: Case,
    legs: Legs,
    box: PoseBox,
    *,
    gap: float,
    shortest: float = 0.0,
    paper: PaperRecord | None = None,
) -> Iterator[Extreme]:
    """Yield the extremes of the case's limits that have searches of their own.

    Args:
        case: the case.
        legs: its joint centres.
        box: the poses.
        gap: allowed distance of a bound from the best value known, as a part of it.
        shortest: no leg of any machine is shorter over the workspace; used with a tolerance of the legs alone.
        paper: records the searches for a proof.
    """

    def search(oracle: SingularValues | Clearance, least: float, name: str) -> Minimum:
        recorder = None if paper is None else paper.own(name)
        return searched_minimum(oracle, box, least, gap, recorder)

    def with_errors(oracle: SingularValues | Clearance, found: Minimum, extreme: Extreme) -> Extreme:
        """Return an extreme with the errors of the machine that reaches it."""
        return replace(extreme, errors=oracle.errors(found.at)) if legs.tolerance else extreme

    for limit in case.limits:
        if isinstance(limit, SmallestSingularValue):
            oracle = SingularValues(legs, box, limit.length, is_condition=False, shortest=shortest)
            found = search(oracle, limit.min, "smallest_singular_value")
            extreme = from_minimum("smallest_singular_value", "smallest_singular_value.min", limit.min, box, found)
            yield with_errors(oracle, found, extreme)
        elif isinstance(limit, ConditionNumber):
            oracle = SingularValues(legs, box, limit.length, is_condition=True, shortest=shortest)
            found = search(oracle, -limit.max, "condition_number")
            extreme = from_minimum("condition_number", "condition_number.max", -limit.max, box, found, sign=-1.0)
            yield with_errors(oracle, found, extreme)
        elif isinstance(limit, LegClearance):
            names = [leg.name for leg in case.model.legs]
            for one, other in itertools.combinations(range(len(names)), 2):
                name, clearance = (
                    f"leg_clearance limbs {names[one]} and {names[other]}",
                    Clearance(legs, box, one, other),
                )
                found = search(clearance, limit.min, name)
                extreme = from_minimum(name, "leg_clearance.min", limit.min, box, found, Dimension.LENGTH)
                yield with_errors(clearance, found, extreme)


def searched_minimum(
    oracle: Oracle,
    box: PoseBox,
    limit: float,
    gap: float,
    recorder: TreeRecord | None,
) -> Minimum:
    """Return the smallest value of a function, only as accurately as its limit needs."""
    allowed, slack = gap * max(abs(limit), _NEAR_ZERO), slack_of(limit)
    return prove_minimum(oracle, box, gap=allowed, limit=limit, slack=slack, recorder=recorder)


def from_minimum(
    name: str,
    key: str,
    limit: float,
    box: PoseBox,
    found: Minimum,
    dimension: Dimension = Dimension.NUMBER,
    sign: float = 1.0,
) -> Extreme:
    """Return the extreme of a number that is a search's value times a sign."""
    slack = slack_of(limit)
    outcome = Outcome.OPEN
    if found.value < limit - slack:
        outcome = Outcome.REFUTED
    elif found.bound >= limit - slack:
        outcome = Outcome.PROVED
    reason = found.reason or CLOSE
    return Extreme(
        name=name,
        sense=Sense.MIN if sign > 0 else Sense.MAX,
        dimension=dimension,
        key=key,
        limit=sign * limit,
        bound=sign * found.bound,
        reached=sign * found.value,
        pose=box.pose(found.at),
        outcome=outcome,
        boxes=found.boxes,
        seconds=found.seconds,
        reason=reason if outcome is Outcome.OPEN else "",
    )


def pose_errors(
    legs: Legs,
    box: PoseBox,
    eps: float,
    shortest: float,
    *,
    paper: PaperRecord | None = None,
) -> Iterator[Extreme]:
    """Yield the largest errors of the platform's position and rotation, for every machine within its tolerances.

    Args:
        legs: joint centres.
        box: the poses.
        eps: largest error of a leg's length, those of its joint centres included, length.
        shortest: proven shortest length of a leg over the poses.
        paper: records the searches for a proof.
    """
    names = (("position error", Dimension.LENGTH), ("rotation error", Dimension.ANGLE))
    legs = legs._replace(tolerance=0.0)  # eps has it
    searches = [WorstError(legs, box, is_rotation=is_rotation) for is_rotation in (False, True)]
    found = []
    for each, (name, _) in zip(searches, names, strict=True):
        size = abs(float(each.values(0.5 * (box.lower + box.upper)[None])[0]))
        recorder = None if paper is None else paper.own(name)
        found.append(prove_minimum(each, box, gap=_ERROR_GAP * size, recorder=recorder))
        if paper is not None:
            paper.firsts[name] = -found[-1].bound
    first = PoseErrors(*(-eps * each.bound for each in found))
    reach = float(np.linalg.norm(legs.platform, axis=1).max())
    whole = with_rest(first, eps, shortest, reach) if all(map(math.isfinite, first)) else PoseErrors(math.inf, math.inf)
    for k, (name, dimension) in enumerate(names):
        y, bound = found[k].at, whole[k]
        # To first order both signs give the same error.
        both = [displaced(legs, box, y, sign * eps * searches[k].worst(y)) for sign in (-1.0, 1.0)]
        reached = max((each[k] for each in both if each is not None), default=math.nan)
        is_proved = math.isfinite(bound) and not found[k].reason
        reason = found[k].reason or "the errors are too large for a bound of their terms of second order"
        yield Extreme(
            name=name,
            sense=Sense.MAX,
            dimension=dimension,
            key="",
            limit=None,
            bound=bound,
            reached=reached,
            pose=None if math.isnan(reached) else box.pose(y),
            outcome=Outcome.PROVED if is_proved else Outcome.OPEN,
            boxes=found[k].boxes,
            seconds=found[k].seconds,
            reason="" if is_proved else reason,
        )
