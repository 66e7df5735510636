"""Limits of a case that C sets at run time, in their own units; and conditions on fixed parameters.

A limit is one or more bounds of constraints, each by a conversion, such as to the cosine of an angle or the square of a
length. One generated function converts all limits to bounds. The tables here assign each bound to its constraint.

Conditions on fixed parameters only are not constraints of the program. In C these parameters are arguments, so an
answer is checked against all such conditions: loop equations that are dependent for the case, lengths of fixed
directions, and limits on fixed parameters.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..case.pose import MAX_FREE_ROTATION
from ..program.layout import WIDENING
from ..program.nlp import Nlp
from ..program.places import FreeRotation
from .ctext import NO_BOUND, c_names, comment_text, integer_table, number_table, string_table

#: Depth for the comparison of two expressions of one limit, larger than that of every conversion.
_DEPTH = 30


@dataclass(frozen=True)
class RunTimeLimit:
    """Limit of a case as set in C.

    Attributes:
        key: dotted key below ``limits``; for the angle of a rotation with a free axis, the constraint's name with
            ``.min`` or ``.max``.
        name: suffix of the limit's C identifier.
        dimension: dimension of the limit.
        default: value in the case, radians for an angle.
        above: exclusive lower bound of allowed values.
        most: largest allowed value.
    """

    key: str
    name: str
    dimension: Dimension
    default: float
    above: float
    most: float


class Side(NamedTuple):
    """Side of a constraint: indices of constraint and converted limit; True for the upper side."""

    constraint: int
    is_upper: bool
    converted: int


class Widening(NamedTuple):
    """Bounds of a variable from the squared radius of a rotation's ball: indices of both."""

    variable: int
    converted: int


@dataclass(frozen=True, eq=False)
class RunTimeLimits:
    """Limits that C sets, and their conversion to bounds.

    Attributes:
        limits: limits in the order of the constraints.
        function: function from limits (k, 1) to converted limits (m, 1); None without limits.
        slopes: function that also returns the derivatives of the converted limits (m, 1), each with respect to its
            limit; None without limits.
        sides: sides of constraints with converted limits as bounds.
        widenings: variables with bounds from converted limits.
        owners: index of the limit of each converted limit.
    """

    limits: tuple[RunTimeLimit, ...]
    function: ca.Function | None
    sides: tuple[Side, ...]
    widenings: tuple[Widening, ...]
    owners: tuple[int, ...] = ()
    slopes: ca.Function | None = None

    @property
    def functions(self) -> tuple[ca.Function, ...]:
        """Functions ``function`` and ``slopes``; none without limits."""
        return tuple(each for each in (self.function, self.slopes) if each is not None)

    @property
    def converted(self) -> int:
        """Number of converted limits."""
        return 0 if self.function is None else int(self.function.numel_out(0))

    def places(self, key: str, reading: Reading, *, is_upper: bool) -> list[int]:
        """Return the constraints that have, on one side, a bound converted from the limit with a key."""
        if self.function is None or key not in (keys := [each.key for each in self.limits]):
            return []
        (values,) = self.function.sx_in()
        number, converted = values[keys.index(key)], self.function(values)
        same = _equal(ca.vertsplit(converted), reading.to_value(number))
        return [each.constraint for each in self.sides if each.is_upper == is_upper and each.converted in same]


