"""F along lines and planes through a point of a program: what it does beside the optimum, without any solve.

A component of a free unit vector cannot move alone: the vector's other components are scaled to keep its length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ....models import FloatArray, frozen_array
from ...evidence.kkt import FEASIBLE
from ...program.epigraph import exact_levels
from ...program.nlp import Nlp

#: Points along a line, and along each side of a plane: odd, so that the middle is one.
_LINE, _PLANE = 121, 41
#: A component of a unit vector whose others are smaller than this has no direction to move in.
_POLE = 1e-9
#: How far outside of a limit counts as inside, in parts of the limit's size: what rounding and a solve leave.
_WITHIN = max(FEASIBLE, 1e-9)


@dataclass(frozen=True, eq=False)
class Slice:
    """F along one variable.

    Attributes:
        variable: index in the program.
        values: (k,) of the variable, in the program's units.
        F: (k,) objective; nan where the robot is not defined.
        inside: (k,) whether every limit is kept.
    """

    variable: int
    values: FloatArray
    F: FloatArray
    inside: FloatArray


@dataclass(frozen=True, eq=False)
class Plane:
    """F over two variables.

    Attributes:
        variables: indices in the program.
        first: (k,) values of the first variable.
        second: (m,) values of the second.
        F: (m, k) objective; nan where the robot is not defined.
        inside: (m, k) whether every limit is kept.
    """

    variables: tuple[int, int]
    first: FloatArray
    second: FloatArray
    F: FloatArray
    inside: FloatArray


def slices_of(nlp: Nlp, x: FloatArray) -> list[Slice]:
    """F through a point (n,) along every variable, from bound to bound."""
    found = []
    for k in _movable(nlp):
        values = _range(nlp, k, _LINE, x)
        F, inside = _values(nlp, _moved(nlp, x, [k], values[None, :]))
        arrays = [frozen_array(each, (len(values),)) for each in (values, F, inside)]
        found.append(Slice(k, *arrays))
    return found


def planes_of(nlp: Nlp, x: FloatArray, most: int) -> list[Plane]:
    """F through a point (n,) over pairs of variables, the first ``most`` pairs."""
    found = []
    for i, j in list(combinations(_movable(nlp), 2))[:most]:
        first, second = _range(nlp, i, _PLANE, x), _range(nlp, j, _PLANE, x)
        across, up = np.meshgrid(first, second)
        F, inside = _values(nlp, _moved(nlp, x, [i, j], np.vstack([across.ravel(), up.ravel()])))
        shape = (len(second), len(first))
        found.append(
            Plane(
                (i, j),
                frozen_array(first, first.shape),
                frozen_array(second, second.shape),
                frozen_array(F.reshape(shape), shape),
                frozen_array(inside.reshape(shape), shape),
            )
        )
    return found


def has_loops(nlp: Nlp) -> bool:
    """Whether the robot has loops that close only after a solve, so that one variable cannot move alone."""
    return bool(nlp.program.model.unknowns)


def _movable(nlp: Nlp) -> list[int]:
    """Indices of the variables but the worst pose's level, which follows from the others."""
    epigraph = nlp.program.places.epigraph
    return [k for k in range(nlp.n) if epigraph is None or k != epigraph.level]


def _range(nlp: Nlp, k: int, count: int, x: FloatArray) -> FloatArray:
    """Values from bound to bound, the point's own among them."""
    lower, upper = nlp.lower[k], nlp.upper[k]
    if any(k in direction for direction in nlp.program.places.directions):
        lower, upper = max(lower, -1.0), min(upper, 1.0)
    return np.unique(np.append(np.linspace(lower, upper, count), np.clip(x[k], lower, upper)))


def _moved(nlp: Nlp, x: FloatArray, changed: Sequence[int], values: FloatArray) -> FloatArray:
    """(n, k) points with some variables replaced, unit vectors kept at unit length; nan where that cannot be."""
    points = np.repeat(x[:, None], values.shape[1], axis=1)
    points[list(changed)] = values
    for direction in nlp.program.places.directions:
        moved = [k for k in direction if k in changed]
        rest = [k for k in direction if k not in changed]
        if not moved:
            continue
        left = 1.0 - np.sum(points[moved] ** 2, axis=0)
        left[np.abs(left) < _POLE] = 0.0
        length = np.linalg.norm(x[rest])
        if length < _POLE:
            points[:, left != 0] = np.nan
            continue
        with np.errstate(invalid="ignore"):
            points[rest] *= np.sqrt(left) / length
    return points


def _values(nlp: Nlp, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """F (k,) at points (n, k), and whether every limit is kept there (k,)."""
    epigraph = nlp.program.places.epigraph
    if epigraph is not None and len(nlp.program.robots) > 1:
        points[epigraph.level] = exact_levels(nlp, points)
    F, g = (each.full() for each in nlp.program.values(points, nlp.arguments))
    size = np.maximum(1.0, np.maximum(np.abs(_finite(nlp.g_lower)), np.abs(_finite(nlp.g_upper))))
    with np.errstate(invalid="ignore"):
        low = g >= (nlp.g_lower - _WITHIN * size)[:, None]
        high = g <= (nlp.g_upper + _WITHIN * size)[:, None]
    values = np.where(np.isfinite(F[0]), F[0], np.nan)
    return values, np.asarray(np.all(low & high, axis=0) & np.isfinite(values), dtype=np.float64)


def _finite(values: FloatArray) -> FloatArray:
    return np.asarray(np.where(np.isfinite(values), values, 0.0))
