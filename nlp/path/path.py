"""Tool paths: points, and the lines, arcs, helices and dwells between them, as arrays.

A path of a million segments is a few arrays; a :class:`Segment` is a view of one segment, made on demand. Along each
segment a parameter runs from 0 to 1: position and orientation are linear or circular functions of it. Poses are those
of the platform frame in the world frame. Machine coordinates are world coordinates unless the path has a frame. Angles
are in radians.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray
from ...models.rotation import matrix_from_axis_angle
from .arcs import PLANES, Arc, arc_length
from .frame import PathFrame
from .idle import Idle
from .options import Between
from .orientation import (
    Order,
    matrices_from_quaternions,
    quaternion_products,
    quaternions_from_angles,
    shortest_turns,
    symbolic_rotation,
    turned,
)
from .settings import Settings, ToolTurn

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Axes of each plane, from code 17 on.
_AXES = np.array(list(PLANES.values()))


class Kind(enum.IntEnum):
    """Kind of a segment."""

    LINE = 0
    ARC = 1
    DWELL = 2


class Poses(NamedTuple):
    """Positions (n, 3) and rotation matrices (n, 3, 3)."""

    positions: FloatArray
    rotations: FloatArray


class SymbolicPose(NamedTuple):
    """Position (3, 1) and rotation matrix (3, 3) as expressions."""

    position: SX
    rotation: SX


class Shape(NamedTuple):
    """Common form of segments whose poses are the same expressions of their parameters.

    Attributes:
        plane: code of the plane of an arc; None for a line and a dwell.
        order: convention of linearly changing angles; None for a rotation about an axis.
    """

    plane: int | None
    order: Order | None

    @property
    def size(self) -> int:
        """Number of a segment's parameters."""
        return (6 if self.plane is None else 8) + (13 if self.order is None else 6)

    def pose(self, numbers: SX, s: SX) -> SymbolicPose:
        """Return the pose at a path parameter of a segment, in the path's frame if it has one.

        Args:
            numbers: (size, 1) parameters of the segment, as numbers or symbols; see :attr:`Segment.numbers`.
            s: (1, 1) path parameter, from 0 at the start to 1 at the end.
        """
        count = 6 if self.plane is None else 8
        return SymbolicPose(self._position(numbers[:count], s), self._rotation(numbers[count:], s))

    def _position(self, numbers: SX, s: SX) -> SX:
        if self.plane is None:
            return numbers[:3] + s * numbers[3:]
        first, second, radius, growth, angle, sweep, height, rise = (numbers[k] for k in range(8))
        radius, angle = radius + s * growth, angle + s * sweep
        position = SX(3, 1)
        along = (first + radius * ca.cos(angle), second + radius * ca.sin(angle), height + s * rise)
        for axis, coordinate in zip(PLANES[self.plane], along, strict=True):
            position[axis] = coordinate
        return position

    def _rotation(self, numbers: SX, s: SX) -> SX:
        if self.order is not None:
            return symbolic_rotation(numbers[:3] + s * numbers[3:], self.order)
        return matrix_from_axis_angle(numbers[9:12], s * numbers[12]) @ ca.reshape(numbers[:9], 3, 3)


