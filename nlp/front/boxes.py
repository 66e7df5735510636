"""The part of the space of goals in which points of a front can still be, as boxes below local upper bounds.

Goals are costs here: smaller is better. A local upper bound is a corner ``u`` such that no known point is below it in
all goals, while any point that none of the known ones dominates is below one of these corners. Each new point splits
the corners above it. The lower corner of a box is taken from the points that define its upper one.

Source: K. Klamroth, R. Lacour and D. Vanderpooten, On the representation of the search region in multi-objective
optimization, European J. Oper. Res. 245 (2015) 767-778.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ...models import FloatArray

#: Boxes that can hold less than this part of the front are left: the square root of it is about a thousandth of a goal.
_SMALLEST = 1e-6


class GoalBox(NamedTuple):
    """A box between a lower and an upper corner, (k,) each."""

    lower: FloatArray
    upper: FloatArray

    @property
    def sides(self) -> FloatArray:
        """(k,) sides, none negative."""
        return np.maximum(self.upper - self.lower, 0.0)

    @property
    def patch(self) -> float:
        """Size of the largest piece of a surface that the box can hold: the product of all sides but the smallest."""
        return float(np.prod(np.sort(self.sides)[1:]))


class Region:
    """Boxes of the space of k goals that known points leave.

    Args:
        best: (k,) the smallest cost of each goal.
        worst: (k,) the largest cost of each goal that is searched.
        points: (k,) each, none of which dominates another.
    """

    def __init__(self, best: FloatArray, worst: FloatArray, points: Iterable[FloatArray] = ()) -> None:
        self._best = best
        self._points: FloatArray = np.zeros((0, len(best)))
        self._corners: FloatArray = worst[np.newaxis]
        for point in points:
            self.add(point)

    def add(self, point: FloatArray) -> None:
        """Split the corners above a point (k,)."""
        self._points = np.vstack([self._points, point])
        above = (point < self._corners).all(axis=1)
        kept, new = self._corners[~above], []
        for corner in self._corners[above]:
            for j in range(len(point)):
                if point[j] > self._best[j]:
                    split = corner.copy()
                    split[j] = point[j]
                    new.append(split)
        corners: FloatArray = np.vstack([kept, *new]) if new else kept
        self._corners = corners[_largest(corners)]

    def widest(self, closed: set[tuple[float, ...]]) -> GoalBox | None:
        """Return the box that can hold the largest piece of the front; None where all that is left is closed or small.

        Args:
            closed: upper corners of boxes without a point.
        """
        boxes = [GoalBox(self._lower(corner), corner) for corner in self._corners if tuple(corner) not in closed]
        found = max(boxes, key=lambda box: box.patch, default=None)
        return None if found is None or found.patch <= _SMALLEST else found

    def _lower(self, corner: FloatArray) -> FloatArray:
        """Return the lower corner (k,) of a box: the largest that the points which define the upper one give."""
        lower = self._best.copy()
        for i in range(len(corner)):
            others = np.arange(len(corner)) != i
            defines = (self._points[:, i] == corner[i]) & (self._points[:, others] < corner[others]).all(axis=1)
            if defines.any():
                lower[others] = np.maximum(lower[others], self._points[defines][:, others].min(axis=0))
        return lower


def _largest(corners: FloatArray) -> list[int]:
    """Return the indices of the corners (m, k) below none of the others, the first of those that are equal."""
    kept = []
    for j, corner in enumerate(corners):
        above = (corners >= corner).all(axis=1)
        equal = (corners == corner).all(axis=1)
        if not (above & ~equal).any() and not equal[:j].any():
            kept.append(j)
    return kept
