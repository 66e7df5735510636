"""Workspaces about the pose of a case: excursions in the axes of the world, and the same poses in world coordinates.

An excursion moves the platform's origin by its position, and turns the platform of the stated pose by its rotation:
``p = p0 + e``, ``R = E R0``. In world coordinates these are a box of the same kind where the pose is not turned, where
nothing turns in the excursions, and where both turn about one axis.

Source of ``E R0`` for roll, pitch and yaw: ``Rz(yaw) Ry(pitch) Rx(roll) R0``, in which a turn R0 about x adds to roll,
about y to pitch where roll is 0, and about z to yaw where both are 0.
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

#: Cosine of the angle between two axes that count as one.
_SAME_AXIS = 1 - 1e-12
#: Part of the largest number of a comparison by which a pose may be outside of a workspace: rounding.
_ROUNDING = 1e-9


class _Along(NamedTuple):
    """The angle of a workspace to which the angle of a pose adds, by its place, and with which sign."""

    place: int
    sign: float


def in_world(workspace: Workspace, pose: Pose) -> Workspace:
    """Return the poses of a workspace in world coordinates; ranges are rounded outwards.

    Args:
        workspace: checked by :func:`check_excursions` where it is about the pose.
        pose: the stated pose of its case, with fixed numbers where the workspace is about it.
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
    return replace(workspace, position=position, turns=turns, about_pose=False)


def check_excursions(workspace: Workspace, pose: Pose, count: int, units: Units) -> None:
    """Refuse a workspace about a pose that is no box of poses in world coordinates.

    Args:
        workspace: the workspace.
        pose: the stated pose.
        count: number of poses that the robot takes.
        units: units for people.

    Raises:
        CaseError: the case has several poses, both turn about different axes, or the angles are too large together.
    """
    if not workspace.about_pose:
        return
    if count > 1 or not pose.displacements[0].is_identity:
        raise CaseError("workspace.about", "must be 'world' where a case has several poses, or displaced ones", "pose")
    turns, rotation = workspace.turns, pose.rotation
    along = _along(turns, rotation)
    if along is None:
        if any(each != 0.0 for each in turns.angles) and rotation.angle != 0.0:
            fault = "must be about the pose's axis, or left out, where the pose is turned and about = 'pose'"
            raise CaseError("workspace.rotation", fault)
        return
    name = TURNS[along.place] if turns.kind is TurnKind.ROLL_PITCH_YAW else "angle"
    ends = [along.sign * each for each in ends_of(rotation.angle)]
    far = max(abs(one + other) for one in ends_of(turns.angles[along.place]) for other in ends)
    if far > LARGEST_TURN:
        most = units.text(LARGEST_TURN, Dimension.ANGLE)
        fault = f"reaches {units.text(far, Dimension.ANGLE)} with the angle of the pose, and at most {most} are allowed"
        raise CaseError(f"workspace.rotation.{name}", fault)


def refuse_free(workspace: Workspace, pose: Pose, source: str | None) -> None:
    """Refuse a pose with a free number where a workspace is about it.

    Raises:
        CaseError: a number is free.
    """
    if not workspace.about_pose:
        return
    rotation = pose.rotation
    numbers = {f"position[{k}]": (f"p_{name}", pose.position[k]) for k, name in enumerate("xyz")}
    numbers["rotation.angle"] = "angle", rotation.angle
    for key, (name, value) in numbers.items():
        if isinstance(value, Free):
            fault = "is free, and the workspace is about the pose"
            raise CaseError(
                f"pose.{key}", f"{fault}: give it with --set {name}=..., or a result with --of", source=source
            )
    if rotation.axis is None and rotation.angle != 0.0:
        fault = "is free, and the workspace is about the pose: give it with --set axis=..., or a result with --of"
        raise CaseError("pose.rotation.axis", fault, source=source)


class NotHeld(NamedTuple):
    """A workspace in world coordinates that holds none of a case's poses.

    Attributes:
        sentence: what is outside, with the offer where the numbers may be excursions.
        may_be_excursions: whether the workspace holds 0 where the pose is outside of it, as excursions do.
    """

    sentence: str
    may_be_excursions: bool


