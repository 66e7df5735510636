"""Taylor forms and intervals of a tape's results over many boxes at once, with rigorous rounding terms.

On the box ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, every value ``v`` of the tape is enclosed twice: for ``0 <= t <= 1``

    v(t e) in c + t sum_i a_i e_i + t^2 [p, q] +- s        and        lo <= v <= hi,

where ``c`` is its value at the centre, ``a`` its scaled gradient there, ``[p, q]`` holds 0 and everything of second
order (that it shrinks with ``t^2`` is what makes the gradient's forms a third as wrong when they are integrated along a
ray), and ``s`` is what rounding may have done. The interval is intersected with the form's range at every operation.
These are Taylor models of first order (M. Berz and K. Makino, *Verified integration of ODEs and flows using
differential algebraic methods on high-order Taylor models*, Reliable Computing 4 (1998)) with the products bounded as
in affine arithmetic (J. Stolfi and L. H. de Figueiredo, 1997; F. Messine, *Extensions of affine arithmetic*, 2002).

All arithmetic is in round to nearest; each operation adds to ``s``, and to both ends, more than its roundings can have
cost (the model is in ``docs/certificate.md``). A value that may be undefined somewhere in the box, or that overflows,
is *poisoned*: its ``s`` and its ends are infinite, and everything computed from it is poisoned too.

This is the reference; ``_bounds.c`` does the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .instructions import Op, Tape

if TYPE_CHECKING:
    from ...models import FloatArray

#: Four times the rounding unit 2^-53: what an end of an interval moves outwards per operation, in parts of itself.
ULP = 2.0**-51
#: More than what underflow can cost an operation. Additions are exact there.
TINY = 1e-300
#: Error, in parts of 2^-51, of sine, cosine, exponential, logarithm and arc tangent as libraries compute them.
LIBRARY = 8.0


@dataclass(eq=False)
class Forms:
    """Enclosures of R values over B boxes.

    Attributes:
        c: (R, B) values at the centres.
        a: (R, n, B) scaled gradients there.
        p, q: (R, B) least and largest of what is of second order, ``p <= 0 <= q``.
        s: (R, B) rounding errors; infinite where a value is poisoned.
        lo, hi: (R, B) intervals.
    """

    c: FloatArray
    a: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    lo: FloatArray
    hi: FloatArray

    @classmethod
    def empty(cls, values: int, symbols: int, boxes: int) -> Forms:
        """Room for enclosures."""
        c, p, q, s, lo, hi = (np.zeros((values, boxes)) for _ in range(6))
        return cls(c, np.zeros((values, symbols, boxes)), p, q, s, lo, hi)


def midpoints(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centres and radii of boxes, (n, B) each: ``centre +- radius`` holds the box whatever rounding does."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    radius = np.maximum(upper - centre, centre - lower)
    return centre, np.where(radius > 0, radius * (1 + ULP) + TINY, 0.0)


def enclose(tape: Tape, lower: FloatArray, upper: FloatArray) -> Forms:
    """Enclosures of a tape's results over boxes.

    Args:
        tape: the instructions.
        lower: (n, B) ends of the boxes.
        upper: (n, B) ends of the boxes.
    """
    centre, radius = midpoints(lower, upper)
    with np.errstate(all="ignore"):
        return _Machine(tape, centre.shape[1]).run(centre, radius, lower, upper)


class _Result(NamedTuple):
    """A form and an interval before they are settled; ``a`` covers the instruction's span of variables."""

    c: FloatArray
    a: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    lo: FloatArray
    hi: FloatArray


