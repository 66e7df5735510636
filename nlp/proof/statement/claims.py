"""Claims about a workspace: ranks, limits of a case, lengths of legs, F of each task, measures of the robot."""

from __future__ import annotations

import enum
import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
from casadi import SX

from ....models import Dimension
from ....models.instance import RobotInstance
from ...case.case import Case
from ...case.limits.clearance import LegClearance
from ...case.limits.constraint import LENGTH, NOT_NEGATIVE, NUMBER, SQUARED_LENGTH, Reading
from ...case.limits.forces import ActuatorForce, ActuatorPower, ActuatorSpeed
from ...case.limits.legs import Actuator, LegLength
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ...case.motors import Motor
from ...case.pose import Free
from ...case.task import Sense
from ...case.workspace import TurnKind, Turns, Workspace
from ...errors import InputError, nearest
from ...program.layout import Layout

#: Names of the claims that J, and that the constraint wrenches alone, have full rank.
REGULAR, CONSTRAINTS = "regular", "constraints regular"
#: Key of the claims that limbs reach every pose.
REACH = "reach"
#: First part of the keys of ranges that a case states for dependent coordinates of the pose.
WORKSPACE = "workspace"
#: Ends of a range by sense.
_ENDS = {Sense.MIN: "lower", Sense.MAX: "upper"}
#: Names of the measures that are no quantities of a robot.
SPECTRAL = (SmallestSingularValue.key, ConditionNumber.key)
#: Names of the measures that are coordinates of actuators.
ACTUATED = ("actuator_length", "actuator_angle")
#: Keys of limits whose expressions are not searched as they are, because another search has better bounds.
_OWN_SEARCHES = (LegClearance.key, *SPECTRAL, ActuatorForce.key, ActuatorSpeed.key, ActuatorPower.key)


class ClaimKind(enum.Enum):
    """What a claim is about, which decides its rule."""

    RANK = "rank of J, or of the constraint wrenches"
    EXPRESSION = "expression of the pose"
    LENGTHS = "shortest and longest length of a leg, combined"
    CLEARANCE = "distance between two legs"
    SPECTRUM = "smallest singular value of J, or its condition number"
    ERROR = "error of the pose"
    MOTOR = "force, speed or power of an actuator"


@dataclass(frozen=True, eq=False)
class Claim:
    """A number whose smallest or largest value over the workspace is to be proved.

    Attributes:
        name: in the words of a case.
        sense: whether the smallest or the largest value is meant.
        expression: (1, 1) in the symbols of the layout, of this kind; it grows with the number.
        reading: how the expression, or the number of another kind, reads in results.
        key: dotted key, below ``limits``, of the number in the case; empty where the number has no limit.
        limit: largest or smallest value allowed of the expression; None where the number has no limit.
        kind: what the claim is about.
        legs: index of the leg whose length, or lengths, the number is; of the two legs of a clearance; else empty.
        weights: of the longest and of the shortest length of this leg, where they are combined.
        length: by which moments are divided in a spectrum, length.
        motor: the actuator and its number, of claims about motors.
        uncovered: reason for a claim about the exact machine where others are meant; else empty.
        is_coordinate: whether the number is a dependent coordinate of the pose, which is often 0.
    """

    name: str
    sense: Sense
    expression: SX = field(default_factory=SX)
    reading: Reading = NUMBER
    key: str = ""
    limit: float | None = None
    kind: ClaimKind = ClaimKind.EXPRESSION
    legs: tuple[int, ...] = ()
    weights: tuple[float, float] = (0.0, 0.0)
    length: float = 1.0
    motor: Motor | None = None
    uncovered: str = ""
    is_coordinate: bool = False

    @property
    def label(self) -> tuple[str, str]:
        """Name and sense, which tell claims apart; a rank has no sense."""
        return self.name, "" if self.kind is ClaimKind.RANK else self.sense.value


#: Claims that J, and that the constraint wrenches alone, have full rank, by name.
RANKS = {name: Claim(name, Sense.MIN, kind=ClaimKind.RANK) for name in (REGULAR, CONSTRAINTS)}
#: Errors of the platform's position and rotation, for machines within their tolerances.
ERRORS = (
    Claim("position error", Sense.MAX, reading=LENGTH, kind=ClaimKind.ERROR),
    Claim("rotation error", Sense.MAX, reading=Reading(Dimension.ANGLE), kind=ClaimKind.ERROR),
)


