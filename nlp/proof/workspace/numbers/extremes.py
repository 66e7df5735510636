"""Proven smallest and largest values over a workspace, each with the pose at which it is met.

Every claim is a program over the numbers of the pose, which :mod:`screwsynth.nlp.proof.certificate` bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .....models import Dimension, FloatArray, axis_angle_from_matrix, frozen_array
from ....case.motors import Motor
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import is_requested, one_search, why_stopped
from ....program.layout import Layout
from ....program.nlp import Nlp
from ...boxes.tree import TreeRecord
from ...certificate.branch_and_bound import certify_program
from ...certificate.certificate import Certificate, CertificateStatus
from ...statement.claims import Claim
from ...statement.machine import JointErrors
from ...statement.posed_layout import extreme_program, varies
from ..robot.path_cover import Place
from ..robot.pose_box import PoseNumbers
from ..verdict import Outcome, slack_of
from .bound_search import Goal, Minimum

if TYPE_CHECKING:
    from ..paper_record import PaperRecord

#: Returns the errors of the machine that is worst at a pose, to first order, and the value of its expression.
WorstMachine = Callable[[PoseNumbers], tuple[JointErrors, float]]
#: Gap of a bound as a part of the value, where none is asked for.
GAP = 1e-3
#: Finest gap that is tried where a limit lies between a bound and the best value known: that of rounding.
_FINEST = 1e-10
#: Part of the room between a value and its limit that a finer gap is: the value known grows a little in a search.
_SHARE = 0.9
#: Part of an expression's scale that gaps of smaller values are parts of, as in the search of certificates.
_NEAR_ZERO = 1e-6
#: Reason for a limit that stays open between a bound and a value although the search ended.
CLOSE = "the limit is closer to the value reached than bounds can tell"


@dataclass(frozen=True, eq=False)
class Extreme:
    """The smallest or the largest value of a number over a workspace.

    Attributes:
        name: of the number, in the words of a case.
        sense: whether the smallest or the largest value is meant.
        dimension: of the number.
        key: dotted key, below ``limits``, of the limit in the case; empty without one.
        limit: the limit, radians for angles; None without one.
        bound: proven: no pose has a smaller, or a larger, value; radians for angles; infinite where nothing is proved.
        reached: the smallest or largest value known; NaN without one.
        pose: the pose at which it is reached; None without one.
        outcome: of the limit, or, without one, of the gap asked for.
        boxes: number of boxes examined.
        seconds: wall time.
        reason: for an open outcome; else empty.
        errors: of the joint centres of the machine that reaches the value; None for the exact machine.
        motor: the actuator and its number, of claims about motors.
        place: on a path, of the value reached; None for a workspace.
    """

    name: str
    sense: Sense
    dimension: Dimension
    key: str
    limit: float | None
    bound: float
    reached: float
    pose: PoseNumbers | None
    outcome: Outcome
    boxes: int
    seconds: float
    reason: str
    errors: JointErrors | None = None
    motor: Motor | None = None
    place: Place | None = None

    @property
    def fails(self) -> bool:
        """Whether it has a limit that is not proved to hold; a number without a limit is information."""
        return self.limit is not None and self.outcome is not Outcome.PROVED


def extreme_of(
    claim: Claim, found: Minimum, pose: PoseNumbers | None = None, *, errors: JointErrors | None = None
) -> Extreme:
    """Return the extreme of a number from the smallest value of its expression, or of minus it for the largest one.

    Args:
        claim: the number, with its limit.
        found: without a reason where it is as good as asked for.
        pose: at which the value is reached.
        errors: of the machine that reaches it, as for :class:`Extreme`.
    """
    sign, read, limit = claim.sense.sign, claim.reading.from_value, claim.limit
    is_bounded, is_reached, reason = math.isfinite(found.bound), math.isfinite(found.value), found.reason
    bound = read(-sign * found.bound) if is_bounded else sign * math.inf
    outcome = Outcome.PROVED if is_bounded and not reason else Outcome.OPEN
    if limit is not None:
        least, slack = -sign * limit, slack_of(limit)
        outcome = Outcome.PROVED if is_bounded and found.bound >= least - slack else Outcome.OPEN
        outcome = Outcome.REFUTED if found.value < least - slack else outcome
        reason = reason or CLOSE
    if claim.uncovered:
        # What is proved of the exact machine is nothing about the others, and refutes all the same.
        bound, reason = sign * math.inf, claim.uncovered
        outcome = outcome if outcome is Outcome.REFUTED else Outcome.OPEN
    return Extreme(
        name=claim.name,
        sense=claim.sense,
        dimension=claim.reading.dimension,
        key=claim.key,
        limit=None if limit is None else read(limit),
        bound=bound,
        reached=read(-sign * found.value) if is_reached else math.nan,
        pose=pose,
        outcome=outcome,
        boxes=found.boxes,
        seconds=found.seconds,
        reason=reason if outcome is Outcome.OPEN else "",
        errors=errors,
        motor=claim.motor,
        place=found.place,
    )


def goal_of(claim: Claim, gap: float = 0.0, part: float = 0.0, *, is_enough: bool = True) -> Goal:
    """Return what a search of minus a claim's number, or of it for a smallest one, is to reach."""
    if claim.limit is None:
        return Goal(gap, part)
    return Goal(gap, part, claim.limit if claim.sense is Sense.MIN else -claim.limit, slack_of(claim.limit), is_enough)


