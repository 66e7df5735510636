"""Quantities of a robot at sampled points of a tool path, for pictures; they prove nothing.

With a joint-centre tolerance, the nominal robot is shown. Limits on strokes concern the whole path and have no value
at a point.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from ....models import FloatArray, axis_angle_from_matrix
from ....models.joints.model.closedform import ClosedForm
from ...case.case import Case
from ...case.motors import ActuatorQuantity, Motor
from ...case.task import Sense
from ...case.workspace import TurnKind
from ...errors import InputError, UncoveredError
from ...evidence.inverse import InversePoses, inverse
from ...path.path import Poses
from ...path.sampling import Points, spread_points, twists_at
from ...program.layout import robot_length
from ..statement.claims import Claim, searched_claims
from ..statement.motors import in_path_motion, motor_claims, speed_claims
from .judgement import Judgement
from .numbers.expressions import Expressions
from .numbers.motors import Motors
from .numbers.searched import Subject
from .numbers.within_tolerance import RobotsWithinTolerance
from .path_closing import closed_form_along
from .path_domain import covered
from .robot.path_cover import Place
from .robot.pose_box import PoseNumbers, pose_box
from .robot.posed_robot import NotJudgedError, build_problem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Largest number of points on a path.
MOST_POINTS = 2000
#: Margin below which a limit counts as violated; a margin nearer to 0 may be rounding.
_VIOLATED = -1e-9


class SampledNumber(NamedTuple):
    """Quantity of a claim at P points of a path.

    Attributes:
        claim: the claim.
        values: (P,) values, radians for angles; NaN where the loops cannot be closed.
    """

    claim: Claim
    values: FloatArray

    @property
    def limit(self) -> float | None:
        """Limit of the claim, radians for an angle; None without a limit."""
        return None if self.claim.limit is None else self.claim.reading.from_value(self.claim.limit)


@dataclass(frozen=True, eq=False)
class PathSamples:
    """Positions, speeds, quantities and margins of a robot at P points of a path.

    Attributes:
        points: points of the path.
        poses: poses of the platform.
        joints: positions of all joints; None if the positions of the actuators are not known.
        speeds: (P, a) speeds of the actuators, radians or length per second; NaN where the path has no time.
        numbers: quantities of all claims with limits at a pose, and of actuators.
        left_out: keys of limits without values at single points.
        keys: keys of the K limits that have values.
        margins: (K, P) smallest margin of each of these limits; negative for a violation. It is relative to the
            distance between the two limits of a quantity, or to a single limit.
    """

    points: Points
    poses: Poses
    joints: InversePoses | None
    speeds: FloatArray
    numbers: tuple[SampledNumber, ...]
    left_out: tuple[str, ...]
    keys: tuple[str, ...]
    margins: FloatArray

    @property
    def least(self) -> FloatArray:
        """Smallest of all margins (P,); NaN where the loops cannot be closed, or without a limit."""
        return np.asarray(np.fmin.reduce(self.margins, axis=0, initial=np.inf) if len(self.keys) else self._none)

    @property
    def nearest(self) -> NDArray[np.intp]:
        """Indices (P,) of the limits with the smallest margins; -1 where no margin is known."""
        if not len(self.keys):
            return np.full(len(self._none), -1)
        found = np.argmin(np.where(np.isfinite(self.margins), self.margins, np.inf), axis=0)
        return np.where(np.isfinite(self.margins).any(axis=0), found, -1)

    @property
    def is_violated(self) -> NDArray[np.bool_]:
        """Whether a limit is violated at each point (P,)."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.least < _VIOLATED)

    @property
    def is_apart(self) -> NDArray[np.bool_]:
        """Whether the joints are unknown at each point (P,): out of reach, or with loops that cannot be closed."""
        return np.zeros(len(self._none), dtype=bool) if self.joints is None else ~self.joints.closed

    @property
    def _none(self) -> FloatArray:
        return np.full(len(self.points.parameters), np.nan)


