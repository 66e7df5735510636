"""Ends of intervals in round to nearest: how far they move outwards, so that rounding never loses a value.

The constants are written here again: the reference shares no number with the package.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from screwsynth.models import FloatArray

#: Four times the rounding unit 2^-53: an end of an interval moves outwards by this part of itself per operation.
ULP = 2.0**-51
#: More than underflow can cost an operation. Additions are exact there.
TINY = 1e-300
#: A value of this size or more is poisoned, so that no square and no product of two overflows, and no inverse of a
#: square underflows.
LARGEST = 1e150
#: Error, in parts of 2^-51, of sine, cosine, exponential, logarithm and arc tangent as libraries compute them.
LIBRARY = 8.0


class Interval(NamedTuple):
    """Lower and upper ends, (B,) each. A NaN end bounds nothing."""

    lo: FloatArray
    hi: FloatArray


def widen(lo: FloatArray, hi: FloatArray, tiny: float = 0.0) -> Interval:
    """Return ends that were rounded to nearest, moved outwards; ``tiny`` where they may have underflowed."""
    return Interval(lo - (np.abs(lo) * ULP + tiny), hi + (np.abs(hi) * ULP + tiny))


def interval_product(lo: FloatArray, hi: FloatArray, other_lo: FloatArray, other_hi: FloatArray) -> Interval:
    """Return the product of two intervals, outwards; an end is NaN where infinity meets zero."""
    p, q, r, s = lo * other_lo, lo * other_hi, hi * other_lo, hi * other_hi
    least, most = np.minimum(np.minimum(p, q), np.minimum(r, s)), np.maximum(np.maximum(p, q), np.maximum(r, s))
    least, most = widen(least, most, TINY)
    # Two factors that are not negative have no negative product, however far down it was rounded.
    return Interval(np.where((lo >= 0) & (other_lo >= 0), np.maximum(least, 0.0), least), most)


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
