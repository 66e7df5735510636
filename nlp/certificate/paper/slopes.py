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

import casadi as ca
import numpy as np

from ...errors import UncoveredError

if TYPE_CHECKING:
    from ....models import FloatArray

    Ends = tuple[FloatArray, FloatArray]

#: Error of a library's sine, cosine, exponential, logarithm and arc tangent, in parts of their size or of 1.
_LIBRARY = 4e-15


def _out(lo: FloatArray, hi: FloatArray) -> Ends:
    return np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf)


def _add(x: Ends, y: Ends) -> Ends:
    return _out(x[0] + y[0], x[1] + y[1])


def _sub(x: Ends, y: Ends) -> Ends:
    return _out(x[0] - y[1], x[1] - y[0])


def _mul(x: Ends, y: Ends) -> Ends:
    p, q, r, s = x[0] * y[0], x[0] * y[1], x[1] * y[0], x[1] * y[1]
    return _out(np.minimum(np.minimum(p, q), np.minimum(r, s)), np.maximum(np.maximum(p, q), np.maximum(r, s)))


def _inverse(x: Ends) -> Ends:
    apart = (x[0] > 0) | (x[1] < 0)
    return _out(np.where(apart, 1 / x[1], np.nan), np.where(apart, 1 / x[0], np.nan))


def _square(x: Ends) -> Ends:
    one, other = x[0] * x[0], x[1] * x[1]
    lo, hi = _out(np.minimum(one, other), np.maximum(one, other))
    return np.where((x[0] <= 0) & (x[1] >= 0), 0.0, np.maximum(lo, 0.0)), hi


def _sqrt(x: Ends) -> Ends:
    lo, hi = _out(np.sqrt(x[0]), np.sqrt(x[1]))
    return np.maximum(lo, 0.0), hi


def _rising(function: Callable[[FloatArray], FloatArray]) -> Callable[[Ends], Ends]:
    """Return the interval version of an increasing library function."""

    def ends(x: Ends) -> Ends:
        lo, hi = function(x[0]), function(x[1])
        return lo - _LIBRARY * (np.abs(lo) + 1e-280), hi + _LIBRARY * (np.abs(hi) + 1e-280)

    return ends


_EXP, _ATAN = _rising(np.exp), _rising(np.arctan)


def _log(x: Ends) -> Ends:
    lo, hi = np.log(np.where(x[0] > 0, x[0], np.nan)), np.log(x[1])
    return lo - _LIBRARY * (1 + np.abs(lo)), hi + _LIBRARY * (1 + np.abs(hi))


def _wave(x: Ends, function: Callable[[FloatArray], FloatArray]) -> Ends:
    """Return the range of sine or cosine, by the Lipschitz constant of 1 about the middle and the second derivative."""
    middle = 0.5 * (x[0] + x[1])
    radius = np.nextafter(np.maximum(x[1] - middle, middle - x[0]), np.inf)
    value = function(middle)
    steep = np.sqrt(np.maximum(1 - value * value, 0.0)) + 1e-7
    spread = np.minimum(radius, steep * radius + 0.5 * radius * radius) * (1 + 1e-12) + 4 * _LIBRARY
    return np.maximum(value - spread, -1.0), np.minimum(value + spread, 1.0)


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


class SlopeArithmetic:
    """Slopes of a function of one vector.

    Args:
        function: made of ``SX``, with one dense input (n, 1) and dense outputs.

    Raises:
        UncoveredError: the function holds an operation without a rule.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._steps = [
            (
                function.instruction_id(k),
                function.instruction_input(k),
                function.instruction_output(k),
                function.instruction_constant(k) if function.instruction_id(k) == ca.OP_CONST else 0.0,
            )
            for k in range(function.n_instructions())
        ]
        known = {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, *_UNARY, *_BINARY}
        for op, *_ in self._steps:
            if op not in known:
                raise UncoveredError(f"the operation number {op} of CasADi's")
        self._offset = np.concatenate([[0], np.cumsum([function.numel_out(i) for i in range(function.n_out())])])

    def __call__(self, lower: FloatArray, upper: FloatArray) -> list[Slope]:
        """Return slopes of the outputs' elements over boxes with ends (n, N)."""
        centre = np.clip(0.5 * (lower + upper), lower, upper)
        boxes = _Boxes(lower, upper, centre, np.nextafter(np.maximum(upper - centre, centre - lower), np.inf))
        work: list[Slope | None] = [None] * self._function.sz_w()
        results: list[Slope | None] = [None] * int(self._offset[-1])
        with np.errstate(all="ignore"):
            for op, source, target, constant in self._steps:
                if op == ca.OP_OUTPUT:
                    results[int(self._offset[target[0]]) + target[1]] = work[source[0]]
                elif op == ca.OP_INPUT:
                    work[target[0]] = boxes.variable(source[1])
                elif op == ca.OP_CONST:
                    work[target[0]] = boxes.constant(constant)
                else:
                    operands = [work[each] for each in source]
                    work[target[0]] = (_UNARY[op] if op in _UNARY else _BINARY[op])(boxes, *operands)  # type: ignore[arg-type]
        return [each for each in results if each is not None]


