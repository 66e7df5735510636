"""Conditions of a set of positions: quadratic polynomials in fractions, and the contraction of boxes to them.

With ``d = p - origin`` a condition is ``d' Q d + b . d <= c``. For a point it is decided in fractions. Over a box it is
a quadratic inequality in one coordinate, with ends of its other terms; its roots are ends of this coordinate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .....models import FloatArray
from ....case.positionsets import PositionSet, SetKind
from ..fractions import sine_cosine_ends

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative rounding of sums and products of coordinates; more than it.
_ROUNDING = 2.0**-46
#: Number of contractions in sequence.
_PASSES = 3
_Exact: TypeAlias = "tuple[Fraction, Fraction, Fraction]"
_ZERO: _Exact = (Fraction(0), Fraction(0), Fraction(0))


@dataclass(frozen=True)
class _Condition:
    """Condition ``d' Q d + b . d <= c`` on the vector d from an origin, for every b in an interval.

    Attributes:
        origin: (3,) origin.
        Q: (3, 3) symmetric matrix.
        b: (3,) lower ends of b.
        above: (3,) upper ends of b; equal to the lower ends if b is exact.
        c: right side.
    """

    origin: _Exact
    Q: tuple[_Exact, _Exact, _Exact]
    b: _Exact
    above: _Exact
    c: Fraction

    def holds(self, point: Sequence[Fraction]) -> bool:
        """Return whether a point (3,) satisfies the condition, for every b."""
        d = [each - by for each, by in zip(point, self.origin, strict=True)]
        square = sum((self.Q[i][j] * d[i] * d[j] for i in range(3) for j in range(3)), Fraction(0))
        most = sum((max(low * x, high * x) for low, high, x in zip(self.b, self.above, d, strict=True)), Fraction(0))
        return square + most <= self.c


class PositionConditions:
    """A set of positions for the checker.

    Args:
        positions: the set.
        lower, upper: (3,) ends of the box that encloses the set.

    Attributes:
        positions: the set.
    """

    def __init__(self, positions: PositionSet, lower: FloatArray, upper: FloatArray) -> None:
        self.positions = positions
        self._every, self._any = _conditions_of(positions)
        self._rounded = [_Rounded(each, lower, upper) for each in self._every]
        self._rounded_any = [_Rounded(each, lower, upper) for each in self._any]

    def holds(self, point: FloatArray) -> bool:
        """Return whether a point (3,) is provably a position of the set; ends of the box are not tested."""
        at = [Fraction(each) for each in point.tolist()]
        is_one = not self._any or any(each.holds(at) for each in self._any)
        return is_one and all(each.holds(at) for each in self._every)

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Contract boxes (B, 3) to the set without loss of a position; also return which boxes may have positions."""
        kept = np.ones(len(lower), dtype=bool)
        for _ in range(_PASSES):
            for each in self._rounded:
                low, high, some = each.contracted(lower, upper)
                kept &= some & (low <= high).all(axis=1)
                lower, upper = (np.where(kept[:, None], new, old) for new, old in ((low, lower), (high, upper)))
        if self._rounded_any:
            kept &= np.any([each.contracted(lower, upper)[2] for each in self._rounded_any], axis=0)
        return lower, upper, kept


