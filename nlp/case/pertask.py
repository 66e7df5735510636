"""Values and poses that change from task to task: those of one task, those that all tasks allow, and all in order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...models import Displacement
from ..errors import CaseError
from .pose import PerTask, Pose, Rotation, Value, shared_value


class Station(NamedTuple):
    """Pose of the robot in a case.

    Attributes:
        task: index of the only task at this pose; None if every task takes it.
        pose: index of the stated pose.
        step: displacement from the stated pose.
    """

    task: int | None
    pose: int
    step: Displacement


def stations(poses: Sequence[Pose], tasks: int, own_poses: bool) -> tuple[Station, ...]:
    """Return the poses of the robot in order: those of the first task, then those of the second, and so on.

    Args:
        poses: stated poses, with their displacements.
        tasks: number of tasks, each with its own dimensions or poses; 0 if every task takes every pose.
        own_poses: True if the stated poses belong to the tasks in turn, as many to each task.
    """
    placed = [(k, step) for k, pose in enumerate(poses) for step in pose.displacements]
    if not tasks:
        return tuple(Station(None, k, step) for k, step in placed)
    count = len(poses) // tasks
    return tuple(
        Station(task, k, step) for task in range(tasks) for k, step in placed if not own_poses or k // count == task
    )


def task_value(value: Value | PerTask, task: int) -> Value:
    """Return the value of a component for one task, by the task's index."""
    return value.values[task] if isinstance(value, PerTask) else value


def check_poses(poses: Sequence[Pose], tasks: int) -> None:
    """Refuse poses that cannot be divided among tasks, the same number for each task.

    Args:
        poses: stated poses, with their displacements.
        tasks: number of tasks.

    Raises:
        CaseError: the tasks have different numbers of poses.
    """
    count = max(len(poses) // tasks, 1)
    sizes = [len(pose.displacements) for pose in poses]
    counts = [sum(sizes[k : k + count]) for k in range(0, len(poses), count)]
    if len(poses) % tasks or len(set(counts)) > 1:
        fault = f"must give each of the {tasks} tasks the same number of poses"
        raise CaseError("pose", f"{fault}, got {len(poses)} stated poses and {sum(sizes)} with displacements")


def common_value(values: Sequence[Value], key: str) -> Value:
    """Return the values that every task allows.

    Args:
        values: value of each task.
        key: dotted key, for messages.

    Raises:
        CaseError: there is none.
    """
    value = shared_value(values)
    if value is None:
        raise CaseError(key, "has no value that every task allows")
    return value


def common_poses(poses: Sequence[Pose], tasks: int) -> list[Pose]:
    """Return the poses with the coordinates that every task allows.

    Args:
        poses: stated poses of all tasks in turn.
        tasks: number of tasks.

    Raises:
        CaseError: the tasks have different axes or displacements, or no coordinate is allowed for every task.
    """
    count = len(poses) // tasks
    found = []
    for k in range(count):
        own = poses[k::count]
        first = own[0]
        if not all(_same_axis(first.rotation, pose.rotation) for pose in own):
            raise CaseError("pose.rotation", "has no axis that every task allows")
        if not all(_same_steps(first, pose) for pose in own):
            raise CaseError("pose", "has displacements that differ from task to task")
        position = [common_value(values, "pose.position") for values in zip(*(p.position for p in own), strict=True)]
        angle = common_value([pose.rotation.angle for pose in own], "pose.rotation.angle")
        found.append(Pose(position, replace(first.rotation, angle=angle), first.displacements))
    return found


def _same_steps(one: Pose, other: Pose) -> bool:
    """Return whether two poses have the same displacements."""
    steps, others = one.displacements, other.displacements
    return len(steps) == len(others) and all(
        np.array_equal(a.rotation, b.rotation) and np.array_equal(a.translation, b.translation)
        for a, b in zip(steps, others, strict=True)
    )


def _same_axis(one: Rotation, other: Rotation) -> bool:
    """Return whether two rotations have the same axis, or both a free axis."""
    if one.axis is None or other.axis is None:
        return one.axis is None and other.axis is None
    return np.array_equal(one.axis, other.axis)