@dataclass(frozen=True, eq=False)
class _Boxes:
    """N boxes, and the operations on values over them.

    Attributes:
        lower, upper: (n, N) ends.
        centre: (n, N).
        radius: (n, N) distance of the farther end from the centre, rounded up.
    """

    lower: FloatArray
    upper: FloatArray
    centre: FloatArray
    radius: FloatArray

    def variable(self, i: int) -> Slope:
        unit = np.zeros_like(self.lower)
        unit[i] = 1.0
        return Slope((self.lower[i], self.upper[i]), (self.centre[i], self.centre[i]), (unit, unit))

    def constant(self, value: float) -> Slope:
        flat, none = np.full(self.lower.shape[1], value), np.zeros_like(self.lower)
        return Slope((flat, flat), (flat, flat), (none, none))

    def slope(self, V: Ends, C: Ends, S: Ends) -> Slope:
        """Return a value, its range intersected with the centred form."""
        reach = np.maximum(np.abs(S[0]), np.abs(S[1])) * self.radius
        spread = reach.sum(axis=0) * (1 + 1e-14)
        low, high = _out(C[0] - spread, C[1] + spread)
        return Slope((np.fmax(V[0], low), np.fmin(V[1], high)), C, S)

    def add(self, u: Slope, v: Slope) -> Slope:
        return self.slope(_add(u.V, v.V), _add(u.C, v.C), _add(u.S, v.S))

    def sub(self, u: Slope, v: Slope) -> Slope:
        return self.slope(_sub(u.V, v.V), _sub(u.C, v.C), _sub(u.S, v.S))

    def mul(self, u: Slope, v: Slope) -> Slope:
        """Return the product: ``uv - u(c)v(c) = (u - u(c)) v + u(c) (v - v(c))``."""
        return self.slope(_mul(u.V, v.V), _mul(u.C, v.C), _add(_mul(u.S, v.V), _mul(u.C, v.S)))

    def div(self, u: Slope, v: Slope) -> Slope:
        """Return the quotient: ``u/v - u(c)/v(c) = ((u - u(c)) - u(c)/v(c) (v - v(c))) / v``."""
        inverse, ratio = _inverse(v.V), _mul(u.C, _inverse(v.C))
        return self.slope(_mul(u.V, inverse), ratio, _mul(_sub(u.S, _mul(ratio, v.S)), inverse))

    def scale(self, u: Slope, by: float) -> Slope:
        factor = (np.array(by), np.array(by))
        return Slope(_mul(u.V, factor), _mul(u.C, factor), _mul(u.S, factor))

    def square(self, u: Slope) -> Slope:
        return self.slope(_square(u.V), _square(u.C), _mul(_add(u.V, u.C), u.S))

    def sqrt(self, u: Slope) -> Slope:
        """Return the root; a difference of roots is that of the numbers over the sum of the roots."""
        V, C = _sqrt(u.V), _sqrt(u.C)
        return self.slope(V, C, _mul(u.S, _inverse(_add(V, C))))

    def smooth(self, u: Slope, function: Callable[[Ends], Ends], derivative: Callable[[Ends], Ends]) -> Slope:
        """Return f(u), by the mean value theorem: its slope is f' somewhere on the range, times the slope of u."""
        hull = np.minimum(u.V[0], u.C[0]), np.maximum(u.V[1], u.C[1])
        return self.slope(function(u.V), function(u.C), _mul(derivative(hull), u.S))

    def one(self) -> Slope:
        return self.constant(1.0)

    def ramp(self, u: Slope) -> Slope:
        """Return max(u, 0): a difference of it is that of u times a number from 0 to 1."""
        low, high = np.minimum(u.V[0], u.C[0]), np.maximum(u.V[1], u.C[1])
        part = np.where(low >= 0, 1.0, 0.0), np.where(high <= 0, 0.0, 1.0)
        V, C = ((np.maximum(ends[0], 0.0), np.maximum(ends[1], 0.0)) for ends in (u.V, u.C))
        return self.slope(V, C, _mul(u.S, part))

    def step(self, u: Slope) -> Slope:
        """Return 1 where u is not negative, else 0; where it is not known which, there is no slope."""
        V, C = ((np.where(ends[0] > 0, 1.0, 0.0), np.where(ends[1] < 0, 0.0, 1.0)) for ends in (u.V, u.C))
        defined = np.isfinite(u.V[0]) & np.isfinite(u.V[1])
        V = np.where(defined, V[0], np.nan), np.where(defined, V[1], np.nan)
        flat = np.broadcast_to(np.where(defined & (V[0] == V[1]), 0.0, np.nan), u.S[0].shape)
        return Slope(V, C, (flat, flat))

    def fmax(self, u: Slope, v: Slope) -> Slope:
        V, C = ((np.maximum(a[0], b[0]), np.maximum(a[1], b[1])) for a, b in ((u.V, v.V), (u.C, v.C)))
        return self.slope(V, C, self.add(v, self.ramp(self.sub(u, v))).S)

    def fmin(self, u: Slope, v: Slope) -> Slope:
        return self.scale(self.fmax(self.scale(u, -1.0), self.scale(v, -1.0)), -1.0)

    def sign(self, u: Slope) -> Slope:
        return self.sub(self.scale(self.step(u), 2.0), self.one())

    def fabs(self, u: Slope) -> Slope:
        return self.sub(self.scale(self.ramp(u), 2.0), u)

    def atan(self, u: Slope) -> Slope:
        return self.smooth(u, _ATAN, lambda x: _inverse(_add(_square(x), (np.array(1.0), np.array(1.0)))))

    def power(self, u: Slope, exponent: Slope) -> Slope:
        """Return a constant whole or half power."""
        power = float(exponent.V[0][0])
        if not (np.array_equal(*exponent.V) and (2 * power).is_integer() and 0 < abs(power) <= 64):
            raise UncoveredError("a power that is not constant, or not whole or half")
        base, left = (u, int(abs(power))) if power.is_integer() else (self.sqrt(u), int(abs(2 * power)))
        result: Slope | None = None
        while left:
            if left & 1:
                result = base if result is None else self.mul(result, base)
            left >>= 1
            base = self.square(base) if left else base
        positive = self.one() if result is None else result
        return positive if power > 0 else self.div(self.one(), positive)

    def asin(self, u: Slope) -> Slope:
        return self.atan(self.div(u, self.sqrt(self.sub(self.one(), self.square(u)))))

    def acos(self, u: Slope) -> Slope:
        return self.sub(self.scale(self.atan(self.one()), 2.0), self.asin(u))

    def atan2(self, y: Slope, x: Slope) -> Slope:
        """Return the angle off the negative x-axis, ``2 atan(y / (sqrt(x^2 + y^2) + x))``."""
        return self.scale(self.atan(self.div(y, self.add(self.hypot(y, x), x))), 2.0)

    def hypot(self, y: Slope, x: Slope) -> Slope:
        return self.sqrt(self.add(self.square(y), self.square(x)))

    def sin(self, u: Slope) -> Slope:
        return self.smooth(u, lambda x: _wave(x, np.sin), lambda x: _wave(x, np.cos))

    def cos(self, u: Slope) -> Slope:
        def slope(x: Ends) -> Ends:
            low, high = _wave(x, np.sin)
            return -high, -low

        return self.smooth(u, lambda x: _wave(x, np.cos), slope)


