"""Claims about a workspace: ranks, limits of a case, leg lengths, F of each task, quantities of the robot."""

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
from ...case.limits.interval import value_of
from ...case.limits.legs import Actuator, LegLength
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ...case.motors import Motor
from ...case.pose import Free
from ...case.task import Sense
from ...case.workspace import TurnKind, Turns, Workspace
from ...errors import InputError, nearest
from ...program.layout import Layout

#: Names of the claims that J has full rank, and that the constraint wrenches have full rank.
REGULAR, CONSTRAINTS = "regular", "constraints regular"
#: Key of the claims that the limbs reach every pose.
REACH = "reach"
#: First part of the keys of a case's ranges for dependent coordinates of the pose.
WORKSPACE = "workspace"
#: Key of the bound of a range, by sense.
_ENDS = {Sense.MIN: "lower", Sense.MAX: "upper"}
#: Names of the measures of J, which are not quantities of a robot file.
SPECTRAL = (SmallestSingularValue.key, ConditionNumber.key)
#: Names of the measures that are actuator coordinates.
ACTUATED = ("actuator_length", "actuator_angle")
#: Keys of limits that are not bounded as expressions, because special searches have better bounds.
_OWN_SEARCHES = (LegClearance.key, *SPECTRAL, ActuatorForce.key, ActuatorSpeed.key, ActuatorPower.key)


class ClaimKind(enum.Enum):
    """Subject of a claim, which selects the rule for its proof."""

    RANK = "rank of J, or of the constraint wrenches"
    EXPRESSION = "expression of the pose"
    LENGTHS = "shortest and longest length of a leg, combined"
    CLEARANCE = "distance between two legs"
    SPECTRUM = "smallest singular value of J, or its condition number"
    ERROR = "error of the pose"
    MOTOR = "force, speed or power of an actuator"