def run_time_limits(nlp: Nlp, prefix: str) -> RunTimeLimits:
    """Return the limits of a program that depend on its variables.

    If a limit is a condition on fixed parameters too, the C checks answers against this condition with the value at run
    time. A limit with different conversions in both cannot be set.

    The names of the functions begin with the prefix.
    """
    balls = {id(each.ball): each for each in nlp.program.places.rotations if isinstance(each, FreeRotation)}
    symbols: dict[str, SX] = {}
    limits: dict[str, RunTimeLimit] = {}
    outputs: list[SX] = []
    owners: list[int] = []
    sides: list[Side] = []
    widenings: list[Widening] = []
    for index, constraint in enumerate(nlp.program.constraints):
        ball = balls.get(id(constraint))
        reading = constraint.reading if ball is None else _ROTATION
        for key, is_upper in zip(_keys(nlp, index, ball), (False, True), strict=True):
            if not key or not _is_settable(nlp, key):
                continue
            bound = float((nlp.g_upper if is_upper else nlp.g_lower)[index])
            value = float(constraint.reading.from_value(bound))
            if key not in limits:
                symbols[key] = SX.sym(key)
                limits[key] = _limit(key, reading, value)
            expression = reading.to_value(symbols[key])
            same = _equal(outputs, expression)
            if not same:
                outputs.append(expression)
                owners.append(list(limits).index(key))
            converted = same[0] if same else len(outputs) - 1
            sides.append(Side(index, is_upper, converted))
            if ball is not None and is_upper:
                widenings += [Widening(variable, converted) for variable in ball.q]
    if not limits:
        return RunTimeLimits((), None, (), ())
    values = ca.vertcat(*symbols.values())
    converted_values = ca.densify(ca.vertcat(*outputs))
    function = ca.Function(f"{prefix}_bounds", [values], [converted_values])
    by_owner = [ca.gradient(each, list(symbols.values())[k]) for each, k in zip(outputs, owners, strict=True)]
    slopes = ca.Function(f"{prefix}_bounds_slopes", [values], [converted_values, ca.densify(ca.vertcat(*by_owner))])
    names = c_names(key.upper() for key in limits)
    named = tuple(replace(each, name=name) for each, name in zip(limits.values(), names, strict=True))
    return RunTimeLimits(named, function, tuple(sides), tuple(widenings), tuple(owners), slopes)


def _squared_sine(angle: SX) -> SX:
    return ca.sin(0.5 * angle) ** 2


#: Conversion of the angle of a rotation about a free axis: the squared length of ``q`` is ``sin^2(angle / 2)``.
_ROTATION = Reading(Dimension.ANGLE, to_value=_squared_sine, above=0.0, most=MAX_FREE_ROTATION)


def _keys(nlp: Nlp, index: int, ball: FreeRotation | None) -> tuple[str, str]:
    """Return the keys of a constraint's lower and upper limit; a key is empty if there is no limit."""
    constraint: Constraint = nlp.program.constraints[index]
    if ball is None:
        return constraint.keys
    return f"{constraint.name}.min" if math.isfinite(nlp.g_lower[index]) else "", f"{constraint.name}.max"


def _is_settable(nlp: Nlp, key: str) -> bool:
    """Return True if conditions on fixed parameters convert a limit as the program does, with the same bound."""
    number, others = SX.sym("number"), [item.constraint for item in nlp.constant_limits]
    bounds, fixed = (
        [each.reading.to_value(number) for each in constraints if key in each.keys]
        for constraints in (nlp.program.constraints, others)
    )
    return all(_equal(bounds, each) for each in fixed)


def _equal(expressions: Sequence[SX], wanted: SX) -> list[int]:
    """Return the indices of the expressions (1, 1) equal to a given one."""
    return [k for k, each in enumerate(expressions) if ca.is_equal(each, wanted, _DEPTH)]


def _limit(key: str, reading: Reading, value: float) -> RunTimeLimit:
    """Return a limit with its range, which includes the value in the case, and without a C identifier."""
    above = reading.above if value > reading.above else float(np.nextafter(value, -math.inf))
    return RunTimeLimit(key, "", reading.dimension, value, above, max(reading.most, value))


