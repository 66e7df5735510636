"""Rotations of any tool path, also with full turns: Cayley vectors with one reference, or with one for each piece.

A rotation is a quaternion ``y = (w, x, y, z)`` of any norm but zero. On each piece of the path it is divided by one of
the four components: y is then a Cayley vector relative to no rotation, or to half a turn about x, y or z. One of these
references is nearer than 120 degrees to any rotation, so paths of any length are covered. Where two pieces with
different divisors meet, they have two quaternions of the same rotation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
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
from .tool_turns import ToolTurns

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....path.frame import PathFrame
    from ....path.path import ProgrammedPath

#: Largest angle from the reference (the tangent of its half grows without bound), and its cosine, the least scalar.
_LARGEST = math.radians(149)
_LEAST = math.cos(_LARGEST / 2)
#: Largest sum of the changes of three angles over a part of a segment with one divisor. At the centre of the part the
#: divisor is at least 1/2 (120 degrees); up to its ends, the rotation turns by half of this sum.
_PART = 0.75
#: Largest number of parts of a path.
_MOST = 5_000_000
#: Smallest scalar of quaternions, for a right angle, that needs no other reference.
_NEAR = math.sqrt(0.5)
#: Number of steps in the search of the mean rotation, largest number of rotations for it, and largest component of the
#: reference.
_STEPS, _SAMPLES, _ROUND = 100, 8192, 8
#: Largest pitch at which roll and yaw are computed from a rotation, and bound of their errors. A matrix has an error
#: of 110 roundings (2^-53). Yaw has 160 divided by the cosine of the pitch, 0.17. Roll has both divided by this
#: cosine: 7000.
_STEEP, _OFF_HELD = math.radians(80), 2.0**-39
#: References of the four divisors.
_UNITS: tuple[Reference, ...] = (UNTURNED, (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))


@dataclass(frozen=True, eq=False)
class LongTurns:
    """Rotations as quaternions with one component equal to 1 in each part of a segment.

    Attributes:
        views: rotations relative to each of the four references.
        counts: (N,) number of equal parts of each segment.
        divisors: (M,) index of the component that is 1 in each part, in the order of the path.
    """

    views: Sequence[PathTurns]
    counts: NDArray[np.intp]
    divisors: NDArray[np.intp]
    kind = TurnKind.ANY_AXIS
    reference = UNTURNED

    @cached_property
    def _first(self) -> NDArray[np.intp]:
        """Indices (N,) of the segments' first parts."""
        return np.asarray(np.cumsum(self.counts) - self.counts)

    def _divisors_of(self, segments: NDArray[np.intp], ends: FloatArray) -> NDArray[np.intp]:
        """Return the index (B,) of the component that is 1 in pieces, from the part with the middle of the piece."""
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
    """Return ranges (2, B, 4) of the quaternions ``(1, r) u``, with the quaternion unit u of a divisor.

    Args:
        divisor: index of the component that is 1 in u.
        low: (B, 3) lower ends of r.
        high: (B, 3) upper ends of r.
    """
    unit = np.array([_UNITS[divisor]], dtype=np.float64)
    found = np.zeros((2, len(low), 4))
    found[:, :, divisor] = 1.0
    for k in range(3):
        # The product of two units is a unit, up to its sign.
        product = quaternion_products(np.eye(4)[None, 1 + k], unit)[0]
        at = int(np.argmax(np.abs(product)))
        ends = (low[:, k], high[:, k]) if product[at] > 0 else (-high[:, k], -low[:, k])
        found[0, :, at], found[1, :, at] = ends
    return found


def turns_of_path(path: ProgrammedPath) -> PathTurns:
    """Return the rotations of a path.

    Raises:
        InputError: the path has too many turns.
    """
    angles, is_slerp, frame = path.knots[:, 3:], path.between is Between.SLERP, path.frame
    tool = path.tool if path.tool is not None and path.tool.angles.any() else None
    held = None if frame is None or tool is not None else _held(angles, path.order, frame)
    if held is not None:
        return held
    is_direct = frame is None and tool is None and not is_slerp and path.order == ORDERS["rpy"]
    if is_direct and np.abs(angles).max() < _LARGEST:
        return Tangents(angles)
    of_task = _shortest_turns(path) if is_slerp else partial(LinearAngles, angles, path.order, frame=frame)
    if tool is not None:
        task = of_task(UNTURNED)
        units = frozenset({0, *(np.flatnonzero(varying(angles, path.order, UNTURNED, frame)) + 1).tolist()})
        return _about_references(path, partial(ToolTurns, task, tool, units=units))
    return _about_references(path, of_task)


