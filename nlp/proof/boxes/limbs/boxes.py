"""Boxes of shared variables, each with a list of boxes of every limb's own variables."""

from __future__ import annotations

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
    """

    lower: FloatArray
    upper: FloatArray
    of: NDArray[np.int64]

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """(B,) place of the first box of each list; none may be empty."""
        return np.flatnonzero(np.diff(self.of, prepend=-1))

    def select(self, which: NDArray[np.intp], count: int) -> OwnBoxes:
        """Return the lists of some of so many shared boxes, which may repeat."""
        sizes = np.bincount(self.of, minlength=count)
        starts, counts = (np.cumsum(sizes) - sizes)[which], sizes[which]
        before = np.cumsum(counts) - counts
        places = np.repeat(starts - before, counts) + np.arange(int(counts.sum()))
        return OwnBoxes(self.lower[:, places], self.upper[:, places], np.repeat(np.arange(which.size), counts))

    def width(self, count: int) -> FloatArray:
        """Return the sum (B,) of all sides of the boxes of each of so many lists."""
        return np.asarray(np.bincount(self.of, (self.upper - self.lower).sum(axis=0), minlength=count))

    def bisect(self, which: NDArray[np.bool_], along: NDArray[np.intp]) -> OwnBoxes:
        """Return the lists with some boxes (N,) bisected along one variable (N,) each."""
        places = np.repeat(np.arange(self.of.size), 1 + which)
        lower, upper = self.lower[:, places].copy(), self.upper[:, places].copy()
        second = np.flatnonzero(np.diff(places, prepend=-1) == 0)
        i = along[places[second]]
        middle = 0.5 * lower[i, second] + 0.5 * upper[i, second]
        upper[i, second - 1], lower[i, second] = middle, middle
        return OwnBoxes(lower, upper, self.of[places])


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

    def select(self, which: NDArray[np.intp]) -> SharedBoxes:
        """Return the boxes at some indices, which may repeat."""
        own = tuple(each.select(which, self.count) for each in self.own)
        good = tuple(each[:, which] for each in self.good)
        return SharedBoxes(self.lower[:, which], self.upper[:, which], self.bound[which], own, good)

    def joined(self, others: list[SharedBoxes]) -> SharedBoxes:
        """Return these boxes and those of others."""
        parts = [self, *others]
        first = np.cumsum([0, *(part.count for part in parts)])
        own = tuple(
            OwnBoxes(
                np.concatenate([part.own[k].lower for part in parts], axis=1),
                np.concatenate([part.own[k].upper for part in parts], axis=1),
                np.concatenate([part.own[k].of + start for part, start in zip(parts, first, strict=False)]),
            )
            for k in range(len(self.own))
        )
        return SharedBoxes(
            np.concatenate([part.lower for part in parts], axis=1),
            np.concatenate([part.upper for part in parts], axis=1),
            np.concatenate([part.bound for part in parts]),
            own,
            tuple(np.concatenate([part.good[k] for part in parts], axis=1) for k in range(len(self.own))),
        )

    def bisect(self, along: NDArray[np.intp]) -> SharedBoxes:
        """Return the halves of all boxes, bisected along one variable (B,) each, with the lists of the whole."""
        both = self.select(np.repeat(np.arange(self.count), 2))
        first = np.arange(0, both.count, 2)
        lower, upper = both.lower.copy(), both.upper.copy()
        middle = 0.5 * lower[along, first] + 0.5 * upper[along, first]
        upper[along, first], lower[along, first + 1] = middle, middle
        return SharedBoxes(lower, upper, both.bound, both.own, both.good)
