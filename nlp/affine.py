"""Affine forms and intervals of a tape's results over many boxes at once, with rigorous rounding terms.

On the box ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, every value ``v`` of the tape is enclosed twice (J. Stolfi and
L. H. de Figueiredo, *Self-Validated Numerical Methods and Applications*, 1997; F. Messine, *Extensions of affine
arithmetic*, 2002):

    v(e) = c + sum_i a_i e_i + (an error of at most d),        lo <= v <= hi

and the interval is intersected with the range of the form at every operation. All arithmetic is in round to nearest;
each operation adds to ``d``, and to both ends, more than its roundings can have cost (the model is in
``docs/certificate.md``). A value that may be undefined somewhere in the box, or that overflows, is *poisoned*: its
``d`` and its ends are infinite, and everything computed from it is poisoned too.

This is the reference; ``_bounds.c`` does the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from screwsynth.nlp.instructions import Op, Tape

if TYPE_CHECKING:
    from screwsynth.models import FloatArray

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
        c: (R, B) centres.
        a: (R, n, B) coefficients.
        d: (R, B) bounds of the errors; infinite where a value is poisoned.
        lo, hi: (R, B) intervals.
    """

    c: FloatArray
    a: FloatArray
    d: FloatArray
    lo: FloatArray
    hi: FloatArray

    @classmethod
    def empty(cls, values: int, symbols: int, boxes: int) -> Forms:
        """Room for enclosures."""
        flat = [np.zeros((values, boxes)) for _ in range(4)]
        return cls(flat[0], np.zeros((values, symbols, boxes)), flat[1], flat[2], flat[3])


