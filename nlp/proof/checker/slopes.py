"""Interval slope arithmetic for the check of a proof: simple, slow, and independent of the search's own arithmetic.

Over boxes with centre ``c``, every value has three intervals (R. Krawczyk and A. Neumaier, *Interval slopes for
rational functions and associated centered forms*, SIAM J. Numer. Anal. 22 (1985)):

    v(x) in V,     v(c) in C,     v(x) - v(c) in sum_i S_i (x_i - c_i)      for every x of the box,

and ``V`` is intersected with ``C + sum_i S_i [-r_i, r_i]`` at every operation. Every result of the processor's
arithmetic moves outwards by one floating-point number, and those of library functions by more. A value that may be
undefined is NaN, and so is every value computed from it; NaN proves nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import intervals as ends
from .arithmetic import Composed, Steps

if TYPE_CHECKING:
    from ....models import FloatArray
    from .intervals import Ends

#: More than underflow can cost a sum.
_TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Slope:
    """A value over N boxes, each attribute a pair of ends.

    Attributes:
        V: (N,) range.
        C: (N,) value at the centre.
        S: (n, N) slopes.
    """

    V: Ends
    C: Ends
    S: Ends


class SlopeArithmetic(Steps):
    """Slopes of a function of one vector."""

    def __call__(self, lower: FloatArray, upper: FloatArray) -> list[Slope]:
        """Return slopes of the outputs' elements over boxes with ends (n, N)."""
        return self.run(_Boxes(lower, upper))


class _Boxes(Composed[Slope]):
    """N boxes with ends (n, N), and the operations on values over them."""

    def __init__(self, lower: FloatArray, upper: FloatArray) -> None:
        self._lower, self._upper = lower, upper
        self._centre = np.clip(0.5 * (lower + upper), lower, upper)
        # Distance of the farther end from the centre, rounded up.
        self._radius = np.nextafter(np.maximum(upper - self._centre, self._centre - lower), np.inf)

    def variable(self, i: int) -> Slope:
        unit = np.zeros_like(self._lower)
        unit[i] = 1.0
        return Slope((self._lower[i], self._upper[i]), (self._centre[i], self._centre[i]), (unit, unit))

    def constant(self, value: float) -> Slope:
        flat, none = np.full(self._lower.shape[1], value), np.zeros_like(self._lower)
        return Slope((flat, flat), (flat, flat), (none, none))

    def number(self, u: Slope) -> float | None:
        return float(u.V[0][0]) if np.array_equal(*u.V) and np.all(u.V[0] == u.V[0][0]) else None

    def slope(self, V: Ends, C: Ends, S: Ends) -> Slope:
        """Return a value, its range intersected with the centred form."""
        reach = np.maximum(np.abs(S[0]), np.abs(S[1])) * self._radius
        spread = reach.sum(axis=0) * (1 + 1e-14) + _TINY
        low, high = ends.out(C[0] - spread, C[1] + spread)
        return Slope((np.fmax(V[0], low), np.fmin(V[1], high)), C, S)

    def add(self, u: Slope, v: Slope) -> Slope:
        return self.slope(ends.add(u.V, v.V), ends.add(u.C, v.C), ends.add(u.S, v.S))

    def sub(self, u: Slope, v: Slope) -> Slope:
        return self.slope(ends.sub(u.V, v.V), ends.sub(u.C, v.C), ends.sub(u.S, v.S))

    def mul(self, u: Slope, v: Slope) -> Slope:
        """Return the product: ``uv - u(c)v(c) = (u - u(c)) v + u(c) (v - v(c))``."""
        S = ends.add(ends.mul(u.S, v.V), ends.mul(u.C, v.S))
        return self.slope(ends.mul(u.V, v.V), ends.mul(u.C, v.C), S)

    def div(self, u: Slope, v: Slope) -> Slope:
        """Return the quotient: ``u/v - u(c)/v(c) = ((u - u(c)) - u(c)/v(c) (v - v(c))) / v``."""
        inverse, ratio = ends.inverse(v.V), ends.mul(u.C, ends.inverse(v.C))
        return self.slope(ends.mul(u.V, inverse), ratio, ends.mul(ends.sub(u.S, ends.mul(ratio, v.S)), inverse))

    def scale(self, u: Slope, by: float) -> Slope:
        factor = (np.array(by), np.array(by))
        return Slope(ends.mul(u.V, factor), ends.mul(u.C, factor), ends.mul(u.S, factor))

    def square(self, u: Slope) -> Slope:
        return self.slope(ends.square(u.V), ends.square(u.C), ends.mul(ends.add(u.V, u.C), u.S))

    def sqrt(self, u: Slope) -> Slope:
        """Return the root; a difference of roots is that of the numbers over the sum of the roots."""
        V, C = ends.sqrt(u.V), ends.sqrt(u.C)
        return self.slope(V, C, ends.mul(u.S, ends.inverse(ends.add(V, C))))

    def smooth(self, u: Slope, function: Callable[[Ends], Ends], derivative: Callable[[Ends], Ends]) -> Slope:
        """Return f(u), by the mean value theorem: its slope is f' somewhere on the range, times the slope of u."""
        hull = np.minimum(u.V[0], u.C[0]), np.maximum(u.V[1], u.C[1])
        return self.slope(function(u.V), function(u.C), ends.mul(derivative(hull), u.S))

    def ramp(self, u: Slope) -> Slope:
        """Return max(u, 0): a difference of it is that of u times a number from 0 to 1."""
        low, high = np.minimum(u.V[0], u.C[0]), np.maximum(u.V[1], u.C[1])
        part = np.where(low >= 0, 1.0, 0.0), np.where(high <= 0, 0.0, 1.0)
        V, C = ((np.maximum(each[0], 0.0), np.maximum(each[1], 0.0)) for each in (u.V, u.C))
        return self.slope(V, C, ends.mul(u.S, part))

    def step(self, u: Slope) -> Slope:
        """Return 1 where u is not negative, else 0; where it is not known which, there is no slope."""
        V, C = ((np.where(each[0] > 0, 1.0, 0.0), np.where(each[1] < 0, 0.0, 1.0)) for each in (u.V, u.C))
        defined = np.isfinite(u.V[0]) & np.isfinite(u.V[1])
        V = np.where(defined, V[0], np.nan), np.where(defined, V[1], np.nan)
        flat = np.broadcast_to(np.where(defined & (V[0] == V[1]), 0.0, np.nan), u.S[0].shape)
        return Slope(V, C, (flat, flat))

    def fmax(self, u: Slope, v: Slope) -> Slope:
        V, C = ((np.maximum(a[0], b[0]), np.maximum(a[1], b[1])) for a, b in ((u.V, v.V), (u.C, v.C)))
        return self.slope(V, C, self.add(v, self.ramp(self.sub(u, v))).S)

    def atan(self, u: Slope) -> Slope:
        return self.smooth(
            u, ends.atan, lambda x: ends.inverse(ends.add(ends.square(x), (np.array(1.0), np.array(1.0))))
        )

    def sin(self, u: Slope) -> Slope:
        return self.smooth(u, lambda x: ends.wave(x, np.sin), lambda x: ends.wave(x, np.cos))

    def cos(self, u: Slope) -> Slope:
        def slope(x: Ends) -> Ends:
            low, high = ends.wave(x, np.sin)
            return -high, -low

        return self.smooth(u, lambda x: ends.wave(x, np.cos), slope)

    def exp(self, u: Slope) -> Slope:
        return self.smooth(u, ends.exp, ends.exp)

    def log(self, u: Slope) -> Slope:
        return self.smooth(u, ends.log, ends.inverse)