def prove_extreme(
    layout: Layout,
    claim: Claim,
    *,
    gap: float = GAP,
    time_limit: float | None = None,
    jobs: int | None = None,
    machine: WorstMachine | None = None,
    paper: PaperRecord | None = None,
) -> Extreme:
    """Prove the smallest or the largest value of a number over a workspace.

    A search whose bound is beyond the number's limit, with a value within it, goes on until the limit is decided.

    Args:
        layout: the case as symbols of the pose.
        claim: the number.
        gap: allowed distance of the bound from the best value known, as a part of it.
        time_limit: seconds after which the search stops with the bound reached.
        jobs: threads.
        machine: returns the machine that is worst at a pose, for a claim about every machine within a tolerance.
        paper: records the search for a proof.
    """
    sign = claim.sense.sign
    if is_requested():
        return extreme_of(claim, Minimum(reason=why_stopped()))
    nlp = extreme_program(layout, claim.expression, claim.sense)
    x: FloatArray | None
    if not varies(layout, [claim.expression])[0]:
        value = nlp.evaluate(nlp.start).F
        if paper is not None:
            paper.constant(claim, nlp, value)
        found, x = Minimum(-sign * value, -sign * value), np.array(nlp.start)
    else:
        try:
            with one_search(time_limit):
                found, x = _search(nlp, claim, gap, jobs, paper)
        except UncoveredError as error:
            return extreme_of(claim, Minimum(reason=str(error)))
    pose = None if x is None else _pose(nlp, x)
    if pose is None or machine is None:
        return extreme_of(claim, found, pose)
    errors, value = machine(pose)
    return extreme_of(claim, found._replace(value=-sign * value), pose, errors=errors)


def _search(
    nlp: Nlp, claim: Claim, gap: float, jobs: int | None, paper: PaperRecord | None
) -> tuple[Minimum, FloatArray | None]:
    """Return the bound of an expression, to the gap or as fine as its limit needs, and the point of its best value.

    Raises:
        UncoveredError: the expression holds an operation without a rule.
    """
    # A program of a claim has one function, and its search is that of certify with or without a record.
    sign, writer = claim.sense.sign, None if paper is None else TreeRecord()
    found = certify_program(nlp, gap=gap, jobs=jobs, recorder=writer)
    boxes, seconds = found.boxes, found.seconds
    while (finer := _finer_gap(nlp, claim, found)) is not None and not is_requested():
        finer_writer = None if paper is None else TreeRecord()
        more = certify_program(nlp, found.x, gap=finer, jobs=jobs, recorder=finer_writer)
        boxes, seconds = boxes + more.boxes, seconds + more.seconds
        if sign * more.bound <= sign * found.bound:
            found, writer = more, finer_writer
        else:
            found = replace(more, bound=found.bound, bound_of_tree=found.bound_of_tree)
    if found.status is CertificateStatus.INFEASIBLE:
        return Minimum(boxes=boxes, seconds=seconds, reason="the robot has no pose there"), None
    if paper is not None and writer is not None:
        paper.program(claim, found, writer)
    # A search that ends early has a bound too, which may be as good as asked for.
    is_met = found.status is CertificateStatus.PROVED or found.gap <= found.allowed
    value = math.inf if math.isnan(found.incumbent) else -sign * found.incumbent
    reason = "" if is_met else found.reason
    return Minimum(-sign * found.bound, value, boxes=boxes, seconds=seconds, reason=reason), found.x


def _finer_gap(nlp: Nlp, claim: Claim, found: Certificate) -> float | None:
    """Return the gap that decides a claim's limit; None where it is decided, or the search did not end by itself."""
    if claim.limit is None or found.status is not CertificateStatus.PROVED:
        return None
    sign = claim.sense.sign
    slack = slack_of(claim.limit)
    room = sign * (claim.limit - found.incumbent) + slack / 2
    if not (room > 0 and sign * (found.bound - claim.limit) > slack):
        return None
    finer = _SHARE * room / max(abs(found.incumbent), _NEAR_ZERO * nlp.objective_size)
    return finer if finer >= _FINEST else None


def _pose(nlp: Nlp, x: FloatArray) -> PoseNumbers:
    """Return the pose at a point (n,) of a program."""
    state = nlp.program.kernels.robot_state(x, nlp.arguments)
    axis, angle = axis_angle_from_matrix(np.array(state.rotation))
    return PoseNumbers(frozen_array(np.array(state.position).ravel(), (3,)), np.array(state.rotation), axis, angle)