@dataclass(frozen=True, eq=False)
class ProgrammedPath:
    """Tool path of n segments, m of them arcs.

    Attributes:
        source: name of the file.
        knots: (n + 1, 6) position and angles of the segment ends: segment k goes from knot k to knot k + 1. Knots and
            arcs are in the path's frame; without a frame, in the world frame.
        lines: (n,) line of the file, or row of a table, for each segment.
        kinds: (n,) kind of each segment.
        durations: (n,) duration of each segment, seconds; NaN if the file states neither time nor feed, as for rapid
            motions.
        arcs: (m, 6) centre, radius, growth of the radius, angle and sweep of each arc; see :class:`.arcs.Arc`.
        planes: (m,) code of the plane of each arc.
        order: convention of the angles.
        between: interpolation between two points.
        idle: ignored words and lines, which cause no motion.
        warnings: sentences about the file that a user has to know.
        frame: frame of the path in the world frame; None if the path is in world coordinates.
        tool: turn about the tool's axis, which comes after the orientations of the path; None without one.
        settings: values of dimensions that change along the path.
    """

    source: str
    knots: FloatArray
    lines: NDArray[np.int32]
    kinds: NDArray[np.uint8]
    durations: FloatArray
    arcs: FloatArray
    planes: NDArray[np.uint8]
    order: Order
    between: Between
    idle: tuple[Idle, ...] = ()
    frame: PathFrame | None = None
    warnings: tuple[str, ...] = ()
    tool: ToolTurn | None = None
    settings: Settings = field(default_factory=Settings)

    def __post_init__(self) -> None:
        for array in (self.knots, self.lines, self.kinds, self.durations, self.arcs, self.planes):
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.lines)

    def __getitem__(self, index: int) -> Segment:
        return Segment(self, range(len(self))[index])

    def __iter__(self) -> Iterator[Segment]:
        return (self[index] for index in range(len(self)))

    @cached_property
    def arc_segments(self) -> NDArray[np.intp]:
        """Indices (m,) of the segments that are arcs."""
        return np.flatnonzero(self.kinds == Kind.ARC)

    @cached_property
    def untimed(self) -> NDArray[np.intp]:
        """Indices of the segments without a stated time."""
        return np.flatnonzero(np.isnan(self.durations))

    @property
    def is_timed(self) -> bool:
        """True if the file states the time of at least one motion."""
        return bool(np.isfinite(self.durations[self.kinds != Kind.DWELL]).any())

    @property
    def time(self) -> float:
        """Total time of the segments with a stated time, seconds."""
        return math.fsum(self.durations[np.isfinite(self.durations)].tolist())

    def with_knots(self, kept: NDArray[np.bool_]) -> ProgrammedPath:
        """Return the path of the segments that end at kept knots; the first knot always stays.

        Args:
            kept: (n,) True for each segment whose end stays.
        """
        which, tool, values = np.concatenate([[True], kept]), self.tool, self.settings.values
        return replace(
            self,
            knots=self.knots[which],
            lines=self.lines[kept],
            kinds=self.kinds[kept],
            durations=self.durations[kept],
            tool=None if tool is None else replace(tool, angles=tool.angles[which]),
            settings=self.settings if values is None else replace(self.settings, values=values[which]),
        )

    @cached_property
    def resets(self) -> NDArray[np.bool_]:
        """Whether a setting changes in each segment (n,)."""
        found = np.zeros(len(self), dtype=bool)
        if self.tool is not None:
            found |= np.diff(self.tool.angles) != 0
        if self.settings.values is not None:
            found |= np.diff(self.settings.values, axis=0).any(axis=1)
        return found

    @cached_property
    def lengths(self) -> FloatArray:
        """Length (n,) of the translation in each segment."""
        lengths = np.asarray(np.linalg.norm(np.diff(self.knots[:, :3], axis=0), axis=1))
        k, axis = self.arc_segments, _AXES[self.planes - 17, 2]
        rises = self.knots[k + 1, axis] - self.knots[k, axis]
        lengths[k] = arc_length(self.arcs[:, 2], self.arcs[:, 3], self.arcs[:, 5], rises)
        return lengths

    def poses_at(self, segments: Sequence[int] | NDArray[np.intp], s: ArrayLike) -> Poses:
        """Return the poses at points of segments, computed by NumPy.

        Args:
            segments: (k,) indices of segments.
            s: (k,) path parameters, from 0 to 1; or one parameter for all segments.
        """
        index = np.asarray(segments, dtype=np.intp)
        parameter = np.broadcast_to(np.asarray(s, dtype=np.float64), index.shape)[:, None]
        start, end = self.knots[index], self.knots[index + 1]
        points = start + parameter * (end - start)
        on_arcs = np.flatnonzero(self.kinds[index] == Kind.ARC)
        rows = np.searchsorted(self.arc_segments, index[on_arcs])
        first, second, radius, growth, angle, sweep = self.arcs[rows].T
        size, turn = radius + parameter[on_arcs, 0] * growth, angle + parameter[on_arcs, 0] * sweep
        axes = _AXES[self.planes[rows] - 17]
        points[on_arcs, axes[:, 0]] = first + size * np.cos(turn)
        points[on_arcs, axes[:, 1]] = second + size * np.sin(turn)
        quaternions = quaternions_from_angles(points[:, 3:], self.order)
        if self.between is Between.SLERP:
            first_one = quaternions_from_angles(start[:, 3:], self.order)
            about, angles = shortest_turns(first_one, quaternions_from_angles(end[:, 3:], self.order))
            quaternions = turned(first_one, about, parameter[:, 0] * angles)
        positions, frame = points[:, :3], self.frame
        if frame is not None:
            positions, quaternions = frame.positions(positions), frame.orientations(quaternions)
        if self.tool is not None:
            quaternions = quaternion_products(quaternions, self.tool.quaternions(index, parameter[:, 0]))
        return Poses(positions, matrices_from_quaternions(quaternions))

    def arc_of(self, segment: int) -> tuple[Arc, int]:
        """Return the arc of an arc segment, and the code of its plane."""
        row = int(np.searchsorted(self.arc_segments, segment))
        return Arc(*self.arcs[row].tolist()), int(self.planes[row])

    def shapes(self) -> dict[Shape, NDArray[np.intp]]:
        """Return the indices of the segments of each shape; the path needs one expression for each shape."""
        order = None if self.between is Between.SLERP else self.order
        found = {Shape(None, order): np.flatnonzero(self.kinds != Kind.ARC)}
        found |= {Shape(plane, order): self.arc_segments[self.planes == plane] for plane in PLANES}
        return {shape: segments for shape, segments in found.items() if len(segments)}


