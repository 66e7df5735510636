"""Rounding of sums and products of doubles, and centres and radii of boxes in spite of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from ....models import FloatArray

#: Four times the rounding unit 2^-53: an end of an interval moves outwards by this part of itself per operation.
ULP = 2.0**-51
#: More than underflow can cost an operation. Additions are exact there.
TINY = 1e-300
#: A value of this size or more is poisoned, so that no square and no product of two overflows, and no inverse of a
#: square underflows.
LARGEST = 1e150


class Midpoints(NamedTuple):
    """Centres and radii of boxes, (n, B) each; ``centre +- radius`` holds the box in spite of rounding."""

    centre: FloatArray
    radius: FloatArray


def midpoints(lower: FloatArray, upper: FloatArray) -> Midpoints:
    """Return the centres and radii of boxes with ends (n, B)."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    radius = np.maximum(upper - centre, centre - lower)
    radius = np.where(radius > 0, radius * (1 + ULP) + TINY, 0.0)
    return Midpoints(centre, np.where(np.maximum(-lower, upper) < LARGEST, radius, np.inf))