class _Rounded:
    """A condition in floating point.

    Args:
        condition: the condition.
        lower, upper: (3,) ends of the box that encloses all boxes.
    """

    def __init__(self, condition: _Condition, lower: FloatArray, upper: FloatArray) -> None:
        self._origin = np.array([float(each) for each in condition.origin])
        self._Q = np.array([[float(each) for each in row] for row in condition.Q])
        self._b = np.array([float(each) for each in condition.b]), np.array([float(each) for each in condition.above])
        self._c = float(condition.c)
        used = self._Q.any(axis=0) | self._b[0].astype(bool) | self._b[1].astype(bool)
        away = np.where(used, np.maximum(np.maximum(np.abs(lower), np.abs(upper)), np.abs(self._origin)), 0.0)
        size = np.where(used, np.maximum(np.abs(lower - self._origin), np.abs(upper - self._origin)), 0.0)
        b = np.maximum(*map(np.abs, self._b))
        # Rounding of the distance from the origin, of ends that are moved, and of the whole polynomial.
        self._near = _ROUNDING * (away + size)
        self._room = _ROUNDING * float(size @ np.abs(self._Q) @ size + b @ size + abs(self._c))

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Contract boxes (B, 3) to the condition; also return which boxes (B,) may have positions."""
        low, high = lower - self._origin - self._near, upper - self._origin + self._near
        kept = np.maximum(self._least(low, high, -1), self._centred(low, high)) <= self._c + self._room
        lower, upper = lower.copy(), upper.copy()
        for k in range(3):
            rest = self._least(low, high, k) - self._c - self._room
            begin, end = self._roots(k, low, high, rest)
            kept &= begin <= end
            is_less, is_more = begin > low[:, k], end < high[:, k]
            lower[:, k] = np.where(
                is_less, np.maximum(lower[:, k], begin + self._origin[k] - self._near[k]), lower[:, k]
            )
            upper[:, k] = np.where(is_more, np.minimum(upper[:, k], end + self._origin[k] + self._near[k]), upper[:, k])
        return lower, upper, np.asarray(kept)

    def _centred(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Return lower bounds (B,) of the polynomial over boxes, from its value and derivatives at their centres."""
        m, h = 0.5 * (low + high), 0.5 * (high - low)
        across = np.abs(self._Q - np.diag(np.diag(self._Q)))
        Qm = m @ self._Q
        b = [np.abs(2 * Qm + each) for each in self._b]
        at = (Qm * m).sum(axis=1) + np.minimum(m * self._b[0], m * self._b[1]).sum(axis=1)
        bend = (h * h) @ np.minimum(np.diag(self._Q), 0.0) - ((h @ across) * h).sum(axis=1)
        return np.asarray(at - (np.maximum(*b) * h).sum(axis=1) + bend)

    def _least(self, low: FloatArray, high: FloatArray, without: int) -> FloatArray:
        """Return lower bounds (B,) of the polynomial over boxes, without the terms of coordinate ``without``.

        With -1, no terms are left out.
        """
        found = np.zeros(len(low))
        for i in range(3):
            if i == without:
                continue
            small, large = (
                np.maximum(np.maximum(low[:, i], -high[:, i]), 0.0) ** 2,
                np.maximum(low[:, i] ** 2, high[:, i] ** 2),
            )
            found += self._Q[i, i] * (small if self._Q[i, i] > 0 else large)
            found += np.min([end[i] * x[:, i] for end in self._b for x in (low, high)], axis=0)
            for j in range(i):
                if j != without and self._Q[i, j]:
                    found += np.min(
                        [2 * self._Q[i, j] * x[:, i] * y[:, j] for x in (low, high) for y in (low, high)], axis=0
                    )
        return found

    def _roots(self, k: int, low: FloatArray, high: FloatArray, rest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ends (B,) of a coordinate where ``q d^2 + B d + rest <= 0`` may hold, with ends of B over boxes."""
        q, count = self._Q[k, k], len(low)
        least, most = np.full(count, self._b[0][k]), np.full(count, self._b[1][k])
        for j in (j for j in range(3) if j != k and self._Q[k, j]):
            ends = 2 * self._Q[k, j] * low[:, j], 2 * self._Q[k, j] * high[:, j]
            least, most = least + np.minimum(*ends), most + np.maximum(*ends)
        wide = _ROUNDING * np.maximum(np.abs(least), np.abs(most))
        least, most = least - wide, most + wide
        begin, end = low[:, k].copy(), high[:, k].copy()
        with np.errstate(all="ignore"):
            if q > 0:
                square = np.maximum(least**2, most**2)
                inside = square - 4 * q * rest + _ROUNDING * (square + 4 * q * np.abs(rest))
                root = np.sqrt(np.maximum(inside, 0.0)) * (1 + _ROUNDING)
                begin, end = np.maximum(begin, (-most - root) / (2 * q)), np.minimum(end, (-least + root) / (2 * q))
                return np.where(inside < 0, np.inf, begin), np.where(inside < 0, -np.inf, end)
            if q < 0 and not (least.any() or most.any()):
                gap = np.sqrt(np.maximum(rest / -q, 0.0)) * (1 - _ROUNDING)
                begin = np.where((gap > 0) & (begin > -gap), np.maximum(begin, gap), begin)
                end = np.where((gap > 0) & (end < gap), np.minimum(end, -gap), end)
            elif q == 0:
                ends = np.maximum(-rest / least, -rest / most), np.minimum(-rest / least, -rest / most)
                end = np.where(least > 0, np.minimum(end, ends[0]), end)
                begin = np.where(most < 0, np.maximum(begin, ends[1]), begin)
        return begin, end


def _conditions_of(given: PositionSet) -> tuple[list[_Condition], list[_Condition]]:
    """Return conditions that all hold in a set, and conditions of which at least one holds.

    If the second list is empty, there is no such condition.
    """
    origin = _vector([Fraction(a) + Fraction(b) for a, b in zip(given.centre, given.shift, strict=True)])
    r, every, any_of = Fraction(given.radius), list[_Condition](), list[_Condition]()
    axis = [Fraction(b) - Fraction(a) for a, b in zip(given.centre, given.end, strict=True)]
    whole = sum((each * each for each in axis), Fraction(0))
    if given.kind in (SetKind.DISC, SetKind.RING):
        every.append(_square(origin, _diagonal(1, 1, 0), r * r))
    elif given.kind is SetKind.BALL:
        every.append(_square(origin, _diagonal(1, 1, 1), r * r))
    elif given.kind in (SetKind.CYLINDER, SetKind.CONE):
        # The squared distance from the axis, times its squared length.
        Q = [[whole * (i == j) - axis[i] * axis[j] for j in range(3)] for i in range(3)]
        c = r * r * whole
        if given.kind is SetKind.CONE:
            Q, c = [[whole * Q[i][j] - r * r * axis[i] * axis[j] for j in range(3)] for i in range(3)], Fraction(0)
        every.append(_square(origin, (_vector(Q[0]), _vector(Q[1]), _vector(Q[2])), c))
        backwards = _vector([-each for each in axis])
        every += [_line(origin, _vector(axis), whole), _line(origin, backwards, Fraction(0))]
    if given.kind is SetKind.RING:
        every.append(_square(origin, _diagonal(-1, -1, 0), -(Fraction(given.inner) ** 2)))
        if given.angles:
            first, last = given.angles
            (sine, cosine), (far_sine, far_cosine) = sine_cosine_ends(first), sine_cosine_ends(last)
            zero = Fraction(0)
            begin = _between(origin, (sine[0], -cosine[1], zero), (sine[1], -cosine[0], zero))
            end = _between(origin, (-far_sine[1], far_cosine[0], zero), (-far_sine[0], far_cosine[1], zero))
            (any_of if last - first > math.pi else every).extend([begin, end])
    for each in given.half_spaces:
        at = _vector([Fraction(a) + Fraction(b) for a, b in zip(each.point, given.shift, strict=True)])
        every.append(_line(at, _vector([Fraction(n) for n in each.normal]), Fraction(0)))
    return every, any_of


def _vector(values: Sequence[Fraction]) -> _Exact:
    """Return three fractions."""
    x, y, z = values
    return x, y, z


def _diagonal(x: int, y: int, z: int) -> tuple[_Exact, _Exact, _Exact]:
    """Return a diagonal matrix."""
    zero = Fraction(0)
    return (Fraction(x), zero, zero), (zero, Fraction(y), zero), (zero, zero, Fraction(z))


def _square(origin: _Exact, Q: tuple[_Exact, _Exact, _Exact], c: Fraction) -> _Condition:
    """Return a condition without linear terms."""
    return _Condition(origin, Q, _ZERO, _ZERO, c)


def _line(origin: _Exact, b: _Exact, c: Fraction) -> _Condition:
    """Return a linear condition."""
    return _Condition(origin, _diagonal(0, 0, 0), b, b, c)


def _between(origin: _Exact, b: _Exact, above: _Exact) -> _Condition:
    """Return a linear condition with a vector between two ends."""
    return _Condition(origin, _diagonal(0, 0, 0), b, above, Fraction(0))
