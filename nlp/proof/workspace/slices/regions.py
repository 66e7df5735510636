"""Regions of a slice, the boxes that cover it, and their bisection."""

from __future__ import annotations

import enum
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray

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


def quarters(lower: FloatArray, upper: FloatArray, chosen: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Return boxes (B, n) bisected along two coordinates, each into four: all first quarters, then all second ones."""
    middle = 0.5 * lower + 0.5 * upper
    lows, highs = [], []
    for sides in SIDES:
        low, high = lower.copy(), upper.copy()
        for k, is_upper in zip(chosen, sides, strict=True):
            (low if is_upper else high)[:, k] = middle[:, k]
        lows.append(low)
        highs.append(high)
    return np.concatenate(lows), np.concatenate(highs)


#: For each quarter of a box whether it is the upper half along the first and the second coordinate.
SIDES = tuple(itertools.product((False, True), repeat=2))
