"""Values of a result as settings of its case, by the names of ``--set``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from ...models import Dimension
from ..case.case import Case
from ..case.choices import values_of_component
from ..case.names import name_of_task
from ..case.overrides import ENDS, Settings
from ..case.pathfile import TURN
from ..case.pose import Free, Pose, RotationForm
from ..errors import InputError, listing
from ..evidence.state import PlatformPose
from ..system.jsonvalues import Vector
from .claims import refuted_claims
from .data import CombinedResult, SolveResult
from .evaluation import EvaluationResult
from .parts import RobotData, settings_from_data
from .path import PathResult
from .poses import rotation_form, rotation_numbers
from .schema import load_result
from .workspace import WorkspaceResult

Answer: TypeAlias = SolveResult | CombinedResult | EvaluationResult
#: Digits of a reached value in a message: its command shows nearly the same design.
_DIGITS = 7
#: Names of the values of a pose, after its prefix.
_OF_POSE = ("p_x", "p_y", "p_z", "axis", "angle", RotationForm.RPY.value, RotationForm.QUATERNION.value)


def load_answer(file: str) -> Answer:
    """Read a result of ``solve`` or ``evaluate``.

    Raises:
        InputError: the file cannot be read, or is no such result.
    """
    result = load_result(file)
    if not isinstance(result, Answer):
        raise InputError(f"--of {file}: is not a result of solve or evaluate")
    return result


def robots_of(result: Answer, source: str, case: Case, *, of_any_case: bool = False) -> tuple[RobotData, ...]:
    """Return the robot of a result of a case; the robot of each task, if dimensions or the pose change with the task.

    Args:
        result: the result.
        source: name of its file, for messages.
        case: the case.
        of_any_case: If true, the result may belong to another case with the same robot and units.

    Raises:
        InputError: the result belongs to another case, has other units or tasks, is no answer, or has dimensions that
            change along a path and not in the case.
    """
    name, model = result.head.case, result.head.model
    if model != case.model.name or (name != case.name and not of_any_case):
        fault = f"is a result of the case {name!r} with the robot {model!r}"
        raise InputError(f"{source}: {fault}, not of {case.name!r} with {case.model.name!r}")
    units = result.head.units
    if (units.length, units.angle) != (case.units.length, case.units.angle):
        own = f"{case.units.length!r} and {case.units.angle!r}"
        raise InputError(f"{source}: has the units {units.length!r} and {units.angle!r}, but the case has {own}")
    settings = _robots(result)
    if not settings or (not isinstance(result, EvaluationResult) and not result.status.is_answer):
        raise InputError(f"{source}: contains no answer: the solve failed{_reached_words(settings, case)}")
    moving = [name for name in _moving(result) if name not in case.settings]
    if moving:
        fault = f"{listing(moving)} changes along the path, but {case.name!r} has one value for it"
        raise InputError(f"{source}: {fault}; set the value with --set")
    if len(settings) > 1 and not case.changes:
        fault = f"has a robot for each of {len(settings)} tasks, but {case.name!r} has one robot for all tasks"
        raise InputError(f"{source}: {fault}; set the values with --set")
    if len(settings) > 1 and len(settings) != len(case.tasks):
        fault = f"has a robot for each of {len(settings)} tasks, but {case.name!r} has {len(case.tasks)} tasks"
        raise InputError(f"{source}: {fault}")
    return settings


def _moving(result: Answer) -> tuple[str, ...]:
    """Return the names of the dimensions that change along the path of a result."""
    if not isinstance(result, SolveResult) or result.schedule is None:
        return ()
    return tuple(name for name in result.schedule.names if name != TURN)


def _robots(result: Answer) -> tuple[RobotData, ...]:
    """Return the robots of a result: one, or one for each task; empty without a robot."""
    if isinstance(result, CombinedResult) and result.combined.settings:
        return result.combined.settings
    if isinstance(result, EvaluationResult) and result.settings:
        return result.settings
    return () if result.robot is None else (result.robot,)


def _reached_words(robots: Sequence[RobotData], case: Case) -> str:
    """Return the options that set the free values of a failed solve to those that it reached; empty without any."""
    if not robots or (len(robots) > 1 and len(robots) != len(case.tasks)):
        return ""
    free = {
        name
        for item in case.model.parameters
        for k in range(len(item.components))
        for _, name, value in values_of_component(case, item, k)
        if isinstance(value, Free)
    }
    free |= {
        case.parameter_name(item.name)
        for item in case.model.parameters
        if any(isinstance(value, Free) for value in case.components(item.name))
    }
    for prefix, pose in zip(case.pose_prefixes, case.poses, strict=True):
        free |= {
            f"{prefix}p_{axis}" for axis, value in zip("xyz", pose.position, strict=True) if isinstance(value, Free)
        }
        free |= {f"{prefix}angle", f"{prefix}axis"}  # settings have these names only if the rotation is free
    reached = {name: value for name, value in settings_of(robots, case).items() if name in free}
    texts = [
        f" --set {name}={','.join(f'{each:.{_DIGITS}g}' for each in (value if isinstance(value, list) else [value]))}"
        for name, value in reached.items()
    ]
    return f"; its reached design:{''.join(texts)}" if texts else ""


def claim_settings(given: str, case: Case) -> Settings:
    """Return the settings of a refuted claim, with limits, and its pose, by their names in its case.

    Args:
        given: file of ``workspace --json`` or ``path --json``, ``#``, and the number of the claim from 1, in the order
            of the file: refuted claims with a pose, or claims of a path with a fault.
        case: the case.

    Raises:
        InputError: the file cannot be read or is another result, or there is no such claim.
    """
    file, _, text = given.rpartition("#")
    if not file or not text.isdecimal():
        raise InputError(f"--set-from {given}: must be RESULT#N: a result file, and the number of a violated claim")
    result = load_result(file)
    form, numbers = rotation_form(case), dict[str, float | list[float]]()
    if isinstance(result, WorkspaceResult | PathResult):
        # The pose of the claim replaces the first pose of the case.
        replaced = {f"{case.pose_prefixes[0]}{name}" for name in _OF_POSE}
        of_command = settings_from_data(result.settings or {})
        numbers |= {name: each for name, each in of_command.items() if _without_end(name) not in replaced}
    if isinstance(result, WorkspaceResult):
        poses = [claim.pose for claim in refuted_claims(result)]
        numbers |= {case.parameter_name(name): _setting(value) for name, value in result.parameters.items()}
    elif isinstance(result, PathResult):
        poses = [claim.fault.pose for claim in result.path.claims if claim.fault is not None]
        form = RotationForm.RPY
    else:
        raise InputError(f"--set-from {given}: {file} is not a result of workspace or path")
    if (result.head.case, result.head.model) != (case.name, case.model.name):
        fault = f"is a result of the case {result.head.case!r} with the robot {result.head.model!r}"
        raise InputError(f"--set-from {given}: {fault}, not of {case.name!r} with {case.model.name!r}")
    if not 1 <= int(text) <= len(poses):
        raise InputError(f"--set-from {given}: {file} has {len(poses)} refuted claims with a pose")
    pose, prefix = poses[int(text) - 1], case.pose_prefixes[0]
    numbers |= {f"{prefix}p_{axis}": value for axis, value in zip("xyz", pose.position, strict=True)}
    turn = rotation_numbers(case, pose.axis, pose.angle, form)
    return numbers | {f"{prefix}{key}": each if len(each) > 1 else each[0] for key, each in turn.items()}


def settings_of(robots: Sequence[RobotData], case: Case) -> Settings:
    """Return the values of a robot, or of the robot of each task, by their names in the case, in the case's units."""
    found = dict(dimensions_of(robots, case))
    own = robots if case.pose_per_task else robots[:1]
    stated = [pose for each in own for pose in ((each.pose,) if each.several is None else each.several.stated_poses)]
    if len(stated) < len(case.poses):  # the poses of one robot, which are those of every task
        stated *= len(case.tasks)
    for prefix, pose, data in zip(case.pose_prefixes, case.poses, stated, strict=True):
        found |= _pose_settings(prefix, pose, data)
    return found


