"""Rotations along a path as ranges of the coordinates of a :class:`~.pose_box.PoseBox`.

Roll, pitch and yaw that change linearly have monotone tangents of their halves. Other rotations have Cayley vectors
``r = v / w`` of quaternions ``(w, v)``, relative to a reference to which the whole path is nearer than half a turn. A
turn about a fixed axis moves the quaternion along a great circle, and so r along a straight line. With angles in any
convention the quaternion is a product of three; r is off the chord between two points by a bound of its second
derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from .....models import FloatArray
from ....case.workspace import TurnKind
from ....errors import InputError
from ....path.options import Between
from ....path.orientation import ORDERS, Order, quaternion_products, quaternions_from_angles, shortest_turns
from .pose_box import UNTURNED, Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....path.path import ProgrammedPath

#: Part of a tangent's, and its angle's, sizes by which its ends move outwards: more than the rounding of its formulas.
_OUTWARDS = 2.0**-48
#: By which an end that is not 0 moves too: more than the rounding of numbers that are so small that they lack digits.
TINY = float(np.finfo(float).tiny)
#: By which a computed unit quaternion may be off, and more of it for each radian of the angles it is computed from.
_ROUNDED, _PER_RADIAN = 2.0**-47, 2.0**-51
#: Part of itself by which a bound of a chord's error is more than its rounding.
_UP = 1 + 1e-12
#: Angles from which on the tangent of the half is too large a coordinate, and its cosine: the least scalar.
_LARGEST = math.radians(149)
_LEAST = math.cos(_LARGEST / 2)
#: Sum of the changes of three angles over which a chord is taken at most, and over a whole segment, radians.
_CHORD, _MOST = 0.25, 250.0
#: Least scalar of quaternions for which no other reference is needed: of a right angle.
_NEAR = math.sqrt(0.5)
#: Steps in the search of the middle of rotations, most rotations that are looked at, and largest part of the reference.
_STEPS, _SAMPLES, _ROUND = 100, 8192, 8


class PathTurns(Protocol):
    """Rotations of a path of N segments, as coordinates."""

    @property
    def kind(self) -> TurnKind:
        """Coordinates of rotations."""
        ...

    @property
    def reference(self) -> Reference:
        """Rotation with the Cayley vector zero."""
        ...

    def boxes(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, 3) of ranges over pieces of segments (B,) between ends (B, 2) of the parameter."""
        ...

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ends (B, 3) of derivatives by the parameter: of Cayley vectors, or of roll, pitch and yaw."""
        ...


@dataclass(frozen=True, eq=False)
class Tangents:
    """Roll, pitch and yaw that change linearly, as tangents of their halves.

    Attributes:
        angles: (N + 1, 3) at the knots.
    """

    angles: FloatArray
    kind = TurnKind.ROLL_PITCH_YAW
    reference = UNTURNED

    def boxes(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges over pieces; see :class:`PathTurns`."""
        start, change = self.angles[segments], self.angles[segments + 1] - self.angles[segments]
        low, high = np.sort([start + s[:, None] * change for s in ends.T], axis=0)
        # Fixed coordinates stay so.
        slack = np.where(change == 0, 0.0, _OUTWARDS * (np.abs(start) + np.abs(change)))
        low, high = np.tan(0.5 * (low - slack)), np.tan(0.5 * (high + slack))
        tiny = np.where((start == 0) & (change == 0), 0.0, TINY)
        return low - _OUTWARDS * np.abs(low) - tiny, high + _OUTWARDS * np.abs(high) + tiny

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002
        """Return derivatives of the angles over pieces; see :class:`PathTurns`."""
        change = self.angles[segments + 1] - self.angles[segments]
        slack = _OUTWARDS * np.abs(change)
        return change - slack, change + slack


