"""The smallest relaxation that makes an infeasible case feasible, as a program.

Every number that limits the case gets an unknown ``t >= 0``, by which part of itself it is moved outwards (by how many
units, where it is 0), at every leg, joint and pose at once. The sum of all t is made least. A sum, unlike a sum of
squares, moves few numbers and leaves the others alone, so that it says which limits are in each other's way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, frozen_vector
from ..case.limits.constraint import Constraint, Reading
from ..case.task import Sense
from .nlp import Nlp
from .places import Scalar
from .sampling import starting_points

#: A number is moved when it is moved by more than this part of itself.
MOVED = 1e-6
#: Points at which it is looked how far each number would have to go, and how much farther it may.
_PROBES, _ROOM = 32, 2.0
#: No number is moved by more than this many times itself.
_FARTHEST = 1e3


@dataclass(frozen=True)
class Relaxed:
    """A limit's number that has to be moved.

    Attributes:
        key: dotted key, below ``limits``, of the number.
        limit: the number in the case, radians for angles.
        needed: what it must be at least, or at most, beside the others that are moved.
        dimension: what both measure.
    """

    key: str
    limit: float
    needed: float
    dimension: Dimension


@dataclass(frozen=True)
class _MovableSide:
    """One side of a constraint whose limit may be moved: outwards is ``direction``."""

    key: str
    constraint: Constraint
    place: int
    limit: float
    direction: float

    @property
    def number(self) -> float:
        return self.constraint.reading.from_value(self.limit)

    @property
    def unit(self) -> float:
        return abs(self.number) or 1.0

    def missing(self, value: float) -> float:
        """By how many units the number would have to be moved for a value of the expression."""
        return max(0.0, self.direction * (self.constraint.reading.from_value(value) - self.number) / self.unit)


def _rows(nlp: Nlp) -> list[_MovableSide]:
    rows = []
    bounds = zip(nlp.program.constraints, nlp.g_lower, nlp.g_upper, strict=True)
    for place, (constraint, lower, upper) in enumerate(bounds):
        low, high = constraint.keys
        if low:
            rows.append(_MovableSide(low, constraint, place, float(lower), -1.0))
        if high:
            rows.append(_MovableSide(high, constraint, place, float(upper), 1.0))
    return rows


def elastic(nlp: Nlp) -> Nlp:
    """The program whose optimum is the smallest relaxation; its last variables are the t of :func:`_keys`."""
    program, rows = nlp.program, _rows(nlp)
    keys = _keys(rows)
    t = SX.sym("t", len(keys))
    most = _farthest(nlp, rows, keys)
    kept = [k for k, constraint in enumerate(program.constraints) if not any(constraint.keys)]
    constraints = [program.constraints[k] for k in kept]
    lower, upper = [nlp.g_lower[k] for k in kept], [nlp.g_upper[k] for k in kept]
    for row in rows:
        number = row.number + row.direction * row.unit * t[keys.index(row.key)]
        room = row.constraint.expression - row.constraint.reading.to_value(number)
        own = (row.key, "") if row.direction < 0 else ("", row.key)
        constraints.append(replace(row.constraint, expression=room, reading=Reading(Dimension.NUMBER), keys=own))
        lower.append(0.0 if row.direction < 0 else -np.inf)
        upper.append(np.inf if row.direction < 0 else 0.0)
    stretched = replace(
        program,
        variables=(*program.variables, *(Scalar(f"relaxation of {key}", Dimension.NUMBER) for key in keys)),
        x=ca.vertcat(program.x, t),
        objective=ca.sum1(t),
        constraints=tuple(constraints),
    )
    return replace(
        nlp,
        program=stretched,
        sense=Sense.MIN,
        lower=frozen_vector([*nlp.lower, *np.zeros(len(keys))]),
        upper=frozen_vector([*nlp.upper, *most]),
        start=frozen_vector([*nlp.start, *most]),
        g_lower=frozen_vector(lower),
        g_upper=frozen_vector(upper),
        size=1.0,
    )


def stretched_point(nlp: Nlp, x: FloatArray) -> FloatArray:
    """A point (n,) of a program with the t that it needs, as a point of :func:`elastic`'s program."""
    rows = _rows(nlp)
    return np.append(x, _missing(nlp, rows, _keys(rows), x))


def relaxed_limits(nlp: Nlp, x: FloatArray) -> tuple[Relaxed, ...]:
    """What is moved at a point of :func:`elastic`'s program, in the order of the case's limits."""
    rows = _rows(nlp)
    moved = []
    for key, t in zip(_keys(rows), x[nlp.n :], strict=True):
        row = next(each for each in rows if each.key == key)
        if t > MOVED:
            needed = row.number + row.direction * row.unit * float(t)
            moved.append(Relaxed(key, row.number, needed, row.constraint.reading.dimension))
    return tuple(moved)


def _keys(rows: Sequence[_MovableSide]) -> list[str]:
    return list(dict.fromkeys(row.key for row in rows))


def _missing(nlp: Nlp, rows: Sequence[_MovableSide], keys: Sequence[str], x: FloatArray) -> FloatArray:
    g = nlp.evaluate(x)[1]
    needed = np.zeros(len(keys))
    for row in rows:
        value = float(g[row.place])
        missing = row.missing(value) if np.isfinite(value) else 0.0
        needed[keys.index(row.key)] = max(needed[keys.index(row.key)], min(missing, _FARTHEST))
    return needed


def _farthest(nlp: Nlp, rows: Sequence[_MovableSide], keys: Sequence[str]) -> FloatArray:
    """(k,) how far each t may go: farther than it must at a few points of the box, and not through zero."""
    points = starting_points(nlp, _PROBES, 0)
    most = _ROOM * np.max([_missing(nlp, rows, keys, x) for x in points], axis=0)
    for k, key in enumerate(keys):
        row = next(each for each in rows if each.key == key)
        reading = row.constraint.reading
        # A limit that is squared, say, cannot be moved below zero.
        one_sided = reading.from_value(float(reading.to_value(SX(-1.0)))) >= 0
        if row.direction < 0 and one_sided:
            most[k] = min(most[k], 1.0)
    return np.asarray(np.maximum(most, 1e-3), dtype=np.float64)
