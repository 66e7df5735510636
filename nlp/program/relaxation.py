"""Smallest relaxation that makes an infeasible case feasible, as a program.

Every limit gets a variable ``t >= 0`` by which the limit is relaxed, at every leg, joint and pose at once. The unit of
``t`` is the limit's value, or 1 for a value of 0. The program minimises the sum of all t. A sum, unlike a sum of
squares, relaxes few limits, so that its optimum shows which limits contradict each other.
"""

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, frozen_vector
from ...models.values import dataclass
from ..case.limits.constraint import Constraint, Reading
from ..case.task import Sense
from ..system.jsonvalues import Hidden, JsonObject, Shown
from .nlp import Nlp, PairPlace
from .pairs import violated_pairs, with_pairs
from .places import Scalar
from .sampling import starting_points

#: Relative relaxation above which a limit counts as relaxed.
RELAXED = 1e-6
#: Difference of two relaxations that counts as rounding of their limits.
_ROUNDING = 1e-9
#: Number of points at which the necessary relaxation of each limit is evaluated for the upper bound of t.
_BOUND_POINTS = 32
#: Upper bound of t, as a multiple of the largest of these necessary relaxations.
_BOUND_FACTOR = 2.0
#: Largest relaxation of a limit, as a multiple of its value.
_LARGEST_RELAXATION = 1e3


class RelaxedLimit(JsonObject):
    """Limit of an infeasible case that must be relaxed, together with all other limits of the list.

    Attributes:
        key: dotted key of the limit's value, below ``limits``.
        limit: value in the case.
        needed: value with which the case would be feasible; over a workspace or along a path, a necessary value,
            perhaps not sufficient.
        unit: unit of both values.
        dimension: dimension of both values; angles are in radians.
    """

    key: str
    limit: Shown
    needed: Shown
    unit: str
    dimension: Hidden[Dimension] = Dimension.NUMBER


@dataclass(frozen=True)
class _RelaxableSide:
    """Side of a constraint that belongs to a limit.

    Attributes:
        key: dotted key of the limit's value, below ``limits``.
        constraint: the constraint.
        place: index of the constraint in the program.
        limit: bound of the side, in units of the constraint's expression.
        direction: sign of a relaxation: -1 for a lower side, +1 for an upper one.
    """

    key: str
    constraint: Constraint
    place: int
    limit: float
    direction: float

    @property
    def number(self) -> float:
        """Value of the limit, radians for angles."""
        return self.constraint.reading.from_value(self.limit)

    @property
    def unit(self) -> float:
        """Change of the limit's value for a relaxation of 1: magnitude of the value, or one unit for a value of 0."""
        return abs(self.number) or 1.0

    def necessary_relaxation(self, value: float) -> float:
        """Return the smallest relaxation t >= 0 for which a value of the expression is feasible."""
        return max(0.0, self.direction * (self.constraint.reading.from_value(value) - self.number) / self.unit)


def _relaxable_sides(nlp: Nlp) -> list[_RelaxableSide]:
    """Return the sides of a program that belong to limits of its case."""
    sides = []
    bounds = zip(nlp.program.constraints, nlp.g_lower, nlp.g_upper, strict=True)
    for place, (constraint, lower, upper) in enumerate(bounds):
        low, high = constraint.keys
        if low:
            sides.append(_RelaxableSide(low, constraint, place, float(lower), -1.0))
        if high:
            sides.append(_RelaxableSide(high, constraint, place, float(upper), 1.0))
    return sides


def formulate_relaxation(nlp: Nlp) -> Nlp:
    """Return the program of the smallest relaxation of a program's limits.

    Its last variables are the t of the limits, in the order of the program's constraints.

    Args:
        nlp: a program with limits.
    """
    program, sides = nlp.program, _relaxable_sides(nlp)
    keys = _keys(sides)
    t = SX.sym("t", len(keys))
    largest = _upper_bounds(nlp, sides, keys)
    unchanged = [k for k, constraint in enumerate(program.constraints) if not any(constraint.keys)]
    constraints = [program.constraints[k] for k in unchanged]
    lower, upper = [nlp.g_lower[k] for k in unchanged], [nlp.g_upper[k] for k in unchanged]
    reading = Reading(Dimension.NUMBER)
    for side in sides:
        number = side.number + side.direction * side.unit * t[keys.index(side.key)]
        slack = side.constraint.expression - side.constraint.reading.to_value(number)
        own = (side.key, "") if side.direction < 0 else ("", side.key)
        constraints.append(replace(side.constraint, expression=slack, call=None, reading=reading, keys=own))
        lower.append(0.0 if side.direction < 0 else -np.inf)
        upper.append(np.inf if side.direction < 0 else 0.0)
    relaxation = replace(
        program,
        variables=(*program.variables, *(Scalar(f"relaxation of {key}", Dimension.NUMBER) for key in keys)),
        x=ca.vertcat(program.x, t),
        objective=ca.sum1(t),
        objective_call=None,
        constraints=tuple(constraints),
    )
    return replace(
        nlp,
        program=relaxation,
        sense=Sense.MIN,
        lower=frozen_vector([*nlp.lower, *np.zeros(len(keys))]),
        upper=frozen_vector([*nlp.upper, *largest]),
        start=frozen_vector([*nlp.start, *largest]),
        g_lower=frozen_vector(lower),
        g_upper=frozen_vector(upper),
        families=(),
        pairs=(),
        pair_count=0,
        size=1.0,
    )


