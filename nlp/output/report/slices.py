"""F along lines and planes through a point of a nonlinear program, by evaluation without solving.

If a variable is a component of a unit vector, the other components of the vector are scaled to keep its length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ....models import FloatArray, frozen_array
from ...evidence.kkt import FEASIBLE
from ...evidence.state import ZERO_F
from ...program.epigraph import exact_levels
from ...program.nlp import Nlp
from ...program.pairs import with_pairs_at

#: Number of points along a line, and along each side of a plane: odd, to include the middle of the range.
_LINE, _PLANE = 121, 41
#: Size of the other components of a unit vector below which scaling them cannot restore the vector's length.
_POLE = 1e-9
#: Allowed violation relative to the limit's size, for rounding and the tolerance of the solver.
_WITHIN = max(FEASIBLE, 1e-9)


@dataclass(frozen=True, eq=False)
class Slice:
    """F along one variable.

    Attributes:
        variable: index of the variable in the nonlinear program.
        values: (k,) values of the variable, in the units of the nonlinear program.
        F: (k,) objective; nan where the robot does not exist.
        inside: (k,) 1 if all constraints are satisfied, otherwise 0.
    """

    variable: int
    values: FloatArray
    F: FloatArray
    inside: FloatArray

    @property
    def has_room(self) -> bool:
        """True if more than one point of the line satisfies all constraints."""
        return bool(self.inside.sum() > 1)


@dataclass(frozen=True, eq=False)
class Plane:
    """F over two variables.

    Attributes:
        variables: indices of the two variables in the nonlinear program.
        first: (k,) values of the first variable.
        second: (m,) values of the second variable.
        F: (m, k) objective; nan where the robot does not exist.
        inside: (m, k) 1 if all constraints are satisfied, otherwise 0.
    """

    variables: tuple[int, int]
    first: FloatArray
    second: FloatArray
    F: FloatArray
    inside: FloatArray


def slices_of(nlp: Nlp, x: FloatArray) -> list[Slice]:
    """Return F along lines through a point (n,): for each variable, from bound to bound."""
    found = []
    for k in _movable(nlp):
        values = _range(nlp, k, _LINE, x)
        F, inside = _values(nlp, _points_with(nlp, x, [k], values[None, :]))
        arrays = [frozen_array(each, (len(values),)) for each in (values, F, inside)]
        found.append(Slice(k, *arrays))
    return found


def planes_of(nlp: Nlp, x: FloatArray, most: int) -> list[Plane]:
    """Return F on planes through a point (n,): for pairs of variables, at most the first ``most`` pairs."""
    found = []
    for i, j in list(combinations(_movable(nlp), 2))[:most]:
        first, second = _range(nlp, i, _PLANE, x), _range(nlp, j, _PLANE, x)
        across, up = np.meshgrid(first, second)
        F, inside = _values(nlp, _points_with(nlp, x, [i, j], np.vstack([across.ravel(), up.ravel()])))
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
    """Return whether the robot has loop equations, so that no variable can change independently."""
    return bool(nlp.program.model.unknowns)


def _movable(nlp: Nlp) -> list[int]:
    """Return indices of all variables except the epigraph variable, which depends on them."""
    epigraph = nlp.program.places.epigraph
    return [k for k in range(nlp.n) if epigraph is None or k != epigraph.level]


def _range(nlp: Nlp, k: int, count: int, x: FloatArray) -> FloatArray:
    """Return values of a variable from bound to bound, including its value at the point."""
    lower, upper = nlp.lower[k], nlp.upper[k]
    if any(k in direction for direction in nlp.program.places.directions):
        lower, upper = max(lower, -1.0), min(upper, 1.0)
    return np.unique(np.append(np.linspace(lower, upper, count), np.clip(x[k], lower, upper)))


def _points_with(nlp: Nlp, x: FloatArray, changed: Sequence[int], values: FloatArray) -> FloatArray:
    """Return points (n, k) with new values of some variables, and unit vectors scaled to unit length.

    Args:
        nlp: nonlinear program.
        x: (n,) point.
        changed: indices of the variables.
        values: (len(changed), k) values of these variables.

    Returns:
        Points (n, k); nan where no scaling of the other components gives a unit vector.
    """
    points = np.repeat(x[:, None], values.shape[1], axis=1)
    points[list(changed)] = values
    for direction in nlp.program.places.directions:
        own = [k for k in direction if k in changed]
        rest = [k for k in direction if k not in changed]
        if not own:
            continue
        left = 1.0 - np.sum(points[own] ** 2, axis=0)
        left[np.abs(left) < _POLE] = 0.0
        length = np.linalg.norm(x[rest])
        if length < _POLE:
            points[:, left != 0] = np.nan
            continue
        with np.errstate(invalid="ignore"):
            points[rest] *= np.sqrt(left) / length
    return points


class _Values(NamedTuple):
    """F (k,), nan if undefined; and (k,) 1 if all constraints are satisfied, otherwise 0."""

    F: FloatArray
    inside: FloatArray


def _values(nlp: Nlp, points: FloatArray) -> _Values:
    """Return F and the satisfaction of the constraints at points (n, k)."""
    nlp = with_pairs_at(nlp, points.T)
    epigraph = nlp.program.places.epigraph
    if epigraph is not None and len(nlp.program.robots) > 1:
        points[epigraph.level] = exact_levels(nlp, points)
    F, g = (each.full() for each in nlp.program.values(points, nlp.arguments))
    # An infinite bound is no bound, and has no size.
    bounds = np.nan_to_num(np.abs([nlp.g_lower, nlp.g_upper]), nan=0.0, posinf=0.0)
    size = np.max(bounds, axis=0, initial=1.0)
    with np.errstate(invalid="ignore"):
        low = g >= (nlp.g_lower - _WITHIN * size)[:, None]
        high = g <= (nlp.g_upper + _WITHIN * size)[:, None]
    # Rounding errors of F are set to 0.
    settled = np.where(np.abs(F[0]) > ZERO_F * nlp.objective_size, F[0], 0.0)
    values = np.where(np.isfinite(F[0]), settled, np.nan)
    return _Values(values, np.asarray(np.all(low & high, axis=0) & np.isfinite(values), dtype=np.float64))