def samples_of(judged: Judgement, most: int = MOST_POINTS) -> PathSamples:
    """Return samples of a robot along its path, with the points at which claims are not proved.

    Args:
        judged: the verdicts along the path.
        most: number of points to spread over the path.
    """
    path, case = judged.path, replace(judged.case, joint_centre_tolerance=None)
    case = in_path_motion(case) if path.is_timed else case
    points = spread_points(path, most, [(each.segment, each.parameter) for each in places_of(judged)])
    poses = path.poses_at(*points)
    try:
        joints: InversePoses | None = inverse(case, *poses, changing=path.settings.by_name(*points))
    except InputError:
        joints = None
    speeds = np.zeros((len(points.parameters), 0))
    if joints is not None and joints.dependent:
        # The path does not say how fast dependent coordinates change.
        poses = poses._replace(positions=joints.positions, rotations=joints.rotations)
    elif joints is not None:
        speeds = np.einsum("pai,pi->pa", joints.rates, twists_at(path, points))
        if joints.resets is not None:
            changes = path.settings.changes(points.segments) / path.durations[points.segments, None]
            speeds += np.einsum("pad,pd->pa", joints.resets, changes)
    numbers, left_out = _numbers(replace(judged, case=case), points, poses, joints)
    if path.is_timed:
        numbers = (*numbers, *_own_speeds(case, speeds))
    keys, margins = _margins(numbers, len(points.parameters))
    return PathSamples(points, poses, joints, speeds, numbers, left_out, keys, margins)


def places_of(judged: Judgement) -> list[Place]:
    """Return the points of the path at which ranks and limits are not proved."""
    found = [each.place for each in judged.verdicts if each.fails]
    found += [each.place for each in judged.faults.values()]
    return sorted({each for each in found if each is not None})


def _numbers(
    judged: Judgement, points: Points, poses: Poses, joints: InversePoses | None
) -> tuple[tuple[SampledNumber, ...], tuple[str, ...]]:
    """Return the quantities of claims at points of the path, and the keys of limits without values."""
    case, closed = judged.case, closed_form_along(judged.case, judged.path)
    motors, lost = list(motor_claims(case)), list[Claim]()
    if judged.path.is_timed:  # a path with times defines speeds; powers from [motion] are not shown
        lost = [each for each in motors if each.motor and each.motor.number is ActuatorQuantity.POWER]
        motors = [each for each in motors if each.motor and each.motor.number is ActuatorQuantity.FORCE]
    claims = [*searched_claims(case), *motors]
    keys = [each.key for each in (*claims, *lost) if each.limit is not None]
    if joints is None and closed.model.unknowns:
        return (), tuple(dict.fromkeys(keys))
    settings = judged.path.settings
    is_rpy = case.workspace is not None and case.workspace.turns.kind is TurnKind.ROLL_PITCH_YAW
    is_whole = is_rpy and not settings.names
    box = (
        pose_box(case.workspace)
        if case.workspace is not None and is_whole
        else covered(judged.path, robot_length(case))[1]
    )
    turns = [axis_angle_from_matrix(each) for each in poses.rotations]
    every = zip(poses.positions, poses.rotations, turns, settings.at(*points), strict=True)
    at = np.array([box.coordinates(PoseNumbers(p, R, *turn), values) for p, R, turn, values in every])
    try:
        problem = build_problem(case, closed.model, box, at[0])
        robots = RobotsWithinTolerance(case, closed, problem)
    except NotJudgedError:
        return (), tuple(dict.fromkeys(keys))
    z = np.hstack([at[:, list(problem.free)], _unknowns(closed, joints, len(at))])
    if joints is not None:
        z[~joints.closed] = np.nan
    found, left_out = [], [each.key for each in lost if each.limit is not None]
    posed = [each for each in robots.symbols.claims((), with_objective=False)[1] if each.limit is not None]
    if posed:
        numbers = Expressions(problem, ca.vertcat(*map(robots.number, posed)))
        found += list(_read(posed, numbers.values(z)))
    subject = Subject(case, closed.model, problem)
    for group in _groups(claims):
        try:
            found += list(_read(group, _values(subject, group, z)))
        except (NotJudgedError, UncoveredError):
            left_out += [each.key for each in group if each.key]
    return tuple(found), tuple(dict.fromkeys(left_out))


