"""Checks of the tasks and loads of a case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...models import Model, frozen_array
from ...models.statics import driven_joints
from ..errors import CaseError, listing
from ..units import Units
from .checks import check_real, check_reals, check_size, check_statics, check_vector
from .loads import Loading
from .pose import LARGEST
from .task import ALONG, MEASURES, SMALLEST, Sense, Task


def check_tasks(given: Sequence[Task], model: Model, loading: Loading) -> tuple[Task, ...]:
    """Return the checked tasks, with twists as arrays (6,).

    Args:
        given: tasks of the case.
        model: the robot.
        loading: loads on the platform, and its largest speeds.

    Raises:
        CaseError: there is no task, a twist or weight is not allowed, or two tasks have the same name.
    """
    if not given:
        raise CaseError("task", "is missing: a case needs at least one [[task]]")
    tasks = []
    for index, task in enumerate(given):
        key = f"task[{index}]"
        twist = check_reals(task.twist, f"{key}.twist")
        if twist.shape != (6,) or not np.isfinite(twist).all():
            raise CaseError(f"{key}.twist", "must be six finite numbers", twist.tolist())
        size = float(np.abs(twist).max())
        if size == 0:
            raise CaseError(f"{key}.twist", "must not be zero: the platform would not move", twist.tolist())
        if not 1 / LARGEST <= size <= LARGEST:
            fault = f"must have a largest component between {1 / LARGEST:g} and {LARGEST:g}, got {size:g}"
            raise CaseError(f"{key}.twist", fault)
        weight = check_real(task.weight, f"{key}.weight")
        if not (math.isfinite(weight) and weight > 0):
            raise CaseError(f"{key}.weight", "must be positive and finite", task.weight)
        point = None if task.point is None else frozen_array(check_vector(task.point, f"{key}.point"), (3,))
        _check_measure(task, len(given), model, loading)
        stated = replace(task, twist=frozen_array(twist, (6,)), sense=Sense(task.sense), weight=weight, point=point)
        tasks.append(stated)
    names = [task.name for task in tasks]
    for index, name in enumerate(names):
        if name in names[:index]:
            raise CaseError(f"task[{index}].name", "is used by an earlier task; give each task its own name", name)
    return tuple(tasks)


def _check_measure(task: Task, tasks: int, model: Model, loading: Loading) -> None:
    """Refuse an objective of the actuators for which loads, motion or a suitable robot is missing.

    Raises:
        CaseError: the objective is not allowed.
    """
    if not task.measure:
        return
    key = task.objective_key
    if task.measure not in (*MEASURES, *ALONG):
        raise CaseError(key, f"must be one of {listing([*MEASURES, *ALONG])}", task.measure)
    if tasks > 1:
        fault = f"must be given at most once with {key}, which does not optimise the F of tasks"
        raise CaseError("task", f"{fault}, got {tasks}")
    sense = Sense.MAX if task.measure == SMALLEST else Sense.MIN
    if task.sense is not sense:
        fault = f'{key} needs no task: remove [[task]], or give it sense = "{sense.value}"'
        raise CaseError("task[0].sense", fault, task.sense.value)
    if task.measure == SMALLEST:
        _check_length(task.length)
    if task.measure in ALONG:
        return  # an objective along a path, checked with it
    needs_loads, needs_motion = MEASURES[task.measure]
    if needs_loads and not loading.loads:
        raise CaseError(key, "needs a table [[load]] with a load on the platform", task.measure)
    if needs_motion and loading.motion is None:
        raise CaseError(key, "needs the table [motion] with the largest speeds of the platform", task.measure)
    check_statics(model, key, task.measure)
    joints = driven_joints(model)
    if task.measure != "actuator_power" and len({joint.dimension for joint in joints}) > 1:
        fault = "compares all actuators, but the robot has revolute and prismatic ones; minimise actuator_power"
        raise CaseError(key, fault, task.measure)


def _check_length(length: float | None) -> None:
    """Refuse a missing length by which moments are divided, or one that is not positive.

    Raises:
        CaseError: the length is not allowed.
    """
    key = "objective.length"
    if length is None:
        fault = "is missing: maximise needs the length by which moments about the platform origin are divided"
        raise CaseError(key, fault)
    if not (math.isfinite(length) and length > 0):
        raise CaseError(key, "must be positive", length)
    check_size(length, key)


def check_loading(loading: Loading, model: Model, units: Units) -> None:
    """Refuse invalid loads and motions, and robots whose actuator forces do not follow from the loads.

    Args:
        loading: loads on the platform, and its largest speeds.
        model: the robot.
        units: units of messages.

    Raises:
        CaseError: loads, motion, gravity or stiffness are not allowed.
    """
    loading.check(units)
    parts = (("load", loading.loads), ("motion", loading.motion), ("robot.actuator_stiffness", loading.stiffness))
    stated = [key for key, given in parts if given]
    if stated:
        check_statics(model, stated[0])
        loading.check_work(model)
    if loading.stiffness is not None:
        loading.stiffness_of([joint.name for joint in driven_joints(model)])
