"""Enclosures of a tape's results over many boxes at once: Taylor forms and intervals with rigorous rounding terms.

:mod:`screwsynth.nlp.proof.enclosure.forms` states both. The interval is intersected with the form's range at every
operation. All arithmetic is in round to nearest; each operation adds more to ``s``, and to both ends, than its
roundings can cost (see ``docs/certificate.md``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from screwsynth.nlp.proof.enclosure.tape import Op, Tape

from .intervals import LARGEST, TINY, ULP, interval_product, midpoints, widen
from .univariate import RULES

if TYPE_CHECKING:
    from screwsynth.models import FloatArray


@dataclass(eq=False)
class Enclosures:
    """Enclosures of R values over B boxes.

    Attributes:
        c: (R, B) values at the centres.
        a: (R, n, B) scaled gradients there; in forms of second order, coefficients of pairs of variables follow.
        p, q: (R, B) least and largest sum of the terms of second order, ``p <= 0 <= q``, or of what is left of them.
        s: (R, B) bounds of the rounding errors; infinite where a value is poisoned.
        lo, hi: (R, B) intervals.
    """

    c: FloatArray
    a: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    lo: FloatArray
    hi: FloatArray


def zeros(values: int, symbols: int, boxes: int) -> Enclosures:
    """Return enclosures of zero, to be written to."""
    c, p, q, s, lo, hi = (np.zeros((values, boxes)) for _ in range(6))
    return Enclosures(c, np.zeros((values, symbols, boxes)), p, q, s, lo, hi)


def enclose(tape: Tape, lower: FloatArray, upper: FloatArray) -> Enclosures:
    """Return enclosures of a tape's results over boxes.

    Args:
        tape: the instructions.
        lower: (n, B) lower ends of the boxes.
        upper: (n, B) upper ends of the boxes.
    """
    centre, radius = midpoints(lower, upper)
    with np.errstate(all="ignore"):
        return _Interpreter(tape, centre.shape[1]).run(centre, radius, lower, upper)


class _Result(NamedTuple):
    """A form and an interval before their intersection; ``a`` covers the instruction's span of variables."""

    c: FloatArray
    a: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    lo: FloatArray
    hi: FloatArray