@dataclass(frozen=True, eq=False)
class Segment:
    """Segment of a path.

    Attributes:
        path: the path.
        index: index of the segment in the path.
    """

    path: ProgrammedPath
    index: int

    @property
    def line(self) -> int:
        """Line of the file, or row of a table."""
        return int(self.path.lines[self.index])

    @property
    def kind(self) -> Kind:
        """Kind of the segment."""
        return Kind(int(self.path.kinds[self.index]))

    @property
    def start(self) -> FloatArray:
        """Position and angles (6,) at the start, in the path's frame."""
        return np.asarray(self.path.knots[self.index])

    @property
    def end(self) -> FloatArray:
        """Position and angles (6,) at the end, in the path's frame."""
        return np.asarray(self.path.knots[self.index + 1])

    @property
    def length(self) -> float:
        """Length of the translation."""
        return float(self.path.lengths[self.index])

    @property
    def duration(self) -> float | None:
        """Duration, seconds; None if the file does not state a time or feed rate."""
        seconds = float(self.path.durations[self.index])
        return None if np.isnan(seconds) else seconds

    @property
    def shape(self) -> Shape:
        """Shape of the segment's expressions."""
        order = None if self.path.between is Between.SLERP else self.path.order
        return Shape(self.path.arc_of(self.index)[1] if self.kind is Kind.ARC else None, order)

    @property
    def numbers(self) -> FloatArray:
        """Parameters (size,) of the segment for :meth:`Shape.pose`.

        For a line: start and change of the position; for an arc: its six parameters, and start and change along the
        axis. Then start and change of the angles; or the first rotation matrix column by column, axis and angle.
        """
        start, change = self.start, self.end - self.start
        position = [start[:3], change[:3]]
        if self.kind is Kind.ARC:
            arc, plane = self.path.arc_of(self.index)
            axis = PLANES[plane][2]
            position = [np.array([*arc, start[axis], change[axis]])]
        if self.path.between is Between.ANGLES:
            return np.concatenate([*position, start[3:], change[3:]])
        first, last = (quaternions_from_angles(end[None, 3:], self.path.order) for end in (start, self.end))
        axes, angles = shortest_turns(first, last)
        return np.concatenate([*position, matrices_from_quaternions(first)[0].ravel(order="F"), axes[0], angles])

    def pose_at(self, s: float) -> Poses:
        """Return position (3,) and rotation matrix (3, 3) at a path parameter from 0 to 1."""
        positions, rotations = self.path.poses_at([self.index], s)
        return Poses(positions[0], rotations[0])

    def expressions(self, s: SX) -> SymbolicPose:
        """Return the pose as expressions of the path parameter (1, 1)."""
        pose, frame, tool = self.shape.pose(SX(self.numbers), s), self.path.frame, self.path.tool
        if tool is not None:
            start, end = tool.angles[self.index : self.index + 2].tolist()
            turn = matrix_from_axis_angle(SX(tool.axis.tolist()), start + s * (end - start))
            pose = pose._replace(rotation=pose.rotation @ turn)
        if frame is None:
            return pose
        R = SX(frame.rotation.tolist())
        return SymbolicPose(R @ pose.position + SX(frame.origin.tolist()), R @ pose.rotation)
