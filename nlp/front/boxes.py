"""Search region of a front: boxes of goal values that can contain further points.

Goals are costs here: smaller is better. A local upper bound is a corner ``u`` with no known point below it in all
goals; every point that no known point dominates is below one of these corners. Each new point splits the corners above
it. The lower corner of a box follows from the points that define its upper corner.

Source: K. Klamroth, R. Lacour and D. Vanderpooten, On the representation of the search region in multi-objective
optimization, European J. Oper. Res. 245 (2015) 767-778.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ...models import FloatArray

#: Size of a box, relative to the front, below which it is not searched: about the square of a thousandth of a goal.
_SMALLEST = 1e-6


class GoalBox(NamedTuple):
    """Box between a lower and an upper corner, (k,) each."""

    lower: FloatArray
    upper: FloatArray

    @property
    def sides(self) -> FloatArray:
        """Sides (k,) of the box, not negative."""
        return np.maximum(self.upper - self.lower, 0.0)

    @property
    def patch(self) -> float:
        """Size of the largest piece of a front in the box: the product of all sides except the smallest."""
        return float(np.prod(np.sort(self.sides)[1:]))


class Region:
    """Search region in the space of k goals, given the known points.

    Args:
        best: (k,) smallest cost of each goal.
        worst: (k,) largest cost of each goal in the search region.
        points: known points (k,) that do not dominate each other.
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
        """Return the box that can contain the largest piece of the front; None if all boxes are closed or small.

        Args:
            closed: upper corners of boxes without a point.
        """
        boxes = [GoalBox(self._lower(corner), corner) for corner in self._corners if tuple(corner) not in closed]
        found = max(boxes, key=lambda box: box.patch, default=None)
        return None if found is None or found.patch <= _SMALLEST else found

    def _lower(self, corner: FloatArray) -> FloatArray:
        """Return the lower corner (k,) of a box: the largest corner from the points that define the upper one."""
        lower = self._best.copy()
        for i in range(len(corner)):
            others = np.arange(len(corner)) != i
            defines = (self._points[:, i] == corner[i]) & (self._points[:, others] < corner[others]).all(axis=1)
            if defines.any():
                lower[others] = np.maximum(lower[others], self._points[defines][:, others].min(axis=0))
        return lower


def _largest(corners: FloatArray) -> list[int]:
    """Return the indices of the corners (m, k) that are below no other corner; of equal corners, the first one."""
    kept = []
    for j, corner in enumerate(corners):
        above = (corners >= corner).all(axis=1)
        equal = (corners == corner).all(axis=1)
        if not (above & ~equal).any() and not equal[:j].any():
            kept.append(j)
    return kept
