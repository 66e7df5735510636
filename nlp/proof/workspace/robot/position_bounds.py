"""Contraction of boxes of positions to a set of positions, as searches use it.

A set is the intersection of parts, in linear forms ``L = rows (p - origin)`` of the position p:

    sum_i s_i L_i^2 <= most    with signs s_i,    and    L_i <= most_i    for all, or for any one, of the forms.

A disc, cylinder or ball has two or three squares, a ring a second part with negative signs, and a cone one negative
square. Ends of forms are propagated back to the coordinates. Rounding moves ends outwards, and points inwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .....models import FloatArray
from .....models.rotation import perpendiculars
from ....case.positionsets import UPRIGHT, PositionSet, SetKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative rounding of linear forms and their squares, with those of the numbers of a set; far more than it.
_ROUNDING = 2.0**-42
#: Number of contractions in sequence, and of bisections towards the middle of a set.
_PASSES, _HALVINGS = 3, 40
#: Rounds of random points before known points are repeated.
_ROUNDS = 200
#: Ends of boxes: lower and upper (B, k).
_Ends: TypeAlias = "tuple[FloatArray, FloatArray]"


@dataclass(frozen=True, eq=False)
class _Part:
    """Part of a set.

    Attributes:
        origin: (3,) origin of the forms.
        rows: (m, 3) rows of the forms.
        signs: (m,) signs of squares; empty for linear conditions.
        most: (1,) largest sum of squares, or (m,) largest forms.
        room: (1,) or (m,) rounding of the sum, or of each form.
        is_any: whether one of the linear conditions is enough.
    """

    origin: FloatArray
    rows: FloatArray
    signs: FloatArray
    most: FloatArray
    room: FloatArray
    is_any: bool = False

    def forms(self, lower: FloatArray, upper: FloatArray) -> _Ends:
        """Return the ends of the forms (B, m) over boxes (B, 3), up to rounding."""
        low, high = lower - self.origin, upper - self.origin
        positive, negative = np.maximum(self.rows, 0.0).T, np.minimum(self.rows, 0.0).T
        return low @ positive + high @ negative, high @ positive + low @ negative

    def values(self, points: FloatArray) -> FloatArray:
        """Return the excess (P, 1) or (P, m) of points (P, 3) over the condition."""
        L = (points - self.origin) @ self.rows.T
        return np.asarray(
            (L * L * self.signs).sum(axis=1, keepdims=True) - self.most if self.signs.size else L - self.most
        )

    def holds(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points (P, 3) provably satisfy the condition."""
        inside = self.values(points) <= -self.room
        return np.asarray(inside.any(axis=1) if self.is_any else inside.all(axis=1))

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Contract boxes (B, 3) to the part; also return which boxes (B,) are outside of the part."""
        low, high = self.forms(lower, upper)
        if not self.signs.size:
            outside = low > self.most + self.room
            if self.is_any:
                parts = [self._linear(lower, upper, [k]) for k in range(len(self.rows))]
                gone = [np.where(outside[:, [k]], np.inf, part[0]) for k, part in enumerate(parts)]
                kept = [np.where(outside[:, [k]], -np.inf, part[1]) for k, part in enumerate(parts)]
                all_gone = np.asarray(outside.all(axis=1))
                least, most = np.min(gone, axis=0), np.max(kept, axis=0)
                least, most = np.where(all_gone[:, None], lower, least), np.where(all_gone[:, None], upper, most)
                return least, most, all_gone
            return *self._linear(lower, upper, list(range(len(self.rows)))), np.asarray(outside.any(axis=1))
        small, large = np.maximum(np.maximum(low, -high), 0.0) ** 2, np.maximum(low**2, high**2)
        terms = np.where(self.signs > 0, small, -large)
        outside = np.asarray(terms.sum(axis=1) > self.most + self.room)
        room = self.most + self.room - (terms.sum(axis=1, keepdims=True) - terms)
        size = np.sqrt(np.maximum(self.signs * room, 0.0)) * (1 + _ROUNDING)
        # A positive square is at most the room, a negative one at least its opposite.
        most, gap = np.where(self.signs > 0, size, np.inf), np.where(self.signs > 0, 0.0, size * (1 - 4 * _ROUNDING))
        new_low, new_high = np.maximum(low, -most), np.minimum(high, most)
        new_low = np.where((gap > 0) & (low > -gap), np.maximum(new_low, gap), new_low)
        new_high = np.where((gap > 0) & (high < gap), np.minimum(new_high, -gap), new_high)
        outside |= (new_low > new_high).any(axis=1)
        least, most = self._back(lower, upper, (low, high), (new_low, new_high))
        return least, most, outside

    def _linear(self, lower: FloatArray, upper: FloatArray, which: list[int]) -> _Ends:
        """Return ends moved to some linear conditions."""
        low, high = self.forms(lower, upper)
        new_high = high.copy()
        new_high[:, which] = np.minimum(high, self.most + self.room)[:, which]
        return self._back(lower, upper, (low, high), (low, new_high))

    def _back(self, lower: FloatArray, upper: FloatArray, before: _Ends, after: _Ends) -> _Ends:
        """Return ends (B, 3) of boxes from new ends of the forms (B, m)."""
        least, most = lower.copy(), upper.copy()
        scale = np.maximum(np.abs(before[0]), np.abs(before[1]))
        for i, row in enumerate(self.rows):
            is_less = (after[0][:, i] > before[0][:, i]) | (after[1][:, i] < before[1][:, i])
            # Coordinates with tiny factors would move only by rounding.
            for k in np.flatnonzero(np.abs(row) > _ROUNDING * np.abs(row).max()):
                low, high = (row[k] * (end[:, k] - self.origin[k]) for end in (lower, upper))
                own = np.minimum(low, high), np.maximum(low, high)
                # The other terms of the form have the rest of its ends.
                slack = _ROUNDING * (scale[:, i] + np.maximum(np.abs(low), np.abs(high))) + _ROUNDING * abs(
                    row[k] * self.origin[k]
                )
                a = (after[0][:, i] - (before[1][:, i] - own[1]) - slack) / row[k] + self.origin[k]
                b = (after[1][:, i] - (before[0][:, i] - own[0]) + slack) / row[k] + self.origin[k]
                a, b = (a, b) if row[k] > 0 else (b, a)
                least[:, k] = np.where(is_less, np.maximum(least[:, k], a), least[:, k])
                most[:, k] = np.where(is_less, np.minimum(most[:, k], b), most[:, k])
        return least, most


class PositionBounds:
    """A set of positions for searches.

    Args:
        positions: the set.
        lower, upper: (3,) ends of the box that encloses the set.

    Attributes:
        positions: the set.
    """

    def __init__(self, positions: PositionSet, lower: FloatArray, upper: FloatArray) -> None:
        self.positions, self._box = positions, (lower, upper)
        self._parts = [self._rounded(each) for each in _parts_of(positions)]

    def _rounded(self, part: _Part) -> _Part:
        """Return a part with its rounding over the box."""
        used = part.rows.any(axis=0)
        lower, upper, origin = (each[used] for each in (*self._box, part.origin))
        away = float(np.abs(np.concatenate([lower, upper, origin])).max())
        size = float(np.linalg.norm(np.maximum(np.abs(lower - origin), np.abs(upper - origin))))
        sizes = np.linalg.norm(part.rows, axis=1)
        room = _ROUNDING * (sizes * (size + away) + np.abs(part.most))
        if part.signs.size:
            room = np.atleast_1d(_ROUNDING * ((sizes**2).sum() * size * (size + away) + abs(float(part.most[0]))))
        return _Part(part.origin, part.rows, part.signs, part.most, room, part.is_any)

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Contract boxes (B, 3) to the set; also return which boxes (B,) have no position of the set."""
        outside = np.zeros(len(lower), dtype=bool)
        for _ in range(_PASSES):
            for part in self._parts:
                low, high, gone = part.contracted(lower, upper)
                outside |= gone | (low > high).any(axis=1)
                lower, upper = (np.where(outside[:, None], old, new) for new, old in ((low, lower), (high, upper)))
        return lower, upper, outside

    def holds(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return which points (..., 3) provably satisfy the conditions of the set; ends of the box are not tested."""
        flat = points.reshape(-1, 3)
        inside = np.ones(len(flat), dtype=bool)
        for part in self._parts:
            inside &= part.holds(flat)
        return np.asarray(inside.reshape(points.shape[:-1]))

    def excess(self, points: FloatArray) -> FloatArray:
        """Return one number for each point (N, 3): negative inside of the set, positive outside."""
        parts = []
        for part in self._parts:
            values = part.values(points)
            values = values / max(float(np.abs(values).max(initial=0.0)), np.finfo(float).tiny)
            parts.append(values.min(axis=1) if part.is_any else values.max(axis=1))
        return np.asarray(np.max(parts, axis=0)) if parts else np.full(len(points), -1.0)

    def clipped(self, points: FloatArray) -> FloatArray:
        """Return points (N, 3) moved into the set."""
        found = self.positions.shape_clipped(points)
        off = np.flatnonzero(~self.holds(found))
        if off.size:
            # Towards a position inside; in a set that is not convex the first part of the way may be outside.
            middle, share = self.positions.middle, np.zeros(off.size)
            for k in range(1, _HALVINGS):
                tried = share + 2.0**-k
                inside = self.holds(middle + tried[:, None] * (found[off] - middle))
                share = np.where(inside, tried, share)
            found[off] = middle + share[:, None] * (found[off] - middle)
        return found

    def random(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random points (count, 3) of the set."""
        parts, known = [self.positions.middle[None]], 0
        for _ in range(_ROUNDS):
            tried = self.positions.shape_points(count, rng)
            parts.append(tried[self.holds(tried)])
            known += len(parts[-1])
            if known >= count:
                break
        points = np.concatenate(parts[1:] if known else parts)
        return np.asarray(points[np.arange(count) % len(points)])


def _parts_of(given: PositionSet) -> list[_Part]:
    """Return the parts of a set, without their rounding."""
    none, origin = np.zeros(0), np.array(given.centre) + np.array(given.shift)
    square, parts = np.array([given.radius**2]), list[_Part]()
    plane = np.eye(3)[:2]
    if given.kind in UPRIGHT:
        parts.append(_Part(origin, plane, np.ones(2), square, none))
    elif given.kind is SetKind.BALL:
        parts.append(_Part(origin, np.eye(3), np.ones(3), square, none))
    elif given.kind is not SetKind.BOX:
        size = float(np.linalg.norm(given.axis))
        along = given.axis / size
        e = perpendiculars(along)
        if given.kind is SetKind.CYLINDER:
            parts.append(_Part(origin, e, np.ones(2), square, none))
        else:
            rows = np.vstack([e, given.radius / size * along])
            parts.append(_Part(origin, rows, np.array([1.0, 1.0, -1.0]), np.zeros(1), none))
        parts.append(_Part(origin, np.stack([along, -along]), none, np.array([size, 0.0]), none))
    if given.kind is SetKind.RING:
        parts.append(_Part(origin, plane, -np.ones(2), np.array([-(given.inner**2)]), none))
        if given.angles:
            first, last = given.angles
            normals = np.array([[math.sin(first), -math.cos(first), 0.0], [-math.sin(last), math.cos(last), 0.0]])
            parts.append(_Part(origin, normals, none, np.zeros(2), none, last - first > math.pi))
    for each in given.half_spaces:
        n = np.array(each.normal) / np.linalg.norm(each.normal)
        parts.append(_Part(np.array(each.point) + np.array(given.shift), n[None], none, np.zeros(1), none))
    return parts