@dataclass(frozen=True, eq=False)
class ShortestTurns:
    """Turns about fixed axes as Cayley vectors.

    Attributes:
        scalars: (N + 1,) of unit quaternions at the knots, relative to the reference; positive.
        vectors: (N + 1, 3) Cayley vectors there.
        slack: (N + 1, 3) by which vectors between such knots may be off.
        halves: (N,) half the angles of the turns.
        reference: of the vectors.
    """

    scalars: FloatArray
    vectors: FloatArray
    slack: FloatArray
    halves: FloatArray
    reference: Reference
    kind = TurnKind.ANY_AXIS

    def boxes(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges over pieces; see :class:`PathTurns`."""
        k, half, start = segments, self.halves[segments, None], self.vectors[segments]
        before = (1 - ends) * _sine_ratio((1 - ends) * half) * self.scalars[k, None]
        after = ends * _sine_ratio(ends * half) * self.scalars[k + 1, None]
        part = after / (before + after)
        points = start[:, None] + part[:, :, None] * (self.vectors[k + 1] - start)[:, None]
        slack = np.maximum(self.slack[k], self.slack[k + 1])
        return points.min(axis=1) - slack, points.max(axis=1) + slack

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return derivatives over pieces; see :class:`PathTurns`.

        The place on the line between the vectors at both knots has the derivative ``w_0 w_1 sin(h) / (h f^2)`` with h
        half the angle and ``f = (w_0 sin((1 - s) h) + w_1 sin(s h)) / h``, which is concave and at most 1.
        """
        k, half = segments, self.halves[segments, None]
        scalars = [self.scalars[k, None], self.scalars[k + 1, None]]
        f = (1 - ends) * _sine_ratio((1 - ends) * half) * scalars[0] + ends * _sine_ratio(ends * half) * scalars[1]
        above = f.max(axis=1, keepdims=True) + (half * (ends[:, 1:] - ends[:, :1])) ** 2 / 8 * _UP
        factor, change = scalars[0] * scalars[1] * _sine_ratio(half), self.vectors[k + 1] - self.vectors[k]
        slack = self.slack[k] + self.slack[k + 1]
        # What scalars are off by is less than the slack of vectors, and f is at least a quarter.
        off = 2.0**-46 + 64 * slack.max(axis=1, keepdims=True)
        least, most = (factor / each**2 for each in (above, f.min(axis=1, keepdims=True)))
        slack = most * (slack + off * np.abs(change))
        both = least * change, most * change
        return np.minimum(*both) - slack, np.maximum(*both) + slack


@dataclass(frozen=True, eq=False)
class LinearAngles:
    """Angles of any convention that change linearly, as Cayley vectors.

    Attributes:
        angles: (N + 1, 3) at the knots.
        order: of the convention.
        sign: of the quaternions of the angles, so that their scalars are positive relative to the reference.
        reference: of the vectors.
    """

    angles: FloatArray
    order: Order
    sign: float
    reference: Reference
    kind = TurnKind.ANY_AXIS

    @cached_property
    def _vary(self) -> FloatArray:
        """1 for the coordinates (3,) that are not zero at all points, else 0."""
        return _varying(self.angles, self.order, self.reference)

    def boxes(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ranges over pieces; see :class:`PathTurns`."""
        change = self.angles[segments + 1] - self.angles[segments]
        width = np.abs(change).sum(axis=1) * (ends[:, 1] - ends[:, 0])
        rows, parts = _divided(ends, np.ceil(width / _CHORD))
        start, change = self.angles[segments[rows]], change[rows]
        each = [start + s[:, None] * change for s in parts.T]
        quaternions = [self.sign * _relative(quaternions_from_angles(at, self.order), self.reference) for at in each]
        off = _ROUNDED + _PER_RADIAN * (np.abs(start) + np.abs(change)).sum(axis=1)
        # A quaternion's derivative is at most half the sum of those of the angles, its second one that squared.
        bend = (0.5 * np.abs(change).sum(axis=1) * (parts[:, 1] - parts[:, 0])) ** 2 / 8 * _UP
        least = np.minimum(quaternions[0][:, 0], quaternions[1][:, 0]) - bend - off
        slack = _vector_slack(off, least) + bend * (1 / least**2 + 2 / least**3) * _UP
        points = np.stack([q[:, 1:] / q[:, :1] for q in quaternions])
        room = slack[:, None] * self._vary
        low, high = points.min(axis=0) - room, points.max(axis=0) + room
        first = np.flatnonzero(np.diff(rows, prepend=-1))
        return np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return derivatives over pieces; see :class:`PathTurns`.

        With the angular velocity w in the world frame, ``2 r' = w + w x r + (w . r) r``.
        """
        start, change = self.angles[segments], self.angles[segments + 1] - self.angles[segments]
        first, second, third = np.abs(change[:, list(self.order)]).T
        at = start + ends.mean(axis=1)[:, None] * change
        w = _angular_velocities(at, change, self.order)
        # A rate turns with the angles before it.
        turned = (first * second + (first + second) * third) * (ends[:, 1] - ends[:, 0]) / 2
        off = (_ROUNDED + _PER_RADIAN * (np.abs(start) + np.abs(change)).sum(axis=1)) * 4 * (first + second + third)
        w_off = np.broadcast_to((turned + off)[:, None], w.shape)
        low, high = self.boxes(segments, ends)
        r, r_off = 0.5 * low + 0.5 * high, (0.5 * high - 0.5 * low) * _UP
        along = (w * r).sum(axis=1, keepdims=True)
        along_off = (np.abs(w) * r_off + w_off * (np.abs(r) + r_off)).sum(axis=1, keepdims=True)
        middle = 0.5 * (w + np.cross(w, r) + along * r)
        parts = w_off + _most_across(np.abs(w), r_off) + _most_across(w_off, np.abs(r) + r_off)
        parts = parts + np.abs(along) * r_off + along_off * (np.abs(r) + r_off)
        sizes = (1 + np.abs(r)).sum(axis=1, keepdims=True) ** 2 * np.abs(w).max(axis=1, keepdims=True)
        slack = (0.5 * parts * _UP + _OUTWARDS * sizes) * self._vary
        return middle * self._vary - slack, middle * self._vary + slack


def turns_of_path(path: ProgrammedPath) -> PathTurns:
    """Return the rotations of a path.

    Raises:
        InputError: its rotations are too far from each other for one reference.
    """
    angles, is_slerp = path.knots[:, 3:], path.between is Between.SLERP
    if not is_slerp and path.order == ORDERS["rpy"] and np.abs(angles).max() < _LARGEST:
        return Tangents(angles)
    every, order = np.arange(len(path)), path.order
    if is_slerp:
        rows, quaternions = np.append(every, every[-1]), quaternions_from_angles(angles, order)
        _, turns = shortest_turns(quaternions[:-1], quaternions[1:])
        # Of both quaternions of a rotation the one nearer to that before.
        flips = (quaternions[:-1] * quaternions[1:]).sum(axis=1) < 0
        quaternions[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
    else:
        change = np.diff(angles, axis=0)
        width = np.abs(change).sum(axis=1)
        if width.max() > _MOST:
            line, most = path.lines[int(np.argmax(width))], round(math.degrees(_MOST), -3)
            raise InputError(f"{path.source}: line {line}: angles change by more than {most:g} degrees in all")
        rows, parts = _divided(np.tile([0.0, 1.0], (len(path), 1)), np.ceil(width / _CHORD))
        at = angles[rows] + parts[:, :1] * change[rows]
        rows, at = np.append(rows, rows[-1]), np.append(at, angles[-1:], axis=0)
        quaternions = quaternions_from_angles(at, order)
    reference = _reference(quaternions)
    relative = _relative(quaternions, reference)
    sign = math.copysign(1.0, float(relative[:, 0].sum()))
    scalars = sign * relative[:, 0]
    if not scalars.min() > _LEAST:
        line = path.lines[rows[np.flatnonzero(~(scalars > _LEAST))[-1]]]
        fault = f"is turned by {math.degrees(_LARGEST):g} degrees or more from the middle of the path's rotations"
        raise InputError(f"{path.source}: line {line}: {fault}; divide the program before it")
    if not is_slerp:
        return LinearAngles(angles, order, sign, reference)
    off = _ROUNDED + _PER_RADIAN * np.abs(angles).sum(axis=1)
    vectors = relative[:, 1:] / relative[:, :1]
    # Four times: of the vector itself, and of its place on a line of a length of at most two.
    slack = 4 * _vector_slack(off, scalars - off)[:, None] * _varying(angles, order, reference)
    return ShortestTurns(scalars, vectors, slack, 0.5 * turns, reference)


def _relative(quaternions: FloatArray, reference: Reference) -> FloatArray:
    """Return quaternions (n, 4) after the reference is undone: q with ``q reference`` equal to the given ones."""
    if reference == UNTURNED:
        return quaternions
    inverse = np.array(reference) * [1.0, -1, -1, -1] / math.hypot(*reference)
    return quaternion_products(quaternions, inverse[None])


def _reference(quaternions: FloatArray) -> Reference:
    """Return no turn where it is near enough, else a rotation in small integers near the middle of those of a path.

    Args:
        quaternions: (n, 4) along the path, of which each is near the one before.
    """
    if np.abs(quaternions[:, 0]).min() >= _NEAR and np.ptp(np.sign(quaternions[:, 0])) == 0:
        return UNTURNED
    some = quaternions[:: -(-len(quaternions) // _SAMPLES)]
    # The centre of the smallest ball with all of them, by steps to the farthest one.
    middle = some[0].copy()
    for step in range(1, _STEPS + 1):
        middle += (some[int(np.argmin(some @ middle))] - middle) / (step + 1)
    parts = np.rint(_ROUND * middle / max(float(np.abs(middle).max()), np.finfo(float).tiny)).astype(int).tolist()
    w, x, y, z = (part // (math.gcd(*parts) or 1) for part in parts)
    return (w, x, y, z) if any(parts) else UNTURNED


def _varying(angles: FloatArray, order: Order, reference: Reference) -> FloatArray:
    """Return 1 for components (3,) of vectors that are not exactly zero at all points, else 0.

    The product of the units i and j is the unit of the bits of both, exclusive, but for its sign.
    """
    found = {0}
    for axis in order:
        found |= {unit ^ (1 + axis) for unit in found if angles[:, axis].any()}
    found = {unit ^ other for unit in found for other in range(4) if reference[other]}
    return np.array([float(unit in found) for unit in (1, 2, 3)])


def _divided(ends: FloatArray, counts: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return equal parts of ranges: the indices (P,) of the ranges, in their order, and the ends (P, 2) of the parts.

    Args:
        ends: (B, 2) of the ranges.
        counts: (B,) numbers of parts; 0 is 1.
    """
    numbers = np.maximum(counts, 1).astype(int)
    rows = np.repeat(np.arange(len(ends)), numbers)
    j = np.arange(len(rows)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    (low, high), n = ends[rows].T, numbers[rows]
    first, last = low + j / n * (high - low), low + (j + 1) / n * (high - low)
    return rows, np.stack([first, np.where(j + 1 == n, high, last)], axis=1)


def _angular_velocities(angles: FloatArray, rates: FloatArray, order: Order) -> FloatArray:
    """Return the angular velocities (B, 3) in the world frame of angles (B, 3) with rates."""
    found, turn = np.zeros_like(angles), np.broadcast_to([1.0, 0, 0, 0], (len(angles), 4))
    for axis in order:
        about = np.zeros_like(turn)
        about[:, 1 + axis] = rates[:, axis]
        found += quaternion_products(quaternion_products(turn, about), turn * [1.0, -1, -1, -1])[:, 1:]
        own = np.zeros_like(angles)
        own[:, axis] = angles[:, axis]
        turn = quaternion_products(turn, quaternions_from_angles(own, order))
    return found


def _most_across(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return bounds (B, 3) of the components of vector products of vectors with components of at most these sizes."""
    return np.asarray(one[:, [1, 2, 0]] * other[:, [2, 0, 1]] + one[:, [2, 0, 1]] * other[:, [1, 2, 0]])


def _vector_slack(off: FloatArray, least: FloatArray) -> FloatArray:
    """Return by how much the Cayley vectors (B,) of unit quaternions may be off.

    Args:
        off: (B,) errors of the quaternions, of which that of ``v / w`` has ``1 / w`` times the size of (1, v / w).
        least: (B,) their least scalars.
    """
    return off / least**2 * _UP


def _sine_ratio(angles: FloatArray) -> FloatArray:
    """Return ``sin(a) / a``."""
    return np.divide(np.sin(angles), angles, out=np.ones_like(angles), where=angles != 0)
