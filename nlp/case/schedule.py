"""Checks of settings: values that change along the tool path of a case, at most at their rates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

from ...models import Model
from ...models.model import joint_parameter
from ..errors import CaseError, listing
from .pathfile import PathFile
from .pose import Free, OverPoses, Rotation, Value
from .task import ALONG, FOLLOWS, Task
from .workspace import Workspace


class ScheduledCase(Protocol):
    """Parts of a case that its settings concern; see :class:`screwsynth.nlp.case.case.Case`."""

    @property
    def model(self) -> Model: ...  # noqa: D102 - the attributes are those of a case
    @property
    def tasks(self) -> Sequence[Task]: ...  # noqa: D102
    @property
    def path(self) -> PathFile | None: ...  # noqa: D102
    @property
    def over_path(self) -> OverPoses | None: ...  # noqa: D102
    @property
    def limits_over(self) -> str: ...  # noqa: D102
    @property
    def workspace(self) -> Workspace | None: ...  # noqa: D102
    @property
    def pose_count(self) -> int: ...  # noqa: D102
    @property
    def position(self) -> Sequence[Value]: ...  # noqa: D102
    @property
    def rotation(self) -> Rotation: ...  # noqa: D102
    @property
    def joint_centre_tolerance(self) -> float | None: ...  # noqa: D102
    def components(self, name: str) -> tuple[Value, ...]: ...  # noqa: D102


def check_settings(case: ScheduledCase) -> None:
    """Refuse settings, and tasks along a path, where these have no meaning or are not supported.

    Raises:
        CaseError: the path or the objective along it is missing, or another part of the case conflicts.
    """
    for key in _keys(case):
        if case.path is None:
            raise CaseError(f"{key}.per", "the case states no path", "path")
        if case.over_path is None:
            fault = f'{key} changes along the path, which needs over = "path" and as = "mean" or "worst"'
            raise CaseError("objective", fault)
    for index, task in enumerate(case.tasks):
        if task.measure in ALONG and case.over_path is None:
            raise CaseError(task.objective_key, 'needs over = "path" and as = "mean" or "worst"', task.measure)
        if task.measure and task.follows:
            fault = f"conflicts with {task.objective_key} = {task.measure!r}, which needs no motion; remove [[task]]"
            raise CaseError(f"task[{index}].follows", fault, task.follows)
        if task.follows:
            _check_follows(case, f"task[{index}].follows", task.follows)
    if case.over_path is not None:
        _check_over_path(case)


def _keys(case: ScheduledCase) -> Iterator[str]:
    """Yield the dotted key of each setting."""
    locked = [joint_parameter(label) for label in case.model.locked]
    for item in case.model.parameters:
        values = case.components(item.name)
        for k, value in enumerate(values):
            if isinstance(value, Free) and value.rate is not None:
                if item.is_direction:
                    raise CaseError(f"robot.parameters.{item.name}", "cannot change along the path: it is a direction")
                key = f"robot.parameters.{item.name}{f'[{k}]' if len(values) > 1 else ''}"
                yield key if item.name not in locked else f"limits.{item.name}"
    if case.path is not None and case.path.tool is not None and isinstance(case.path.tool.turn, Free):
        yield "path.tool.turn"


def _check_follows(case: ScheduledCase, key: str, follows: str) -> None:
    """Refuse a motion that moves with a path without this path, its objective or its tool."""
    if follows not in FOLLOWS:
        raise CaseError(key, f"must be one of {listing(FOLLOWS)}", follows)
    if case.path is None:
        raise CaseError(key, "the case states no path", follows)
    if case.over_path is None:
        raise CaseError(key, 'needs [objective] over = "path" and as = "mean" or "worst"', follows)
    if follows != "feed" and case.path.tool is None:
        raise CaseError(key, "needs path.tool with the tool's axis", follows)


def _check_over_path(case: ScheduledCase) -> None:
    """Refuse an objective along the path together with what it does not support."""
    key, over = "objective.over", "path"
    if case.over_path not in (OverPoses.MEAN, OverPoses.WORST):
        raise CaseError("objective.as", "must be 'mean' or 'worst'", getattr(case.over_path, "value", case.over_path))
    if case.path is None:
        raise CaseError(key, "the case states no path", over)
    if case.limits_over == "workspace":
        fault = "conflicts with objective.as: limits are then those of the path; use over = 'path'"
        raise CaseError("limits.over", f"{fault}, and prove the schedule with path --along", case.limits_over)
    if case.workspace is not None:
        raise CaseError("workspace", "conflicts with objective.as, which is about the path; remove [workspace]")
    if case.path.free:
        raise CaseError(f"path.place.{case.path.free[0]}", "must be a number: objective.as needs a path in one place")
    if case.pose_count > 1:
        raise CaseError("pose", f"must be one pose with objective.as, got {case.pose_count}")
    stated = [*case.position, case.rotation.angle]
    if case.rotation.axis is None or any(isinstance(value, Free) for value in stated):
        raise CaseError("pose", "must be fixed with objective.as: the poses are those of the path")
    if case.joint_centre_tolerance is not None:
        raise CaseError("tolerance.joint_centre", "is not supported with objective.as")
    if len({task.sense for task in case.tasks}) > 1:
        raise CaseError("task", "must all have the same sense with objective.as")
