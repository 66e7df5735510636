"""Branch and bound for singular values and condition numbers of J, leg clearances, and actuator quantities."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .....models import FloatArray, Model
from ....case.case import Case
from ....case.motors import ActuatorQuantity, Motor
from ....case.task import Sense
from ....errors import UncoveredError
from ....interruption import seconds_left, within
from ...boxes.tree import TreeRecord
from ...statement.claims import Claim, ClaimKind, searched_claims
from ...statement.fixed_robot import JointErrors, Legs, has_straight_legs, joint_centres
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

#: Singular value, and clearance relative to the robot's size, below which gaps are relative to this value.
_NEAR_ZERO = {ClaimKind.SPECTRUM: 0.1, ClaimKind.CLEARANCE: 0.01}
#: Reason for a measure without a bound over all robots within the tolerance.
_TOO_LARGE = "the joint-centre errors are too large: the change of J has no bound"
#: Gap of an actuator quantity, relative to its largest absolute value.
MOTOR_GAP = 0.01
#: Lower bound of this value, relative to load times motion. Some quantities are 0 at every pose, such as moments on a
#: platform that cannot rotate.
_SMALL = 0.01
#: Relative rounding error of a product of two bounds, rounded up.
_ROUNDING = 1e-15
#: Number of random poses, and of poses near corners, at which the width of a bound within the tolerance is sampled.
_POINTS, _SEED = 64, 0


@dataclass(frozen=True, eq=False)
class Subject:
    """Robot whose quantities are searched: the nominal robot, or all robots within the tolerance.

    Attributes:
        case: case with fixed dimensions.
        model: robot of the case, with closed forms in place of unknowns.
        family: the nominal robot, or all robots within the tolerance, over the workspace; None if these robots are not
            judged.
        reason: reason why the robot is not judged; otherwise empty.
        shortest: lower bound of all leg lengths over the workspace, length.
    """

    case: Case
    model: Model
    family: Problem | None
    reason: str = ""
    shortest: float = 0.0

    def errors(self, vectors: FloatArray | None, *, of_legs: bool = False) -> JointErrors | None:
        """Return joint-centre errors (m, 3) with the names of the centres; None for the nominal robot.

        With ``of_legs``, ``vectors`` has only errors of leg centres; other centres have no error.
        """
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
        """The nominal robot over the workspace.

        Raises:
            NotJudgedError: the robots are not judged.
        """
        if self.family is None:
            raise NotJudgedError(self.reason)
        return self.family.problem

    def number(self, claim: Claim) -> SingularValues | Clearance:
        """Return the quantity of a claim about a clearance or a singular value, negated for a largest value."""
        if claim.kind is ClaimKind.CLEARANCE:
            if self.problem.of_settings:
                raise NotJudgedError("leg clearances are not verified while a dimension changes along the path")
            if self.legs.tolerance and self.problem.has_following:
                raise NotJudgedError("dependent pose coordinates differ between robots within the tolerance")
            return Clearance(self.problem, self.legs, claim.legs)
        return self.spectrum(claim.length, is_condition=claim.sense is Sense.MAX)

    def spectrum(self, length: float, *, is_condition: bool) -> SingularValues:
        """Return the smallest singular value of J, or its negative condition number."""
        problem = self.problem
        if not (self.case.joint_centre_tolerance and has_straight_legs(self.case.model)):
            return SingularValues(self.family or problem, length, is_condition=is_condition)
        # For six straight legs the change of J by joint-centre errors has a special bound.
        change = change_of_rows(self.legs, length, self.shortest)
        return SingularValues(problem, length, is_condition=is_condition, family=self.family, change=change)


def searched_extremes(subject: Subject, names: Sequence[str], search: NumberSearch) -> Iterator[Verdict]:
    """Yield the verdicts on leg clearances, singular values and condition numbers.

    Args:
        subject: the robot.
        names: names of the requested quantities; other names are ignored.
        search: requested gap, and the proof record.
    """
    for claim in searched_claims(subject.case, names):
        yield _answer(subject, claim, search)


def _answer(subject: Subject, claim: Claim, search: NumberSearch) -> Verdict:
    """Return the verdict on a quantity; the search ends as soon as the limit is decided."""
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
    # A bound of 0 for the smallest singular value, or an infinite condition number, is trivial.
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
    """Yield the verdicts on forces, speeds and powers of each actuator, under each load.

    Each actuator gets an equal share of the remaining time; the work after the last actuator gets one share, too.

    Args:
        subject: the robot.
        with_all: If false, omit quantities without limits.
        speeds: proved bounds of actuator speeds, by name of the actuator; None if speeds are searched too.
        record: recorder of the searches for a proof file.
    """
    claims = [each for each in motor_claims(subject.case) if with_all or each.limit is not None]
    known = dict(speeds or {})
    if speeds is not None:
        claims = [each for each in claims if each.motor and each.motor.number is not ActuatorQuantity.SPEED]
    alike = itertools.groupby(claims, lambda claim: claim.motor and claim.motor.whose)
    groups = [list(group) for _, group in alike]
    for left, group in zip(range(len(groups), 0, -1), groups, strict=True):
        actuator = group[0].motor.actuator if group[0].motor else ""
        with within(seconds_left() / (left + 1)):
            found = list(_motor_answers(subject, group, known.get(actuator, math.inf), record))
        if group[0].motor and group[0].motor.number is ActuatorQuantity.SPEED:
            known[actuator] = found[0].bound
        yield from found


def _motor_answers(
    subject: Subject, claims: Sequence[Claim], speed: float, record: ProofRecord | None
) -> Iterator[Verdict]:
    """Yield the verdicts on quantities of one actuator, with gaps relative to the largest value of their kind.

    Args:
        subject: the robot.
        claims: claims about the quantities of one load, or about the speed.
        speed: proved bound of the actuator's speed; infinite without a proof.
        record: recorder of the search for a proof file.
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
            # All claims share one search.
            record.boxes |= dict.fromkeys((claim.name for claim in claims), recorder)
    except (UncoveredError, NotJudgedError) as error:
        every = [Minimum(reason=str(error))] * len(claims)
    for claim, found in zip(claims, every, strict=True):
        is_known = math.isfinite(found.value)
        pose = problem.box.pose(problem.pose_of(found.at)) if is_known else None
        yield verdict_of(claim, found, pose)


