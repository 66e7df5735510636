"""Box of poses in the coordinates of a search: three of position, three or four of rotation.

Rotations have coordinates in which ``s R``, with a positive ``s``, is a polynomial:

* any axis: Cayley vector ``tan(angle / 2) axis``, within a ball, of the rotation relative to a reference;
* one axis: ``tan(angle / 2)``, the first of the three coordinates;
* roll, pitch and yaw: tangents of the half angles;
* all rotations: a quaternion ``(w, x, y, z)`` of any norm but zero.

Positions may lie in a set inside the box (:mod:`.position_bounds`).

Along a path, dimensions that change are further coordinates, after the pose.

Ends are rounded outwards, so that the box contains every pose of the workspace.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray, axis_angle_from_matrix, frozen_array
from .....models.arrays import values_at
from .....models.rotation import turn_about
from ....case.pose import Free, Value, ends_of
from ....case.workspace import TurnKind, Workspace
from ....path.orientation import matrices_from_quaternions
from ...statement.tolerance import PoseCoordinates
from .position_bounds import PositionBounds

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: A rotation as a quaternion ``(w, x, y, z)`` of integers, of any norm but zero.
Reference: TypeAlias = "tuple[int, int, int, int]"
UNTURNED: Reference = (1, 0, 0, 0)
#: Relative error bound of a tangent: several times the error of the library function.
_TANGENT = 2.0**-50
#: Relative unit by which ends move outwards, several roundings.
_ULP = 2.0**-51


@dataclass(frozen=True, eq=False)
class PoseNumbers:
    """A pose of the platform.

    Attributes:
        position: (3,) origin of the platform frame in the world frame, length.
        rotation: (3, 3) platform to world coordinates.
        axis: (3,) unit axis of the rotation; z without rotation.
        angle: angle of the rotation, radians, not negative.
    """

    position: FloatArray
    rotation: FloatArray
    axis: FloatArray
    angle: float


@dataclass(frozen=True, eq=False)
class PoseBox:
    """A box of poses.

    Attributes:
        kind: coordinates of rotations.
        axis: (3,) unit axis of rotations about one axis.
        lower, upper: (c,) bounds of the coordinates: position, then rotation. There are six coordinates, or seven with
        quaternions.
        ball: largest squared norm of a Cayley vector, rounded up; infinite if rotations are not in a ball.
        reference: rotation with Cayley vector zero.
        dependent: indices of the dependent coordinates. Their bounds only start a search, and exclude no pose. A ball
            contains only independent components.
        positions: set of positions; None for all positions of the box.
        settings: names of the dimensions that change along a path: components of the robot's parameters. They are the
            last coordinates.
    """

    kind: TurnKind
    axis: FloatArray
    lower: FloatArray
    upper: FloatArray
    ball: float
    reference: Reference = UNTURNED
    dependent: tuple[int, ...] = ()
    positions: PositionBounds | None = None
    settings: tuple[str, ...] = ()

    @property
    def of_pose(self) -> int:
        """Number of coordinates of the pose: six, or seven with quaternions."""
        return len(self.lower) - len(self.settings)

    @property
    def middle(self) -> FloatArray:
        """Pose (c,) from which searches begin: the middle of the box, or of the set of positions."""
        y = 0.5 * self.lower + 0.5 * self.upper
        if self.positions is not None:
            own = self._positioned
            y[own] = self.positions.positions.middle[own]
        return y

    @property
    def is_convex(self) -> bool:
        """Whether the workspace contains the line between any two of its poses."""
        return self.positions is None or self.positions.positions.is_convex

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the coordinates that vary."""
        return tuple(np.flatnonzero(self.upper > self.lower).tolist())

    def symbols(self, z: SX) -> SX:
        """Return the coordinates (c, 1); the first symbols of z (n, 1) stand for the varying coordinates."""
        y = SX((0.5 * self.lower + 0.5 * self.upper).tolist())
        y[list(self.free)] = z[: len(self.free)]
        return y

    @cached_property
    def _inner(self) -> tuple[FloatArray, FloatArray, float]:
        """Ends, and the largest squared norm of a Cayley vector, of poses that are provably in the workspace.

        Bounds of rotations were moved outwards by about 4 roundings, and the squared radius of the ball by another 4.
        """
        sizes = np.maximum(np.abs(self.lower), np.abs(self.upper)) * (np.arange(len(self.lower)) > 2)
        slack = np.where(self.upper > self.lower, 8 * _TANGENT * sizes, 0.0)
        lower, upper = self.lower + slack, self.upper - slack
        lower[list(self.dependent)], upper[list(self.dependent)] = -np.inf, np.inf
        return lower, upper, self.ball * (1 - 16 * _TANGENT)

    @property
    def is_ball(self) -> bool:
        """Whether all three components of a Cayley vector lie in a ball."""
        return math.isfinite(self.ball) and len(self._turns) == 3

    @property
    def _turns(self) -> list[int]:
        """Indices of the components of the ball."""
        return [k for k in range(3, 6) if k not in self.dependent]

    @property
    def _positioned(self) -> list[int]:
        """Indices of the independent coordinates of the position that vary."""
        return [k for k in self.free if k < 3 and k not in self.dependent]

    def holds(self, y: FloatArray) -> NDArray[np.bool_]:
        """Return whether points (..., c) are provably poses of the workspace itself.

        Points that only the outward rounding of its bounds includes do not count.
        """
        lower, upper, ball = self._inner
        inside = ((y >= lower) & (y <= upper)).all(axis=-1)
        if self.positions is not None:
            inside &= self.positions.holds(y[..., :3])
        return np.asarray(inside & (np.square(y[..., self._turns]).sum(axis=-1) <= ball))

    def rotations(self, points: FloatArray) -> FloatArray:
        """Return the rotation matrices (K, 3, 3) at points (K, c)."""
        turn, own = SX.sym("turn", self.of_pose - 3), points[:, 3 : self.of_pose]
        return values_at(ca.Function("rotation", [turn], [ca.densify(rotation_of(self, turn))]), own)[0]

    def pose(self, y: FloatArray) -> PoseNumbers:
        """Return the pose at a point (c,)."""
        rotation = self.rotations(y[None])[0]
        axis, angle = axis_angle_from_matrix(rotation)
        return PoseNumbers(frozen_array(y[:3], (3,)), rotation, axis, angle)

    def coordinates(self, pose: PoseNumbers, settings: Sequence[float] | FloatArray = ()) -> FloatArray:
        """Return the coordinates (c,) of a pose in this box; fixed coordinates are taken from the box.

        Args:
            pose: the pose.
            settings: values of the dimensions that change along a path.
        """
        y = np.concatenate([pose.position, self._turn(pose), settings])
        return np.asarray(np.where(self.lower == self.upper, self.lower, y))

    def _turn(self, pose: PoseNumbers) -> FloatArray:
        """Return the coordinates (3,) or (4,) of a pose's rotation."""
        R = pose.rotation
        if self.of_pose > 6:
            return np.append(math.cos(pose.angle / 2), math.sin(pose.angle / 2) * pose.axis)
        if self.kind is not TurnKind.ROLL_PITCH_YAW:
            axis, angle = pose.axis, pose.angle
            if self.reference != UNTURNED:
                turn, square = _reference_matrix(self.reference)
                axis, angle = axis_angle_from_matrix(R @ turn.T / square)
            r = np.tan(angle / 2) * axis
            return np.asarray(r if self.kind is TurnKind.ANY_AXIS else np.array([r @ self.axis, 0.0, 0.0]))
        pitch = math.asin(min(max(-R[2, 0], -1.0), 1.0))
        roll, yaw = math.atan2(R[2, 1], R[2, 2]), math.atan2(R[1, 0], R[0, 0])
        # Two triples of angles describe the same rotation.
        other = [math.remainder(each, 2 * math.pi) for each in (roll + math.pi, math.pi - pitch, yaw + math.pi)]
        both = [np.tan(0.5 * np.array(each)) for each in ((roll, pitch, yaw), other)]
        low, high = self.lower[3 : self.of_pose], self.upper[3 : self.of_pose]
        return min(both, key=lambda r: float(np.maximum(low - r, r - high).max()))

    def contracted(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """Contract boxes (B, c) to the sets of positions and rotations; also return whether each result is empty."""
        lower, upper = np.array(lower), np.array(upper)
        without = np.zeros(len(lower), dtype=bool)
        if self.positions is not None:
            lower[:, :3], upper[:, :3], without = self.positions.contracted(lower[:, :3], upper[:, :3])
        if not self.ball < np.inf:
            return lower, upper, without
        turns = self._turns
        low, high = lower[:, turns], upper[:, turns]
        least = np.where(low > 0, low, np.where(high < 0, -high, 0.0)) ** 2
        whole = least.sum(axis=1, keepdims=True)
        slack = 4 * _ULP * (self.ball + whole)
        most = np.sqrt(np.maximum(self.ball - (whole - least) + slack, 0)) * (1 + _ULP)
        lower[:, turns], upper[:, turns] = np.maximum(low, -most), np.minimum(high, most)
        outside = (whole > self.ball + slack)[:, 0] | (lower > upper).any(axis=1)
        return lower, np.maximum(lower, upper), outside | without

    def clipped(self, points: FloatArray) -> FloatArray:
        """Return points (K, 6) moved into the workspace."""
        lower, upper, ball = self._inner
        points = np.clip(points, lower, upper)
        if math.isfinite(ball):
            # Slightly inside, so that rounding moves no point outside.
            radius = math.sqrt(ball) * (1 - _TANGENT)
            turns = self._turns
            sizes = np.sqrt((points[:, turns] ** 2).sum(axis=1, keepdims=True))
            points[:, turns] *= np.minimum(1.0, radius / np.maximum(sizes, radius))
        if self.positions is not None:
            own = self._positioned
            points[:, own] = self.positions.clipped(points[:, :3])[:, own]
        return np.asarray(points)

    def random(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random points (count, 6) of the workspace."""
        points = rng.uniform(self.lower, self.upper, (count, len(self.lower)))
        while math.isfinite(self.ball):
            outside = np.flatnonzero((points[:, self._turns] ** 2).sum(axis=1) > self._inner[2])
            if not outside.size:
                break
            points[outside] = rng.uniform(self.lower, self.upper, (outside.size, 6))
        if self.positions is not None:
            own = self._positioned
            points[:, own] = self.positions.random(count, rng)[:, own]
        return points


def pose_box(workspace: Workspace) -> PoseBox:
    """Return the box of coordinates of a workspace."""
    ends = [ends_of(value) for value in workspace.position]
    turns, ball = workspace.turns, math.inf
    if turns.kind is TurnKind.ANY_AXIS:
        radius = _tangent(max(abs(end) for end in ends_of(turns.angles[0])), 1.0)
        ball = radius * radius * (1 + _TANGENT)
        ends += [(-radius, radius)] * 3
    else:
        angles = [ends_of(value) for value in turns.angles]
        ends += [
            (_tangent(low, -1.0), _tangent(high, 1.0)) if low < high else (math.tan(low / 2),) * 2
            for low, high in angles
        ]
        ends += [(0.0, 0.0)] * (6 - len(ends))
    for each in workspace.dependent:
        is_turn = each.index >= 3
        ends[each.index] = (math.tan(each.lower / 2), math.tan(each.upper / 2)) if is_turn else (each.lower, each.upper)
    lower, upper = frozen_array(np.array(ends).T, (2, 6))
    dependent = tuple(each.index for each in workspace.dependent)
    chosen = workspace.position_set
    positions = None if chosen is None else PositionBounds(chosen, lower[:3], upper[:3])
    axis = frozen_array(turns.axis, (3,))
    return PoseBox(turns.kind, axis, lower, upper, ball, dependent=dependent, positions=positions)


def pose_coordinates(box: PoseBox) -> PoseCoordinates:
    """Return the coordinates of a box of poses, for a case as expressions of these coordinates."""
    middle = 0.5 * box.lower + 0.5 * box.upper
    values: list[Value] = [float(each) for each in (*middle[:3], *(2 * np.arctan(middle[3 : box.of_pose])))]
    for k in (k for k in box.free if k < box.of_pose):
        values[k] = Free(float(box.lower[k]), float(box.upper[k]))
    return PoseCoordinates(values, lambda turn: rotation_of(box, turn), box.ball)


def scaled(workspace: Workspace, factor: float) -> Workspace:
    """Return a workspace scaled about its centre, including angles; ranges of dependent coordinates are kept.

    Only the radius of a set of positions is scaled.
    """
    positions = None if workspace.position_set is None else workspace.position_set.scaled(factor)
    if positions is not None and positions.has_radius:
        return replace(workspace, position=positions.box, position_set=positions)
    turns, dependent = workspace.turns, [each.index for each in workspace.dependent]
    is_ball = turns.kind is TurnKind.ANY_AXIS
    values = [
        value if k in dependent and not (is_ball and k >= 3) else _scaled(value, factor, is_ball and k >= 3)
        for k, value in enumerate((*workspace.position, *turns.angles))
    ]
    if positions is not None:
        values[:3] = positions.box
    turned = replace(turns, angles=tuple(values[3:]))
    return replace(workspace, position=tuple(values[:3]), turns=turned, position_set=positions)


def _scaled(value: Value, factor: float, about_zero: bool = False) -> Value:
    """Return a range scaled about its centre, or about zero."""
    if not isinstance(value, Free):
        return value
    centre = 0.0 if about_zero else (value.lower + value.upper) / 2
    return Free(centre + factor * (value.lower - centre), centre + factor * (value.upper - centre))


def _tangent(angle: float, outwards: float) -> float:
    """Return the tangent of half an angle, moved up or down by more than its rounding error."""
    value = math.tan(angle / 2)
    return value + outwards * _TANGENT * abs(value)


def rotation_of(box: PoseBox, turn: SX) -> SX:
    """Return the rotation (3, 3) with coordinates (3, 1) or (4, 1) of a box."""
    if turn.numel() > 3:
        turned, scale = quaternion_rotation(turn)
        return turned / scale
    if box.kind is TurnKind.ROLL_PITCH_YAW:
        factors = [2 / (1 + turn[k] * turn[k]) for k in range(3)]
        about = [turn_about(k, factor - 1, factor * turn[k]) for k, factor in enumerate(factors)]
        return about[2] @ about[1] @ about[0]
    r = turn if box.kind is TurnKind.ANY_AXIS else turn[0] * SX(box.axis.tolist())
    scaled = 2 / (1 + ca.sumsqr(r)) * r
    turned = SX.eye(3) + ca.skew(scaled) + ca.skew(scaled) @ ca.skew(r)
    if box.reference == UNTURNED:
        return turned
    matrix, square = _reference_matrix(box.reference)
    return turned @ SX(matrix.tolist()) / square


def polynomial_rotation(box: PoseBox, turn: SX) -> tuple[SX, SX]:
    """Return ``s R`` (3, 3) and ``s`` (1, 1), polynomials of the coordinates of a rotation R, ``s > 0``."""
    if turn.numel() > 3:
        return quaternion_rotation(turn)
    if box.kind is TurnKind.ROLL_PITCH_YAW:
        turned, scale = SX.eye(3), SX(1)
        for k in range(3):
            one = 1 + turn[k] ** 2
            turned, scale = turn_about(k, 1 - turn[k] ** 2, 2 * turn[k], one) @ turned, one * scale
        return turned, scale
    turned, scale = cayley_rotation(turn if box.kind is TurnKind.ANY_AXIS else turn[0] * SX(box.axis.tolist()))
    if box.reference == UNTURNED:
        return turned, scale
    matrix, square = _reference_matrix(box.reference)
    return turned @ SX(matrix.tolist()), scale * square


def _reference_matrix(reference: Reference) -> tuple[FloatArray, float]:
    """Return the rotation matrix (3, 3) of a quaternion times its squared norm, exactly; and the squared norm."""
    return matrices_from_quaternions(np.array([reference], dtype=np.float64))[0], float(sum(k * k for k in reference))


def cayley_rotation(r: SX) -> tuple[SX, SX]:
    """Return ``s R`` (3, 3) and ``s = 1 + r.r`` (1, 1): R is the rotation with the Cayley vector r (3, 1)."""
    return quaternion_rotation(ca.vertcat(1, r))


def quaternion_rotation(y: SX) -> tuple[SX, SX]:
    """Return ``s R`` (3, 3) and ``s`` (1, 1): R is the rotation of a quaternion (4, 1), s its positive squared norm."""
    w, v = y[0], y[1:]
    square = ca.sumsqr(v)
    return (w * w - square) * SX.eye(3) + 2 * (v @ v.T) + 2 * w * ca.skew(v), w * w + square