class _Machine:
    """Runs a tape over B boxes."""

    def __init__(self, tape: Tape, boxes: int) -> None:
        self.tape = tape
        self.work = Forms.empty(tape.registers, tape.inputs, boxes)
        self.rad = np.zeros((tape.registers, boxes))
        self.out = Forms.empty(tape.outputs, tape.inputs, boxes)
        # An operation makes about n + 4 roundings of each of its terms.
        self.slack = (tape.inputs + 8) * ULP

    def run(self, centre: FloatArray, radius: FloatArray, lower: FloatArray, upper: FloatArray) -> Forms:
        tape, work, out = self.tape, self.work, self.out
        columns = (tape.op, tape.to, tape.a, tape.b, tape.k, tape.first, tape.last)
        for op, to, a, b, k, first, last in zip(*(column.tolist() for column in columns), strict=True):
            if op == Op.OUTPUT:
                for target, source in zip(vars(out).values(), vars(work).values(), strict=True):
                    target[to] = source[a]
            elif op == Op.INPUT:
                for target in vars(work).values():
                    target[to] = 0.0
                work.c[to], work.lo[to], work.hi[to] = centre[a], lower[a], upper[a]
                work.a[to, a] = self.rad[to] = radius[a]
            elif op == Op.CONSTANT:
                for target in vars(work).values():
                    target[to] = 0.0
                work.c[to] = work.lo[to] = work.hi[to] = k
                self.rad[to] = 0.0
            else:
                span = slice(first, last)
                self._settle(to, self._step(op, a, b, k, span), span)
        return out

    def _step(self, op: int, x: int, y: int, k: float, span: slice) -> _Result:  # noqa: PLR0911 - one for each rule
        if op in (Op.ADD, Op.SUB):
            return self._sum(op, x, y, span)
        if op == Op.MUL:
            return self._product(x, y, span)
        if op == Op.DIV:
            return self._quotient(x, y, span)
        if op == Op.SQUARE:
            return self._square(x, span)
        if op == Op.SCALE:
            return self._scaled(x, k, span)
        w = self.work
        if op == Op.SHIFT:
            c = w.c[x] + k
            lo, hi = _widened(w.lo[x] + k, w.hi[x] + k)
            return _Result(c, w.a[x, span], w.p[x], w.q[x], w.s[x] + self.slack * np.abs(c), lo, hi)
        return self._univariate(op, x, span)

    def _sum(self, op: int, x: int, y: int, span: slice) -> _Result:
        w = self.work
        combine = np.add if op == Op.ADD else np.subtract
        p, q, low, high = w.p[y], w.q[y], w.lo[y], w.hi[y]
        if op == Op.SUB:
            p, q, low, high = q, p, high, low
        c = combine(w.c[x], w.c[y])
        s = w.s[x] + w.s[y] + self.slack * (np.abs(c) + self.rad[x] + self.rad[y])
        ends = _widened(combine(w.lo[x], low), combine(w.hi[x], high))
        return _Result(c, combine(w.a[x, span], w.a[y, span]), combine(w.p[x], p), combine(w.q[x], q), s, *ends)

    def _scaled(self, x: int, k: float, span: slice) -> _Result:
        """Times a constant; by 1 or -1 nothing is rounded."""
        w, size = self.work, abs(k)
        c, a = w.c[x] * k, w.a[x, span] * k
        p, q = (w.p[x] * k, w.q[x] * k) if k >= 0 else (w.q[x] * k, w.p[x] * k)
        lo, hi = (w.lo[x] * k, w.hi[x] * k) if k >= 0 else (w.hi[x] * k, w.lo[x] * k)
        if size == 1:
            return _Result(c, a, p, q, w.s[x], lo, hi)
        s = w.s[x] * size + (self.slack * (np.abs(c) + size * self.rad[x]) + TINY)
        return _Result(c, a, p, q, s, *_widened(lo, hi, TINY))

    def _product(self, x: int, y: int, span: slice) -> _Result:
        w = self.work
        cx, cy, ax, ay = w.c[x], w.c[y], w.a[x, span], w.a[y, span]
        p, q, big, other = self._second_order(
            (cx, ax, self.rad[x], w.p[x], w.q[x]), (cy, ay, self.rad[y], w.p[y], w.q[y])
        )
        s = (big * w.s[y] + other * w.s[x] + w.s[x] * w.s[y]) + (self.slack * (big * other) + TINY)
        ends = _interval_product(w.lo[x], w.hi[x], w.lo[y], w.hi[y])
        return _Result(cx * cy, cx * ay + cy * ax, p, q, s, *ends)

    @staticmethod
    def _second_order(one: Part, other: Part) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """What is of second order in a product of two forms, and the size of each factor.

        The product of the linear parts is bounded twice: ``e_i^2`` lies in [0, 1]; and
        ``4 A B = (A + B)^2 - (A - B)^2``, with both scaled to the same size.
        """
        (cx, ax, rx, px, qx), (cy, ay, ry, py, qy) = one, other
        products = ax * ay
        sizes = np.abs(products).sum(axis=0)
        balance = products.sum(axis=0)
        both = rx * ry
        cross = both - sizes
        most, least = 0.5 * (sizes + balance) + cross, 0.5 * (sizes - balance) + cross
        first, second = ax * ry, ay * rx
        plus, minus = np.abs(first + second).sum(axis=0), np.abs(first - second).sum(axis=0)
        quarter = 0.25 / np.where(both > 0, both, 1.0)
        most, least = np.minimum(most, plus * plus * quarter), np.minimum(least, minus * minus * quarter)
        mx, my = np.maximum(-px, qx), np.maximum(-py, qy)
        mixed = rx * my + ry * mx + mx * my
        p = np.minimum(cx * py, cx * qy) + np.minimum(cy * px, cy * qx) - (least + mixed)
        q = np.maximum(cx * py, cx * qy) + np.maximum(cy * px, cy * qx) + (most + mixed)
        return p, q, np.abs(cx) + rx + mx, np.abs(cy) + ry + my

    def _square(self, x: int, span: slice) -> _Result:
        """The square of the linear part is not negative."""
        w = self.work
        c, rad, p, q, s = w.c[x], self.rad[x], w.p[x], w.q[x], w.s[x]
        m = np.maximum(-p, q)
        mixed = 2 * rad * m + m * m
        low, high = np.minimum(2 * c * p, 2 * c * q) - mixed, np.maximum(2 * c * p, 2 * c * q) + (rad * rad + mixed)
        big = np.abs(c) + rad + m
        error = 2 * big * s + s * s + (self.slack * (big * big) + TINY)
        one, other = np.abs(w.lo[x]), np.abs(w.hi[x])
        small, large = np.minimum(one, other), np.maximum(one, other)
        small = np.where((w.lo[x] <= 0) & (w.hi[x] >= 0), 0.0, small)
        lo, hi = small * small, large * large
        lo = np.maximum(lo - (lo * ULP + TINY), 0.0)
        return _Result(c * c, 2 * c * w.a[x, span], low, high, error, lo, hi + (hi * ULP + TINY))

    def _quotient(self, x: int, y: int, span: slice) -> _Result:
        """``k + (x - k y) / y`` with ``k`` the quotient of the centres, so that the numerator has no centre.

        ``1 / (c + Y) = 1 / c - Y / c^2 + Y^2 / (c^2 (c + Y))``.
        """
        w = self.work
        low, high, c = w.lo[y], w.hi[y], w.c[y]
        positive = low > 0
        near, far = np.where(positive, low, -high), np.where(positive, high, -low)
        near = np.where(near > 0, near, np.nan)  # an interval with 0 in it has no inverse
        sign = np.where(positive, 1.0, -1.0)
        my = np.maximum(-w.p[y], w.q[y])
        inverse = 1.0 / c
        steep = inverse * inverse
        moved = self.rad[y] + my
        curved = moved * moved * steep / near
        pi, qi = -steep * w.q[y], -steep * w.p[y]
        pi, qi = np.where(positive, pi, pi - curved), np.where(positive, qi + curved, qi)
        ri = steep * self.rad[y]
        size = np.abs(inverse) + ri + np.maximum(-pi, qi)
        si = w.s[y] * steep * (1 + (2 * moved + w.s[y]) / near) + (self.slack * size + TINY)
        k = w.c[x] / c
        steepness = np.abs(k)
        an = w.a[x, span] - k * w.a[y, span]
        pn = w.p[x] - np.where(k >= 0, k * w.q[y], k * w.p[y])
        qn = w.q[x] - np.where(k >= 0, k * w.p[y], k * w.q[y])
        whole = np.abs(w.c[x]) + self.rad[x] + steepness * (np.abs(c) + self.rad[y])
        sn = w.s[x] + steepness * w.s[y] + (self.slack * whole + TINY)
        rn = np.abs(an).sum(axis=0)
        nothing = np.zeros_like(k)
        p, q, big, other = self._second_order((nothing, an, rn, pn, qn), (inverse, -steep * w.a[y, span], ri, pi, qi))
        s = big * si + other * sn + sn * si + (self.slack * (np.abs(k) + big * other) + TINY)
        one, two = sign / far, sign / near
        ends = _widened(np.minimum(one, two), np.maximum(one, two), TINY)
        return _Result(k, inverse * an, p, q, s, *_interval_product(w.lo[x], w.hi[x], *ends))

    def _univariate(self, op: int, x: int, span: slice) -> _Result:
        """``f(c) + f'(c) Y + [least, most] Y^2``, where the bracket holds ``f'' / 2`` on the interval."""
        w = self.work
        c = w.c[x]
        # The centre as it was rounded may lie outside of a narrow interval.
        value, slope, least, most, error, lo, hi = _RULES[Op(op)](c, np.minimum(w.lo[x], c), np.maximum(w.hi[x], c))
        moved = self.rad[x] + np.maximum(-w.p[x], w.q[x])
        square = moved * moved
        p = np.minimum(slope * w.p[x], slope * w.q[x]) + np.minimum(least * square, 0.0)
        q = np.maximum(slope * w.p[x], slope * w.q[x]) + np.maximum(most * square, 0.0)
        steep = np.abs(slope) + 2 * np.maximum(np.abs(least), np.abs(most)) * (moved + w.s[x])
        size = np.abs(slope) * moved + np.abs(value)
        s = steep * w.s[x] + error * (1 + moved) + (self.slack * size + TINY)
        return _Result(value, slope * w.a[x, span], p, q, s, lo, hi)

    def _settle(self, to: int, made: _Result, span: slice) -> None:
        """Write a register: poison what has no finite enclosure, intersect the interval with the form's range."""
        w, (c, a, p, q, s, lo, hi) = self.work, made
        rad = np.abs(a).sum(axis=0)
        # The terms of p, q and s, and the sum of |a|, were themselves rounded.
        grown = 1 + self.slack
        p, q, s = np.minimum(p * grown, 0.0), np.maximum(q * grown, 0.0), s * grown
        ends = ULP * np.abs(c) + s
        down, up = (rad - p + ends) * grown, (rad + q + ends) * grown
        good = (down < np.inf) & (up < np.inf) & (np.abs(c) < np.inf)
        low, high = c - down, c + up
        low, high = low - ULP * np.abs(low), high + ULP * np.abs(high)
        if not good.all():
            c, p, q, rad = (np.where(good, each, 0.0) for each in (c, p, q, rad))
            a, s = np.where(good, a, 0.0), np.where(good, s, np.inf)
            lo, low = np.where(good, lo, -np.inf), np.where(good, low, -np.inf)
            hi, high = np.where(good, hi, np.inf), np.where(good, high, np.inf)
        # The operand's own memory may be the target: the coefficients are written first.
        w.a[to, span] = a
        w.a[to, : span.start] = 0.0
        w.a[to, span.stop :] = 0.0
        w.c[to], w.p[to], w.q[to], w.s[to], self.rad[to] = c, p, q, s, rad
        # fmax and fmin: an end that is NaN says nothing.
        w.lo[to], w.hi[to] = np.fmax(lo, low), np.fmin(hi, high)