def _linear_product(a: FloatArray, ra: FloatArray, b: FloatArray, rb: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the range of the product of two linear parts (n, B), whose sums of sizes are ``ra`` and ``rb``.

    It has two bounds: ``e_i^2`` lies in [0, 1]; and ``4 A B = (A + B)^2 - (A - B)^2``, with both scaled to one size.
    """
    products = a * b
    sizes = np.abs(products).sum(axis=0)
    balance = products.sum(axis=0)
    both = ra * rb
    cross = both - sizes
    most, least = 0.5 * (sizes + balance) + cross, 0.5 * (sizes - balance) + cross
    plus, minus = np.abs(a * rb + b * ra).sum(axis=0), np.abs(a * rb - b * ra).sum(axis=0)
    quarter = 0.25 / np.where(both > 0, both, 1.0)
    # In this order: the square of a sum may underflow.
    return -np.minimum(least, minus * (minus * quarter)), np.minimum(most, plus * (plus * quarter))


class _Interpreter:
    """A tape's registers over B boxes, and the rule of each operation."""

    def __init__(self, tape: Tape, boxes: int) -> None:
        self.tape = tape
        self.work = zeros(tape.registers, tape.inputs, boxes)
        self.rad = np.zeros((tape.registers, boxes))
        self.out = zeros(tape.outputs, tape.inputs, boxes)
        # An operation makes about n + 4 roundings of each of its terms.
        self.slack = (tape.inputs + 8) * ULP

    def run(self, centre: FloatArray, radius: FloatArray, lower: FloatArray, upper: FloatArray) -> Enclosures:
        """Run the tape over boxes, (n, B) each, and return its results."""
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
                self._write(to, self._apply(op, a, b, k, span), span)
        return out

    def _apply(self, op: int, x: int, y: int, k: float, span: slice) -> _Result:  # noqa: PLR0911 - one for each rule
        """Return the result of an operation on registers ``x`` and ``y`` and the constant ``k``."""
        if op in (Op.ADD, Op.SUB):
            return self._sum(op, x, y, span)
        if op == Op.MUL:
            return self._product(x, y, span)
        if op == Op.DIV:
            return self._quotient(x, y, span)
        if op == Op.SQUARE:
            return self._square(x, span)
        if op == Op.SCALE:
            return self._multiple(x, k, span)
        w = self.work
        if op == Op.SHIFT:
            c = w.c[x] + k
            lo, hi = widen(w.lo[x] + k, w.hi[x] + k)
            return _Result(c, w.a[x, span], w.p[x], w.q[x], w.s[x] + self.slack * np.abs(c), lo, hi)
        return self._univariate(op, x, span)

    def _sum(self, op: int, x: int, y: int, span: slice) -> _Result:
        """Return the sum or the difference of two registers."""
        w = self.work
        combine = np.add if op == Op.ADD else np.subtract
        p, q, low, high = w.p[y], w.q[y], w.lo[y], w.hi[y]
        if op == Op.SUB:
            p, q, low, high = q, p, high, low
        c = combine(w.c[x], w.c[y])
        s = w.s[x] + w.s[y] + self.slack * (np.abs(c) + self.rad[x] + self.rad[y])
        ends = widen(combine(w.lo[x], low), combine(w.hi[x], high))
        return _Result(c, combine(w.a[x, span], w.a[y, span]), combine(w.p[x], p), combine(w.q[x], q), s, *ends)

    def _multiple(self, x: int, k: float, span: slice) -> _Result:
        """Return a register times a constant; 1 and -1 cause no rounding."""
        w, size = self.work, abs(k)
        c, a = w.c[x] * k, w.a[x, span] * k
        p, q = (w.p[x] * k, w.q[x] * k) if k >= 0 else (w.q[x] * k, w.p[x] * k)
        lo, hi = (w.lo[x] * k, w.hi[x] * k) if k >= 0 else (w.hi[x] * k, w.lo[x] * k)
        if size == 1:
            return _Result(c, a, p, q, w.s[x], lo, hi)
        s = w.s[x] * size + (self.slack * (np.abs(c) + size * self.rad[x]) + TINY)
        return _Result(c, a, p, q, s, *widen(lo, hi, TINY))

    def _product(self, x: int, y: int, span: slice) -> _Result:
        """Return the product of two registers."""
        w, rx, ry = self.work, self.rad[x], self.rad[y]
        cx, cy, ax, ay = w.c[x], w.c[y], w.a[x, span], w.a[y, span]
        least, most = _linear_product(ax, rx, ay, ry)
        mx, my = self._rest(x), self._rest(y)
        mixed = rx * my + ry * mx + mx * my
        p = np.minimum(cx * w.p[y], cx * w.q[y]) + np.minimum(cy * w.p[x], cy * w.q[x]) + (least - mixed)
        q = np.maximum(cx * w.p[y], cx * w.q[y]) + np.maximum(cy * w.p[x], cy * w.q[x]) + (most + mixed)
        big, other = np.abs(cx) + rx + mx, np.abs(cy) + ry + my
        s = (big * w.s[y] + other * w.s[x] + w.s[x] * w.s[y]) + (self.slack * (big * other) + TINY)
        ends = interval_product(w.lo[x], w.hi[x], w.lo[y], w.hi[y])
        return _Result(cx * cy, cx * ay + cy * ax, p, q, s, *ends)

    def _rest(self, x: int) -> FloatArray:
        """Return the largest size of a register's terms of second order."""
        return np.maximum(-self.work.p[x], self.work.q[x])

    def _square(self, x: int, span: slice) -> _Result:
        """Return the square of a register; those of its linear part and of the rest are not negative."""
        w = self.work
        c, rad, p, q, s = w.c[x], self.rad[x], w.p[x], w.q[x], w.s[x]
        m = self._rest(x)
        mixed, square = 2 * rad * m, rad * rad + m * m
        low, high = np.minimum(2 * c * p, 2 * c * q) - mixed, np.maximum(2 * c * p, 2 * c * q) + (mixed + square)
        big = np.abs(c) + rad + m
        error = 2 * big * s + s * s + (self.slack * (big * big) + TINY)
        one, other = np.abs(w.lo[x]), np.abs(w.hi[x])
        small, large = np.minimum(one, other), np.maximum(one, other)
        small = np.where((w.lo[x] <= 0) & (w.hi[x] >= 0), 0.0, small)
        lo, hi = small * small, large * large
        lo = np.maximum(lo - (lo * ULP + TINY), 0.0)
        return _Result(c * c, 2 * c * w.a[x, span], low, high, error, lo, hi + (hi * ULP + TINY))

    def _quotient(self, x: int, y: int, span: slice) -> _Result:
        """Return ``x / y`` as ``P + (x - P y) / y``, where P is the quotient's polynomial of first order.

        ``x - P y`` has terms of second and higher order only.
        """
        w = self.work
        low, high, py, qy = w.lo[y], w.hi[y], w.p[y], w.q[y]
        positive = low > 0
        near, far = np.where(positive, low, -high), np.where(positive, high, -low)
        near = np.where(near > 0, near, np.nan)  # an interval with 0 in it has no inverse
        sign = np.where(positive, 1.0, -1.0)
        inverse, k, my = 1.0 / w.c[y], w.c[x] / w.c[y], self._rest(y)
        a = (w.a[x, span] - k * w.a[y, span]) * inverse
        moved = np.abs(a).sum(axis=0)
        least, most = _linear_product(a, moved, w.a[y, span], self.rad[y])
        p = w.p[x] - np.maximum(k * py, k * qy) - (most + moved * my)
        q = w.q[x] - np.minimum(k * py, k * qy) - (least - moved * my)
        whole, long, other = np.abs(k) + moved, np.abs(w.c[x]) + self.rad[x], np.abs(w.c[y]) + self.rad[y] + my
        s = w.s[x] + whole * w.s[y] + (self.slack * (long + whole * other) + TINY * (1 + other))
        s = s / near + (self.slack * whole + TINY)
        p, q = np.where(positive, p, -q) / near, np.where(positive, q, -p) / near
        one, two = sign / far, sign / near
        ends = widen(np.minimum(one, two), np.maximum(one, two), TINY)
        return _Result(k, a, p, q, s, *interval_product(w.lo[x], w.hi[x], *ends))

    def _univariate(self, op: int, x: int, span: slice) -> _Result:
        """Return a function of one variable as ``f(c) + f'(c) Y + [least, most] Y^2``."""
        w = self.work
        c = w.c[x]
        # The rounded centre may lie outside of a narrow interval.
        rule = RULES[Op(op)](c, np.minimum(w.lo[x], c), np.maximum(w.hi[x], c))
        value, slope, least, most, error, slope_error, lo, hi = rule
        moved = self.rad[x] + np.maximum(-w.p[x], w.q[x])
        square = moved * moved
        p = np.minimum(slope * w.p[x], slope * w.q[x]) + np.minimum(least * square, 0.0)
        q = np.maximum(slope * w.p[x], slope * w.q[x]) + np.maximum(most * square, 0.0)
        bent = np.maximum(np.abs(least), np.abs(most))
        steep = np.abs(slope) + 2 * bent * (moved + w.s[x])
        size = np.abs(slope) * moved + np.abs(value)
        error = error + slope_error * moved + TINY * (1 + bent) * (1 + moved)
        s = steep * w.s[x] + error + self.slack * size
        return _Result(value, slope * w.a[x, span], p, q, s, lo, hi)

    def _write(self, to: int, result: _Result, span: slice) -> None:
        """Write a register: poison a value without a finite form, intersect the interval with the form's range."""
        w, (c, a, p, q, s, lo, hi) = self.work, result
        rad = np.abs(a).sum(axis=0)
        # The terms of p, q and s, and the sum of |a|, have rounding errors of their own.
        grown = 1 + self.slack
        p, q, s = np.minimum(p * grown, 0.0), np.maximum(q * grown, 0.0), s * grown
        ends = ULP * np.abs(c) + s
        down, up = (rad - p + ends) * grown, (rad + q + ends) * grown
        good = (down < LARGEST) & (up < LARGEST) & (np.abs(c) < LARGEST)
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
        # fmax and fmin ignore an end that is NaN, which bounds nothing.
        w.lo[to], w.hi[to] = np.fmax(lo, low), np.fmin(hi, high)
