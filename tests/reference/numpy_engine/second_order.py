"""Enclosures of a tape's results by forms of second order, for the first pass over a box.

On the box ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, each value ``v`` of the tape lies in

    v(e) in c + sum_i a_i e_i + sum_{i <= j} Q_ij e_i e_j + [p, q] +- s        and        lo <= v <= hi,

where ``[p, q]`` holds 0 and all terms of third and higher order, and ``s`` bounds the rounding errors. The terms of
second order of a sum cancel as they do in the function, so that what ``[p, q]`` holds is an order smaller than in
:mod:`.first_order`, for ``n (n + 1) / 2`` more coefficients of each value. Terms of third order of a product are
bounded monomial by monomial.

Rounding and poison are as in :mod:`.first_order`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from screwsynth.nlp.proof.enclosure.tape import Op, Tape

from .intervals import LARGEST, TINY, ULP, Interval, interval_product, midpoints, widen
from .univariate import RULES, Rule

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from screwsynth.models import FloatArray


@dataclass(frozen=True, eq=False)
class Forms:
    """Enclosures of one value over B boxes, P = n (n + 1) / 2, or of R values with R in front.

    Attributes:
        c: (B,) values at the centres.
        a: (n, B) scaled gradients there.
        Q: (P, B) coefficients of ``e_i e_j``, i <= j, row by row.
        p, q: (B,) least and largest terms of higher order, ``p <= 0 <= q``.
        s: (B,) bounds of the rounding errors; infinite where a value is poisoned.
        lo, hi: (B,) intervals.
    """

    c: FloatArray
    a: FloatArray
    Q: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    lo: FloatArray
    hi: FloatArray


@dataclass(frozen=True, eq=False)
class _Register(Forms):
    """A value with the sum of ``|a|`` and the range of its quadratic part, (B,) each."""

    rad: FloatArray
    least: FloatArray
    most: FloatArray

    @property
    def rest(self) -> FloatArray:
        """Largest size of the terms of higher order."""
        return np.maximum(-self.p, self.q)

    @property
    def curved(self) -> FloatArray:
        """Largest size of the quadratic part."""
        return np.maximum(-self.least, self.most)

    @property
    def size(self) -> FloatArray:
        """Bound of the sum of the sizes of all terms."""
        return np.abs(self.c) + self.rad + (self.most - self.least) + self.rest


class _Monomials(NamedTuple):
    """Places of coefficients: of pairs, and of the products ``a_i Q_jk`` in each monomial of third order.

    Attributes:
        first, second: (P,) the two variables of each pair.
        is_square: (P,) whether they are the same.
        linear, pair: (M, 3) places of ``a`` and of ``Q``.
        counts: (M, 3, 1) 1 for each product of the monomial, else 0.
    """

    first: NDArray[np.intp]
    second: NDArray[np.intp]
    is_square: NDArray[np.bool_]
    linear: NDArray[np.intp]
    pair: NDArray[np.intp]
    counts: FloatArray


@cache
def monomials(n: int) -> _Monomials:
    """Return the monomials of second and third order of n variables."""
    first, second = np.triu_indices(n)
    place = np.zeros((n, n), dtype=np.intp)
    place[first, second] = place[second, first] = np.arange(first.size)
    linear, pair, counts = [], [], []
    for i in range(n):
        for j in range(i, n):
            for k in range(j, n):
                # Each distinct variable in turn as the linear one.
                parts = [(i, place[j, k])] + [(j, place[i, k])] * (j > i) + [(k, place[i, j])] * (k > j)
                spare = 3 - len(parts)
                linear.append([part[0] for part in parts] + [0] * spare)
                pair.append([part[1] for part in parts] + [0] * spare)
                counts.append([1.0] * len(parts) + [0.0] * spare)
    return _Monomials(
        first, second, first == second, np.array(linear), np.array(pair), np.array(counts)[:, :, np.newaxis]
    )


def enclose_second(tape: Tape, lower: FloatArray, upper: FloatArray) -> Forms:
    """Return forms of a tape's R results over boxes with ends (n, B)."""
    centre, radius = midpoints(lower, upper)
    with np.errstate(all="ignore"):
        found = _Interpreter(tape.inputs, centre.shape[1]).run(tape, centre, radius, lower, upper)
        return Forms(*(np.stack([getattr(each, name) for each in found]) for name in Forms.__dataclass_fields__))


