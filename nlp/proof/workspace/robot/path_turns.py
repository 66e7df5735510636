"""Rotations along a tool path as ranges of the coordinates of a :class:`~.pose_box.PoseBox`.

Roll, pitch and yaw that change linearly have monotone tangents of their halves. Other rotations have Cayley vectors
``r = v / w`` of quaternions ``(w, v)``, relative to a reference at less than half a turn from the whole path. A turn
about a fixed axis moves the quaternion along a great circle, and r along a straight line. For angles in any convention
the quaternion is a product of three; a bound of the second derivative bounds the distance of r from a chord. The
rotation of the path's frame, one more factor on the left, does not change norms. If no reference is near the whole
path, each piece has a reference of its own; see :mod:`.long_turns`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .....models import FloatArray
from ....case.workspace import TurnKind
from ....path.orientation import Order, quaternion_products, quaternions_from_angles, shortest_turns, turned
from .pose_box import UNTURNED, Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....path.frame import PathFrame

#: Outward shift of an end, relative to a tangent and its angle, more than the rounding of its formulas.
_OUTWARDS = 2.0**-48
#: Outward shift of an end that is not 0, more than the rounding of subnormal numbers.
TINY = float(np.finfo(float).tiny)
#: Error bound of a computed unit quaternion, and its increase for each radian of the angles.
ROUNDED, PER_RADIAN = 2.0**-47, 2.0**-51
#: Outward factor of the bound of a chord's error, for rounding.
_UP = 1 + 1e-12
#: Largest sum of the changes of three angles over one chord, radians.
CHORD = 0.25


class PathTurns(Protocol):
    """Rotations of a path of N segments, as coordinates."""

    @property
    def kind(self) -> TurnKind:
        """Coordinates of rotations."""
        ...

    @property
    def reference(self) -> Reference:
        """Rotation whose Cayley vector is zero."""
        ...

    @property
    def counts(self) -> NDArray[np.intp] | None:
        """Number (N,) of equal parts of each segment, with one reference for each part; None for one reference."""
        ...

    def boxes(
        self, segments: NDArray[np.intp], ends: FloatArray, within: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, c) of ranges over pieces of segments (B,) between ends (B, 2) of the parameter.

        Args:
            segments: indices of the segments.
            ends: ends of the pieces.
            within: (B, 2) ends of the pieces that define the references; the pieces themselves if left out.
        """
        ...

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return bounds (B, 3) of roll, pitch and yaw rates, or of angular velocities, per unit of the parameter.

        Angular velocities are in the world frame.
        """
        ...


class OneReference(ABC):
    """Rotations of a path relative to one reference, so that no part of a segment has a reference of its own."""

    counts = None

    def boxes(
        self,
        segments: NDArray[np.intp],
        ends: FloatArray,
        within: FloatArray | None = None,  # noqa: ARG002
    ) -> tuple[FloatArray, FloatArray]:
        """Return ranges over pieces; see :class:`PathTurns`."""
        return self.over(segments, ends)

    @abstractmethod
    def over(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, 3) of ranges over pieces of segments (B,) between ends (B, 2) of the parameter."""


