"""Ends of intervals for the check of a proof: operations move them outwards by one number, or by a library's error.

An interval is a pair of arrays. An operation that may be undefined gives NaN, which proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ....models import FloatArray

    Ends = tuple[FloatArray, FloatArray]

#: Error of a library's sine, cosine, exponential, logarithm and arc tangent, in parts of their size or of 1.
LIBRARY = 4e-15


def out(lo: FloatArray, hi: FloatArray) -> Ends:
    """Return ends moved outwards by one number."""
    return np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf)


def add(x: Ends, y: Ends) -> Ends:
    """Return the sum."""
    return out(x[0] + y[0], x[1] + y[1])


def sub(x: Ends, y: Ends) -> Ends:
    """Return the difference."""
    return out(x[0] - y[1], x[1] - y[0])


def mul(x: Ends, y: Ends) -> Ends:
    """Return the product."""
    p, q, r, s = x[0] * y[0], x[0] * y[1], x[1] * y[0], x[1] * y[1]
    return out(np.minimum(np.minimum(p, q), np.minimum(r, s)), np.maximum(np.maximum(p, q), np.maximum(r, s)))


def inverse(x: Ends) -> Ends:
    """Return 1 / x; NaN for an interval with 0 in it."""
    apart = (x[0] > 0) | (x[1] < 0)
    return out(np.where(apart, 1 / x[1], np.nan), np.where(apart, 1 / x[0], np.nan))


def square(x: Ends) -> Ends:
    """Return the square."""
    one, other = x[0] * x[0], x[1] * x[1]
    lo, hi = out(np.minimum(one, other), np.maximum(one, other))
    return np.where((x[0] <= 0) & (x[1] >= 0), 0.0, np.maximum(lo, 0.0)), hi


def sqrt(x: Ends) -> Ends:
    """Return the root; NaN below 0."""
    lo, hi = out(np.sqrt(x[0]), np.sqrt(x[1]))
    return np.maximum(lo, 0.0), hi


def _rising(function: Callable[[FloatArray], FloatArray]) -> Callable[[Ends], Ends]:
    """Return the interval version of an increasing library function."""

    def ends(x: Ends) -> Ends:
        lo, hi = function(x[0]), function(x[1])
        return lo - LIBRARY * (np.abs(lo) + 1e-280), hi + LIBRARY * (np.abs(hi) + 1e-280)

    return ends


exp, atan = _rising(np.exp), _rising(np.arctan)


def log(x: Ends) -> Ends:
    """Return the logarithm; NaN unless the interval is positive."""
    lo, hi = np.log(np.where(x[0] > 0, x[0], np.nan)), np.log(x[1])
    return lo - LIBRARY * (1 + np.abs(lo)), hi + LIBRARY * (1 + np.abs(hi))


def wave(x: Ends, function: Callable[[FloatArray], FloatArray]) -> Ends:
    """Return the range of sine or cosine, by the Lipschitz constant of 1 about the middle and the second derivative."""
    middle = 0.5 * (x[0] + x[1])
    radius = np.nextafter(np.maximum(x[1] - middle, middle - x[0]), np.inf)
    value = function(middle)
    steep = np.sqrt(np.maximum(1 - value * value, 0.0)) + 1e-7
    spread = np.minimum(radius, steep * radius + 0.5 * radius * radius) * (1 + 1e-12) + 4 * LIBRARY
    return np.maximum(value - spread, -1.0), np.minimum(value + spread, 1.0)