class _Interpreter:
    """The rule of each operation for forms of n variables over B boxes."""

    def __init__(self, n: int, boxes: int) -> None:
        self.n, self.boxes, self.places = n, boxes, monomials(n)
        # An operation makes fewer roundings of each of its terms than there are monomials of third order.
        self.slack = (n * (n + 1) * (n + 2) // 6 + 16) * ULP

    def run(
        self, tape: Tape, centre: FloatArray, radius: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> list[_Register]:
        """Return the results of a tape over boxes, (n, B) each."""
        zero = np.zeros(self.boxes)
        no_pairs = np.zeros((self.places.first.size, self.boxes))
        work: dict[int, _Register] = {}
        out: dict[int, _Register] = {}
        columns = (tape.op, tape.to, tape.a, tape.b, tape.k)
        for op, to, a, b, k in zip(*(column.tolist() for column in columns), strict=True):
            if op == Op.OUTPUT:
                out[to] = work[a]
            elif op == Op.INPUT:
                linear = np.zeros((self.n, self.boxes))
                linear[a] = radius[a]
                ends = lower[a], upper[a]
                work[to] = _Register(centre[a], linear, no_pairs, zero, zero, zero, *ends, radius[a], zero, zero)
            elif op == Op.CONSTANT:
                value, none = np.full(self.boxes, k), np.zeros((self.n, self.boxes))
                work[to] = _Register(value, none, no_pairs, zero, zero, zero, value, value, zero, zero, zero)
            else:
                work[to] = self._settled(self._apply(op, work[a], work.get(b, work[a]), k))
        return [out[k] for k in range(tape.outputs)]

    def _apply(self, op: int, x: _Register, y: _Register, k: float) -> Forms:  # noqa: PLR0911 - one for each rule
        """Return the result of an operation on x and y and the constant k."""
        if op == Op.ADD:
            return self._sum(x, y)
        if op == Op.SUB:
            return self._sum(x, _negative(y))
        if op == Op.MUL:
            return self._product(x, y)
        if op == Op.DIV:
            return self._quotient(x, y)
        if op == Op.SQUARE:
            return self._square(x)
        if op == Op.SCALE:
            return self._multiple(x, k)
        if op == Op.SHIFT:
            c = x.c + k
            return Forms(c, x.a, x.Q, x.p, x.q, x.s + self.slack * np.abs(c), *widen(x.lo + k, x.hi + k))
        return self._univariate(RULES[Op(op)](x.c, np.minimum(x.lo, x.c), np.maximum(x.hi, x.c)), op, x)

    def _sum(self, x: _Register, y: _Register) -> Forms:
        """Return the sum of two values."""
        c = x.c + y.c
        size = (x.rad + y.rad) + ((x.most - x.least) + (y.most - y.least))
        s = x.s + y.s + self.slack * (np.abs(c) + size)
        return Forms(c, x.a + y.a, x.Q + y.Q, x.p + y.p, x.q + y.q, s, *widen(x.lo + y.lo, x.hi + y.hi))

    def _multiple(self, x: _Register, k: float) -> Forms:
        """Return a value times a constant; 1 and -1 cause no rounding."""
        p, q = (x.p * k, x.q * k) if k >= 0 else (x.q * k, x.p * k)
        lo, hi = (x.lo * k, x.hi * k) if k >= 0 else (x.hi * k, x.lo * k)
        c, size = x.c * k, abs(k)
        if size == 1:
            return Forms(c, x.a * k, x.Q * k, p, q, x.s, lo, hi)
        s = x.s * size + (self.slack * (np.abs(c) + size * (x.rad + (x.most - x.least))) + TINY)
        return Forms(c, x.a * k, x.Q * k, p, q, s, *widen(lo, hi, TINY))

    def _product(self, x: _Register, y: _Register) -> Forms:
        """Return the product of two values."""
        at = self.places
        crossed = np.where(at.is_square[:, None], 0.0, x.a[at.second] * y.a[at.first])
        Q = (x.c * y.Q + y.c * x.Q) + (x.a[at.first] * y.a[at.second] + crossed)
        cubic = self._cubic_sizes(x.a, x.Q, y.a, y.Q)
        rest, other_rest = x.rest, y.rest
        higher = cubic + x.curved * y.curved
        higher = higher + ((x.rad + x.curved) * other_rest + (y.rad + y.curved) * rest + rest * other_rest)
        p = np.minimum(x.c * y.p, x.c * y.q) + np.minimum(y.c * x.p, y.c * x.q) - higher
        q = np.maximum(x.c * y.p, x.c * y.q) + np.maximum(y.c * x.p, y.c * x.q) + higher
        s = (x.size * y.s + y.size * x.s + x.s * y.s) + (self.slack * (x.size * y.size) + TINY)
        return Forms(x.c * y.c, x.c * y.a + y.c * x.a, Q, p, q, s, *interval_product(x.lo, x.hi, y.lo, y.hi))

    def _square(self, x: _Register) -> Forms:
        """Return the square of a value; that of its terms of second and higher order is not negative."""
        at, c, p, q, s, size = self.places, x.c, x.p, x.q, x.s, x.size
        products = x.a[at.first] * x.a[at.second]
        Q = 2 * c * x.Q + np.where(at.is_square[:, None], products, 2 * products)
        mixed = self._cubic_sizes(x.a, x.Q) + 2 * x.rad * x.rest
        low = np.minimum(2 * c * p, 2 * c * q) - mixed
        high = np.maximum(2 * c * p, 2 * c * q) + (mixed + (x.curved + x.rest) * (x.curved + x.rest))
        error = 2 * size * s + s * s + (self.slack * (size * size) + TINY)
        one, other = np.abs(x.lo), np.abs(x.hi)
        small, large = np.minimum(one, other), np.maximum(one, other)
        small = np.where((x.lo <= 0) & (x.hi >= 0), 0.0, small)
        lo, hi = widen(small * small, large * large, TINY)
        return Forms(c * c, 2 * c * x.a, Q, low, high, error, np.maximum(lo, 0.0), hi)

    def _quotient(self, x: _Register, y: _Register) -> Forms:
        """Return ``x / y`` as ``P + (x - P y) / y``, where P is the quotient's polynomial of second order.

        ``x - P y`` has terms of third and higher order only.
        """
        at = self.places
        positive = y.lo > 0
        near, far = np.where(positive, y.lo, -y.hi), np.where(positive, y.hi, -y.lo)
        near = np.where(near > 0, near, np.nan)  # an interval with 0 in it has no inverse
        sign = np.where(positive, 1.0, -1.0)
        inverse, k = 1.0 / y.c, x.c / y.c
        a = (x.a - k * y.a) * inverse
        crossed = a[at.first] * y.a[at.second] + np.where(at.is_square[:, None], 0.0, a[at.second] * y.a[at.first])
        Q = ((x.Q - k * y.Q) - crossed) * inverse
        rad, curved = np.abs(a).sum(axis=0), np.abs(Q).sum(axis=0)
        moved = rad + curved
        higher = self._cubic_sizes(a, Q, y.a, y.Q) + curved * y.curved + moved * y.rest
        p = x.p - np.maximum(k * y.p, k * y.q) - higher
        q = x.q - np.minimum(k * y.p, k * y.q) + higher
        whole = np.abs(k) + moved
        long = np.abs(x.c) + x.rad + (x.most - x.least)
        s = x.s + whole * y.s + (self.slack * (long + whole * y.size) + TINY * (1 + y.size))
        s = s / near + (self.slack * whole + TINY)
        p, q = np.where(positive, p, -q) / near, np.where(positive, q, -p) / near
        one, two = sign / far, sign / near
        ends = widen(np.minimum(one, two), np.maximum(one, two), TINY)
        return Forms(k, a, Q, p, q, s, *interval_product(x.lo, x.hi, *ends))

    def _univariate(self, rule: Rule, op: int, x: _Register) -> Forms:
        """Return a function ``f(c + Y) in f(c) + f'(c) Y + k Y^2 + [least, most] Y^2``, k half its curvature at c."""
        at, slope, p, q, s = self.places, rule.slope, x.p, x.q, x.s
        curve = _curve(op, rule, x.c)
        mixed = self._cubic_sizes(x.a, x.Q) + 2 * x.rad * x.rest
        square = mixed + (x.curved + x.rest) * (x.curved + x.rest)
        moved = x.rad + (x.most - x.least) + x.rest
        reach = moved + s
        if op in (Op.SIN, Op.COS):  # the third derivative is at most 1
            most = reach * reach * (reach / 6)
            least = -most
        else:
            blur = (np.abs(rule.least) + np.abs(rule.most) + np.abs(curve)) * ULP
            least = (rule.least - curve - blur) * (reach * reach)
            most = (rule.most - curve + blur) * (reach * reach)
        low = np.minimum(slope * p, slope * q) + np.minimum(curve * -mixed, curve * square) + np.minimum(least, 0.0)
        high = np.maximum(slope * p, slope * q) + np.maximum(curve * -mixed, curve * square) + np.maximum(most, 0.0)
        steep = np.abs(slope) + 2 * np.abs(curve) * reach
        size = np.abs(rule.value) + np.abs(slope) * moved + np.abs(curve) * (moved * moved)
        # A rule without a value poisons the result.
        unknown = 0 * (least + most)
        lost = TINY * (1 + np.abs(curve) + np.abs(rule.least) + np.abs(rule.most))
        further = moved + moved * moved
        error = rule.error + rule.slope_error * further + lost * (1 + further)
        error = steep * s + error + self.slack * size + unknown
        products = x.a[at.first] * x.a[at.second]
        Q = slope * x.Q + np.where(at.is_square[:, None], curve, 2 * curve) * products
        return Forms(rule.value, slope * x.a, Q, low, high, error, rule.lo, rule.hi)

    def _cubic_sizes(
        self, a: FloatArray, Q: FloatArray, b: FloatArray | None = None, P: FloatArray | None = None
    ) -> FloatArray:
        """Return the sum (B,) of the sizes of the monomials of ``a e P(e) + b e Q(e)``, or ``2 a e Q(e)``."""
        at = self.places
        if b is None or P is None:
            return np.asarray(np.abs(2 * (at.counts * a[at.linear] * Q[at.pair]).sum(axis=1)).sum(axis=0))
        products = a[at.linear] * P[at.pair] + b[at.linear] * Q[at.pair]
        return np.asarray(np.abs((at.counts * products).sum(axis=1)).sum(axis=0))

    def _settled(self, v: Forms) -> _Register:
        """Return a result with the ranges of its parts, both enclosures intersected; poison without a finite form."""
        own = v.Q[self.places.is_square]
        crossed = np.abs(v.Q[~self.places.is_square]).sum(axis=0)
        rad = np.abs(v.a).sum(axis=0)
        least, most = np.minimum(own, 0.0).sum(axis=0) - crossed, np.maximum(own, 0.0).sum(axis=0) + crossed
        grown = 1 + self.slack
        p, q, s = np.minimum(v.p * grown, 0.0), np.maximum(v.q * grown, 0.0), v.s * grown
        ends = ULP * np.abs(v.c) + s
        down, up = (rad - least - p + ends) * grown, (rad + most + q + ends) * grown
        good = (down < LARGEST) & (up < LARGEST) & (np.abs(v.c) < LARGEST)
        low, high = v.c - down, v.c + up
        low, high = low - ULP * np.abs(low), high + ULP * np.abs(high)
        # fmax and fmin ignore an end that is NaN, which bounds nothing.
        lo, hi = np.where(good, np.fmax(v.lo, low), -np.inf), np.where(good, np.fmin(v.hi, high), np.inf)
        c, p, q, rad, least, most = (np.where(good, each, 0.0) for each in (v.c, p, q, rad, least, most))
        a, Q, s = np.where(good, v.a, 0.0), np.where(good, v.Q, 0.0), np.where(good, s, np.inf)
        return _Register(c, a, Q, p, q, s, lo, hi, rad, least, most)


def _negative(y: _Register) -> _Register:
    """Return minus a value, without rounding."""
    ends = Interval(-y.hi, -y.lo)
    return _Register(-y.c, -y.a, -y.Q, -y.q, -y.p, y.s, *ends, y.rad, -y.most, -y.least)


def _curve(op: int, rule: Rule, c: FloatArray) -> FloatArray:
    """Return half of a function's second derivative at c, from its rule."""
    if op == Op.SQRT:
        return np.asarray(-0.25 * rule.slope / c)
    if op in (Op.SIN, Op.COS):
        return -0.5 * rule.value
    if op == Op.EXP:
        return 0.5 * rule.value
    if op == Op.LOG:
        return -0.5 * rule.slope * rule.slope
    if op == Op.ATAN:
        return -c * rule.slope * rule.slope
    return np.zeros_like(c)