def one_robot_name(claim: str) -> str:
    """Return the name of the lengths from which a claim about one machine at two poses follows."""
    return f"{claim}, lengths of one machine"


def dependent_claims(robot: RobotInstance, workspace: Workspace) -> Iterator[Claim]:
    """Yield the smallest and the largest value of each dependent coordinate of the pose, with its stated range.

    Args:
        robot: at one pose of the workspace.
        workspace: with its dependent coordinates.
    """
    turns = workspace.turns
    stated = [*workspace.position, *turns.angles]
    for k in (each.index for each in workspace.dependent):
        expression, reading = (robot.position[k], LENGTH) if k < 3 else _turn(robot.rotation, turns, k - 3)
        is_stated = k < len(stated) and not (k >= 3 and turns.kind is TurnKind.ANY_AXIS)
        value, name = stated[k] if is_stated else None, workspace.names[k]
        for sense in Sense:
            limit = getattr(value, _ENDS[sense]) if isinstance(value, Free) else None
            key = "" if limit is None else f"{WORKSPACE}.{name}"
            yield Claim(name, sense, expression, reading, key, limit, is_coordinate=True)


def _turn(R: SX, turns: Turns, k: int) -> tuple[SX, Reading]:
    """Return a coordinate of a rotation (3, 3), and how it reads."""
    if turns.kind is TurnKind.ROLL_PITCH_YAW:
        angles = ca.atan2(R[2, 1], R[2, 2]), ca.asin(-R[2, 0]), ca.atan2(R[1, 0], R[0, 0])
        return angles[k], Reading(Dimension.ANGLE)
    cayley = ca.vertcat(R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]) / (1 + ca.trace(R))
    if turns.kind is TurnKind.ANY_AXIS:
        return cayley[k], NUMBER
    return 2 * ca.atan(ca.dot(cayley, SX(list(turns.axis)))), Reading(Dimension.ANGLE)


def length_claims(case: Case) -> Iterator[Claim]:
    """Yield the claims about the stroke, and about the dead length, of each telescoping leg."""
    for limit in (each for each in case.limits if isinstance(each, Actuator)):
        ends = (
            ("stroke_max", Sense.MAX, limit.stroke_max, (1.0, -1.0)),
            ("dead_length", Sense.MIN, limit.dead_length, (-1.0, 2.0)),
        )
        for (i, leg), (end, sense, value, weights) in itertools.product(enumerate(case.model.legs), ends):
            if value is not None:
                key = f"{limit.key}.{end}"
                number = Claim(f"{key} limb {leg.name}", sense, reading=LENGTH, key=key, limit=value)
                yield replace(number, kind=ClaimKind.LENGTHS, legs=(i,), weights=weights)


def searched_claims(case: Case, quantities: Sequence[str] = ()) -> Iterator[Claim]:
    """Yield the claims about clearances of legs and about spectra, first those of the case's limits.

    The smallest singular value, or the largest condition number, is yielded where it is among the quantities and the
    case does not limit it; moments about the platform's origin are then divided by the characteristic length.
    """
    limited = dict[str, float]()
    for limit in case.limits:
        if isinstance(limit, SmallestSingularValue):
            limited[limit.key] = limit.length
            yield _spectrum(limit.key, limit.length, f"{limit.key}.min", limit.min)
        elif isinstance(limit, ConditionNumber):
            limited[limit.key] = limit.length
            yield _spectrum(limit.key, limit.length, f"{limit.key}.max", limit.max)
        elif isinstance(limit, LegClearance):
            for (i, one), (j, other) in itertools.combinations(enumerate(case.model.legs), 2):
                name = f"{limit.key} limbs {one.name} and {other.name}"
                number = Claim(name, Sense.MIN, reading=LENGTH, key=f"{limit.key}.min", limit=limit.min)
                yield replace(number, kind=ClaimKind.CLEARANCE, legs=(i, j))
    length = case.characteristic_length
    for measure in dict.fromkeys(quantities):
        if measure in SPECTRAL and limited.get(measure) != length:
            asked = _spectrum(measure, length)
            # A limit on it divides moments by a length of its own, and has the shorter name.
            yield replace(asked, name=f"{measure} with the characteristic length") if measure in limited else asked


