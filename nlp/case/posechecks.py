"""Checks of the stated poses of a case."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...models import Dimension, unit_vector
from ..errors import CaseError
from ..units import Units
from .checks import check_direction, check_value
from .pose import MAX_FREE_ROTATION, Free, OverPoses, Pose, Rotation, Value


def check_position(position: Sequence[Value], pose: str, units: Units) -> tuple[Value, ...]:
    """Return the checked position of a stated pose.

    Args:
        position: position of the pose.
        pose: dotted key of the pose, for messages.
        units: units of messages.

    Raises:
        CaseError: there are not three coordinates, or a coordinate is not allowed.
    """
    if len(position) != 3:
        fault = f"must be a list of 3, each a number or {{ min, max }}, got {len(position)}"
        raise CaseError(f"{pose}.position", fault)
    return tuple(
        check_value(value, f"{pose}.position[{index}]", Dimension.LENGTH, units) for index, value in enumerate(position)
    )


def check_rotation(given: Rotation, pose: str, units: Units) -> Rotation:
    """Return the checked rotation of a stated pose; a fixed axis becomes a unit vector.

    Args:
        given: rotation of the pose.
        pose: dotted key of the pose, for messages.
        units: units of messages.

    Raises:
        CaseError: the angle is too large, its bounds are not symmetric about a free axis, or the axis is zero.
    """
    key = f"{pose}.rotation.angle"
    if given.axis is None:
        largest, why = MAX_FREE_ROTATION, "with a free axis"
    else:
        largest, why = 2 * math.pi, "with a fixed axis"
    angle = check_value(given.angle, key, Dimension.ANGLE, units)
    ends = {f"{key}.min": angle.lower, f"{key}.max": angle.upper} if isinstance(angle, Free) else {key: angle}
    for place, end in ends.items():
        if abs(end) > largest:
            allowed = units.text(largest, Dimension.ANGLE)
            raise CaseError(place, f"must be at most {allowed} in magnitude {why}", units.shown(end, Dimension.ANGLE))
    lopsided = isinstance(angle, Free) and angle.lower < 0 < angle.upper and not math.isclose(-angle.lower, angle.upper)
    if given.axis is None and isinstance(angle, Free) and lopsided:
        fault = "must be -max, or have the sign of max: about a free axis the sign of an angle has no meaning"
        raise CaseError(f"{key}.min", fault, units.shown(angle.lower, Dimension.ANGLE))
    axis = None if given.axis is None else unit_vector(check_direction(given.axis, f"{pose}.rotation.axis"))
    return Rotation(axis, angle, given.form)


def check_further_poses(poses: Sequence[Pose], units: Units) -> tuple[Pose, ...]:
    """Return the checked stated poses after the first.

    Args:
        poses: stated poses after the first, with their displacements.
        units: units of messages.

    Raises:
        CaseError: a coordinate is not allowed.
    """
    return tuple(
        Pose(
            check_position(pose.position, f"pose[{k}]", units),
            check_rotation(pose.rotation, f"pose[{k}]", units),
            tuple(pose.displacements),
        )
        for k, pose in enumerate(poses, 1)
    )


def check_displacements(poses: Sequence[Pose], over_poses: OverPoses, tasks: int) -> None:
    """Refuse poses without a displacement, and the worst F over poses with several tasks.

    Args:
        poses: all stated poses.
        over_poses: combination of F over the poses.
        tasks: number of tasks.

    Raises:
        CaseError: the poses are not allowed.
    """
    for k, pose in enumerate(poses):
        if not pose.displacements:
            raise CaseError(f"pose[{k}]" if k else "pose", "must have at least one displacement, got none")
    if sum(len(pose.displacements) for pose in poses) > 1 and over_poses is OverPoses.WORST and tasks > 1:
        raise CaseError("combine.over_poses", "must be 'sum' or 'mean' with several tasks", over_poses.value)