def not_held(workspace: Workspace, poses: Sequence[Pose], units: Units, *, by_ranges: bool = False) -> NotHeld | None:
    """Return how a workspace in world coordinates holds none of a case's poses; None where it holds one.

    Of a pose with free numbers, any value counts. Rotations are compared where both are fixed or about one axis.

    Args:
        workspace: the workspace.
        poses: the stated poses.
        units: units for people.
        by_ranges: whether ranges of the workspace alone count: those of its fixed numbers that the robot cannot choose
            follow from others.
    """
    if workspace.about_pose:
        return None
    every = [list(_faults(workspace, pose, units, by_ranges=by_ranges)) for pose in poses]
    if not all(every):
        return None
    is_one, (fault, holds_zero) = len(poses) == 1, max(every[0], key=lambda each: each.may_be_excursions)
    sentence = f"the workspace does not hold the pose{'' if is_one else 's'}: {fault}"
    if is_one and holds_zero:
        sentence += '; write about = "pose" in [workspace] if its numbers are excursions about the pose'
    return NotHeld(sentence, is_one and holds_zero)


def _faults(workspace: Workspace, pose: Pose, units: Units, *, by_ranges: bool) -> Iterator[NotHeld]:
    """Yield each coordinate in which a pose is outside of a workspace, as far as that is known."""
    pairs = [
        (name, stated, own, Dimension.LENGTH)
        for name, stated, own in zip("xyz", workspace.position, pose.position, strict=True)
    ]
    pairs += [(name, stated, own, Dimension.ANGLE) for name, stated, own in _angles(workspace.turns, pose.rotation)]
    for name, stated, own, dimension in pairs:
        (low, high), (least, most) = ends_of(stated), ends_of(own)
        slack = _ROUNDING * max(map(abs, (low, high, least, most)))
        is_meant = isinstance(stated, Free) or not by_ranges
        if is_meant and (least > high + slack or most < low - slack):
            ranges = [_span(each, units, dimension) for each in (stated, own)]
            yield NotHeld(f"{name} is {ranges[0]}, and the pose has {ranges[1]}", low <= 0 <= high)


def _angles(turns: Turns, rotation: Rotation) -> list[tuple[str, Value, Value]]:
    """Return the angles of a workspace beside those of a pose, by name, where they can be compared."""
    if turns.kind is TurnKind.ANY_AXIS:
        least, most = ends_of(rotation.angle)
        size = min(abs(least), abs(most)) if least * most > 0 else 0.0
        return [("angle", turns.angles[0], size)]
    along = _along(turns, rotation)
    if along is not None:
        name = TURNS[along.place] if turns.kind is TurnKind.ROLL_PITCH_YAW else "angle"
        own = rotation.angle
        low, high = sorted(along.sign * each for each in ends_of(own))
        return [(name, turns.angles[along.place], Free(low, high) if isinstance(own, Free) else low)]
    if turns.kind is TurnKind.ROLL_PITCH_YAW and rotation.axis is not None and not isinstance(rotation.angle, Free):
        return list(zip(TURNS, turns.angles, _roll_pitch_yaw(rotation.axis, rotation.angle), strict=True))
    if turns == Turns() and rotation.axis is not None:
        return [("the angle", 0.0, rotation.angle)]
    return []


def _roll_pitch_yaw(axis: ArrayLike, angle: float) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation."""
    w, (x, y, z) = math.cos(angle / 2), (math.sin(angle / 2) * frozen_array(axis, (3,))).tolist()
    pitch = math.asin(min(max(2 * (w * y - x * z), -1.0), 1.0))
    return (
        math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        pitch,
        math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)),
    )


def _span(value: Value, units: Units, dimension: Dimension) -> str:
    """Return a number or a range with its unit."""
    if not isinstance(value, Free):
        return units.text(value, dimension)
    return f"{units.shown(value.lower, dimension):.6g} to {units.text(value.upper, dimension)}"


def _along(turns: Turns, rotation: Rotation) -> _Along | None:
    """Return the angle of a workspace to which that of a pose adds; None for none."""
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
    """Return a number moved by another one; a range holds every sum."""
    if not by:
        return value
    if not isinstance(value, Free):
        return value + by
    return Free(_sum(value.lower, by, -math.inf), _sum(value.upper, by, math.inf))


def _sum(one: float, other: float, outwards: float) -> float:
    """Return a sum, rounded to one side where it is rounded at all."""
    total = one + other
    # The error of a sum of two doubles is a double (Knuth).
    part = total - one
    error = (one - (total - part)) + (other - part)
    return total if error == 0 or (error < 0) == (outwards > 0) else math.nextafter(total, outwards)
