"""Claims about numbers over a workspace: limits of a case, lengths of legs, F of each task, measures of the robot."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
from casadi import SX

from ....models import Dimension
from ...case.limits.constraint import SQUARED_LENGTH, BoundedConstraint, Reading
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
OWN_SEARCHES = ("leg_clearance", "smallest_singular_value", "condition_number")
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
        leg, task: index of the leg whose length, or of the task whose F, the number is; None for another.
        quantity: name of the measure of the robot that the number is; empty for another.
        uncovered: reason for a claim about the exact machine where others are meant; else empty.
    """

    name: str
    sense: Sense
    expression: SX
    reading: Reading
    key: str = ""
    limit: float | None = None
    leg: int | None = None
    task: int | None = None
    quantity: str = ""
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
    found = with_limits(_of_quantities(layout, quantities), [*_of_limits(layout), *_of_legs(layout)])
    if with_objective:
        found += _of_tasks(layout)
    return found


def with_limits(claims: Iterable[Claim], more: Sequence[Claim]) -> list[Claim]:
    """Return claims after those on limits of theirs and after more; a measure with its limit is claimed once.

    Args:
        claims: among them measures that are asked for, which give way to claims of the same number.
        more: further claims.
    """
    named = {(each.name, each.sense) for each in more}
    kept = [each for each in claims if each.limit is not None or (each.name, each.sense) not in named]
    place = next((k for k, each in enumerate(kept) if not each.key or each.leg is not None), len(kept))
    return [*kept[:place], *more, *kept[place:]]


def _of_limits(layout: Layout) -> Iterator[Claim]:
    """Yield a claim for each side of each limit at a pose."""
    # At one pose the limit on a leg's dead length says less than over all poses.
    own = (*OWN_SEARCHES, "leg_length", f"{Actuator.key}.") if layout.robots[0].legs else OWN_SEARCHES
    items = (*layout.constraints, *layout.constant_limits)
    yield from claims_of_items([item for item in items if not any(key.startswith(own) for key in item.constraint.keys)])


def claims_of_items(items: Sequence[BoundedConstraint]) -> Iterator[Claim]:
    """Yield a claim for each side of constraints that is a limit of the case."""
    for item in items:
        constraint = item.constraint
        low, high = constraint.keys
        for key, sense, limit in ((low, Sense.MIN, item.lower), (high, Sense.MAX, item.upper)):
            if key and math.isfinite(limit):
                yield Claim(constraint.name, sense, constraint.expression, constraint.reading, key, limit)


def _of_legs(layout: Layout) -> Iterator[Claim]:
    """Yield the smallest and the largest length of each leg, with their limits: the lengths that its actuator needs."""
    limit = next((each for each in layout.case.limits if isinstance(each, LegLength)), None)
    ends = ((Sense.MIN, "min"), (Sense.MAX, "max"))
    for i, leg in enumerate(layout.robots[0].legs):
        for sense, end in ends:
            allowed = None if limit is None else getattr(limit, end)
            yield Claim(
                f"leg_length limb {leg.name}",
                sense,
                ca.sumsqr(leg.span),
                SQUARED_LENGTH,
                "" if allowed is None else f"leg_length.{end}",
                None if allowed is None else allowed**2,
                leg=i,
            )


def _of_quantities(layout: Layout, names: Sequence[str]) -> Iterator[Claim]:
    """Yield the smallest and the largest value of measures of the robot, at each of their owners."""
    known = {quantity.name: k for k, quantity in enumerate(layout.case.model.quantities)}
    for name in dict.fromkeys(names):
        if name not in known:
            raise InputError(f"--of-quantity {name}: no measure of this robot; {nearest(name, known)}")
        quantity, values = layout.case.model.quantities[known[name]], layout.robots[0].quantities[known[name]]
        for i, owner in enumerate(quantity.owners):
            for sense in (Sense.MIN, Sense.MAX):
                yield Claim(f"{name} limb {owner}", sense, values[i], Reading(quantity.dimension), quantity=name)


def _of_tasks(layout: Layout) -> Iterator[Claim]:
    """Yield the smallest and the largest F of each task."""
    for j, task in enumerate(layout.case.tasks):
        name = "F" if len(layout.case.tasks) == 1 else f"F of {task.name}"
        for sense in (Sense.MIN, Sense.MAX):
            yield Claim(name, sense, layout.robots[0].F[j], Reading(Dimension.NUMBER), task=j)
