"""Regions of a slice, and the search of boxes that cover it."""

from __future__ import annotations

import enum
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray
from ...boxes.rows import Boxes, Columns, bisected, some
from ...boxes.search import Order, Rule, Search, Verdicts

#: Limits of a box: all are proved to be kept, or nothing is proved; else the index of a limit that is violated.
KEPT, UNDECIDED = -1, -2
#: Width of the smallest boxes in parts of the slice.
LEAST = 2.0**-8


class Region(enum.Enum):
    """Verdict on a box of a slice."""

    REGULAR = "proved regular"
    BEYOND = "regular, with a singular pose on the way from the middle"
    OTHER_SIGN = "regular, with the other sign of the determinant"
    OPEN = "open: too close to a singular pose"
    UNREACHED = "out of reach, proved"
    UNKNOWN = "open: reach or closed loops are not proved"


class Cover(NamedTuple):
    """Boxes that cover a slice, lower then upper ends (B, 4), and the region and the limit (B,) of each."""

    boxes: FloatArray
    regions: tuple[Region, ...]
    binding: NDArray[np.int16]


#: Order of the regions in arrays.
_REGIONS = tuple(Region)


def index_of(region: Region) -> int:
    """Return the index of a region in arrays."""
    return _REGIONS.index(region)


def cover_of(lower: FloatArray, upper: FloatArray, region: NDArray[np.int8], binding: NDArray[np.int16]) -> Cover:
    """Return boxes with ends (B, 2), and indices (B,) of regions and limits, as a cover."""
    binding.flags.writeable = False
    return Cover(np.concatenate([lower, upper], axis=1), tuple(_REGIONS[k] for k in region.tolist()), binding)


class CoverRule(Rule[Columns]):
    """Rule for boxes that cover a slice: they are bisected along both of its coordinates.

    Args:
        places: indices of the two coordinates.
        lower, upper: (2,) ends of the slice.
    """

    def __init__(self, places: list[int], lower: FloatArray, upper: FloatArray) -> None:
        self._places, self._lower, self._upper = places, lower, upper

    def divided(self, boxes: Boxes[Columns]) -> Boxes[Columns]:
        """Return the quarters of boxes."""
        halves = bisected(boxes)
        return bisected(halves._replace(split=np.full(len(halves.split), self._places[1])))

    def ends(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Return ends (B, 2) of boxes in the slice, and whether they are as small as they get."""
        low, high = lower[:, self._places], upper[:, self._places]
        return low, high, np.asarray((high - low <= LEAST * (self._upper - self._lower)).all(axis=1))

    def cover(self, root: Boxes[Columns]) -> None:
        """Divide the slice until all boxes are done."""
        whole = (root.upper - root.lower)[0]
        search = Search(self, root, whole=np.nan_to_num(whole), least=(0.0, 0.0), order=Order.NEWEST)
        while search.is_open:
            search.step(-math.inf)

    def open(self, boxes: Boxes[Columns], done: NDArray[np.bool_]) -> Verdicts[Columns]:
        """Return the boxes that are not done."""
        left = some(boxes, ~done)
        split = np.full(len(left.split), self._places[0])
        return Verdicts(left._replace(split=split), -math.inf, len(boxes.split))