def limit_texts(given: RunTimeLimits, prefix: str, columns: Mapping[str, list[Any]]) -> dict[str, str]:
    """Return the texts of the placeholders for limits; columns contain names, units and values."""
    L, limits, sides, widenings = f"{prefix.upper()}_LIMITS", given.limits, given.sides, given.widenings
    named = zip(columns["c_name"], limits, columns["unit"], strict=True)
    members = [f"    {name} = {k}, /* {_description(each, unit)} */\n" for k, (name, each, unit) in enumerate(named)]
    tables = [
        string_table(f"{prefix}_limit_keys", L, columns["key"]),
        string_table(f"{prefix}_limit_units", L, columns["unit"]),
        string_table(f"{prefix}_limit_multiplier_units", L, columns["multiplier_unit"]),
        number_table(f"{prefix}_limit_defaults", L, columns["default"]),
        number_table(f"{prefix}_limit_above", L, columns["above"]),
        number_table(f"{prefix}_limit_most", L, columns["most"]),
    ]
    of_sides = [
        integer_table("side_constraints", "SIDES", [each.constraint for each in sides]),
        integer_table("side_is_upper", "SIDES", [int(each.is_upper) for each in sides]),
        integer_table("side_converted", "SIDES", [each.converted for each in sides]),
        integer_table("converted_limits", "CONVERTED", given.owners),
        integer_table("widened", "WIDENED", [each.variable for each in widenings]),
        integer_table("widened_converted", "WIDENED", [each.converted for each in widenings]),
    ]
    return {
        "nlimits": str(len(limits)),
        "limit_members": "".join(members),
        "limit_tables": "\n".join(tables),
        "nconverted": str(given.converted),
        "limit_work": str(max((int(each.sz_w()) for each in given.functions), default=0)),
        "nsides": str(len(sides)),
        "nwidened": str(len(widenings)),
        "widening": repr(WIDENING),
        "limit_sides": "\n".join(of_sides),
    }


def _description(limit: RunTimeLimit, unit: str) -> str:
    """Return a limit for a comment of C: key, default with unit, and allowed values."""
    allowed = [f"above {limit.above:.6g}"] if limit.above > -NO_BOUND else []
    allowed += [f"at most {limit.most:.6g}"] if limit.most < NO_BOUND else []
    shown = f"{limit.default:.6g} {unit}".rstrip()
    return comment_text(f"{limit.key}: {shown}{'; ' if allowed else ''}{', '.join(allowed)}")


@dataclass(frozen=True, eq=False)
class FixedConditions:
    """Constraints that the fixed parameters satisfy.

    Attributes:
        items: constraints, first those that depend on variables, all of them loop equations.
        equations: number of these loop equations.
    """

    items: tuple[BoundedConstraint, ...]
    equations: int

    @property
    def values(self) -> SX:
        """(k, 1) expressions of the constraints."""
        return ca.vertcat(SX(0, 1), *[item.constraint.expression for item in self.items])


def fixed_conditions(nlp: Nlp) -> FixedConditions:
    """Return the constraints that the fixed parameters of the case satisfy."""
    pairs = [
        item
        for family in nlp.fixed_families
        for a, b in itertools.permutations(range(int(family.values.numel())), 2)
        for item in family.pair(a, b)
    ]
    items = (*nlp.implied, *nlp.constant_limits, *pairs)
    x = nlp.program.x
    varies = [bool(nlp.n) and any(ca.which_depends(each.constraint.expression, x, 1, True)) for each in items]
    first = tuple(item for item, own in zip(items, varies, strict=True) if own)
    return FixedConditions((*first, *(item for item, own in zip(items, varies, strict=True) if not own)), len(first))


def fixed_condition_texts(held: FixedConditions, limits: RunTimeLimits) -> dict[str, str]:
    """Return the texts of the placeholders for constraints that the fixed parameters satisfy.

    If a limit set at run time bounds several constraints, the tightest one counts.
    """
    bounds = [np.array([item.lower for item in held.items]), np.array([item.upper for item in held.items])]
    shared: list[tuple[int, int, int]] = []
    for k, item in enumerate(held.items):
        for is_upper, key in enumerate(item.constraint.keys):
            places = limits.places(key, item.constraint.reading, is_upper=bool(is_upper))
            shared += [(k, is_upper, place) for place in places]
            if places:
                bounds[is_upper][k] = np.inf if is_upper else -np.inf
    columns = zip(("shared_held", "shared_is_upper", "shared_constraints"), range(3), strict=True)
    tables = [number_table(f"held_{end}", "HELD", own) for end, own in zip(("lower", "upper"), bounds, strict=True)]
    tables += [integer_table(name, "SHARED", [each[column] for each in shared]) for name, column in columns]
    return {
        "nheld": str(len(held.items)),
        "nequations": str(held.equations),
        "nshared": str(len(shared)),
        "held_tables": "\n".join(tables) if held.items else "",
    }
