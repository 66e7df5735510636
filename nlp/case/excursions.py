"""Workspaces stated as excursions from the pose of a case, and their conversion to world coordinates.

An excursion displaces the platform along and about the world axes: ``p = p0 + e``, ``R = E R0``. The result is a box in
world coordinates if the pose has no rotation, the excursions have none, or both rotate about one axis. In ``Rz(yaw)
Ry(pitch) Rx(roll) R0``, a rotation R0 about x adds to roll; about y to pitch, if roll is 0; about z to yaw, if roll and
pitch are 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...models import Dimension, FloatArray, frozen_array
from ..errors import CaseError
from ..units import Units
from .pose import Free, Pose, Rotation, Value, ends_of
from .workspace import LARGEST_TURN, TURNS, TurnKind, Turns, Workspace

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: Smallest cosine of the angle between two axes that are considered equal.
_SAME_AXIS = 1 - 1e-12
#: Relative rounding error by which a pose may be outside of a workspace.
_ROUNDING = 1e-9


class _Along(NamedTuple):
    """Angle of a workspace to which the angle of a pose is added: its index, and the sign of the sum."""

    place: int
    sign: float


def in_world(workspace: Workspace, pose: Pose) -> Workspace:
    """Return a workspace in world coordinates; ranges are rounded outwards.

    Args:
        workspace: the workspace; if stated as excursions, already checked by :func:`check_excursions`.
        pose: stated pose of the case; fixed if the workspace is stated as excursions.
    """
    if not workspace.about_pose:
        return workspace
    position = tuple(_moved(value, ends_of(by)[0]) for value, by in zip(workspace.position, pose.position, strict=True))
    turns, angle = workspace.turns, ends_of(pose.rotation.angle)[0]
    along = _along(turns, pose.rotation)
    if along is None and angle and pose.rotation.axis is not None:
        x, y, z = frozen_array(pose.rotation.axis, (3,)).tolist()
        turns = Turns(TurnKind.AXIS, (angle,), (x, y, z))
    elif along is not None:
        angles = list(turns.angles)
        angles[along.place] = _moved(angles[along.place], along.sign * angle)
        turns = replace(turns, angles=tuple(angles))
    positions = workspace.position_set
    if positions is not None:
        positions = positions.moved(np.array([ends_of(each)[0] for each in pose.position]))
        position = positions.box
    return replace(workspace, position=position, turns=turns, about_pose=False, position_set=positions)


def check_excursions(workspace: Workspace, pose: Pose, count: int, units: Units) -> None:
    """Refuse excursions that are not a box in world coordinates.

    Args:
        workspace: the workspace.
        pose: stated pose of the case.
        count: number of poses of the robot.
        units: units of messages.

    Raises:
        CaseError: the case has several poses, pose and excursions rotate about different axes, or their angles are too
            large together.
    """
    if not workspace.about_pose:
        return
    if count > 1 or not pose.displacements[0].is_identity:
        raise CaseError(
            "workspace.about", "must be 'world' for a case with several poses or with displacements", "pose"
        )
    turns, rotation = workspace.turns, pose.rotation
    along = _along(turns, rotation)
    if along is None:
        if any(each != 0.0 for each in turns.angles) and rotation.angle != 0.0:
            fault = (
                "must be left out, or rotate about the axis of the pose's rotation: with about = 'pose', "
                "rotations about different axes cannot be combined"
            )
            raise CaseError("workspace.rotation", fault)
        return
    name = TURNS[along.place] if turns.kind is TurnKind.ROLL_PITCH_YAW else "angle"
    ends = [along.sign * each for each in ends_of(rotation.angle)]
    far = max(abs(one + other) for one in ends_of(turns.angles[along.place]) for other in ends)
    if far > LARGEST_TURN:
        most = units.text(LARGEST_TURN, Dimension.ANGLE)

        both = units.text(far, Dimension.ANGLE)
        fault = f"must be at most {most} when added to the rotation angle of the pose, got the sum {both}"
        raise CaseError(f"workspace.rotation.{name}", fault)


def refuse_free(workspace: Workspace, pose: Pose, source: str | None) -> None:
    """Refuse a pose with a free coordinate for a workspace stated as excursions.

    Raises:
        CaseError: a coordinate of the pose is free.
    """
    if not workspace.about_pose:
        return
    rotation = pose.rotation
    numbers = {f"position[{k}]": (f"p_{name}", pose.position[k]) for k, name in enumerate("xyz")}
    numbers["rotation.angle"] = "angle", rotation.angle
    for key, (name, value) in numbers.items():
        if isinstance(value, Free):
            fault = f"must be fixed, as the workspace is relative to the pose: use --set {name}=... or --of RESULT"
            raise CaseError(f"pose.{key}", fault, source=source)
    if rotation.axis is None and rotation.angle != 0.0:
        fault = "must be fixed, as the workspace is relative to the pose: use --set axis=... or --of RESULT"
        raise CaseError("pose.rotation.axis", fault, source=source)


class OutsideWorkspace(NamedTuple):
    """Report that a workspace in world coordinates contains no stated pose of the case.

    Attributes:
        sentence: message with the coordinate outside of its range, and a hint if excursions were probably intended.
        may_be_excursions: True if the range of this coordinate contains 0, as ranges of excursions do.
    """

    sentence: str
    may_be_excursions: bool


def outside_workspace(
    workspace: Workspace, poses: Sequence[Pose], units: Units, *, by_ranges: bool = False
) -> OutsideWorkspace | None:
    """Return the reason why a workspace in world coordinates contains no stated pose; None if it contains one.

    A free coordinate of a pose may have any value in its range. Rotations are compared if both are fixed, or about the
    same axis.

    Args:
        workspace: the workspace.
        poses: stated poses of the case.
        units: units of messages.
        by_ranges: If true, only coordinates with a range are compared, because fixed ones may be dependent.
    """
    if workspace.about_pose:
        return None
    every = [list(_faults(workspace, pose, units, by_ranges=by_ranges)) for pose in poses]
    if not all(every):
        return None
    is_one, (fault, holds_zero) = len(poses) == 1, max(every[0], key=lambda each: each.may_be_excursions)
    sentence = f"the workspace does not contain the pose{'' if is_one else 's'}: {fault}"
    if is_one and holds_zero:
        sentence += '; write about = "pose" in [workspace] if its values are excursions from the pose'
    return OutsideWorkspace(sentence, is_one and holds_zero)


def _faults(workspace: Workspace, pose: Pose, units: Units, *, by_ranges: bool) -> Iterator[OutsideWorkspace]:
    """Yield a report for each coordinate in which a pose is outside of a workspace, if it can be compared."""
    pairs = [
        (name, stated, at, Dimension.LENGTH)
        for name, stated, at in zip("xyz", workspace.position, pose.position, strict=True)
    ]
    pairs += [(name, stated, at, Dimension.ANGLE) for name, stated, at in _angles(workspace.turns, pose.rotation)]
    for name, stated, at, dimension in pairs:
        (low, high), (least, most) = ends_of(stated), ends_of(at)
        slack = _ROUNDING * max(map(abs, (low, high, least, most)))
        is_compared = isinstance(stated, Free) or not by_ranges
        if is_compared and (least > high + slack or most < low - slack):
            ranges = [_span(each, units, dimension) for each in (stated, at)]
            yield OutsideWorkspace(f"{name} is {ranges[0]} there and {ranges[1]} at the pose", low <= 0 <= high)
    positions = workspace.position_set
    if positions is not None and not any(isinstance(each, Free) for each in pose.position):
        # Coordinates that the shape does not couple were compared before.
        used, point = list(positions.coordinates), np.array(workspace.middle)
        point[used] = np.array([ends_of(each)[0] for each in pose.position])[used]
        if not positions.contains(point):
            place = ", ".join(units.text(value, Dimension.LENGTH) for value in point[used].tolist())
            yield OutsideWorkspace(
                f"the position at the pose ({place}) is outside of its {positions.kind.value}", False
            )


def _angles(turns: Turns, rotation: Rotation) -> list[tuple[str, Value, Value]]:
    """Return name, value in the workspace and value at the pose of each angle that can be compared."""
    if turns.kind is TurnKind.ANY_AXIS:
        least, most = ends_of(rotation.angle)
        size = min(abs(least), abs(most)) if least * most > 0 else 0.0
        return [("angle", turns.angles[0], size)]
    along = _along(turns, rotation)
    if along is not None:
        name = TURNS[along.place] if turns.kind is TurnKind.ROLL_PITCH_YAW else "angle"
        angle = rotation.angle
        low, high = sorted(along.sign * each for each in ends_of(angle))
        return [(name, turns.angles[along.place], Free(low, high) if isinstance(angle, Free) else low)]
    if turns.kind is TurnKind.ROLL_PITCH_YAW and rotation.axis is not None and not isinstance(rotation.angle, Free):
        return list(zip(TURNS, turns.angles, _roll_pitch_yaw(rotation.axis, rotation.angle), strict=True))
    if turns == Turns() and rotation.axis is not None:
        return [("the angle", 0.0, rotation.angle)]
    return []


def _roll_pitch_yaw(axis: ArrayLike, angle: float) -> tuple[float, float, float]:
    """Return roll, pitch and yaw, radians, of a rotation about an axis (3,)."""
    w, (x, y, z) = math.cos(angle / 2), (math.sin(angle / 2) * frozen_array(axis, (3,))).tolist()
    pitch = math.asin(min(max(2 * (w * y - x * z), -1.0), 1.0))
    return (
        math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        pitch,
        math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)),
    )


def _span(value: Value, units: Units, dimension: Dimension) -> str:
    """Return a value or a range as text with its unit."""
    if not isinstance(value, Free):
        return units.text(value, dimension)
    return f"{units.shown(value.lower, dimension):.6g} to {units.text(value.upper, dimension)}"


def _along(turns: Turns, rotation: Rotation) -> _Along | None:
    """Return the angle of a workspace to which the angle of a pose is added; None for different axes."""
    if rotation.axis is None or turns.kind is TurnKind.ANY_AXIS:
        return None
    axis: FloatArray = frozen_array(rotation.axis, (3,))
    if turns.kind is TurnKind.AXIS:
        cosine = float(np.dot(axis, turns.axis))
        return _Along(0, math.copysign(1.0, cosine)) if abs(cosine) >= _SAME_AXIS else None
    k = int(np.abs(axis).argmax())
    if abs(axis[k]) < _SAME_AXIS or any(each != 0.0 for each in turns.angles[:k]):
        return None
    return _Along(k, math.copysign(1.0, float(axis[k])))


def _moved(value: Value, by: float) -> Value:
    """Return a fixed or free value shifted by an offset; a range is rounded outwards."""
    if not by:
        return value
    if not isinstance(value, Free):
        return value + by
    return Free(_sum(value.lower, by, -math.inf), _sum(value.upper, by, math.inf))


def _sum(one: float, other: float, outwards: float) -> float:
    """Return a sum; if it is rounded, it is moved towards ``outwards``, which is plus or minus infinity."""
    total = one + other
    # The error of a sum of two doubles is a double (Knuth).
    part = total - one
    error = (one - (total - part)) + (other - part)
    return total if error == 0 or (error < 0) == (outwards > 0) else math.nextafter(total, outwards)