if TYPE_CHECKING:
    #: Centre, linear part, its size, least and largest of second order.
    Part = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    #: Value and slope at the centre, least and largest of half the second derivative, error, ends.
    Rule = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


def _widened(lo: FloatArray, hi: FloatArray, tiny: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Ends that were rounded to nearest, moved outwards."""
    return lo - (np.abs(lo) * ULP + tiny), hi + (np.abs(hi) * ULP + tiny)


def _interval_product(
    lo: FloatArray, hi: FloatArray, other_lo: FloatArray, other_hi: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Interval product, outwards; an end is NaN where infinity meets zero."""
    p, q, r, s = lo * other_lo, lo * other_hi, hi * other_lo, hi * other_hi
    least, most = np.minimum(np.minimum(p, q), np.minimum(r, s)), np.maximum(np.maximum(p, q), np.maximum(r, s))
    least, most = _widened(least, most, TINY)
    # Two factors that are not negative have no negative product, however far down it was rounded.
    return np.where((lo >= 0) & (other_lo >= 0), np.maximum(least, 0.0), least), most


#: What a library's function may be off by, in parts of its size.
_OFF = LIBRARY * ULP


def _sqrt(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """``sqrt(c + Y) = r + Y / (2 r) - Y^2 / (2 r (sqrt(c + Y) + r)^2)`` with ``r = sqrt(c)``. NaN below 0."""
    root, low, high = np.sqrt(c), np.sqrt(lo), np.sqrt(hi)
    slope = 0.5 / root
    least, most = -slope / ((low + root) * (low + root)), -slope / ((high + root) * (high + root))
    # The slope's own rounding is in parts of slope * |Y|, which the general term covers.
    return root, slope, least, most, _OFF * root, *_widened(low, high)


def _wave(c: FloatArray, lo: FloatArray, hi: FloatArray, shifted: bool) -> Rule:
    """Sine, or cosine. Within r of the middle it stays within ``|f'| r + r^2 / 2`` of its value there."""
    middle = 0.5 * lo + 0.5 * hi
    radius = np.maximum(hi - middle, middle - lo) * (1 + ULP) + TINY
    centred = np.cos(middle) if shifted else np.sin(middle)
    steep = np.abs(np.sin(middle)) if shifted else np.abs(np.cos(middle))
    spread = steep * radius + 0.5 * radius * radius
    spread = spread + 2 * _OFF * (1 + spread)
    least, most = np.maximum(centred - spread, -1.0), np.minimum(centred + spread, 1.0)
    sine, cosine = np.sin(c), np.cos(c)
    value, slope = (cosine, -sine) if shifted else (sine, cosine)
    # The second derivative is minus the function; errors are of order 1, not of the value's own size.
    return value, slope, -0.5 * most, -0.5 * least, np.full_like(c, 4 * _OFF), least, most


def _exp(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    value, low, high = np.exp(c), np.exp(lo), np.exp(hi)
    least, most = np.maximum(low * (1 - _OFF) - TINY, 0.0), high * (1 + _OFF) + TINY
    return value, value, 0.5 * least, 0.5 * most, 2 * _OFF * value, least, most


def _log(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Logarithm; NaN unless the whole interval is positive."""
    lo = np.where(lo > 0, lo, np.nan)
    low, high, value, slope = np.log(lo), np.log(hi), np.log(c), 1 / c
    grown = 1 + _OFF
    ends = low - (np.abs(low) * _OFF + TINY), high + (np.abs(high) * _OFF + TINY)
    return value, slope, -0.5 * grown / (lo * lo), -0.5 / (grown * hi * hi), 2 * _OFF * (np.abs(value) + slope), *ends


def _atan(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Arc tangent; its second derivative ``-2 v / (1 + v^2)^2`` is at most 0.6496 in size, and has the sign of -v."""
    low, high, value = np.arctan(lo), np.arctan(hi), np.arctan(c)
    most = np.where(lo >= 0, 0.0, np.minimum(0.325, -lo * (1 + ULP)))
    least = np.where(hi <= 0, 0.0, np.maximum(-0.325, -hi * (1 + ULP)))
    ends = low - (np.abs(low) * _OFF + TINY), high + (np.abs(high) * _OFF + TINY)
    return value, 1 / (1 + c * c), least, most, 2 * _OFF * (np.abs(value) + 1), *ends


_RULES = {
    Op.SQRT: _sqrt,
    Op.SIN: lambda c, lo, hi: _wave(c, lo, hi, shifted=False),
    Op.COS: lambda c, lo, hi: _wave(c, lo, hi, shifted=True),
    Op.EXP: _exp,
    Op.LOG: _log,
    Op.ATAN: _atan,
}