def dimensions_of(robots: Sequence[RobotData], case: Case) -> Settings:
    """Return the dimensions of a robot, or of the robot of each task, by their names in the case, in its units.

    Dimensions that change along the path of the case are left out: a robot has one value of each.
    """
    found: dict[str, float | list[float]] = {}
    changing = case.dimensions_per_task
    for item in case.model.parameters:
        if case.settings.keys() & set(case.component_names(item)):
            continue  # a schedule gives its values
        of_task = [_setting(robot.parameters[item.name]) for robot in robots]
        names = case.component_names(item)
        if not changing.keys() & set(item.components) and not case.settings.keys() & set(names):
            found[case.parameter_name(item.name)] = of_task[0]
            continue
        parts = [each if isinstance(each, list) else [each] for each in of_task]
        for k, (key, name) in enumerate(zip(item.components, names, strict=True)):
            if key in changing:
                found |= {name_of_task(name, j): parts[j % len(parts)][k] for j in range(len(case.tasks))}
            elif name not in case.settings:
                found[name] = parts[0][k]
    return found


def _without_end(name: str) -> str:
    """Return the name of a value without ``.min``, ``.max`` or another suffix of a range."""
    whole, _, end = name.rpartition(".")
    return whole if end in ENDS else name


def _setting(value: float | Vector) -> float | list[float]:
    return list(value) if isinstance(value, tuple) else value


def joints_of(robots: Sequence[RobotData], case: Case) -> Mapping[str, float]:
    """Return the free actuator coordinates by the names of their variables, length or radians.

    Raises:
        InputError: every task has its own coordinates.
    """
    robot = robots[0]
    if case.changes and robot.free_joints:
        fault = f"each task has its own coordinates of the actuated joints {', '.join(case.model.free_joints)}"
        raise InputError(f"--of: is not supported for this robot: {fault}; set the other values with --set")
    return {each.name: case.units.to_internal(each.value, Dimension(each.kind)) for each in robot.free_joints or ()}


def place_of(result: Answer, case: Case) -> Settings:
    """Return the free values of the path placement in a result, by their names in the case."""
    path = result.path if isinstance(result, SolveResult) else None
    if path is None or case.path is None:
        return {}
    return {f"path.place.{name}": getattr(path.place, name) for name in case.path.free}


def _pose_settings(prefix: str, pose: Pose, data: PlatformPose) -> Settings:
    """Return the values of a pose; values of the rotation only if the rotation is free."""
    found: dict[str, float | list[float]] = {
        f"{prefix}p_{axis}": value for axis, value in zip("xyz", data.position, strict=True)
    }
    if isinstance(pose.rotation.angle, Free) or pose.rotation.axis is None:
        found[f"{prefix}angle"] = data.angle
        found[f"{prefix}axis"] = list(data.axis)
    return found
