"""Claims about numbers over a workspace: limits of a case, lengths of legs, F of each task, measures of the robot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
from casadi import SX

from ....models import Dimension
from ...case.limits.constraint import SQUARED_LENGTH, Reading
from ...case.limits.legs import Actuator, LegLength
from ...case.limits.singular_values import ConditionNumber, SmallestSingularValue
from ...case.task import Sense
from ...errors import InputError, nearest
from ...program.layout import Layout

if TYPE_CHECKING:
    from ...case.case import Case

#: Names of the claims that J, and that the constraint wrenches alone, have full rank.
REGULAR, CONSTRAINTS = "regular", "constraints regular"
#: Key of the claims that limbs reach every pose.
REACH = "reach"
#: Keys of limits whose expressions are not searched as they are, because another search has better bounds.
_OWN_SEARCHES = ("leg_clearance", "smallest_singular_value", "condition_number")
#: Names of the measures that are no quantities of a robot.
SPECTRAL = (SmallestSingularValue.key, ConditionNumber.key)


@dataclass(frozen=True, eq=False)
class Claim:
    """A number whose smallest or largest value over the workspace is to be proved.

    Attributes:
        name: in the words of a case.
        sense: whether the smallest or the largest value is meant.
        expression: (1, 1) in the symbols of the layout; it grows with the number.
        reading: how the expression reads as the number.
        key: dotted key, below ``limits``, of the number in the case; empty where the number has no limit.
        limit: largest or smallest value allowed of the expression; None where the number has no limit.
        leg: index of the leg whose length the number is; None for another.
        uncovered: reason for a claim about the exact machine where others are meant; else empty.
    """

    name: str
    sense: Sense
    expression: SX
    reading: Reading
    key: str = ""
    limit: float | None = None
    leg: int | None = None
    uncovered: str = ""


def one_machine_name(claim: str) -> str:
    """Return the name of the lengths from which a claim about one machine at two poses follows."""
    return f"{claim}, lengths of one machine"


def asked_spectra(case: Case, names: Sequence[str]) -> list[str]:
    """Return the measures of the singular values of J among names; not those that are limited with the same length."""
    length = case.characteristic_length
    same = [each for each in case.limits if isinstance(each, SmallestSingularValue | ConditionNumber)]
    limited = {each.key for each in same if each.length == length}
    return [name for name in dict.fromkeys(names) if name in SPECTRAL and name not in limited]


def asked_name(case: Case, name: str) -> str:
    """Return the name of a measure of the singular values of J that is asked for.

    A limit on it divides moments by a length of its own, and has the shorter name.
    """
    is_limited = any(limit.key == name for limit in case.limits)
    return f"{name} with the characteristic length" if is_limited else name


def claims_of(layout: Layout, quantities: Sequence[str] = (), *, with_objective: bool = True) -> list[Claim]:
    """Return the claims about a case over its workspace.

    Args:
        layout: the case as symbols of the pose.
        quantities: names of measures of the robot that are asked for beside the case's limits.
        with_objective: whether F of each task is one of the numbers.

    Raises:
        InputError: the robot has no measure of a name.
    """
    found = [*_of_limits(layout), *_of_legs(layout)]
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


def _of_legs(layout: Layout) -> Iterator[Claim]:
    """Yield the smallest and the largest length of each leg, with their limits: the lengths that its actuator needs."""
    limit = next((each for each in layout.case.limits if isinstance(each, LegLength)), None)
    for i, leg in enumerate(layout.robots[0].legs):
        for sense in (Sense.MIN, Sense.MAX):
            allowed = None if limit is None else getattr(limit, sense.value)
            key, square = ("", None) if allowed is None else (f"leg_length.{sense.value}", allowed**2)
            name = f"leg_length limb {leg.name}"
            yield Claim(name, sense, ca.sumsqr(leg.span), SQUARED_LENGTH, key, square, leg=i)


def _of_quantities(layout: Layout, names: Sequence[str]) -> Iterator[Claim]:
    """Yield the smallest and the largest value of measures of the robot, at each of their owners."""
    known = {quantity.name: k for k, quantity in enumerate(layout.case.model.quantities)}
    for name in dict.fromkeys(names):
        if name not in known:
            raise InputError(f"--of-quantity {name}: no measure of this robot; {nearest(name, known)}")
        quantity, values = layout.case.model.quantities[known[name]], layout.robots[0].quantities[known[name]]
        for i, owner in enumerate(quantity.owners):
            for sense in (Sense.MIN, Sense.MAX):
                yield Claim(f"{name} limb {owner}", sense, values[i], Reading(quantity.dimension))


def _of_tasks(layout: Layout) -> Iterator[Claim]:
    """Yield the smallest and the largest F of each task."""
    for j, task in enumerate(layout.case.tasks):
        name = "F" if len(layout.case.tasks) == 1 else f"F of {task.name}"
        for sense in (Sense.MIN, Sense.MAX):
            yield Claim(name, sense, layout.robots[0].F[j], Reading(Dimension.NUMBER))