@dataclass(frozen=True, eq=False)
class Claim:
    """Claim about the smallest or the largest value of a quantity over the workspace.

    Attributes:
        name: name of the quantity, in the terms of case files.
        sense: ``MIN`` for the smallest value, ``MAX`` for the largest.
        expression: (1, 1) expression, in the symbols of the layout, that increases with the quantity; only for claims
            of the kind ``EXPRESSION``.
        reading: conversion of the expression's value to the quantity in results.
        key: dotted key of the limit below ``limits`` in the case; empty without a limit.
        limit: largest or smallest allowed value of the expression, by ``sense``; None without a limit.
        kind: subject of the claim.
        legs: index of the leg, for a length or a stroke; indices of both legs, for a clearance; empty for other
            quantities.
        weights: factors of the longest and of the shortest length of the leg, if they are combined.
        length: length that divides moments in a singular value or condition number.
        motor: actuator and its quantity, for a claim about an actuator.
        uncovered: reason why a claim covers only the nominal robot instead of all robots within the tolerance;
            otherwise empty.
        is_coordinate: whether the quantity is a dependent coordinate of the pose; such quantities are often 0.
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
        """Name and sense, which identify a claim; the sense of a rank is empty."""
        return self.name, "" if self.kind is ClaimKind.RANK else self.sense.value


#: Claims that J, and that the constraint wrenches, have full rank, by name.
RANKS = {name: Claim(name, Sense.MIN, kind=ClaimKind.RANK) for name in (REGULAR, CONSTRAINTS)}
#: Claims about the platform's position error and rotation error, for robots within the tolerances.
ERRORS = (
    Claim("position error", Sense.MAX, reading=LENGTH, kind=ClaimKind.ERROR),
    Claim("rotation error", Sense.MAX, reading=Reading(Dimension.ANGLE), kind=ClaimKind.ERROR),
)


def one_robot_name(claim: str) -> str:
    """Return the name of the lemmas that prove a claim about the lengths of one robot at two poses."""
    return f"{claim}, lengths of one machine"


def dependent_claims(robot: RobotInstance, workspace: Workspace) -> Iterator[Claim]:
    """Yield the claims about the smallest and the largest value of each dependent coordinate, with its stated range.

    Args:
        robot: robot at one pose of the workspace.
        workspace: box of poses, with the dependent coordinates.
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
    """Return coordinate k of a rotation (3, 3), and the conversion of this coordinate for results."""
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
    """Yield the claims about leg clearances, singular values and condition numbers; limits of the case come first.

    The smallest singular value, or the condition number, is also yielded if its name is among the quantities; moments
    about the platform's origin are then divided by the characteristic length.
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
            # A limit may divide moments by another length; the claim of the limit keeps the shorter name.
            yield replace(asked, name=f"{measure} with the characteristic length") if measure in limited else asked


def _spectrum(measure: str, length: float, key: str = "", limit: float | None = None) -> Claim:
    """Return the claim about the smallest singular value of J, or about its condition number."""
    sense = Sense.MAX if measure == ConditionNumber.key else Sense.MIN
    return Claim(measure, sense, key=key, limit=limit, kind=ClaimKind.SPECTRUM, length=length)


def claims_of(layout: Layout, quantities: Sequence[str] = (), *, with_objective: bool = True) -> list[Claim]:
    """Return the claims about a case over its workspace.

    Args:
        layout: the case as expressions of the pose.
        quantities: names of requested quantities of the robot, in addition to the case's limits.
        with_objective: If true, include F of each task.

    Raises:
        InputError: the robot has no quantity of a given name.
    """
    found = [*_of_limits(layout), *_of_legs(layout, quantities)]
    # A measure with a limit has one claim.
    named = {(each.name, each.sense) for each in found}
    found += [each for each in _of_quantities(layout, quantities) if (each.name, each.sense) not in named]
    return [*found, *_of_tasks(layout)] if with_objective else found


def _of_limits(layout: Layout) -> Iterator[Claim]:
    """Yield a claim for the lower and for the upper bound of each limit of the case that applies to one pose."""
    # The limit on a leg's dead length is stronger over all poses than at one pose.
    own = (*_OWN_SEARCHES, "leg_length", f"{Actuator.key}.") if layout.robots[0].legs else _OWN_SEARCHES
    for item in (*layout.constraints, *layout.constant_limits):
        constraint = item.constraint
        if any(key.startswith(own) for key in constraint.keys):
            continue
        for key, sense, limit in zip(constraint.keys, (Sense.MIN, Sense.MAX), (item.lower, item.upper), strict=True):
            if key and math.isfinite(limit):
                yield Claim(constraint.name, sense, constraint.expression, constraint.reading, key, limit)


def _of_legs(layout: Layout, names: Sequence[str]) -> Iterator[Claim]:
    """Yield the claims about the smallest and the largest length of each leg, which show the needed stroke."""
    limit = next((each for each in layout.case.limits if isinstance(each, LegLength)), None)
    # A robot given joint by joint also has measures of its robot file.
    is_asked = LegLength.key in names or any(isinstance(each, LegLength | Actuator) for each in layout.case.limits)
    for i, leg in enumerate(layout.robots[0].legs if is_asked or not layout.case.model.structure else ()):
        for sense in (Sense.MIN, Sense.MAX):
            allowed = None if limit is None else getattr(limit, sense.value)
            key, square = ("", None) if allowed is None else (f"leg_length.{sense.value}", allowed**2)
            name = f"leg_length limb {leg.name}"
            yield Claim(name, sense, ca.sumsqr(leg.span), SQUARED_LENGTH, key, square, legs=(i,))


def _of_quantities(layout: Layout, names: Sequence[str]) -> Iterator[Claim]:
    """Yield the claims about the smallest and the largest value of named quantities, for each limb or joint."""
    known = {quantity.name: k for k, quantity in enumerate(layout.case.model.quantities)}
    # Loads and motions also request the ranges of the actuators.
    loading = layout.case.loading
    own = [name for name in ACTUATED if name in known] if loading.loads or loading.motion else []
    for name in dict.fromkeys((*names, *own)):
        if name == LegLength.key and layout.robots[0].legs:
            continue  # already among the claims
        if name not in known:
            raise InputError(f"--quantity {name}: this robot has no such quantity; {nearest(name, known)}")
        quantity, values = layout.case.model.quantities[known[name]], layout.robots[0].quantities[known[name]]
        for i, owner in enumerate(quantity.owners):
            for sense in (Sense.MIN, Sense.MAX):
                yield Claim(value_of(name, owner), sense, values[i], Reading(quantity.dimension))


def _of_tasks(layout: Layout) -> Iterator[Claim]:
    """Yield the claims about the smallest and the largest F of each task."""
    for j, task in enumerate(layout.case.tasks):
        if task.measure:
            continue  # a motion is not an objective of the case
        name = "F" if len(layout.case.tasks) == 1 else f"F of {task.name}"
        for sense in (Sense.MIN, Sense.MAX):
            yield Claim(name, sense, layout.robots[0].F[j], NOT_NEGATIVE)
