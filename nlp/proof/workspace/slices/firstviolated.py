"""The limit that is violated first on the straight way from the middle of a slice, for each box of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray
from .limitcells import LimitState
from .regions import KEPT, UNDECIDED

#: Points to each side of a slice, and on each way from its middle, at which limits are tried for the first violated.
POINTS, _STEPS = 65, 96


class FirstViolated:
    """The limit that is violated first on the straight way from the middle of a slice.

    The limit's violation in a box is that of its enclosure; which of several comes first is taken from points.

    Args:
        violated: returns whether each limit is violated at the points of the slice's grid, (M, N, N).
        count: number M of limits.
        lower: (2,) lower ends of the slice.
        upper: (2,) upper ends of the slice.
    """

    def __init__(
        self, violated: Callable[[], NDArray[np.bool_]], count: int, lower: FloatArray, upper: FloatArray
    ) -> None:
        self._function, self._count = violated, count
        self._lower, self._upper = lower, upper

    @cached_property
    def _violated(self) -> NDArray[np.bool_]:
        """Whether each limit is violated at points of the slice, (M, N, N)."""
        return self._function()

    def of(
        self, states: NDArray[np.int8], lower: FloatArray, upper: FloatArray
    ) -> tuple[NDArray[np.int16], NDArray[np.bool_]]:
        """Return the limit (B,) of each box, and whether it is that of the whole box.

        Args:
            states: (M, B) of the limits over the boxes.
            lower: (B, 2) lower ends of the boxes.
            upper: (B, 2) upper ends of the boxes.
        """
        violated = states == LimitState.VIOLATED
        limit = np.where((states == LimitState.OPEN).any(axis=0), UNDECIDED, KEPT).astype(np.int16)
        is_same = limit == KEPT
        some = np.flatnonzero(violated.any(axis=0))
        if not some.size:
            return limit, is_same
        limit[some] = np.argmax(violated[:, some], axis=0)
        # Another limit that is open may be violated first in a part of the box.
        is_same[some] = (states[:, some] == LimitState.KEPT).sum(axis=0) == self._count - 1
        several = some[~is_same[some]]
        if several.size:
            low, high = lower[several], upper[several]
            own = violated[:, several]
            limit[several] = self._first(own, 0.5 * (low + high))
            corners = [np.column_stack([x[:, 0], y[:, 1]]) for x in (low, high) for y in (low, high)]
            candidates = states[:, several] != LimitState.KEPT
            around = [self._first(candidates, corner) for corner in corners]
            is_same[several] = np.all([each == limit[several] for each in around], axis=0)
        return limit, is_same

    def _first(self, candidates: NDArray[np.bool_], ends: FloatArray) -> NDArray[np.int16]:
        """Return which of the candidates (M, C) is violated first on the way to each end (C, 2)."""
        middle = 0.5 * (self._lower + self._upper)
        parts = np.linspace(0.0, 1.0, _STEPS)[:, None, None]
        way = middle + parts * (ends - middle)
        place = np.rint((way - self._lower) / (self._upper - self._lower) * (POINTS - 1)).astype(np.intp)
        on_way = self._violated[:, place[..., 0], place[..., 1]] & candidates[:, None]
        # One that is violated at no point of the way comes last.
        begins = np.where(on_way.any(axis=1), np.argmax(on_way, axis=1), _STEPS)
        begins = np.where(candidates, begins, _STEPS + 1)
        return np.asarray(np.argmin(begins, axis=0), dtype=np.int16)


def grid_points(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return the points (N, N, 2) of the grid of a slice with ends (2,)."""
    axes = [np.linspace(low, high, POINTS) for low, high in zip(lower, upper, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