def _own_speeds(case: Case, speeds: FloatArray) -> Iterator[SampledNumber]:
    """Yield the absolute speeds (P, a) of actuators in the motion of the path; NaN where the path has no time."""
    for claim in speed_claims(case) if speeds.shape[1] else ():
        k = claim.motor.place if claim.motor else 0
        yield SampledNumber(claim, np.array([claim.reading.from_value(each) for each in np.abs(speeds[:, k]).tolist()]))


def _unknowns(closed: ClosedForm, joints: InversePoses | None, count: int) -> FloatArray:
    """Return the positions (P, u) of the passive joints that are coordinates of a problem."""
    if joints is None:
        return np.zeros((count, 0))
    return joints.unknowns[:, [joints.joints.index(each.name) for each in closed.model.unknowns]]


def _groups(claims: Sequence[Claim]) -> Iterator[list[Claim]]:
    """Yield groups of claims that are computed together: all claims about one actuator are one group."""
    for whose, group in itertools.groupby(claims, lambda each: each.motor and each.motor.place):
        own = list(group)
        yield from [own] if whose is not None else ([each] for each in own)


def _values(subject: Subject, group: Sequence[Claim], z: FloatArray) -> FloatArray:
    """Return the quantities (P, K) of claims, with the sign changed for largest values.

    Raises:
        NotJudgedError, UncoveredError: a quantity has no values.
    """
    number = Motors(subject.problem, subject.case, group) if group[0].motor else subject.number(group[0])
    with np.errstate(all="ignore"):
        known = np.isfinite(z).all(axis=1)
        values = np.full((len(z), len(group)), np.nan)
        values[known] = number.values(z[known])
    return values


def _read(claims: Sequence[Claim], values: FloatArray) -> Iterator[SampledNumber]:
    """Yield quantities in their usual sign, from values (P, K) with the sign changed for largest values."""
    for claim, column in zip(claims, values.T, strict=True):
        read = claim.reading.from_value
        own = (-claim.sense.sign * column).tolist()
        yield SampledNumber(claim, np.array([read(each) if math.isfinite(each) else math.nan for each in own]))


def _margins(numbers: Sequence[SampledNumber], count: int) -> tuple[tuple[str, ...], FloatArray]:
    """Return the keys (K,) of limits, and the smallest margin (K, P) of each."""
    limited = [each for each in numbers if each.limit is not None]
    ends = {(each.claim.name, each.claim.sense): each.limit or 0.0 for each in limited}
    found: dict[str, FloatArray] = {}
    for each in limited:
        limit, other = each.limit or 0.0, ends.get((each.claim.name, _OTHER[each.claim.sense]))
        size = abs(limit if other is None else limit - other) or float(np.nanmax(np.abs(each.values), initial=0.0))
        margin = each.claim.sense.sign * (limit - each.values) / (size or 1.0)
        found[each.claim.key] = np.fmin(found.get(each.claim.key, margin), margin)
    return tuple(found), np.array(list(found.values())).reshape(len(found), count)


_OTHER = {Sense.MIN: Sense.MAX, Sense.MAX: Sense.MIN}


def motor_numbers(numbers: Sequence[SampledNumber], kind: ActuatorQuantity) -> dict[str, list[SampledNumber]]:
    """Return the actuator quantities of a kind, by load; the load of a speed is empty."""
    found: dict[str, list[SampledNumber]] = {}
    for each in numbers:
        motor = each.claim.motor or Motor(ActuatorQuantity.COORDINATE)
        if motor.number is kind:
            found.setdefault(motor.load, []).append(each)
    return found
