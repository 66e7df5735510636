"""Arithmetic of the check: numbers over boxes as balls with slopes, rounded outwards at every operation.

Over a box with centre ``c`` and half widths ``h`` every number has, each as a middle and a radius,

    v(c) in C,     v(y) - v(c) in sum_k S_k (y_k - c_k)      for every y of the box,

as in R. Krawczyk and A. Neumaier, *Interval slopes for rational functions and associated centered forms*, SIAM J.
Numer. Anal. 22 (1985). Its range is C with the sum of ``|S_k| h_k``. A middle that is rounded adds to its radius; a
radius is a sum of numbers that are not negative, and is enlarged by more than its own rounding. NaN proves nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .....models import FloatArray

#: Index of an array of NumPy's.
Key = Any
#: Rounding of one operation, in parts of its result.
UNIT = 2.0**-53
#: Factor of a radius: a sum of products of numbers that are not negative, with fewer than 60 roundings in a row.
UP = 1 + 64 * UNIT
#: Largest error of an operation whose result is near the smallest doubles.
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class BallSlopes:
    """Numbers over B boxes.

    Attributes:
        c, ce: (B, ...) middles and radii at the centre.
        s, se: (B, ..., 6) middles and radii of the slopes.
        h: (B, 6) half widths, rounded up.
    """

    c: FloatArray
    ce: FloatArray
    s: FloatArray
    se: FloatArray
    h: FloatArray

    @property
    def spread(self) -> FloatArray:
        """(B, ...) largest distance of the number from the middle at the centre."""
        h = self.h.reshape(len(self.h), *(1,) * (self.c.ndim - 1), 6)
        return np.asarray((self.ce + ((np.abs(self.s) + self.se) * h).sum(axis=-1)) * UP)

    def __getitem__(self, key: Key) -> BallSlopes:
        """Return some of the numbers; the key's first index is that of the boxes."""
        return BallSlopes(self.c[key], self.ce[key], self.s[key], self.se[key], self.h)

    def __neg__(self) -> BallSlopes:
        return BallSlopes(-self.c, self.ce, -self.s, self.se, self.h)

    def __add__(self, other: BallSlopes) -> BallSlopes:
        c, s = self.c + other.c, self.s + other.s
        return BallSlopes(
            c,
            (self.ce + other.ce + UNIT * np.abs(c)) * UP,
            s,
            (self.se + other.se + UNIT * np.abs(s)) * UP,
            self.h,
        )

    def __sub__(self, other: BallSlopes) -> BallSlopes:
        return self + -other

    def __mul__(self, other: BallSlopes) -> BallSlopes:
        """Return the product: ``uv - u(c) v(c) = (u - u(c)) v + u(c) (v - v(c))``."""
        u, v, wide = self, other, other.spread
        c = u.c * v.c
        ce = np.abs(u.c) * v.ce + u.ce * (np.abs(v.c) + v.ce) + UNIT * np.abs(c) + TINY
        uc, ue, vc = u.c[..., None], u.ce[..., None], v.c[..., None]
        one, two = u.s * vc, uc * v.s
        size = np.abs(one) + np.abs(two)
        se = np.abs(u.s) * wide[..., None] + u.se * (np.abs(vc) + wide[..., None])
        se += np.abs(uc) * v.se + ue * (np.abs(v.s) + v.se) + 2 * UNIT * size + TINY
        return BallSlopes(c, ce * UP, one + two, se * UP, u.h)

    def times(self, factor: FloatArray) -> BallSlopes:
        """Return the numbers times doubles, of the shape (...) or (B, ...)."""
        factor = np.asarray(factor, dtype=float)
        c, s = self.c * factor, self.s * factor[..., None]
        size = np.abs(factor)
        return BallSlopes(
            c,
            (self.ce * size + UNIT * np.abs(c) + TINY) * UP,
            s,
            (self.se * size[..., None] + UNIT * np.abs(s) + TINY) * UP,
            self.h,
        )

    def plus(self, number: FloatArray) -> BallSlopes:
        """Return the numbers plus doubles, of the shape (...) or (B, ...)."""
        c = self.c + number
        s, se = (np.broadcast_to(each, (*c.shape, 6)) for each in (self.s, self.se))
        return BallSlopes(c, (self.ce + UNIT * np.abs(c)) * UP, s, se, self.h)

    def sum(self, axis: int) -> BallSlopes:
        """Return the sum over an axis, counted from the front, of fewer than 32 numbers."""
        rounding = 32 * UNIT
        return BallSlopes(
            self.c.sum(axis=axis),
            (self.ce + rounding * np.abs(self.c)).sum(axis=axis) * UP,
            self.s.sum(axis=axis),
            (self.se + rounding * np.abs(self.s)).sum(axis=axis) * UP,
            self.h,
        )

    def root(self) -> BallSlopes:
        """Return the square roots; a difference of roots is that of the numbers over the sum of the roots.

        NaN where a number may be 0 or below.
        """
        wide = self.spread
        with np.errstate(invalid="ignore", divide="ignore"):
            low, high = self.c - wide * UP - UNIT * np.abs(self.c), self.c + wide * UP + UNIT * np.abs(self.c)
            low = np.where(low > 0, low, np.nan)
            c = np.sqrt(self.c)
            least, most = np.sqrt(low) * (1 - 4 * UNIT), np.sqrt(high) * (1 + 4 * UNIT)
            ce = (self.ce / least + 2 * UNIT * c) * UP
            # 1 / (root + root at the centre) lies between these two.
            small, large = (1 - 8 * UNIT) / (c + ce + most), (1 + 8 * UNIT) / (least + c - ce)
            middle, half = 0.5 * (small + large), 0.5 * (large - small) + 4 * UNIT * large
        factor, off = middle[..., None], half[..., None]
        s = self.s * factor
        se = (np.abs(self.s) + self.se) * off + self.se * factor + UNIT * np.abs(s) + TINY
        return BallSlopes(c, ce, s, se * UP, self.h)

    def combined(self, weights: FloatArray) -> BallSlopes:
        """Return E sums of numbers (B, T), T below 32, with weights (E, T) that are doubles."""
        size, rounding = np.abs(weights), 32 * UNIT
        return BallSlopes(
            self.c @ weights.T,
            ((self.ce + rounding * np.abs(self.c)) @ size.T + TINY) * UP,
            weights @ self.s,
            (size @ (self.se + rounding * np.abs(self.s)) + TINY) * UP,
            self.h,
        )


def concatenated(parts: Sequence[BallSlopes], axis: int) -> BallSlopes:
    """Return numbers side by side, along an axis counted from the front."""
    c, ce, s, se = (
        np.concatenate([getattr(each, name) for each in parts], axis=axis) for name in ("c", "ce", "s", "se")
    )
    return BallSlopes(c, ce, s, se, parts[0].h)


def coordinates(lower: FloatArray, upper: FloatArray) -> BallSlopes:
    """Return the six coordinates over boxes (B, 6)."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    h = np.nextafter(np.maximum(upper - centre, centre - lower), np.inf)
    h = np.where(upper > lower, h, 0.0)
    s = np.broadcast_to(np.eye(6), (len(centre), 6, 6))
    return BallSlopes(centre, np.zeros_like(centre), s, np.zeros_like(s), h)
