"""Boxes of poses that cover pieces of a tool path, in the coordinates of a :class:`~.pose_box.PoseBox`.

Dimensions that change along the path are further coordinates. They are linear functions of the parameter.

Positions on a line are monotone. Positions on an arc are products of a radius and of cosines over ranges. In a rotated
frame, a coordinate ``u cos a + v sin a`` of a circle is again a cosine, ``hypot(u, v) cos(a - atan2(v, u))``, and a
helix adds its height. Ends move outwards by several roundings. Ranges of rotations come from :mod:`.path_turns`.
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

    from ....path.frame import PathFrame

#: Relative outward shift of the ends of a piece, more than the rounding of its formulas.
_OUTWARDS = 2.0**-48
#: Number of pieces whose points are computed at once.
_BLOCK = 2**15


class Place(NamedTuple):
    """Place on a path: a segment, and the parameter along this segment.

    Attributes:
        segment: index of the segment.
        parameter: parameter from 0 to 1 along the segment.
    """

    segment: int
    parameter: float


def place_in(piece: FloatArray, part: float) -> Place:
    """Return the place on a path at a fraction, from 0 to 1, of a piece (3,)."""
    segment, low, high = piece.tolist()
    return Place(int(segment), low + part * (high - low) if part < 1 else high)


class _CircleRows(NamedTuple):
    """A world coordinate of A arcs: ``centre + size r cos(a - phase) + rise (height + s change)``.

    Here r is the radius, a the angle, and s the parameter from 0 to 1 along the arc.

    Attributes:
        axis: index of the coordinate.
        which: (A,) indices of the arcs.
        centre: (A,) coordinate of the centre, at the height 0.
        size: (A,) amplitude per radius, at most 1.
        phase: (A,) phase, radians.
        rise: (A,) derivative of the coordinate with respect to the height.
        height: (A,) height at the start, along the normal of the arc's plane.
        change: (A,) change of the height along the arc.
        off: (A,) sum of the magnitudes from which centre and height are computed; it bounds rounding errors.
        off_change: (A,) sum of the magnitudes from which the change of the height is computed.
    """

    axis: int
    which: NDArray[np.intp]
    centre: FloatArray
    size: FloatArray
    phase: FloatArray
    rise: FloatArray
    height: FloatArray
    change: FloatArray
    off: FloatArray
    off_change: FloatArray


@dataclass(frozen=True, eq=False)
class PathCover:
    """Tool path that is covered by boxes of poses, one for each piece of a segment.

    Attributes:
        knots: (N + 1, 3) positions in the path's frame.
        arcs: (N, 6) centre, radius, growth of the radius, angle and sweep of arcs in the path's frame; NaN for lines.
        axes: (N, 3) indices of the two axes of an arc's plane, and of its normal.
        turns: rotations along the path.
        seconds: (N,) durations of the segments; infinite (standstill) for segments without a known duration.
        frame: frame of the path in the world; None if it is the world frame.
        settings: (N + 1, k) dimensions that change along the path, at the knots.
    """

    knots: FloatArray
    arcs: FloatArray
    axes: NDArray[np.intp]
    turns: PathTurns
    seconds: FloatArray
    frame: PathFrame | None = None
    settings: FloatArray | None = None

    @cached_property
    def pieces(self) -> FloatArray:
        """Pieces (M, 3) of the segments: index, and both ends of the parameter; large turns are divided."""
        count = len(self.knots) - 1
        parts = np.ones(count) if self.turns.counts is None else self.turns.counts.astype(float)
        rows, ends = divided(np.tile([0.0, 1.0], (count, 1)), parts)
        found = np.concatenate([rows[:, None], ends], axis=1)
        found.flags.writeable = False
        return found

    def blocks(self) -> Iterator[slice]:
        """Yield the indices of :attr:`pieces` in blocks, so that a long path needs little memory."""
        return (slice(begin, begin + _BLOCK) for begin in range(0, len(self.pieces), _BLOCK))

    def boxes(self, pieces: FloatArray, within: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, c) of boxes that cover pieces (B, 3).

        Args:
            pieces: indices of segments, and both ends of the parameter.
            within: (B, 3) pieces that define the references of rotations; the pieces themselves if left out.
        """
        k = pieces[:, 0].astype(int)
        (start, off), (end, off_end) = self._in_world(k), self._in_world(k + 1)
        change, off = end - start, np.maximum(off, off_end)
        ends = [start + s[:, None] * change for s in (pieces[:, 1], pieces[:, 2])]
        slack = _OUTWARDS * (np.abs(start) + np.abs(change)) + TINY + off
        low, high = np.minimum(*ends) - slack, np.maximum(*ends) + slack
        # Fixed coordinates stay fixed.
        low, high = (np.where((change == 0) & (off == 0), start, each) for each in (low, high))
        arcs = np.flatnonzero(np.isfinite(self.arcs[k, 0]))
        if arcs.size:
            _, _, radius, growth, angle, sweep = self.arcs[k[arcs]].T
            s = pieces[arcs, 1:]
            radii = radius[:, None] + s * growth[:, None]
            angles = angle[:, None] + s * sweep[:, None]
            for row in self._circles(k[arcs]):
                products = radii[row.which, :, None] * _cosines(angles[row.which] - row.phase[:, None])[:, None, :]
                products *= row.size[:, None, None]
                heights = row.rise[:, None] * (row.height[:, None] + s[row.which] * row.change[:, None])
                size = np.abs(radii[row.which]).max(axis=1) * (4 + np.abs(angles[row.which]).max(axis=1))
                slack = _OUTWARDS * (row.off + size)
                at = arcs[row.which], row.axis
                low[at] = row.centre + products.min(axis=(1, 2)) + heights.min(axis=1) - slack
                high[at] = row.centre + products.max(axis=(1, 2)) + heights.max(axis=1) + slack
            # The ends of an arc meet its knots up to rounding, or up to the tolerance of a G-code program.
            for index, knots in enumerate((start, end)):
                at = arcs[s[:, index] == index]
                low[at], high[at] = np.minimum(low[at], (knots - off)[at]), np.maximum(high[at], (knots + off)[at])
        turns = self.turns.boxes(k, pieces[:, 1:], None if within is None else within[:, 1:])
        settings = self._settings(k, pieces[:, 1:])
        return np.hstack([low, turns[0], settings[0]]), np.hstack([high, turns[1], settings[1]])

    def _settings(self, k: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, d) of the dimensions over pieces of segments (B,) between ends (B, 2)."""
        if self.settings is None:
            return np.zeros((len(k), 0)), np.zeros((len(k), 0))
        start, change = self.settings[k], self.settings[k + 1] - self.settings[k]
        low, high = np.sort([start + s[:, None] * change for s in ends.T], axis=0)
        slack = np.where(change == 0, 0.0, _OUTWARDS * (np.abs(start) + np.abs(change)))
        return low - slack, high + slack

    def _in_world(self, knots: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return positions (B, 3) of knots in the world frame, and bounds of the rounding errors of the conversion."""
        points = self.knots[knots]
        if self.frame is None:
            return points, np.zeros_like(points)
        return self.frame.positions(points), self.frame.off_positions(points)

    def _circles(self, k: NDArray[np.intp]) -> Iterator[_CircleRows]:
        """Yield each world coordinate of arcs that is not linear.

        Args:
            k: (A,) segments of the arcs.
        """
        frame, axes = self.frame, self.axes[k]
        every, (first, second, along) = np.arange(len(k)), axes.T
        centres = np.zeros((len(k), 3))
        centres[every, first], centres[every, second] = self.arcs[k, 0], self.arcs[k, 1]
        heights = self.knots[k, along], self.knots[k + 1, along] - self.knots[k, along]
        sizes, (R, pattern) = np.abs(centres), (np.eye(3), np.eye(3, dtype=bool))
        if frame is not None:
            sizes, centres, R, pattern = frame.sizes(centres), frame.positions(centres), frame.rotation, frame.pattern
        for axis in range(3):
            which = np.flatnonzero(pattern[axis, first] | pattern[axis, second])
            u, v, rise = R[axis, axes[which]].T
            height, change = (each[which] for each in heights)
            rises = pattern[axis, along[which]]
            yield _CircleRows(
                axis=axis,
                which=which,
                centre=centres[which, axis],
                size=np.hypot(u, v),
                phase=np.arctan2(v, u),
                rise=rise,
                height=height,
                change=change,
                off=sizes[which, axis] + rises * (np.abs(height) + np.abs(change)),
                off_change=rises * np.abs(change),
            )

    def derivatives(self, pieces: FloatArray, order: int = 1) -> tuple[FloatArray, FloatArray]:
        """Return bounds (B, 6 + d) of derivatives with respect to the parameter, over pieces (B, 3).

        The rows contain derivatives of positions, then derivatives of roll, pitch and yaw or angular velocities in the
        world frame, then derivatives of the dimensions that change.

        Args:
            pieces: indices of segments, and both ends of the parameter.
            order: order of the derivative, 1; for roll, pitch and yaw also 2.
        """
        k = pieces[:, 0].astype(int)
        turns = self.turns.derivatives(k, pieces[:, 1:]) if order == 1 else np.zeros((2, len(k), 3))
        change = self.knots[k + 1] - self.knots[k] if order == 1 else np.zeros((len(k), 3))
        off = np.zeros_like(change)
        if self.frame is not None:
            change, off = self.frame.vectors(change), self.frame.off_vectors(change)
        slack = _OUTWARDS * np.abs(change) + off
        low, high = change - slack, change + slack
        arcs = np.flatnonzero(np.isfinite(self.arcs[k, 0]))
        if arcs.size:
            _, _, radius, growth, angle, sweep = self.arcs[k[arcs]].T
            s = pieces[arcs, 1:]
            radii = radius[:, None] + s * growth[:, None]
            angles = angle[:, None] + s * sweep[:, None]
            # Each derivative shifts the cosine: (r c)' = g c + r w c', (r c)'' = 2 g w c' + r w^2 c''.
            by_growth = order * growth * sweep ** (order - 1)
            by_radius = radii * (sweep**order)[:, None]
            size = np.abs(by_growth) + np.abs(by_radius).max(axis=1)
            size *= 8 + np.abs(angles).max(axis=1)
            for row in self._circles(k[arcs]):
                turned = angles[row.which] - row.phase[:, None]
                before, after = (_cosines(turned + 0.5 * np.pi * n) for n in (order - 1, order))
                one = (row.size * by_growth[row.which])[:, None] * before
                other = (row.size[:, None] * by_radius[row.which])[:, :, None] * after[:, None, :]
                rise = row.rise * row.change if order == 1 else np.zeros(len(row.which))
                slack = _OUTWARDS * (size[row.which] + row.off_change * (order == 1))
                at = arcs[row.which], row.axis
                low[at] = one.min(axis=1) + other.min(axis=(1, 2)) + rise - slack
                high[at] = one.max(axis=1) + other.max(axis=(1, 2)) + rise + slack
        resets = np.zeros((len(k), 0))
        if self.settings is not None:
            resets = (self.settings[k + 1] - self.settings[k]) * (order == 1)
        slack = _OUTWARDS * np.abs(resets)
        return np.hstack([low, turns[0], resets - slack]), np.hstack([high, turns[1], resets + slack])

    def rates(self, pieces: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return bounds (B, 6 + d) of derivatives with respect to time, per second, over pieces (B, 3)."""
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
        """Return the coordinates (B, c) of the points at a fraction, from 0 to 1, of pieces, in floating point."""
        s = pieces[:, 1] + part * (pieces[:, 2] - pieces[:, 1])
        low, high = self.boxes(np.stack([pieces[:, 0], s, s], axis=1), pieces)
        return 0.5 * low + 0.5 * high


def _cosines(angles: FloatArray) -> FloatArray:
    """Return the ends (B, 2) of the cosines over ranges (B, 2) of angles, with ends in any order."""
    low, high = angles.min(axis=1), angles.max(axis=1)
    ends = np.cos(angles)
    # Multiples of pi in the range, with a margin for rounding.
    has_one = np.floor(high / (2 * np.pi) + 1e-12) >= np.ceil(low / (2 * np.pi) - 1e-12)
    has_minus = np.floor(high / (2 * np.pi) - 0.5 + 1e-12) >= np.ceil(low / (2 * np.pi) - 0.5 - 1e-12)
    least = np.where(has_minus, -1.0, ends.min(axis=1))
    most = np.where(has_one, 1.0, ends.max(axis=1))
    return np.stack([least, most], axis=1)