def relaxation_point(nlp: Nlp, x: FloatArray) -> FloatArray:
    """Return a point of the relaxation's program: a point of the original program with the required t.

    Args:
        nlp: the original program.
        x: (n,) a point of the original program.

    Returns:
        (n + k,) array, with a t for each of the k limits.
    """
    sides = _relaxable_sides(nlp)
    return np.append(x, _necessary_relaxations(nlp, sides, _keys(sides), x))


def unrelaxed_pairs(nlp: Nlp, x: FloatArray) -> list[PairPlace]:
    """Return the missing pairs of a program that are violated at a point of its relaxation.

    Args:
        nlp: the original program.
        x: (n + k,) a point of the relaxation's program.
    """
    missing = violated_pairs(nlp, x[: nlp.n])
    if not missing:
        return []
    given = dict(zip(_keys(_relaxable_sides(nlp)), x[nlp.n :], strict=True))
    extended = with_pairs(nlp, missing)
    sides = _relaxable_sides(extended)
    keys = _keys(sides)
    needed = zip(keys, _necessary_relaxations(extended, sides, keys, x[: nlp.n]), strict=True)
    return missing if any(t > given.get(key, 0.0) + _ROUNDING for key, t in needed) else []


def relaxed_limits(nlp: Nlp, x: FloatArray) -> tuple[RelaxedLimit, ...]:
    """Return the limits that are relaxed at a point of the relaxation's program.

    Args:
        nlp: the original program.
        x: (n + k,) a point of the relaxation's program.

    Returns:
        The relaxed limits, in the order of the original program's constraints.
    """
    sides = _relaxable_sides(nlp)
    relaxed = []
    for key, t in zip(_keys(sides), x[nlp.n :], strict=True):
        side = next(each for each in sides if each.key == key)
        if t > RELAXED:
            needed = side.number + side.direction * side.unit * float(t)
            dimension = side.constraint.reading.dimension
            unit = nlp.case.units.label(dimension)
            relaxed.append(RelaxedLimit(key=key, limit=side.number, needed=needed, unit=unit, dimension=dimension))
    return tuple(relaxed)


def _keys(sides: Sequence[_RelaxableSide]) -> list[str]:
    """Return the key of each limit's value once, in the order of the sides."""
    return list(dict.fromkeys(side.key for side in sides))


def _necessary_relaxations(nlp: Nlp, sides: Sequence[_RelaxableSide], keys: Sequence[str], x: FloatArray) -> FloatArray:
    """Return the smallest t (k,) for which a point (n,) is feasible, at most :data:`_LARGEST_RELAXATION`."""
    g = nlp.evaluate(x)[1]
    needed = np.zeros(len(keys))
    for side in sides:
        value = float(g[side.place])
        t = side.necessary_relaxation(value) if np.isfinite(value) else 0.0
        needed[keys.index(side.key)] = max(needed[keys.index(side.key)], min(t, _LARGEST_RELAXATION))
    return needed


def _upper_bounds(nlp: Nlp, sides: Sequence[_RelaxableSide], keys: Sequence[str]) -> FloatArray:
    """Return upper bounds of t (k,): above the necessary relaxations at a few points, without a change of sign."""
    points = starting_points(nlp, _BOUND_POINTS, 0)
    largest = _BOUND_FACTOR * np.max([_necessary_relaxations(nlp, sides, keys, x) for x in points], axis=0)
    for k, key in enumerate(keys):
        side = next(each for each in sides if each.key == key)
        reading = side.constraint.reading
        # For example, a limit that enters the program squared cannot be relaxed below zero.
        one_sided = reading.from_value(float(reading.to_value(SX(-1.0)))) >= 0
        if side.direction < 0 and one_sided:
            largest[k] = min(largest[k], 1.0)
    return np.asarray(np.maximum(largest, 1e-3), dtype=np.float64)