def midpoints(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centres and radii of boxes, (n, B) each: ``centre +- radius`` holds the box whatever rounding does."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    radius = np.maximum(upper - centre, centre - lower)
    return centre, np.where(radius > 0, radius * (1 + ULP) + TINY, 0.0)


def enclose(tape: Tape, lower: FloatArray, upper: FloatArray) -> Forms:
    """Enclosures of a tape's results over boxes.

    Args:
        tape: the instructions.
        lower, upper: (n, B) ends of the boxes.
    """
    centre, radius = midpoints(lower, upper)
    return _Machine(tape, tape.inputs, centre.shape[1]).run(centre, radius, lower, upper)


def evaluate(tape: Tape, points: FloatArray) -> Forms:
    """Enclosures of a tape's results at points (n, B): boxes without a symbol, so only rounding is left."""
    return _Machine(tape, 0, points.shape[1]).run(points, np.zeros_like(points), points, points)


class _Machine:
    """Runs a tape over B boxes with n symbols. Every rule's formula is beside it."""

    def __init__(self, tape: Tape, symbols: int, boxes: int) -> None:
        self.tape, self.symbols = tape, symbols
        self.work = Forms.empty(tape.registers, symbols, boxes)
        self.rad = np.zeros((tape.registers, boxes))
        self.out = Forms.empty(tape.outputs, symbols, boxes)
        # An operation makes about n + 4 roundings of each of its terms.
        self.slack = (symbols + 8) * ULP

    def run(self, centre: FloatArray, radius: FloatArray, lower: FloatArray, upper: FloatArray) -> Forms:
        tape, work = self.tape, self.work
        with np.errstate(all="ignore"):
            for op, to, a, b, k, first, last in zip(
                tape.op.tolist(),
                tape.to.tolist(),
                tape.a.tolist(),
                tape.b.tolist(),
                tape.k.tolist(),
                tape.first.tolist(),
                tape.last.tolist(),
                strict=True,
            ):
                span = slice(first, last) if self.symbols else slice(0, 0)
                if op == Op.OUTPUT:
                    out = self.out
                    out.c[to], out.a[to], out.d[to] = work.c[a], work.a[a], work.d[a]
                    out.lo[to], out.hi[to] = work.lo[a], work.hi[a]
                elif op == Op.INPUT:
                    work.a[to] = 0.0
                    work.c[to], work.d[to] = centre[a], 0.0
                    work.lo[to], work.hi[to] = lower[a], upper[a]
                    self.rad[to] = 0.0
                    if self.symbols:
                        work.a[to, a] = radius[a]
                        self.rad[to] = radius[a]
                elif op == Op.CONSTANT:
                    work.c[to] = work.lo[to] = work.hi[to] = k
                    work.a[to] = work.d[to] = self.rad[to] = 0.0
                else:
                    self._step(op, to, a, b, k, span)
        return self.out

    def _step(self, op: int, to: int, x: int, y: int, k: float, span: slice) -> None:
        if op in (Op.ADD, Op.SUB):
            self._sum(op, to, x, y, span)
        elif op == Op.MUL:
            self._product(to, x, y, span)
        elif op == Op.DIV:
            self._quotient(to, x, y, span)
        elif op == Op.SHIFT:
            lo, hi = _widened(self.work.lo[x] + k, self.work.hi[x] + k)
            c = self.work.c[x] + k
            d = self.work.d[x] + self.slack * np.abs(c)
            self._settle(to, c, self.work.a[x, span], d, lo, hi, span)
        elif op == Op.SCALE:
            self._scaled(to, x, k, span)
        elif op == Op.SQUARE:
            self._square(to, x, span)
        else:
            self._univariate(op, to, x, span)

    def _sum(self, op: int, to: int, x: int, y: int, span: slice) -> None:
        w = self.work
        combine = np.add if op == Op.ADD else np.subtract
        low, high = (w.lo[y], w.hi[y]) if op == Op.ADD else (w.hi[y], w.lo[y])
        lo, hi = _widened(combine(w.lo[x], low), combine(w.hi[x], high))
        c, a = combine(w.c[x], w.c[y]), combine(w.a[x, span], w.a[y, span])
        d = w.d[x] + w.d[y] + self.slack * (np.abs(c) + self.rad[x] + self.rad[y])
        self._settle(to, c, a, d, lo, hi, span)

    def _scaled(self, to: int, x: int, k: float, span: slice) -> None:
        """Times a constant; by 1 or -1 nothing is rounded."""
        w = self.work
        if abs(k) == 1:
            lo, hi = (w.lo[x], w.hi[x]) if k > 0 else (-w.hi[x], -w.lo[x])
            self._settle(to, w.c[x] * k, w.a[x, span] * k, w.d[x], lo, hi, span)
            return
        one, other = w.lo[x] * k, w.hi[x] * k
        lo, hi = (one, other) if k >= 0 else (other, one)
        lo, hi = _widened(lo, hi, TINY)
        c, a = w.c[x] * k, w.a[x, span] * k
        d = w.d[x] * abs(k)
        self._settle(to, c, a, d + (self.slack * (np.abs(c) + abs(k) * self.rad[x]) + TINY), lo, hi, span)

    def _product(self, to: int, x: int, y: int, span: slice) -> None:
        """``(c + a e)(c' + a' e)``, with ``e_i^2`` in [0, 1]: half of each ``a_i a'_i`` goes to the centre."""
        w = self.work
        cx, cy, ax, ay = w.c[x], w.c[y], w.a[x, span], w.a[y, span]
        products = ax * ay
        c = cx * cy + 0.5 * products.sum(axis=0)
        a = cx * ay + cy * ax
        px, py = np.abs(cx), np.abs(cy)
        rx, ry = self.rad[x] + w.d[x], self.rad[y] + w.d[y]
        d = px * w.d[y] + py * w.d[x] + (rx * ry - 0.5 * np.abs(products).sum(axis=0))
        d += self.slack * ((px + rx) * (py + ry)) + TINY
        lo, hi = _interval_product(w.lo[x], w.hi[x], w.lo[y], w.hi[y])
        self._settle(to, c, a, d, lo, hi, span)

    def _square(self, to: int, x: int, span: slice) -> None:
        w = self.work
        cx, ax = w.c[x], w.a[x, span]
        half = 0.5 * (ax * ax).sum(axis=0)
        px, rx = np.abs(cx), self.rad[x] + w.d[x]
        d = 2 * px * w.d[x] + (rx * rx - half) + (self.slack * ((px + rx) * (px + rx)) + TINY)
        one, other = np.abs(w.lo[x]), np.abs(w.hi[x])
        small, large = np.minimum(one, other), np.maximum(one, other)
        small = np.where((w.lo[x] <= 0) & (w.hi[x] >= 0), 0.0, small)
        lo, hi = small * small, large * large
        lo = np.maximum(lo - (lo * ULP + TINY), 0.0)
        self._settle(to, cx * cx + half, 2 * cx * ax, d, lo, hi + (hi * ULP + TINY), span)

    def _quotient(self, to: int, x: int, y: int, span: slice) -> None:
        """``q + (x - q y) / y`` with ``q`` the quotient of the centres, so that the numerator has no centre."""
        w = self.work
        low, high = w.lo[y], w.hi[y]
        sign = np.where(low > 0, 1.0, -1.0)
        near, far = np.where(low > 0, low, -high), np.where(low > 0, high, -low)
        near = np.where(near > 0, near, np.nan)  # an interval with 0 in it has no inverse
        # Least and largest of 1/y - slope y on [near, far]: at the geometric mean, and at both ends.
        slope = -1.0 / (near * far)
        least, most = 2.0 / np.sqrt(near * far), 1.0 / near + 1.0 / far
        shift, off = 0.5 * (least + most), np.maximum(0.5 * (most - least), 0.0) + 16 * ULP * most
        ci = slope * w.c[y] + sign * shift
        ai = slope * w.a[y, span]
        pi, ri = np.abs(slope) * np.abs(w.c[y]) + shift, np.abs(slope) * self.rad[y]
        di = np.abs(slope) * w.d[y] + off + (self.slack * (pi + ri) + TINY)
        q = w.c[x] / w.c[y]
        an = w.a[x, span] - q * w.a[y, span]
        size = np.abs(w.c[x]) + self.rad[x] + np.abs(q) * (np.abs(w.c[y]) + self.rad[y])
        dn = w.d[x] + np.abs(q) * w.d[y] + (self.slack * size + TINY)
        products = an * ai
        c, a = q + 0.5 * products.sum(axis=0), ci * an
        rn, ri = np.abs(an).sum(axis=0) * (1 + self.slack) + dn, ri * (1 + self.slack) + di
        d = np.abs(ci) * dn + (rn * ri - 0.5 * np.abs(products).sum(axis=0))
        d += self.slack * (np.abs(q) + (np.abs(ci) + ri) * rn) + TINY
        one, other = sign / far, sign / near
        inverse = _widened(np.minimum(one, other), np.maximum(one, other), TINY)
        lo, hi = _interval_product(w.lo[x], w.hi[x], *inverse)
        self._settle(to, c, a, d, lo, hi, span)

    def _univariate(self, op: int, to: int, x: int, span: slice) -> None:
        """``f(v)`` within ``shift + slope v +- off`` on the interval of ``v``."""
        w = self.work
        slope, shift, off, lo, hi = _RULES[Op(op)](w.lo[x], w.hi[x])
        c, a = slope * w.c[x] + shift, slope * w.a[x, span]
        steep = np.abs(slope)
        size = steep * (np.abs(w.c[x]) + self.rad[x] + w.d[x]) + np.abs(shift) + off
        d = steep * w.d[x] + off + (self.slack * size + TINY)
        self._settle(to, c, a, d, lo, hi, span)

    def _settle(
        self, to: int, c: FloatArray, a: FloatArray, d: FloatArray, lo: FloatArray, hi: FloatArray, span: slice
    ) -> None:
        """Write a register: poison what has no finite enclosure, intersect the interval with the form's range."""
        w = self.work
        rad = np.abs(a).sum(axis=0)
        # The terms of d, and the sum of |a|, were themselves rounded.
        d = d * (1 + self.slack)
        reach = (rad + d) * (1 + self.slack)
        good = (reach < np.inf) & (np.abs(c) < np.inf)
        poisoned = not good.all()
        if poisoned:
            c, d, rad = np.where(good, c, 0.0), np.where(good, d, np.inf), np.where(good, rad, 0.0)
            a, reach = np.where(good, a, 0.0), np.where(good, reach, np.inf)
        ends = ULP * np.abs(c)
        low, high = c - (reach + ends), c + (reach + ends)
        if poisoned:
            lo, hi = np.where(good, lo, -np.inf), np.where(good, hi, np.inf)
        # The operand's own memory may be the target: the coefficients are written first.
        w.a[to, span] = a
        w.a[to, : span.start] = 0.0
        w.a[to, span.stop :] = 0.0
        w.c[to], w.d[to], self.rad[to] = c, d, rad
        # fmax and fmin: an end that is NaN says nothing.
        w.lo[to], w.hi[to] = np.fmax(lo, low), np.fmin(hi, high)


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


Rule = tuple["FloatArray", "FloatArray", "FloatArray", "FloatArray", "FloatArray"]


def _sqrt(lo: FloatArray, hi: FloatArray) -> Rule:
    """Least and largest of sqrt(v) - slope v: at both ends, and at ``1 / (4 slope^2)``. NaN below 0."""
    low, high = np.sqrt(lo), np.sqrt(hi)
    slope = 1.0 / (low + high)
    least, most = low * high * slope, 0.25 * (low + high)
    off = np.maximum(0.5 * (most - least), 0.0) + 16 * ULP * high
    return slope, 0.5 * (least + most), off, *_widened(low, high)


def _taylor(
    lo: FloatArray, hi: FloatArray, value: FloatArray, slope: FloatArray, curvature: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Slope, shift and error of ``f(m) + f'(m)(v - m) + f''(..) (v - m)^2 / 2`` on [lo, hi], m its middle."""
    middle, radius = _middle(lo, hi)
    half = 0.5 * radius * radius
    least, most = np.minimum(half * curvature[0], 0.0), np.maximum(half * curvature[1], 0.0)
    shift = value - slope * middle + 0.5 * (least + most)
    size = np.abs(value) + np.abs(slope) * (np.abs(middle) + radius) + (most - least)
    return slope, shift, 0.5 * (most - least) + 2 * LIBRARY * ULP * size


def _middle(lo: FloatArray, hi: FloatArray) -> tuple[FloatArray, FloatArray]:
    middle = 0.5 * lo + 0.5 * hi
    return middle, np.maximum(hi - middle, middle - lo) * (1 + ULP) + TINY


def _wave(lo: FloatArray, hi: FloatArray, shifted: bool) -> Rule:
    """Sine, or cosine. Near the middle m it stays within ``|f'(m)| r + r^2 / 2`` of its value there."""
    middle, radius = _middle(lo, hi)
    sine, cosine = np.sin(middle), np.cos(middle)
    value, slope = (cosine, -sine) if shifted else (sine, cosine)
    spread = np.abs(slope) * radius + 0.5 * radius * radius
    spread = spread + (2 * LIBRARY * ULP) * (1 + spread)
    least, most = np.maximum(value - spread, -1.0), np.minimum(value + spread, 1.0)
    slope, shift, off = _taylor(lo, hi, value, slope, (-most, -least))
    # The slope is off by roundings of order 1, not of its own size.
    return slope, shift, off + (2 * LIBRARY * ULP) * (1 + radius), least, most


def _exp(lo: FloatArray, hi: FloatArray) -> Rule:
    middle, _ = _middle(lo, hi)
    value, low, high = np.exp(middle), np.exp(lo), np.exp(hi)
    least, most = np.maximum(low * (1 - LIBRARY * ULP) - TINY, 0.0), high * (1 + LIBRARY * ULP) + TINY
    # The argument's own rounding does not count: the value is taken at the double.
    return *_taylor(lo, hi, value, value, (least, most)), least, most


def _log(lo: FloatArray, hi: FloatArray) -> Rule:
    """Logarithm; NaN unless the whole interval is positive."""
    lo = np.where(lo > 0, lo, np.nan)
    middle, _ = _middle(lo, hi)
    low, high = np.log(lo), np.log(hi)
    curved = 1 + LIBRARY * ULP
    least, most = -curved / (lo * lo), -1 / (curved * hi * hi)
    slope, shift, off = _taylor(lo, hi, np.log(middle), 1 / middle, (least, most))
    ends = LIBRARY * ULP
    return slope, shift, off, low - (np.abs(low) * ends + TINY), high + (np.abs(high) * ends + TINY)


def _atan(lo: FloatArray, hi: FloatArray) -> Rule:
    """Arc tangent; its second derivative ``-2 v / (1 + v^2)^2`` is at most 0.6496 in size, and has the sign of -v."""
    middle, _ = _middle(lo, hi)
    low, high = np.arctan(lo), np.arctan(hi)
    most = np.where(lo >= 0, 0.0, np.minimum(0.65, -2 * lo * (1 + ULP)))
    least = np.where(hi <= 0, 0.0, np.maximum(-0.65, -2 * hi * (1 + ULP)))
    slope, shift, off = _taylor(lo, hi, np.arctan(middle), 1 / (1 + middle * middle), (least, most))
    ends = LIBRARY * ULP
    return slope, shift, off, low - (np.abs(low) * ends + TINY), high + (np.abs(high) * ends + TINY)


_RULES = {
    Op.SQRT: _sqrt,
    Op.SIN: lambda lo, hi: _wave(lo, hi, shifted=False),
    Op.COS: lambda lo, hi: _wave(lo, hi, shifted=True),
    Op.EXP: _exp,
    Op.LOG: _log,
    Op.ATAN: _atan,
}