def _spectrum(measure: str, length: float, key: str = "", limit: float | None = None) -> Claim:
    """Return the claim about the smallest singular value of J, or about its condition number."""
    sense = Sense.MAX if measure == ConditionNumber.key else Sense.MIN
    return Claim(measure, sense, key=key, limit=limit, kind=ClaimKind.SPECTRUM, length=length)


def claims_of(layout: Layout, quantities: Sequence[str] = (), *, with_objective: bool = True) -> list[Claim]:
    """Return the claims about a case over its workspace.

    Args:
        layout: the case as symbols of the pose.
        quantities: names of measures of the robot that are asked for beside the case's limits.
        with_objective: whether F of each task is one of the numbers.

    Raises:
        InputError: the robot has no measure of a name.
    """
    found = [*_of_limits(layout), *_of_legs(layout, quantities)]
    # A measure with its limit is claimed once.
    named = {(each.name, each.sense) for each in found}
    found += [each for each in _of_quantities(layout, quantities) if (each.name, each.sense) not in named]
    return [*found, *_of_tasks(layout)] if with_objective else found


def _of_limits(layout: Layout) -> Iterator[Claim]:
    """Yield a claim for each side of each limit at a pose."""
    # At one pose the limit on a leg's dead length says less than over all poses.
    own = (*_OWN_SEARCHES, "leg_length", f"{Actuator.key}.") if layout.robots[0].legs else _OWN_SEARCHES
    for item in (*layout.constraints, *layout.constant_limits):
        constraint = item.constraint
        if any(key.startswith(own) for key in constraint.keys):
            continue
        for key, sense, limit in zip(constraint.keys, (Sense.MIN, Sense.MAX), (item.lower, item.upper), strict=True):
            if key and math.isfinite(limit):
                yield Claim(constraint.name, sense, constraint.expression, constraint.reading, key, limit)


def _of_legs(layout: Layout, names: Sequence[str]) -> Iterator[Claim]:
    """Yield the smallest and the largest length of each leg, with their limits: the lengths that its actuator needs."""
    limit = next((each for each in layout.case.limits if isinstance(each, LegLength)), None)
    # A robot given joint by joint has measures of its own beside them.
    is_asked = LegLength.key in names or any(isinstance(each, LegLength | Actuator) for each in layout.case.limits)
    for i, leg in enumerate(layout.robots[0].legs if is_asked or not layout.case.model.structure else ()):
        for sense in (Sense.MIN, Sense.MAX):
            allowed = None if limit is None else getattr(limit, sense.value)
            key, square = ("", None) if allowed is None else (f"leg_length.{sense.value}", allowed**2)
            name = f"leg_length limb {leg.name}"
            yield Claim(name, sense, ca.sumsqr(leg.span), SQUARED_LENGTH, key, square, legs=(i,))


def _of_quantities(layout: Layout, names: Sequence[str]) -> Iterator[Claim]:
    """Yield the smallest and the largest value of measures of the robot, at each of their owners."""
    known = {quantity.name: k for k, quantity in enumerate(layout.case.model.quantities)}
    # Loads and motions ask for the ranges of the actuators too.
    loading = layout.case.loading
    own = [name for name in ACTUATED if name in known] if loading.loads or loading.motion else []
    for name in dict.fromkeys((*names, *own)):
        if name == LegLength.key and layout.robots[0].legs:
            continue  # among the claims already
        if name not in known:
            raise InputError(f"--quantity {name}: no measure of this robot; {nearest(name, known)}")
        quantity, values = layout.case.model.quantities[known[name]], layout.robots[0].quantities[known[name]]
        for i, owner in enumerate(quantity.owners):
            for sense in (Sense.MIN, Sense.MAX):
                yield Claim(f"{name} limb {owner}", sense, values[i], Reading(quantity.dimension))


def _of_tasks(layout: Layout) -> Iterator[Claim]:
    """Yield the smallest and the largest F of each task."""
    for j, task in enumerate(layout.case.tasks):
        if task.measure:
            continue  # F of its motion is not what the case is about
        name = "F" if len(layout.case.tasks) == 1 else f"F of {task.name}"
        for sense in (Sense.MIN, Sense.MAX):
            yield Claim(name, sense, layout.robots[0].F[j], NOT_NEGATIVE)
