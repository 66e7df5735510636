"""Margins of a point in each limit of the case, and the cost of each limit.

The cost of a limit is the derivative of the optimal F with respect to the limit's value in the case. It follows from
the multipliers: with the Lagrangian ``phi + sum_j mu_j (g_j - c_j)`` of :mod:`.kkt`, ``d phi* / d c_j = -mu_j``. A
value that limits several legs or poses costs the sum of its costs at each of them. The derivative is two-sided where
the active limits have independent normals and positive multipliers, which :mod:`screwsynth.nlp.evidence.optimality`
checks.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, frozen_array
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint
from ..program.nlp import Bound, Nlp
from ..program.pairs import pair_constraints, tightest_pairs, with_pairs_at
from ..system.jsonvalues import Hidden, JsonObject, Known, Measure, Shown, Slope
from ..units import rate_unit
from .kkt import FEASIBLE, Linearisation, linearise, multipliers
from .state import loses_forces

#: First words of the names of constraints on actuator rates.
_RATE = "actuator_rate actuator "


class Margin(JsonObject):
    """Margin of a point in a limit at one leg, joint or pose.

    Attributes:
        name: name of the limit, with the leg, joint or pose.
        key: dotted key of the limit's value in the case, below limits.
        bound: side of the limit.
        value: measured value; null if it is not finite.
        limit: value of the limit in the case.
        margin: distance from the limit, positive for a satisfied limit.
        unit: unit of value, limit and margin.
        active: If true, the point lies on the limit.
        violated: If true, the point violates the limit by more than rounding error.
        cost: derivative of the optimal F with respect to the limit; null if the point is not an optimum.
        dimension: dimension of value, limit and margin; angles are in radians.
    """

    name: str
    key: str
    bound: Bound
    value: Annotated[Known, Measure.NUMBER]
    limit: Shown
    margin: Annotated[Known, Measure.NUMBER]
    unit: str
    active: bool
    violated: bool
    cost: Slope[float | None]
    dimension: Hidden[Dimension] = Dimension.NUMBER


def unit_of_side(case: Case, name: str, dimension: Dimension) -> str:
    """Return the unit of a bound's or a limit's value; empty for a plain number.

    Args:
        case: the case.
        name: name of the variable or the constraint.
        dimension: dimension of the value; a limit on actuator rates has the same value for angles and lengths.
    """
    if not name.startswith(_RATE):
        return case.units.label(dimension)
    owners = [each for each in case.model.actuators if name.startswith(f"{_RATE}{each.name}")]
    kind = max(owners, key=lambda each: len(each.name)).dimension if owners else Dimension.LENGTH
    tasks = [task for task in case.tasks if f" task {task.name}" in name] or list(case.tasks[:1])
    return rate_unit(frozen_array(tasks[0].twist, (6,)), case.units, kind)


def measured_slack(nlp: Nlp, x: FloatArray, at: Linearisation, numbers: Sequence[float] | None = None) -> FloatArray:
    """Return the distances (k,) of a point from all sides, negative outside, with measured singular values.

    At a singular point, the distances from limits on quantities under loads are NaN: actuator forces are undetermined.

    The constraints of a program estimate singular values and condition numbers on the safe side. An estimate may
    therefore violate a limit that the measured value satisfies.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        at: linearised program at the point.
        numbers: measured values of the constraints, from :func:`measured_values`; computed if left out.
    """
    slack, constraints = at.slack.copy(), nlp.program.constraints
    sides = [(j, side.constraint) for j, side in enumerate(at.sides) if side.constraint is not None]
    for j, k in sides:
        if constraints[k].measure is not None:
            numbers = measured_values(nlp, x) if numbers is None else numbers
            value = float(constraints[k].reading.to_value(SX(numbers[k])))
            slack[j] = -float(nlp.sides.sign[j] * (value - nlp.sides.limit[j]) * at.per_unit[j])
    undetermined = _undetermined(nlp, x, constraints)
    slack[[j for j, k in sides if k in undetermined]] = np.nan
    return slack


def _undetermined(nlp: Nlp, x: FloatArray, constraints: Sequence[Constraint]) -> list[int]:
    """Return the indices of limits on quantities under loads at a singular point (n,); empty at another point."""
    if not loses_forces(nlp, x):
        return []
    prefixes = tuple(f"{limit.name}." for limit in nlp.case.limits if limit.needs_loads)
    return [k for k, each in enumerate(constraints) if any(key.startswith(prefixes) for key in each.keys)]


def measured_violation(nlp: Nlp, x: FloatArray) -> float:
    """Return the largest violation of a side at a point (n,), from measured values; ``inf`` if undefined."""
    at = linearise(nlp, x)
    return replace(at, slack=measured_slack(nlp, x, at)).violation


def measured_values(nlp: Nlp, x: FloatArray) -> list[float]:
    """Return the measured value of each constraint at a point (n,), radians for angles; NaN if it is not a limit."""
    return _measured(nlp, x, nlp.program.constraints, nlp.evaluate(x)[1])


def margins_of(nlp: Nlp, x: FloatArray, *, optimal: bool) -> list[Margin]:
    """Return the margins of a point in every limit of the case, in the order of the program's constraints.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        optimal: If true, the point is an optimum, and the margins have costs.
    """
    if not nlp.case.limits:
        return []
    nlp = with_pairs_at(nlp, [x])
    at = linearise(nlp, x)
    active = set(at.active())
    mu, _ = multipliers(at, sorted(active)) if optimal else (np.zeros(len(at.sides)), 0.0)
    gained = -mu * nlp.sides.sign * at.per_unit * nlp.objective_scale * nlp.sign
    measured = measured_values(nlp, x)
    slack = measured_slack(nlp, x, at, measured)
    rows = []
    for j, side in enumerate(nlp.sides.sides):
        if side.constraint is None:
            continue
        constraint = nlp.program.constraints[side.constraint]
        key = constraint.keys[1 if side.bound == "max" else 0]
        if not key:
            continue
        at_side, limit = _LimitSide(side.bound, key, nlp.stated_limit(j)), nlp.stated_limit(j)
        cost = float(gained[j] * constraint.reading.slope(limit)) if optimal else None
        is_violated = not slack[j] >= -FEASIBLE
        value = measured[side.constraint]
        rows.append(_margin(nlp, constraint, at_side, value, active=j in active, violated=is_violated, cost=cost))
    known = set(nlp.pairs)
    other = [item for place in tightest_pairs(nlp, x) if place not in known for item in pair_constraints(nlp, place)]
    return [
        *rows,
        *_without_cost(nlp, x, other, optimal=optimal),
        *_without_cost(nlp, x, nlp.constant_limits, optimal=optimal),
    ]


def _without_cost(nlp: Nlp, x: FloatArray, limits: Sequence[BoundedConstraint], *, optimal: bool) -> list[Margin]:
    """Return the margins in limits of cost 0: limits on constants, and inactive limits on pairs."""
    if not limits:
        return []
    constraints = [item.constraint for item in limits]
    expressions = ca.vertcat(*[constraint.expression for constraint in constraints])
    function = ca.Function("constant", [nlp.program.x, nlp.program.p], [ca.densify(expressions)])
    measured = _measured(nlp, x, constraints, function(x, nlp.arguments).full().ravel())
    return [
        _margin(nlp, item.constraint, side, value, active=False, violated=False, cost=0.0 if optimal else None)
        for item, value in zip(limits, measured, strict=True)
        for side in _sides(item)
    ]


class _LimitSide(NamedTuple):
    """A side of a constraint, with the key of its limit in the case and the bound in the nonlinear program."""

    bound: Bound
    key: str
    limit: float


def _margin(
    nlp: Nlp,
    constraint: Constraint,
    side: _LimitSide,
    value: float,
    *,
    active: bool,
    violated: bool,
    cost: float | None,
) -> Margin:
    """Return the margin of a measured value from a side of a constraint."""
    limit, dimension = constraint.reading.from_value(side.limit), constraint.reading.dimension
    distance = value - limit if side.bound == "min" else limit - value
    return Margin(
        name=constraint.name,
        key=side.key,
        bound=side.bound,
        value=value,
        limit=limit,
        margin=-abs(distance) if side.bound == "equal" else distance,
        unit=unit_of_side(nlp.case, constraint.name, dimension),
        active=active,
        violated=violated,
        cost=cost,
        dimension=dimension,
    )


def _sides(item: BoundedConstraint) -> list[_LimitSide]:
    """Return the sides of a constraint that are limits of the case."""
    low, high = item.constraint.keys
    if item.lower == item.upper:
        return [_LimitSide("equal", low, item.lower)]
    sides = [_LimitSide("min", low, item.lower), _LimitSide("max", high, item.upper)]
    return [side for side in sides if side.key]


def _measured(nlp: Nlp, x: FloatArray, constraints: Sequence[Constraint], values: FloatArray) -> list[float]:
    """Return the measured value of each limit, radians for angles.

    The value is NaN for a constraint that is not a limit, and for a quantity under loads at a singular point.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        constraints: constraints of the program, or constant constraints.
        values: (c,) expressions of the constraints at the point.
    """
    exact = {k: each.exact for k, each in enumerate(constraints) if each.exact is not None}
    measured = [
        each.reading.from_value(float(value)) if any(each.keys) else float("nan")
        for each, value in zip(constraints, values, strict=True)
    ]
    if exact:
        function = ca.Function("exact", [nlp.program.x, nlp.program.p], [ca.densify(ca.vertcat(*exact.values()))])
        for k, value in zip(exact, function(x, nlp.arguments).full().ravel(), strict=True):
            measured[k] = float(value)
    for k, each in enumerate(constraints):
        if each.measure is not None and each.spectral is not None:
            measured[k] = each.measured_at((nlp.program.x, nlp.program.p), (x, nlp.arguments))
    for k in _undetermined(nlp, x, constraints):
        measured[k] = float("nan")
    return measured