class TurnsAtRates(Protocol):
    """Rotations of a path whose quaternions are products of factors that turn at constant rates in each segment."""

    @property
    def widths(self) -> FloatArray:
        """Sums (N,) of the changes of all angles over each segment, radians."""
        ...

    def quaternions(self, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
        """Return the quaternions (B, 4), relative to the reference, at parameters (B,) of segments (B,)."""
        ...


@dataclass(frozen=True, eq=False)
class Tangents(OneReference):
    """Roll, pitch and yaw that change linearly, as tangents of their halves.

    Attributes:
        angles: (N + 1, 3) angles at the knots, radians.
        off: error bound of each angle, radians.
    """

    angles: FloatArray
    off: float = 0.0
    kind = TurnKind.ROLL_PITCH_YAW
    reference = UNTURNED

    def over(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges (B, 3) over pieces."""
        start, change = self.angles[segments], self.angles[segments + 1] - self.angles[segments]
        low, high = np.sort([start + s[:, None] * change for s in ends.T], axis=0)
        # Fixed coordinates stay fixed.
        slack = np.where(change == 0, 0.0, _OUTWARDS * (np.abs(start) + np.abs(change))) + self.off
        low, high = np.tan(0.5 * (low - slack)), np.tan(0.5 * (high + slack))
        tiny = np.where((start == 0) & (change == 0) & (self.off == 0), 0.0, TINY)
        return low - _OUTWARDS * np.abs(low) - tiny, high + _OUTWARDS * np.abs(high) + tiny

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        """Return derivatives of the angles over pieces; see :class:`PathTurns`."""
        change = self.angles[segments + 1] - self.angles[segments]
        slack = _OUTWARDS * np.abs(change)
        return change - slack, change + slack


@dataclass(frozen=True, eq=False)
class ShortestTurns(OneReference):
    """Turns about fixed axes as Cayley vectors.

    Attributes:
        knots: (N + 1, 4) quaternions at the knots, relative to the reference; each near the one before.
        off: (N + 1,) error bounds of the quaternions.
        halves: (N,) half angles of the turns, radians.
        velocities: (N, 3) axes in the world frame times the angles.
        vary, turning: (3,) 0 for coordinates, and velocities, that are zero at all points; otherwise 1.
        reference: reference of the Cayley vectors.
    """

    knots: FloatArray
    off: FloatArray
    halves: FloatArray
    velocities: FloatArray
    vary: FloatArray
    turning: FloatArray
    reference: Reference
    kind = TurnKind.ANY_AXIS

    def over(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges (B, 3) over pieces.

        Between two points of a great circle with scalars of one sign, r moves on a straight line.
        """
        quaternions, off = self._quaternions(segments, ends), self._off(segments)
        # Scalars are concave along a great circle.
        least = np.abs(quaternions[:, :, 0]).min(axis=0) - off
        with np.errstate(divide="ignore"):
            return _hull(quaternions, least, _vector_slack(off, least), self.vary)

    def _quaternions(self, segments: NDArray[np.intp], ends: FloatArray) -> FloatArray:
        """Return quaternions (2, B, 4) at ends of pieces, of norm at most 1."""
        half = self.halves[segments, None]
        before, after = ((s * _sine_ratio(s * half)).T[:, :, None] for s in (1 - ends, ends))
        return np.asarray(before * self.knots[segments] + after * self.knots[segments + 1])

    @cached_property
    def widths(self) -> FloatArray:
        """Angles (N,) of the turns, radians."""
        return np.asarray(2 * self.halves)

    def quaternions(self, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
        """Return the quaternions (B, 4), relative to the reference, at parameters (B,) of segments (B,)."""
        return turned_between(self.knots[segments], self.knots[segments + 1], s)

    def _off(self, segments: NDArray[np.intp]) -> FloatArray:
        """Return error bounds (B,) of quaternions and angular velocities over pieces, from errors at both knots."""
        return np.asarray(16 * np.maximum(self.off[segments], self.off[segments + 1]))

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        """Return angular velocities over pieces; see :class:`PathTurns`."""
        middle, slack = self.velocities[segments], self._off(segments)[:, None] * self.turning
        return middle - slack, middle + slack


@dataclass(frozen=True, eq=False)
class LinearAngles(OneReference):
    """Angles of any convention that change linearly, as Cayley vectors.

    Attributes:
        angles: (N + 1, 3) angles at the knots, radians.
        order: convention of the angles.
        reference: reference of the Cayley vectors.
        frame: frame of the angles; None for the world.
    """

    angles: FloatArray
    order: Order
    reference: Reference
    frame: PathFrame | None = None
    kind = TurnKind.ANY_AXIS

    @cached_property
    def widths(self) -> FloatArray:
        """Sums (N,) of the changes of the angles over each segment, radians."""
        return np.asarray(np.abs(np.diff(self.angles, axis=0)).sum(axis=1))

    def quaternions(self, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
        """Return the quaternions (B, 4), relative to the reference, at parameters (B,) of segments (B,)."""
        start = self.angles[segments]
        angles = start + s[:, None] * (self.angles[segments + 1] - start)
        return relative(in_world(quaternions_from_angles(angles, self.order), self.frame), self.reference)

    @cached_property
    def _vary(self) -> FloatArray:
        """0 for coordinates (3,) that are zero at all points; else 1."""
        return varying(self.angles, self.order, self.reference, self.frame)

    @cached_property
    def rounded(self) -> float:
        """Error bound of a quaternion of exact angles; with a frame, the quaternion is a product of one more factor."""
        return ROUNDED if self.frame is None else 2 * ROUNDED

    def over(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges (B, 3) over pieces."""
        start, change = self.angles[segments], self.angles[segments + 1] - self.angles[segments]
        off = self.rounded + PER_RADIAN * (np.abs(start) + np.abs(change)).sum(axis=1)
        return chord_hull(self, segments, ends, off, self._vary)

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angular velocities over pieces; see :class:`PathTurns`."""
        start, change = self.angles[segments], self.angles[segments + 1] - self.angles[segments]
        first, second, third = np.abs(change[:, list(self.order)]).T
        middle = _angular_velocities(start + ends.mean(axis=1)[:, None] * change, change, self.order)
        # The axis of a rate turns with the angles before it.
        turned = (first * second + (first + second) * third) * (ends[:, 1] - ends[:, 0]) / 2
        off = (self.rounded + PER_RADIAN * (np.abs(start) + np.abs(change)).sum(axis=1)) * 4 * (first + second + third)
        # The slack bounds the norm of a vector, so it is valid in any frame.
        vary = varying(self.angles, self.order, UNTURNED)
        if self.frame is not None:
            middle, vary = self.frame.vectors(middle), turning_in_world(vary, self.frame)
        slack = (turned + off)[:, None] * vary
        return middle - slack, middle + slack


def chord_hull(
    turns: TurnsAtRates, segments: NDArray[np.intp], ends: FloatArray, off: FloatArray, vary: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ranges (B, 3) of Cayley vectors over pieces, from chords between quaternions.

    Args:
        turns: the rotations.
        segments: (B,) indices of the segments.
        ends: (B, 2) ends of the parameter.
        off: (B,) error bounds of quaternions.
        vary: (3,) 0 for coordinates that are zero at all points; otherwise 1.
    """
    widths = turns.widths[segments]
    rows, parts = divided(ends, np.ceil(widths * (ends[:, 1] - ends[:, 0]) / CHORD))
    both = np.stack([turns.quaternions(segments[rows], s) for s in parts.T])
    # A quaternion's derivative is at most half the sum of the angles' rates, its second derivative that squared.
    bend, off = (0.5 * widths[rows] * (parts[:, 1] - parts[:, 0])) ** 2 / 8 * _UP, off[rows]
    least = np.abs(both[:, :, 0]).min(axis=0) - bend - off
    with np.errstate(divide="ignore"):
        slack = _vector_slack(off, least) + bend * (1 / least**2 + 2 / least**3) * _UP
    low, high = _hull(both, least, slack, vary)
    first = np.flatnonzero(np.diff(rows, prepend=-1))
    return np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)


def turned_between(first: FloatArray, last: FloatArray, s: FloatArray) -> FloatArray:
    """Return the quaternions (n, 4) at fractions (n,) of the shortest rotations between quaternions (n, 4)."""
    axes, angles = shortest_turns(first, last)
    return turned(first, axes, s * angles)


def relative(quaternions: FloatArray, reference: Reference) -> FloatArray:
    """Return quaternions (n, 4) relative to a reference: q with ``q reference`` equal to the given quaternions."""
    if reference == UNTURNED:
        return quaternions
    inverse = np.array(reference) * [1.0, -1, -1, -1] / math.hypot(*reference)
    return quaternion_products(quaternions, inverse[None])


def in_world(quaternions: FloatArray, frame: PathFrame | None) -> FloatArray:
    """Return quaternions (n, 4) of a frame in the world; frame None is the world."""
    return quaternions if frame is None else frame.orientations(quaternions)


def turning_in_world(turning: FloatArray, frame: PathFrame | None) -> FloatArray:
    """Return 0 for components (3,) in the world that are exactly zero at all points; otherwise 1.

    Args:
        turning: (3,) 0 for components in the frame that are exactly zero at all points; otherwise 1.
        frame: the frame; None for the world.
    """
    return turning if frame is None else np.asarray((frame.pattern @ turning > 0).astype(float))


def varying(angles: FloatArray, order: Order, reference: Reference, frame: PathFrame | None = None) -> FloatArray:
    """Return 0 for components (3,) of Cayley vectors that are exactly zero at all points; otherwise 1.

    The product of the quaternion units i and j is, up to its sign, the unit with index ``i XOR j``.

    Args:
        angles: (n, 3) angles at points, radians.
        order: convention of the angles.
        reference: reference of the Cayley vectors.
        frame: frame of the angles; None for the world.
    """
    factors = [(axis, angles[:, axis].any()) for axis in order]
    if frame is not None:
        factors += [(axis, frame.angles[axis] != 0) for axis in range(3)]
    found = {0}
    for axis, turns in factors:
        found |= {unit ^ (1 + axis) for unit in found if turns}
    found = {unit ^ other for unit in found for other in range(4) if reference[other]}
    return np.array([float(unit in found) for unit in (1, 2, 3)])


def _hull(
    quaternions: FloatArray, least: FloatArray, slack: FloatArray, vary: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ranges (B, 3) of Cayley vectors; infinite where the scalar is not provably of one sign.

    Args:
        quaternions: (2, B, 4) quaternions at both ends.
        least: (B,) smallest absolute scalars between the ends.
        slack: (B,) distances of the vectors from the line between the ends.
        vary: (3,) 0 for coordinates that are zero at all points; otherwise 1.
    """
    with np.errstate(all="ignore"):
        points = quaternions[:, :, 1:] / quaternions[:, :, :1]
        room, lost = slack[:, None] * vary, (quaternions[:, :, 0].prod(axis=0) <= 0) | ~(least > 0)
        low, high = points.min(axis=0) - room, points.max(axis=0) + room
    low[lost], high[lost] = (np.where(vary > 0, end, 0.0) for end in (-np.inf, np.inf))
    return low, high


def divided(ends: FloatArray, counts: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return equal parts of ranges: the index (P,) of each part's range, in order, and the ends (P, 2) of the parts.

    Args:
        ends: (B, 2) ends of the ranges.
        counts: (B,) number of parts of each range; 0 counts as 1.
    """
    numbers = np.maximum(counts, 1).astype(int)
    rows = np.repeat(np.arange(len(ends)), numbers)
    j = np.arange(len(rows)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    (low, high), n = ends[rows].T, numbers[rows]
    first, last = low + j / n * (high - low), low + (j + 1) / n * (high - low)
    return rows, np.stack([first, np.where(j + 1 == n, high, last)], axis=1)


def _angular_velocities(angles: FloatArray, rates: FloatArray, order: Order) -> FloatArray:
    """Return the angular velocities (B, 3) in the world frame from angles (B, 3) and their rates."""
    found, turn = np.zeros_like(angles), np.broadcast_to([1.0, 0, 0, 0], (len(angles), 4))
    for axis in order:
        about = np.zeros_like(turn)
        about[:, 1 + axis] = rates[:, axis]
        found += quaternion_products(quaternion_products(turn, about), turn * [1.0, -1, -1, -1])[:, 1:]
        own = np.zeros_like(angles)
        own[:, axis] = angles[:, axis]
        turn = quaternion_products(turn, quaternions_from_angles(own, order))
    return found


def _vector_slack(off: FloatArray, least: FloatArray) -> FloatArray:
    """Return error bounds (B,) of the Cayley vectors of unit quaternions.

    Args:
        off: (B,) errors of the quaternions; ``v / w`` has this error times ``1 / w`` and the norm of (1, v / w).
        least: (B,) smallest scalars of the quaternions.
    """
    return off / least**2 * _UP


def _sine_ratio(angles: FloatArray) -> FloatArray:
    """Return ``sin(a) / a``."""
    return np.divide(np.sin(angles), angles, out=np.ones_like(angles), where=angles != 0)