def _shortest_turns(path: ProgrammedPath) -> Callable[[Reference], ShortestTurns]:
    """Return the rotations of a path about fixed axes, as a function of the reference."""
    angles, order, frame = path.knots[:, 3:], path.order, path.frame
    quaternions = in_world(quaternions_from_angles(angles, order), frame)
    axes, width = shortest_turns(quaternions[:-1], quaternions[1:])
    # A rotation has two quaternions; the one nearer to the preceding quaternion is taken.
    flips = (quaternions[:-1] * quaternions[1:]).sum(axis=1) < 0
    quaternions[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
    off = (1 if frame is None else 2) * ROUNDED + PER_RADIAN * np.abs(angles).sum(axis=1)
    turning = turning_in_world(varying(angles, order, UNTURNED), frame)

    def turns(reference: Reference) -> ShortestTurns:
        own, vary = relative(quaternions, reference), varying(angles, order, reference, frame)
        return ShortestTurns(own, off, 0.5 * width, width[:, None] * axes * turning, vary, turning, reference)

    return turns


def _about_references(
    path: ProgrammedPath, turns: Callable[[Reference], ShortestTurns | LinearAngles | ToolTurns]
) -> PathTurns:
    """Return rotations relative to one reference, or to one for each part of a segment.

    Args:
        path: the path.
        turns: function from a reference to the rotations.

    Raises:
        InputError: the path has too many turns.
    """
    own = turns(UNTURNED)
    width = own.widths
    if not isinstance(own, ShortestTurns) and np.ceil(width / CHORD).sum() > _MOST + len(path):
        line = path.lines[int(np.argmax(width))]
        fault = f"angles change by {math.degrees(float(width.sum())):.4g} degrees in total, mostly on this line"
        raise InputError(f"{path.source}: line {line}: {fault}; at most {math.degrees(_MOST * CHORD):.4g} are allowed")
    chord = np.zeros(len(path)) if isinstance(own, ShortestTurns) else np.ceil(width / CHORD)
    rows, parts = divided(np.tile([0.0, 1.0], (len(path), 1)), chord)
    last = own.quaternions(np.array([len(path) - 1]), np.ones(1))
    every = np.append(own.quaternions(rows, parts[:, 0]), last, 0)
    reference = _reference(every)
    scalars = relative(every, reference)[:, 0]
    if np.abs(scalars).min() > _LEAST and np.ptp(np.sign(scalars)) == 0:
        return turns(reference)
    counts = np.maximum(np.ceil(width / _PART), 1).astype(int)
    rows, parts = divided(np.tile([0.0, 1.0], (len(path), 1)), counts.astype(float))
    middles = own.quaternions(rows, parts.mean(axis=1))
    return LongTurns([turns(each) for each in _UNITS], counts, np.argmax(np.abs(middles), axis=1))


def _held(angles: FloatArray, order: Order, frame: PathFrame) -> Tangents | None:
    """Return the constant rotation of a path in its frame, as roll, pitch and yaw in the world.

    Args:
        angles: (N + 1, 3) angles at the knots, radians.
        order: convention of the angles.
        frame: frame of the path.

    Returns:
        The rotation. None if the rotation is not constant, or if roll, pitch and yaw are large or badly determined.
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
    """Return a reference near all rotations of a path: no rotation if possible, else a quaternion of small integers.

    Args:
        quaternions: (n, 4) quaternions along the path, each near the preceding one.
    """
    if np.abs(quaternions[:, 0]).min() >= _NEAR and np.ptp(np.sign(quaternions[:, 0])) == 0:
        return UNTURNED
    some = quaternions[:: -(-len(quaternions) // _SAMPLES)]
    # The centre of the smallest ball around all quaternions, by steps to the farthest one.
    middle = some[0].copy()
    for step in range(1, _STEPS + 1):
        middle += (some[int(np.argmin(some @ middle))] - middle) / (step + 1)
    parts = np.rint(_ROUND * middle / max(float(np.abs(middle).max()), np.finfo(float).tiny)).astype(int).tolist()
    w, x, y, z = (part // (math.gcd(*parts) or 1) for part in parts)
    return (w, x, y, z) if any(parts) else UNTURNED
