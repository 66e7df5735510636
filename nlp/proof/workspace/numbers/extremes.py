"""Proved smallest and largest values over a workspace by the search of ``certify``, each with a pose.

Every claim is a nonlinear program over the coordinates of the pose; :mod:`screwsynth.nlp.proof.certificate` bounds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from .....models import FloatArray, axis_angle_from_matrix, frozen_array
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import is_requested, one_search, why_stopped
from ....program.layout import Layout
from ....program.nlp import Nlp
from ...boxes.tree import TreeRecord
from ...certificate.branch_and_bound import certify_program
from ...certificate.certificate import Certificate, CertificateStatus
from ...statement.claims import Claim
from ...statement.fixed_robot import JointErrors
from ...statement.posed_layout import extreme_program, varies
from ..robot.pose_box import PoseNumbers
from ..verdict import Outcome, Verdict, slack_of
from .bound_search import Goal, Minimum

if TYPE_CHECKING:
    from ..proof_record import ProofRecord

#: Returns the joint-centre errors that are worst at a pose to first order, and the value with these errors.
WorstRobot = Callable[[PoseNumbers], tuple[JointErrors, float]]
#: Default of the largest relative gap of a bound.
GAP = 1e-3
#: Smallest gap, near rounding, for a limit that lies between the bound and the best known value.
_FINEST = 1e-10
#: Largest reduced gap as a fraction of the distance from a value to its limit, because the best known value changes in
#: a search.
_SHARE = 0.9
#: Fraction of an expression's scale; for smaller values, gaps are relative to this fraction, as in the search of
#: certificates.
_NEAR_ZERO = 1e-6
#: Reason for a limit that stays open between a bound and a value although the search ended.
CLOSE = "the limit is too close to the best known value: no bound separates the two"


@dataclass(frozen=True)
class NumberSearch:
    """Settings of a search of smallest and largest values of quantities.

    Attributes:
        gap: largest relative gap between a bound and the best known value.
        jobs: number of threads; None for all processors.
        record: recorder of the searches for a proof file; None without a proof.
    """

    gap: float = GAP
    jobs: int | None = None
    record: ProofRecord | None = None


#: Default settings of a search.
DEFAULT = NumberSearch()


def verdict_of(
    claim: Claim, found: Minimum, pose: PoseNumbers | None = None, *, errors: JointErrors | None = None
) -> Verdict:
    """Return the verdict on a claim from the proved minimum of its expression; negated for a largest value.

    Args:
        claim: claim about the quantity, with its limit.
        found: result of the search; its reason is empty if the gap was reached.
        pose: pose of the best known value.
        errors: joint-centre errors of the robot with this value, see :class:`.Verdict`.
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
        # A bound for the nominal robot does not cover other robots within the tolerance; a violation refutes the claim.
        bound, reason = sign * math.inf, claim.uncovered
        outcome = outcome if outcome is Outcome.REFUTED else Outcome.OPEN
    return Verdict(
        claim,
        outcome,
        bound,
        read(-sign * found.value) if is_reached else math.nan,
        pose,
        reason if outcome is Outcome.OPEN else "",
        boxes=found.boxes,
        open=found.open,
        seconds=found.seconds,
        place=found.place,
        errors=errors,
    )


def goal_of(claim: Claim, gap: float = 0.0, part: float = 0.0, *, is_enough: bool = True) -> Goal:
    """Return the goal of a search for the smallest value of a claim's expression, negated for a largest value."""
    if claim.limit is None:
        return Goal(gap, part)
    return Goal(gap, part, claim.limit if claim.sense is Sense.MIN else -claim.limit, slack_of(claim.limit), is_enough)


def prove_extreme(
    layout: Layout,
    claim: Claim,
    search: NumberSearch = DEFAULT,
    *,
    time_limit: float | None = None,
    worst: WorstRobot | None = None,
) -> Verdict:
    """Prove the smallest or the largest value of a quantity over a workspace.

    If the limit lies between the bound and the best known value, the search goes on until the limit is decided.

    Args:
        layout: the case as expressions of the pose.
        claim: claim about the quantity.
        search: requested gap, threads, and recorder for a proof file.
        time_limit: seconds after which the search stops with its present bound.
        worst: function that returns the worst robot within the tolerance at a pose; None for a claim about the nominal
            robot.
    """
    sign = claim.sense.sign
    if is_requested():
        return verdict_of(claim, Minimum(reason=why_stopped()))
    nlp = extreme_program(layout, claim.expression, claim.sense)
    x: FloatArray | None
    if not varies(layout, [claim.expression])[0]:
        value = nlp.evaluate(nlp.start).F
        if search.record is not None:
            search.record.constant(claim, nlp, value)
        found, x = Minimum(-sign * value, -sign * value), np.array(nlp.start)
    else:
        try:
            with one_search(time_limit):
                found, x = _searched(nlp, claim, search)
        except UncoveredError as error:
            return verdict_of(claim, Minimum(reason=str(error)))
    pose = None if x is None else _pose(nlp, x)
    if pose is None or worst is None:
        return verdict_of(claim, found, pose)
    errors, value = worst(pose)
    return verdict_of(claim, found._replace(value=-sign * value), pose, errors=errors)


def _searched(nlp: Nlp, claim: Claim, search: NumberSearch) -> tuple[Minimum, FloatArray | None]:
    """Return the bound of an expression with the gap that the limit requires, and the point of the best value.

    Raises:
        UncoveredError: the expression has an operation without an interval rule.
    """
    # The program of a claim has one function: the search of ``certify`` is the same with and without a record.
    sign, writer = claim.sense.sign, None if search.record is None else TreeRecord()
    found = certify_program(nlp, gap=search.gap, jobs=search.jobs, recorder=writer)
    boxes, seconds = found.boxes, found.seconds
    while (finer := _finer_gap(nlp, claim, found)) is not None and not is_requested():
        finer_writer = None if search.record is None else TreeRecord()
        more = certify_program(nlp, found.x, gap=finer, jobs=search.jobs, recorder=finer_writer)
        boxes, seconds = boxes + more.boxes, seconds + more.seconds
        if sign * more.bound <= sign * found.bound:
            found, writer = more, finer_writer
        else:
            found = replace(more, bound=found.bound, bound_of_tree=found.bound_of_tree)
    if found.status is CertificateStatus.INFEASIBLE:
        return Minimum(boxes=boxes, seconds=seconds, reason="the robot reaches no pose of the workspace"), None
    if search.record is not None and writer is not None:
        search.record.program(claim, found, writer)
    # A search that ends early may still have reached the requested gap.
    is_met = found.status is CertificateStatus.PROVED or found.gap <= found.allowed
    value = math.inf if math.isnan(found.incumbent) else -sign * found.incumbent
    reason = "" if is_met else found.reason
    return Minimum(-sign * found.bound, value, boxes=boxes, seconds=seconds, reason=reason), found.x


def _finer_gap(nlp: Nlp, claim: Claim, found: Certificate) -> float | None:
    """Return the gap with which a search decides a claim's limit; None if decided, or after a requested stop."""
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
