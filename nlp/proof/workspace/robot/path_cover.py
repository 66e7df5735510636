"""Boxes of poses that cover pieces of a path: hulls in the coordinates of a :class:`~.pose_box.PoseBox`.

Positions on a line are monotone between its ends. Those on an arc are products of a radius between its ends and of
cosines over a range. Ends move outwards by several roundings. Ranges of rotations are those of :mod:`.path_turns`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray
from .path_turns import TINY, PathTurns, divided

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Part of the sizes of the numbers of a piece by which its ends move outwards: more than the rounding of its formulas.
_OUTWARDS = 2.0**-48
#: Number of pieces whose points are computed at once.
_BLOCK = 2**15


class Place(NamedTuple):
    """A point of a path: the index of its segment, and the parameter from 0 to 1 along it."""

    segment: int
    parameter: float


def place_in(piece: FloatArray, part: float) -> Place:
    """Return the place at a part, from 0 to 1, of a piece (3,)."""
    segment, low, high = piece.tolist()
    return Place(int(segment), low + part * (high - low) if part < 1 else high)


@dataclass(frozen=True, eq=False)
class PathCover:
    """A path as boxes of poses.

    Attributes:
        knots: (N + 1, 3) positions.
        arcs: (N, 6) centre, radius, growth of the radius, angle and sweep of arcs; NaN of lines.
        axes: (N, 3) axes of the plane of arcs, and the axis along it.
        turns: the rotations.
        seconds: (N,) times of the segments; infinite, as if the platform stood there, where none is known.
    """

    knots: FloatArray
    arcs: FloatArray
    axes: NDArray[np.intp]
    turns: PathTurns
    seconds: FloatArray

    @cached_property
    def pieces(self) -> FloatArray:
        """The segments as pieces (M, 3): index, and ends of the parameter; those that turn far in equal parts."""
        count = len(self.knots) - 1
        parts = np.ones(count) if self.turns.counts is None else self.turns.counts.astype(float)
        rows, ends = divided(np.tile([0.0, 1.0], (count, 1)), parts)
        found = np.concatenate([rows[:, None], ends], axis=1)
        found.flags.writeable = False
        return found

    def blocks(self) -> Iterator[slice]:
        """Yield the places of these pieces in blocks, so that a long path needs little memory."""
        return (slice(begin, begin + _BLOCK) for begin in range(0, len(self.pieces), _BLOCK))

    def boxes(self, pieces: FloatArray, within: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, c) of boxes that cover pieces (B, 3).

        Args:
            pieces: indices of segments, and ends of the parameter.
            within: (B, 3) pieces whose references of rotations are used; the pieces themselves if left out.
        """
        k = pieces[:, 0].astype(int)
        start, change = self.knots[k], self.knots[k + 1] - self.knots[k]
        ends = [start + s[:, None] * change for s in (pieces[:, 1], pieces[:, 2])]
        slack = _OUTWARDS * (np.abs(start) + np.abs(change)) + TINY
        low, high = np.minimum(*ends) - slack, np.maximum(*ends) + slack
        # Fixed coordinates stay so.
        low, high = (np.where(change == 0, start, each) for each in (low, high))
        arcs = np.flatnonzero(np.isfinite(self.arcs[k, 0]))
        if arcs.size:
            first, second, radius, growth, angle, sweep = self.arcs[k[arcs]].T
            s = pieces[arcs, 1:]
            radii = radius[:, None] + s * growth[:, None]
            angles = angle[:, None] + s * sweep[:, None]
            for axis, centre, turn in ((0, first, 0.0), (1, second, -0.5 * np.pi)):
                cosines = _cosines(angles + turn)
                products = radii[:, :, None] * cosines[:, None, :]
                size = np.abs(centre) + np.abs(radii).max(axis=1) * (4 + np.abs(angles).max(axis=1))
                at = arcs, self.axes[k[arcs], axis]
                low[at] = centre + products.min(axis=(1, 2)) - _OUTWARDS * size
                high[at] = centre + products.max(axis=(1, 2)) + _OUTWARDS * size
            # The ends of an arc meet its knots up to rounding, or up to what a program may be off.
            for end, knots in enumerate((start, self.knots[k + 1])):
                at = arcs[s[:, end] == end]
                low[at], high[at] = np.minimum(low[at], knots[at]), np.maximum(high[at], knots[at])
        turns = self.turns.boxes(k, pieces[:, 1:], None if within is None else within[:, 1:])
        return np.hstack([low, turns[0]]), np.hstack([high, turns[1]])

    def derivatives(self, pieces: FloatArray, order: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, 6) of derivatives of the pose by the parameter, over pieces (B, 3).

        They are of positions, and of the angles roll, pitch and yaw, or else angular velocities in the world frame.

        Args:
            pieces: indices of segments, and ends of the parameter.
            order: 1, or of roll, pitch and yaw also 2.
        """
        k = pieces[:, 0].astype(int)
        turns = self.turns.derivatives(k, pieces[:, 1:]) if order == 1 else np.zeros((2, len(k), 3))
        change = self.knots[k + 1] - self.knots[k] if order == 1 else np.zeros((len(k), 3))
        slack = _OUTWARDS * np.abs(change)
        low, high = change - slack, change + slack
        arcs = np.flatnonzero(np.isfinite(self.arcs[k, 0]))
        if arcs.size:
            _, _, radius, growth, angle, sweep = self.arcs[k[arcs]].T
            s = pieces[arcs, 1:]
            radii = radius[:, None] + s * growth[:, None]
            angles = angle[:, None] + s * sweep[:, None]
            # Each derivative turns by a right angle: (r c)' = g c + r w c', (r c)'' = 2 g w c' + r w^2 c''.
            by_growth = order * growth * sweep ** (order - 1)
            by_radius = radii * (sweep**order)[:, None]
            size = np.abs(by_growth) + np.abs(by_radius).max(axis=1)
            size *= 8 + np.abs(angles).max(axis=1)
            for axis, turn in ((0, 0.0), (1, -0.5 * np.pi)):
                before, after = (_cosines(angles + turn + 0.5 * np.pi * n) for n in (order - 1, order))
                one = by_growth[:, None] * before
                other = by_radius[:, :, None] * after[:, None, :]
                at = arcs, self.axes[k[arcs], axis]
                low[at] = one.min(axis=1) + other.min(axis=(1, 2)) - _OUTWARDS * size
                high[at] = one.max(axis=1) + other.max(axis=(1, 2)) + _OUTWARDS * size
        return np.hstack([low, turns[0]]), np.hstack([high, turns[1]])

    def rates(self, pieces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, 6) of these derivatives by seconds, over pieces (B, 3)."""
        seconds = self.seconds[pieces[:, 0].astype(int), None]
        low, high = (each / seconds for each in self.derivatives(pieces))
        return low - _OUTWARDS * np.abs(low), high + _OUTWARDS * np.abs(high)

    def random(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random points of the path as pieces (count, 3) without a length."""
        rows, part = rng.integers(0, len(self.pieces), count), rng.random(count)
        k, low, high = self.pieces[rows].T
        s = low + part * (high - low)
        return np.stack([k, s, s], axis=1)

    def points(self, pieces: FloatArray, part: float) -> FloatArray:
        """Return coordinates (B, c) of computed points of pieces."""
        s = pieces[:, 1] + part * (pieces[:, 2] - pieces[:, 1])
        low, high = self.boxes(np.stack([pieces[:, 0], s, s], axis=1), pieces)
        return 0.5 * low + 0.5 * high


def _cosines(angles: FloatArray) -> FloatArray:
    """Return the ends (B, 2) of the cosines over ranges (B, 2) of angles, whose ends may be exchanged."""
    low, high = angles.min(axis=1), angles.max(axis=1)
    ends = np.cos(angles)
    # Multiples of pi in the range, with room for their rounding.
    has_one = np.floor(high / (2 * np.pi) + 1e-12) >= np.ceil(low / (2 * np.pi) - 1e-12)
    has_minus = np.floor(high / (2 * np.pi) - 0.5 + 1e-12) >= np.ceil(low / (2 * np.pi) - 0.5 - 1e-12)
    least = np.where(has_minus, -1.0, ends.min(axis=1))
    most = np.where(has_one, 1.0, ends.max(axis=1))
    return np.stack([least, most], axis=1)
