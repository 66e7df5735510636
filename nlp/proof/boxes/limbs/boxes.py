"""Boxes of shared variables, each with a list of boxes of every limb's own variables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray


@dataclass(frozen=True, eq=False)
class OwnBoxes:
    """Lists of boxes of one limb's own variables, for B shared boxes.

    Attributes:
        lower, upper: (d, N) ends of all lists, one after the other.
        of: (N,) number of the shared box that a box belongs to, ascending.
        count: number B of the shared boxes.
    """

    lower: FloatArray
    upper: FloatArray
    of: NDArray[np.int64]
    count: int

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """(B,) place of the first box of each list; none may be empty."""
        return np.flatnonzero(np.diff(self.of, prepend=-1))

    def some(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> OwnBoxes:
        """Return the lists of some of the shared boxes, which may repeat."""
        chosen = np.flatnonzero(which) if which.dtype == np.bool_ else which
        sizes = np.bincount(self.of, minlength=self.count)
        starts, counts = (np.cumsum(sizes) - sizes)[chosen], sizes[chosen]
        before = np.cumsum(counts) - counts
        places = np.repeat(starts - before, counts) + np.arange(int(counts.sum()))
        of = np.repeat(np.arange(chosen.size), counts)
        return OwnBoxes(self.lower[:, places], self.upper[:, places], of, chosen.size)

    def joined(self, parts: Sequence[OwnBoxes]) -> OwnBoxes:
        """Return the lists of several, one after the other."""
        first = np.cumsum([0, *(part.count for part in parts)])
        return OwnBoxes(
            np.concatenate([part.lower for part in parts], axis=1),
            np.concatenate([part.upper for part in parts], axis=1),
            np.concatenate([part.of + start for part, start in zip(parts, first, strict=False)]),
            int(first[-1]),
        )

    @property
    def width(self) -> FloatArray:
        """(B,) sum of all sides of the boxes of each list."""
        return np.asarray(np.bincount(self.of, (self.upper - self.lower).sum(axis=0), minlength=self.count))

    def bisect(self, which: NDArray[np.bool_], along: NDArray[np.intp]) -> OwnBoxes:
        """Return the lists with some boxes (N,) bisected along one variable (N,) each."""
        places = np.repeat(np.arange(self.of.size), 1 + which)
        lower, upper = self.lower[:, places].copy(), self.upper[:, places].copy()
        second = np.flatnonzero(np.diff(places, prepend=-1) == 0)
        i = along[places[second]]
        middle = 0.5 * lower[i, second] + 0.5 * upper[i, second]
        upper[i, second - 1], lower[i, second] = middle, middle
        return OwnBoxes(lower, upper, self.of[places], self.count)


@dataclass(frozen=True, eq=False)
class SharedBoxes:
    """B boxes of shared variables with lists of own boxes.

    Attributes:
        lower, upper: (m, B) ends.
        bound: (B,) upper bound of the value that is maximised.
        own: lists of each limb.
        good: (d, B) a point of each limb's own variables that is the best known.
    """

    lower: FloatArray
    upper: FloatArray
    bound: FloatArray
    own: tuple[OwnBoxes, ...]
    good: tuple[FloatArray, ...]

    @property
    def count(self) -> int:
        """Number of shared boxes."""
        return int(self.bound.size)
