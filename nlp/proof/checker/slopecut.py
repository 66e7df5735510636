"""Parts of boxes that a linear form with interval slopes excludes, for the check of a proof."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ....models import FloatArray

#: Error of a sum of a few hundred rounded terms, in parts of their sizes.
_SUMS = 1e-13
#: More than underflow can cost a sum.
_TINY = 1e-290


def cut_off(
    centre_value: FloatArray, slope_low: FloatArray, slope_high: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ends (n, N) of the parts of boxes that hold every point where a value is at most 0; crossed if none is.

    Args:
        centre_value: (N,) lower bound of the value at the centres of the boxes.
        slope_low: (n, N) lower ends of slopes from the centre: ``v(x) - v(c) in sum_i S_i (x_i - c_i)``.
        slope_high: (n, N) upper ends.
        lower: (n, N) lower ends of the boxes.
        upper: (n, N) upper ends.
    """
    with np.errstate(all="ignore"):
        centre = np.clip(0.5 * (lower + upper), lower, upper)
        radius = np.nextafter(np.maximum(upper - centre, centre - lower), np.inf)
        reach = np.maximum(np.abs(slope_low), np.abs(slope_high)) * radius
        total = reach.sum(axis=0)
        sizes = np.abs(centre_value) + total
        # The value is at least ``rest + S_i d`` with ``d = x_i - c_i``, so S_i d <= -rest must hold for some slope.
        rest = (centre_value - (total - reach)) - (_SUMS * sizes + _TINY)
        right = np.where(slope_low < 0, rest / -slope_low, np.inf) * (1 - _SUMS)
        left = np.where(slope_high > 0, rest / slope_high, np.inf) * (1 - _SUMS)
        known = (rest > 0) & np.isfinite(sizes)
        no_right, no_left = known & (right > radius), known & (left > radius)
        margin = _SUMS * (np.abs(centre) + radius)
        low = np.where(no_left, np.where(no_right, np.inf, centre + right - margin), lower)
        high = np.where(no_right, np.where(no_left, -np.inf, centre - left + margin), upper)
    return np.fmax(lower, low), np.fmin(upper, high)
