"""F along lines and planes through a point of a program, by evaluation alone.

A component of a free unit vector cannot move alone: the vector's other components are scaled to keep its length.
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

#: Points along a line, and along each side of a plane: odd, so that the middle of the range is among them.
_LINE, _PLANE = 121, 41
#: Where the other components of a unit vector are smaller than this, no scale of them keeps the vector's length.
_POLE = 1e-9
#: Violation of a limit, in parts of the limit's size, that is allowed for rounding and the tolerance of a solve.
_WITHIN = max(FEASIBLE, 1e-9)


@dataclass(frozen=True, eq=False)
class Slice:
    """F along one variable.

    Attributes:
        variable: index in the program.
        values: (k,) of the variable, in the program's units.
        F: (k,) objective; nan where the robot is not defined.
        inside: (k,) 1 where every constraint holds, else 0.
    """

    variable: int
    values: FloatArray
    F: FloatArray
    inside: FloatArray

    @property
    def has_room(self) -> bool:
        """Whether the line lies within every constraint at more than one point."""
        return bool(self.inside.sum() > 1)


@dataclass(frozen=True, eq=False)
class Plane:
    """F over two variables.

    Attributes:
        variables: indices in the program.
        first: (k,) values of the first variable.
        second: (m,) values of the second.
        F: (m, k) objective; nan where the robot is not defined.
        inside: (m, k) 1 where every constraint holds, else 0.
    """

    variables: tuple[int, int]
    first: FloatArray
    second: FloatArray
    F: FloatArray
    inside: FloatArray


def slices_of(nlp: Nlp, x: FloatArray) -> list[Slice]:
    """Return F through a point (n,) along every variable, from bound to bound."""
    found = []
    for k in _movable(nlp):
        values = _range(nlp, k, _LINE, x)
        F, inside = _values(nlp, _points_with(nlp, x, [k], values[None, :]))
        arrays = [frozen_array(each, (len(values),)) for each in (values, F, inside)]
        found.append(Slice(k, *arrays))
    return found


def planes_of(nlp: Nlp, x: FloatArray, most: int) -> list[Plane]:
    """Return F through a point (n,) over pairs of variables, at most the first ``most`` pairs."""
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
    """Return whether the robot has loops, which close at solutions only, so that no variable can move alone."""
    return bool(nlp.program.model.unknowns)


def _movable(nlp: Nlp) -> list[int]:
    """Return indices of all variables but the epigraph variable, which the others determine."""
    epigraph = nlp.program.places.epigraph
    return [k for k in range(nlp.n) if epigraph is None or k != epigraph.level]


def _range(nlp: Nlp, k: int, count: int, x: FloatArray) -> FloatArray:
    """Return values of a variable from bound to bound, the point's own among them."""
    lower, upper = nlp.lower[k], nlp.upper[k]
    if any(k in direction for direction in nlp.program.places.directions):
        lower, upper = max(lower, -1.0), min(upper, 1.0)
    return np.unique(np.append(np.linspace(lower, upper, count), np.clip(x[k], lower, upper)))


def _points_with(nlp: Nlp, x: FloatArray, changed: Sequence[int], values: FloatArray) -> FloatArray:
    """Return points (n, k) that differ from a point (n,) in some variables, with unit vectors scaled to unit length.

    Args:
        nlp: the program.
        x: (n,) the point.
        changed: indices of the variables.
        values: (len(changed), k) of these variables.

    Returns:
        The points; nan where no scale of the other components makes a unit vector.
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
    """F (k,), nan where it has no value, and 1 where every constraint holds, else 0, (k,)."""

    F: FloatArray
    inside: FloatArray


def _values(nlp: Nlp, points: FloatArray) -> _Values:
    """Return F and the constraints' state at points (n, k)."""
    nlp = with_pairs_at(nlp, points.T)
    epigraph = nlp.program.places.epigraph
    if epigraph is not None and len(nlp.program.robots) > 1:
        points[epigraph.level] = exact_levels(nlp, points)
    F, g = (each.full() for each in nlp.program.values(points, nlp.arguments))
    # An infinite bound is absent, and has no size.
    bounds = np.nan_to_num(np.abs([nlp.g_lower, nlp.g_upper]), nan=0.0, posinf=0.0)
    size = np.max(bounds, axis=0, initial=1.0)
    with np.errstate(invalid="ignore"):
        low = g >= (nlp.g_lower - _WITHIN * size)[:, None]
        high = g <= (nlp.g_upper + _WITHIN * size)[:, None]
    # What rounding leaves of F is 0.
    settled = np.where(np.abs(F[0]) > ZERO_F * nlp.objective_size, F[0], 0.0)
    values = np.where(np.isfinite(F[0]), settled, np.nan)
    return _Values(values, np.asarray(np.all(low & high, axis=0) & np.isfinite(values), dtype=np.float64))
