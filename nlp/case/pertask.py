"""Dimensions and poses that change from task to task: values of one task, sharing, and refusals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CaseError
from .pose import OverPoses, PerTask, Pose, Rotation, Value, shared_value

if TYPE_CHECKING:
    from .case import Case


def task_value(value: Value | PerTask, task: int) -> Value:
    """Return the value of a component for one task, by the task's index."""
    return value.values[task] if isinstance(value, PerTask) else value


def check_per_task(case: Case) -> None:
    """Refuse dimensions and poses that change from task to task where this has no meaning, or is not supported.

    Raises:
        CaseError: there is only one task, poses do not fit to tasks, or another table of the case conflicts.
    """
    if not case.changes:
        return
    name = next(iter(case.dimensions_per_task), None)
    key = "pose" if name is None else f"robot.parameters.{name}"
    tasks = len(case.tasks)
    if tasks == 1:
        raise CaseError(f"{key}.per", "'task' needs several [[task]], but the case has one; leave per out")
    if case.limits_over:
        fault = f"conflicts with {key}.per = 'task': a workspace or path needs one robot; remove over"
        raise CaseError("limits.over", fault, case.limits_over)
    if case.over_poses is OverPoses.WORST and case.pose_count > tasks:
        raise CaseError("combine.over_poses", "must be 'sum' or 'mean' with several tasks", case.over_poses.value)
    if case.pose_per_task:
        counts = _counts(case)
        if len(case.poses) % tasks or len(set(counts)) > 1:
            fault = f"must give every task the same number of poses: {tasks} tasks"
            raise CaseError("pose", f"{fault} have {len(case.poses)} stated poses, {sum(counts)} with displacements")
    for task in range(tasks):
        case.of_task(task)  # checks the dimensions and poses of this task


def _counts(case: Case) -> list[int]:
    """Return the number of poses of each task, with displacements."""
    each = max(len(case.poses) // len(case.tasks), 1)
    numbers = iter([len(pose.displacements) for pose in case.poses])
    return [sum(islice(numbers, each)) for _ in case.tasks]


def sharing(case: Case, names: Sequence[str]) -> Case:
    """Return a case in which some of the changing dimensions, or the pose, are the same for every task.

    Args:
        case: the case.
        names: names of its changing dimensions, or ``pose``.

    Raises:
        CaseError: no value is allowed for every task.
    """
    found = case
    if "pose" in names:
        first, *further = _shared_poses(case)
        found = replace(
            found, position=first.position, rotation=first.rotation, further=further, pose_per_task=False
        )
    parameters: dict[str, list[Value | PerTask]] = {}
    for item in case.model.parameters:
        given = case.parameters[item.name]
        parts = list(given) if isinstance(given, Sequence) else [given]
        for k, name in enumerate(item.components):
            part = parts[k]
            if isinstance(part, PerTask) and case.parameter_name(name) in names:
                parts[k] = _common(part.values, f"robot.parameters.{name}")
        parameters[item.name] = parts
    return replace(found, parameters=parameters)


def _common(values: Sequence[Value], key: str) -> Value:
    """Return the values that every task allows.

    Raises:
        CaseError: there is none.
    """
    value = shared_value(values)
    if value is None:
        raise CaseError(key, "has no value that every task allows")
    return value


def _shared_poses(case: Case) -> list[Pose]:
    """Return the poses with the coordinates that every task allows.

    Raises:
        CaseError: the tasks have different axes or displacements, or no coordinate is allowed for every task.
    """
    count = len(case.poses) // len(case.tasks)
    found = []
    for k in range(count):
        poses = case.poses[k::count]
        first = poses[0]
        rotations = [pose.rotation for pose in poses]
        if not all(_same_axis(first.rotation, each) for each in rotations):
            raise CaseError("pose.rotation", "has no axis that every task allows")
        if not all(_same_steps(first, pose) for pose in poses):
            raise CaseError("pose", "has displacements that differ from task to task")
        position = [_common(values, "pose.position") for values in zip(*(pose.position for pose in poses), strict=True)]
        angle = _common([each.angle for each in rotations], "pose.rotation.angle")
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
