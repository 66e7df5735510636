"""Branch and bound for singular values and condition numbers of J, clearances of legs, and numbers of actuators."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .....models import FloatArray, Model
from ....case.case import Case
from ....case.motors import Motor, MotorNumber
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import seconds_left, within
from ...boxes.tree import TreeRecord
from ...statement.claims import Claim, ClaimKind, searched_claims
from ...statement.machine import JointErrors, Legs, has_straight_legs, joint_centres
from ...statement.motors import motor_claims
from ..proof_record import ProofRecord
from ..robot.path_cover import PathCover
from ..robot.posed_robot import NotJudgedError, Problem
from ..verdict import EVERYWHERE, Verdict
from .bound_search import Minimum, smallest_values
from .clearance import Clearance
from .extremes import NumberSearch, goal_of, verdict_of
from .jacobian_numbers import SingularValues, change_of_rows
from .motors import Motors

#: Singular values, and clearances in parts of the robot's length, of which gaps are parts where a limit is smaller.
_NEAR_ZERO = {ClaimKind.SPECTRUM: 0.1, ClaimKind.CLEARANCE: 0.01}
#: Reason for a measure of which nothing is known of every machine.
_TOO_LARGE = "the errors of joint centres are too large for a bound of the change of J"
#: Gap of numbers of actuators as a part of the largest size of the same number.
MOTOR_GAP = 0.01
#: Part of a load times a motion that such a size is at least: some numbers are 0 at every pose, as those of a platform
#: that cannot turn under a moment.
_SMALL = 0.01
#: Part of a product of two bounds that is more than its rounding.
_ROUNDING = 1e-15
#: Number of poses at which the width of a bound over machines is taken, and as many near corners.
_POINTS, _SEED = 64, 0


@dataclass(frozen=True, eq=False)
class Subject:
    """The robot that numbers are about, and all machines that are meant.

    Attributes:
        case: with fixed dimensions.
        model: its robot, without unknowns that follow in closed form.
        family: the design, or all robots within the tolerance, over the workspace; None if they are not judged.
        reason: why they are not; else empty.
        shortest: no leg of any machine is shorter over the workspace.
    """

    case: Case
    model: Model
    family: Problem | None
    reason: str = ""
    shortest: float = 0.0

    def errors(self, vectors: FloatArray | None, *, of_legs: bool = False) -> JointErrors | None:
        """Return errors (m, 3) of joint centres, or of those of legs alone, with their names; None for the design."""
        if vectors is None or self.family is None:
            return None
        names, found = self.family.names, np.zeros((len(self.family.names), 3))
        of = [names.index(each) for leg in self.case.model.legs for each in leg.centres] if of_legs else slice(None)
        found[of] = vectors
        return JointErrors(names, found)

    @cached_property
    def legs(self) -> Legs:
        """Joint centres of straight legs, with the tolerance."""
        return joint_centres(self.case)

    @property
    def problem(self) -> Problem:
        """The design over the workspace.

        Raises:
            NotJudgedError: the machines that are meant are not judged.
        """
        if self.family is None:
            raise NotJudgedError(self.reason)
        return self.family.problem

    def number(self, claim: Claim) -> SingularValues | Clearance:
        """Return what has bounds of the number of a claim about a clearance or a spectrum, or of minus it."""
        if claim.kind is ClaimKind.CLEARANCE:
            if self.legs.tolerance and self.problem.has_following:
                raise NotJudgedError("numbers of the pose that follow from others differ from machine to machine")
            return Clearance(self.problem, self.legs, claim.legs)
        return self.spectrum(claim.length, is_condition=claim.sense is Sense.MAX)

    def spectrum(self, length: float, *, is_condition: bool) -> SingularValues:
        """Return the smallest singular value of J, or minus its condition number."""
        problem = self.problem
        if not (self.legs.tolerance and has_straight_legs(self.case.model)):
            return SingularValues(self.family or problem, length, is_condition=is_condition)
        # The change of J by errors of six straight legs has a bound of its own.
        change = change_of_rows(self.legs, length, self.shortest)
        return SingularValues(problem, length, is_condition=is_condition, family=self.family, change=change)


def searched_extremes(subject: Subject, names: Sequence[str], search: NumberSearch) -> Iterator[Verdict]:
    """Yield the extremes of :func:`~.claims.searched_claims`.

    Args:
        subject: the robot.
        names: measures that are asked for, of which the others are left out.
        search: gap and record.
    """
    for claim in searched_claims(subject.case, names):
        yield _answer(subject, claim, search)


def _answer(subject: Subject, claim: Claim, search: NumberSearch) -> Verdict:
    """Return the extreme of a number; the search of a limit ends as soon as it is decided."""
    if subject.model.rank < 6 and claim.limit is None and claim.kind is not ClaimKind.CLEARANCE:
        return verdict_of(claim, Minimum(reason=EVERYWHERE))
    try:
        number, problem = subject.number(claim), subject.problem
        least = _NEAR_ZERO[claim.kind] * (problem.length if claim.kind is ClaimKind.CLEARANCE else 1.0)
        gap, record = search.gap, search.record
        allowed = _asked_gap(subject, number, gap) if claim.limit is None else gap * max(abs(claim.limit), least)
        recorder = None if record is None or problem.dependent else record.tree(claim.name)
        (found,) = smallest_values(number, [goal_of(claim, allowed)], recorder)
    except (UncoveredError, NotJudgedError) as error:
        return verdict_of(claim, Minimum(reason=str(error)))
    # A smallest singular value of at least 0, or an infinite condition number, says nothing.
    is_bound = math.isfinite(found.bound) and (claim.sense is Sense.MAX or found.bound > 0)
    if claim.limit is None and not is_bound and subject.case.joint_centre_tolerance:
        found = found._replace(reason=found.reason or _TOO_LARGE)
    if not math.isfinite(found.value):
        return verdict_of(claim, found)
    y = problem.pose_of(found.at)
    errors = subject.errors(number.worst(y), of_legs=claim.kind is ClaimKind.CLEARANCE)
    return verdict_of(claim, found, problem.box.pose(y), errors=errors)


def motor_extremes(
    subject: Subject,
    *,
    with_all: bool = True,
    speeds: Mapping[str, float] | None = None,
    record: ProofRecord | None = None,
) -> Iterator[Verdict]:
    """Yield the extremes of :func:`~.motors.motor_claims`, all or those with limits, for each actuator and load.

    Actuators are much alike: each takes its share of the time left, and the work after them has one too.

    Args:
        subject: the robot.
        with_all: whether numbers without limits are yielded too.
        speeds: proven bounds of the actuators' speeds, by name, which are then not searched; None where they are.
        record: record of the searches for a proof.
    """
    claims = [each for each in motor_claims(subject.case) if with_all or each.limit is not None]
    known = dict(speeds or {})
    if speeds is not None:
        claims = [each for each in claims if each.motor and each.motor.number is not MotorNumber.SPEED]
    alike = itertools.groupby(claims, lambda claim: claim.motor and claim.motor.whose)
    groups = [list(group) for _, group in alike]
    for left, group in zip(range(len(groups), 0, -1), groups, strict=True):
        actuator = group[0].motor.actuator if group[0].motor else ""
        with within(seconds_left() / (left + 1)):
            found = list(_motor_answers(subject, group, known.get(actuator, math.inf), record))
        if group[0].motor and group[0].motor.number is MotorNumber.SPEED:
            known[actuator] = found[0].bound
        yield from found


def _motor_answers(
    subject: Subject, claims: Sequence[Claim], speed: float, record: ProofRecord | None
) -> Iterator[Verdict]:
    """Yield the extremes of numbers of an actuator, each to a part of the largest size of its kind at some poses.

    Args:
        subject: the robot.
        claims: the numbers; those of one load, or the speed.
        speed: proven bound of the actuator's speed; infinite where there is none.
        record: record of the search for a proof.
    """
    try:
        if subject.family is None:
            raise NotJudgedError(subject.reason)
        number, problem = Motors(subject.family, subject.case, claims), subject.family.problem
        z = np.tile(subject.family.start, (2 * _POINTS, 1))
        if problem.cover:
            z[:, problem.of_path] = _points_of_path(problem, problem.cover)
        else:
            z[:, problem.stated] = _free_points(problem)[:, problem.stated]
        closed = number.closed(z)
        values = np.nan_to_num(number.values(closed), posinf=0.0, neginf=0.0)
        kinds = [claim.motor and claim.motor.number for claim in claims]
        sizes = np.array([np.abs(values[:, [other is kind for other in kinds]]).max() for kind in kinds])
        products = np.nan_to_num(number.products(closed), posinf=0.0)
        sizes = np.maximum(sizes, _SMALL * np.median(products, axis=0))
        allowed = MOTOR_GAP * sizes
        if subject.family.names and not problem.dependent:
            z = z[:, : len(problem.start)]
            allowed = allowed + np.nan_to_num(values - number.bounds(z, z), posinf=0.0).max(axis=0)
        goals = [goal_of(claim, gap, is_enough=False) for claim, gap in zip(claims, allowed.tolist(), strict=True)]
        recorder = None if record is None else TreeRecord()
        every = _at_most_products(claims, smallest_values(number, goals, recorder), speed)
        if record is not None and recorder is not None:
            # One search is that of all.
            record.boxes |= dict.fromkeys((claim.name for claim in claims), recorder)
    except (UncoveredError, NotJudgedError) as error:
        every = [Minimum(reason=str(error))] * len(claims)
    for claim, found in zip(claims, every, strict=True):
        is_known = math.isfinite(found.value)
        pose = problem.box.pose(problem.pose_of(found.at)) if is_known else None
        yield verdict_of(claim, found, pose)


def _at_most_products(claims: Sequence[Claim], every: Sequence[Minimum], speed: float) -> list[Minimum]:
    """Return the results of claims, with powers of at most the bound of the force times that of the speed."""
    motors, forces, found = [claim.motor or Motor() for claim in claims], dict[Sense, float](), []
    for claim, motor, own in zip(claims, motors, every, strict=True):
        bound = own.bound
        if motor.number is MotorNumber.FORCE:
            forces[claim.sense] = max(-bound, 0.0)
        elif motor.number is MotorNumber.POWER:
            force = forces.get(Sense.MIN if motor.is_backwards else Sense.MAX, math.inf)
            most = force * speed * (1 + _ROUNDING) if math.isfinite(force) and math.isfinite(speed) else math.inf
            bound = max(bound, -most)
        found.append(own._replace(bound=bound))
    return found


def _asked_gap(subject: Subject, number: SingularValues | Clearance, gap: float) -> float:
    """Return the gap of a number without a limit: wider by how far the bound at a pose is from the worst machine there.

    A bound of the change of J is wider than its change in any one machine, and no smaller boxes make it less wide. The
    most at a few poses is taken.
    """
    problem = number.problem
    allowed = gap * (abs(float(number.values(problem.start[None])[0, 0])) or 1.0)
    if not subject.case.joint_centre_tolerance or problem.dependent:
        return allowed
    z = _free_points(problem)
    return allowed + float(np.nanmax(number.values(problem.exact(z)) - number.bounds(z, z), initial=0.0))


def _points_of_path(problem: Problem, cover: PathCover) -> FloatArray:
    """Return coordinates (P, c) at random places of a path."""
    return problem.path_points(cover, cover.random(2 * _POINTS, np.random.default_rng(_SEED)), 0.0)


def _free_points(problem: Problem) -> FloatArray:
    """Return the free coordinates (P, f) at the poses of :func:`_points`."""
    return _points(problem)[:, list(problem.free)]


def _points(problem: Problem) -> FloatArray:
    """Return random poses (P, 6) of a workspace, and as many near its corners."""
    rng, box = np.random.default_rng(_SEED), problem.box
    points = box.random(_POINTS, rng)
    corners = box.clipped(np.where(rng.uniform(size=points.shape) < 0.5, box.lower, box.upper))
    return np.concatenate([points, corners])