def _at_most_products(claims: Sequence[Claim], every: Sequence[Minimum], speed: float) -> list[Minimum]:
    """Return the results of claims; a power is at most the bound of the force times the bound of the speed."""
    motors, forces, found = [claim.motor or Motor() for claim in claims], dict[Sense, float](), []
    for claim, motor, own in zip(claims, motors, every, strict=True):
        bound = own.bound
        if motor.number is ActuatorQuantity.FORCE:
            forces[claim.sense] = max(-bound, 0.0)
        elif motor.number is ActuatorQuantity.POWER:
            force = forces.get(Sense.MIN if motor.is_backwards else Sense.MAX, math.inf)
            most = force * speed * (1 + _ROUNDING) if math.isfinite(force) and math.isfinite(speed) else math.inf
            bound = max(bound, -most)
        found.append(own._replace(bound=bound))
    return found


def _asked_gap(subject: Subject, number: SingularValues | Clearance, gap: float) -> float:
    """Return the requested gap of a quantity without a limit, plus the width of its bound at single poses.

    A bound of the change of J exceeds the change in any single robot. Smaller boxes do not reduce this difference, so
    its largest value at a few poses is added to the gap.
    """
    problem = number.problem
    allowed = gap * (abs(float(number.values(problem.start[None])[0, 0])) or 1.0)
    if not subject.case.joint_centre_tolerance or problem.dependent:
        return allowed
    z = _free_points(problem)
    return allowed + float(np.nanmax(number.values(problem.exact(z)) - number.bounds(z, z), initial=0.0))


def _points_of_path(problem: Problem, cover: PathCover) -> FloatArray:
    """Return the coordinates (P, c) of random points of a path."""
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
