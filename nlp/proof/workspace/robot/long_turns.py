"""Rotations of any path, near one reference or with several: each piece then has coordinates of its own.

A rotation is the quaternion ``y = (w, x, y, z)`` of any size but zero. A piece of the path is divided by one of the
four components, which is then 1: y is that of a Cayley vector relative to no turn, or to half a turn about x, y or z.
One of these is nearer than 120 degrees to any rotation, so that paths of any length, with whole turns too, are covered.
Two pieces with different divisors have the same rotation where they meet, by two of its quaternions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .....models import FloatArray
from ....case.workspace import TurnKind
from ....errors import InputError
from ....path.options import Between
from ....path.orientation import (
    ORDERS,
    Order,
    quaternion_products,
    quaternions_from_angles,
    roll_pitch_yaw,
    shortest_turns,
)
from .path_turns import (
    CHORD,
    PER_RADIAN,
    ROUNDED,
    LinearAngles,
    PathTurns,
    ShortestTurns,
    Tangents,
    divided,
    in_world,
    relative,
    turning_in_world,
    varying,
)
from .pose_box import UNTURNED, Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....path.frame import PathFrame
    from ....path.path import ProgrammedPath

#: Angles from which on the tangent of the half is too large a coordinate, and its cosine: the least scalar.
_LARGEST = math.radians(149)
_LEAST = math.cos(_LARGEST / 2)
#: Sum of the changes of three angles over a part of a segment with one divisor, at most. In the middle the divisor is
#: at least a half, that of 120 degrees, and up to the ends the rotation turns by half of this sum.
_PART = 0.75
#: Largest number of parts of a path over which chords are taken.
_MOST = 5_000_000
#: Least scalar of quaternions for which no other reference is needed: of a right angle.
_NEAR = math.sqrt(0.5)
#: Steps in the search of the middle of rotations, most rotations that are looked at, and largest part of the reference.
_STEPS, _SAMPLES, _ROUND = 100, 8192, 8
#: Largest pitch at which roll and yaw are computed from a rotation, and by how much these are off at most. A matrix is
#: off by 110 roundings (2^-53), a yaw by 160 over the pitch's cosine, 0.17, and a roll by both over this cosine: 7000.
_STEEP, _OFF_HELD = math.radians(80), 2.0**-39
#: References of the four divisors.
_UNITS: tuple[Reference, ...] = (UNTURNED, (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))


@dataclass(frozen=True, eq=False)
class LongTurns:
    """Rotations as quaternions of which one component is 1 in each part of a segment.

    Attributes:
        views: the rotations relative to each of the four references.
        counts: (N,) numbers of equal parts of the segments.
        divisors: (M,) components that are 1 in these parts, in their order.
    """

    views: Sequence[PathTurns]
    counts: NDArray[np.intp]
    divisors: NDArray[np.intp]
    kind = TurnKind.ANY_AXIS
    reference = UNTURNED

    @cached_property
    def _first(self) -> NDArray[np.intp]:
        """Places (N,) of the segments' first parts."""
        return np.asarray(np.cumsum(self.counts) - self.counts)

    def _divisors_of(self, segments: NDArray[np.intp], ends: FloatArray) -> NDArray[np.intp]:
        """Return the component (B,) that is 1 in pieces: that of the part with their middle."""
        count = self.counts[segments]
        part = np.clip((0.5 * (ends[:, 0] + ends[:, 1]) * count).astype(int), 0, count - 1)
        return np.asarray(self.divisors[self._first[segments] + part])

    def boxes(
        self, segments: NDArray[np.intp], ends: FloatArray, within: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return ranges (B, 4) over pieces; see :class:`~.path_turns.PathTurns`."""
        divisors, found = self._divisors_of(segments, ends if within is None else within), np.zeros((2, len(ends), 4))
        for k, view in enumerate(self.views):
            rows = np.flatnonzero(divisors == k)
            if rows.size:
                found[:, rows] = _as_quaternions(k, *view.boxes(segments[rows], ends[rows]))
        return found[0], found[1]

    def derivatives(self, segments: NDArray[np.intp], ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angular velocities over pieces; see :class:`~.path_turns.PathTurns`."""
        return self.views[0].derivatives(segments, ends)


def _as_quaternions(divisor: int, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return ranges (2, B, 4) of ``(1, r) u`` with the unit u that is a divisor from those (B, 3) of r.

    Args:
        divisor: the component of the unit.
        low: (B, 3) lower ends of r.
        high: (B, 3) upper ends.
    """
    unit = np.array([_UNITS[divisor]], dtype=np.float64)
    found = np.zeros((2, len(low), 4))
    found[:, :, divisor] = 1.0
    for k in range(3):
        # The product of two units is a unit, but for its sign.
        product = quaternion_products(np.eye(4)[None, 1 + k], unit)[0]
        at = int(np.argmax(np.abs(product)))
        ends = (low[:, k], high[:, k]) if product[at] > 0 else (-high[:, k], -low[:, k])
        found[0, :, at], found[1, :, at] = ends
    return found


def turns_of_path(path: ProgrammedPath) -> PathTurns:
    """Return the rotations of a path.

    Raises:
        InputError: they turn too often.
    """
    angles, is_slerp, frame = path.knots[:, 3:], path.between is Between.SLERP, path.frame
    held = None if frame is None else _held(angles, path.order, frame)
    if held is not None:
        return held
    if frame is None and not is_slerp and path.order == ORDERS["rpy"] and np.abs(angles).max() < _LARGEST:
        return Tangents(angles)
    order, change = path.order, np.diff(angles, axis=0)
    if is_slerp:
        quaternions = in_world(quaternions_from_angles(angles, order), frame)
        axes, width = shortest_turns(quaternions[:-1], quaternions[1:])
        # Of both quaternions of a rotation the one nearer to that before.
        flips = (quaternions[:-1] * quaternions[1:]).sum(axis=1) < 0
        quaternions[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
        off = (1 if frame is None else 2) * ROUNDED + PER_RADIAN * np.abs(angles).sum(axis=1)
        every, turning = quaternions, turning_in_world(varying(angles, order, UNTURNED), frame)

        def turns(reference: Reference) -> PathTurns:
            own, vary = relative(quaternions, reference), varying(angles, order, reference, frame)
            return ShortestTurns(own, off, 0.5 * width, width[:, None] * axes * turning, vary, turning, reference)
    else:
        width = np.abs(change).sum(axis=1)
        if np.ceil(width / CHORD).sum() > _MOST + len(path):
            line = path.lines[int(np.argmax(width))]
            fault = f"angles change by {math.degrees(float(width.sum())):.4g} degrees in all, most of them here"
            raise InputError(f"{path.source}: line {line}: {fault}; at most {math.degrees(_MOST * CHORD):.4g} are read")
        rows, parts = divided(np.tile([0.0, 1.0], (len(path), 1)), np.ceil(width / CHORD))
        points = np.append(angles[rows] + parts[:, :1] * change[rows], angles[-1:], 0)
        every = in_world(quaternions_from_angles(points, order), frame)

        def turns(reference: Reference) -> PathTurns:
            return LinearAngles(angles, order, reference, frame)

    reference = _reference(every)
    scalars = relative(every, reference)[:, 0]
    if np.abs(scalars).min() > _LEAST and np.ptp(np.sign(scalars)) == 0:
        return turns(reference)
    counts = np.maximum(np.ceil(width / _PART), 1).astype(int)
    rows, parts = divided(np.tile([0.0, 1.0], (len(path), 1)), counts.astype(float))
    s = parts.mean(axis=1, keepdims=True)
    if is_slerp:
        middles = np.sin((1 - s) * 0.5 * width[rows, None]) * every[rows]
        middles += np.sin(s * 0.5 * width[rows, None]) * every[rows + 1]
        middles = np.where(width[rows, None] > 0, middles, every[rows])
    else:
        middles = in_world(quaternions_from_angles(angles[rows] + s * change[rows], order), frame)
    return LongTurns([turns(each) for each in _UNITS], counts, np.argmax(np.abs(middles), axis=1))


def _held(angles: FloatArray, order: Order, frame: PathFrame) -> Tangents | None:
    """Return the rotation of a path that does not turn in its frame, as roll, pitch and yaw in the world.

    Args:
        angles: (N + 1, 3) angles at the knots, radians.
        order: convention of the angles.
        frame: frame of the path.

    Returns:
        None where it turns, or where roll, pitch and yaw are large or not well determined.
    """
    if np.ptp(angles, axis=0).any():
        return None
    found, off = frame.angles, 0.0
    if angles.any():
        found = roll_pitch_yaw(frame.orientations(quaternions_from_angles(angles[:1], order)))[0]
        if abs(found[1]) > _STEEP:
            return None
        off = _OFF_HELD * (1 + float(np.abs(angles[0]).sum()))
    return Tangents(np.tile(found, (len(angles), 1)), off) if np.abs(found).max() < _LARGEST else None


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