_UNARY: dict[int, Callable[[_Boxes, Slope], Slope]] = {
    ca.OP_ASSIGN: lambda _, u: u,
    ca.OP_NEG: lambda at, u: at.scale(u, -1.0),
    ca.OP_TWICE: lambda at, u: at.scale(u, 2.0),
    ca.OP_SQ: _Boxes.square,
    ca.OP_SQRT: _Boxes.sqrt,
    ca.OP_INV: lambda at, u: at.div(at.one(), u),
    ca.OP_SIN: _Boxes.sin,
    ca.OP_COS: _Boxes.cos,
    ca.OP_TAN: lambda at, u: at.div(at.sin(u), at.cos(u)),
    ca.OP_ATAN: _Boxes.atan,
    ca.OP_ASIN: _Boxes.asin,
    ca.OP_ACOS: _Boxes.acos,
    ca.OP_EXP: lambda at, u: at.smooth(u, _EXP, _EXP),
    ca.OP_FABS: _Boxes.fabs,
    ca.OP_SIGN: _Boxes.sign,
    ca.OP_LOG: lambda at, u: at.smooth(u, _log, _inverse),
}
_BINARY: dict[int, Callable[[_Boxes, Slope, Slope], Slope]] = {
    ca.OP_ADD: _Boxes.add,
    ca.OP_SUB: _Boxes.sub,
    ca.OP_MUL: _Boxes.mul,
    ca.OP_DIV: _Boxes.div,
    ca.OP_POW: _Boxes.power,
    ca.OP_CONSTPOW: _Boxes.power,
    ca.OP_ATAN2: _Boxes.atan2,
    ca.OP_HYPOT: _Boxes.hypot,
    ca.OP_FMAX: _Boxes.fmax,
    ca.OP_FMIN: _Boxes.fmin,
    ca.OP_LE: lambda at, u, v: at.step(at.sub(v, u)),
}
