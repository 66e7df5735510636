"""Replacement of values in a case file by name, as the option ``--set`` does."""

from __future__ import annotations

import re
from collections.abc import Mapping
from copy import deepcopy
from typing import Any, TypeAlias

from ...models import component_names
from ..errors import CaseError, nearest
from .names import name_of_task, parameter_name, pose_prefixes
from .pathfile import TURN
from .posesettings import override_setting

#: New values by name, in the units of the case file: a number, or three for a point, axis or direction.
Settings: TypeAlias = Mapping[str, float | list[float]]
#: Table or list that contains a value, and the key or index of the value.
_Place: TypeAlias = tuple[Any, int | str]

#: Prefix of the dotted keys of limits.
_LIMITS = "limits."
#: Prefix of the names of coordinates of the path's frame.
_PLACE = "path.place."
#: First part of the name of an actuated joint that the pose does not determine.
_JOINT = "joint."
#: Keys of the table of a free variable.
ENDS = ("min", "max", "start")
#: Further key of a value that changes along the path.
RATE = "rate"
#: Names of values of a task, such as ``task.pitch`` or ``task[1].point_x``.
_TASK = re.compile(r"task(\[\d+\])?\..+")
#: Names of coordinates of one of several poses, and names of dimensions of one task, such as ``x1.task2``.
_OF_POSE, _OF_TASK = re.compile(r"pose\d+_"), re.compile(r"\.task\d+(\.|$)")
#: Names of the six components of a task's twist.
_TWIST = tuple(f"twist_{k}" for k in range(6))
#: Forms of a rotation that are a single list of numbers.
_FORMS = ("rpy", "quaternion")
#: Tables within the table of a joint in ``limits.joint``.
_PARTS_OF_JOINTS = ("first", "second", "angle", "stroke")


def override_number(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace a number, or the three numbers of a point, axis or direction, in a document.

    Args:
        tables: the document, as ``tomllib`` returns it; changed in place.
        name: name of a quantity of the case; ``.min``, ``.max`` or ``.start`` may follow the name of a free variable.
            Or the dotted key of a limit, such as ``limits.leg_length.max``; of a task, such as ``task.pitch`` or
            ``task.point_x``, with an index for several tasks, as in ``task[1].pitch``; or of the path's frame, such as
            ``path.place.x``.
        value: new value, in the units of the file: a number, or three.

    Raises:
        CaseError: the case has no value with this name.
    """
    if name.startswith(_LIMITS):
        _override_limit(tables, name, value)
        return
    if name.startswith(_PLACE):
        _override_place(tables, name, value)
        return
    if _TASK.fullmatch(name):
        _override_task(tables, name, value)
        return
    tool = _tool_of(tables, name)
    if tool is not None:
        _override_turn(tool, name, value)
        return
    _separate_tasks(tables, name)
    if not override_setting(tables, name, value):
        _override_place_of_case(tables, name, value)


def _tool_of(tables: Mapping[str, Any], name: str) -> dict[str, Any] | None:
    """Return the table of the tool if a name is that of the turn about it; otherwise None."""
    path = tables.get("path")
    if name.partition(".")[0] != TURN or not isinstance(path, dict) or not isinstance(path.get("tool"), dict):
        return None
    found: dict[str, Any] = path["tool"]
    return found


def _override_place_of_case(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace a parameter of the robot or a coordinate of a pose; see :func:`override_number`."""
    places, rotations = _places(tables, name)
    whole, _, end = name.rpartition(".")
    if end in (*ENDS, RATE) and whole in places:
        table, place = places[whole]
        if not isinstance(table[place], dict):
            raise CaseError(name, f"cannot be set: {whole} is fixed; set {whole} itself")
        if "tasks" in table[place]:
            raise CaseError(name, f"cannot be set: {whole} differs from task to task; set {whole}.task1.{end}")
        if "values" in table[place]:
            raise CaseError(name, f"cannot be set: {whole} has catalogue values and no bounds; set {whole} itself")
        if end == RATE and RATE not in table[place]:
            raise CaseError(name, f"cannot be set: {whole} does not change along the path")
        table[place][end] = value
        return
    robot = tables.get("robot")
    if name.startswith(_JOINT) and isinstance(robot, dict):
        robot.setdefault("parameters", {})[name] = value
        return
    if name not in places:
        raise CaseError(name, f"cannot be set; {_allowed(name, tables, places, rotations)}")
    table, place = places[name]
    table[place] = value


def fields_of(name: str) -> tuple[str, ...]:
    """Return the fields of a case that change with a value, by its name as for :func:`override_number`."""
    if name.startswith(_LIMITS):
        return ("limits",)
    if name.startswith(_PLACE):
        return ("path",)
    if name.partition(".")[0] == TURN:
        return ("path",)
    if _TASK.fullmatch(name):
        return ("tasks", "displacements", "further")  # poses may follow the screw motion of a task
    return ("parameters", "position", "rotation", "displacements", "further")


def _allowed(name: str, tables: Mapping[str, Any], places: Mapping[str, _Place], rotations: list[str]) -> str:
    """Return a hint with the names that can be set; bounds, limits and tasks are shown by one example each."""
    written = {each: table[place] for each, (table, place) in places.items()}
    free = [each for each, value in written.items() if isinstance(value, dict) and "values" not in value]
    ends = [f"{each}.{end}" for each in free for end in ENDS]
    tasks = sorted(task_numbers(tables), key=len)
    others = [
        *(f"bounds of variables such as {each}" for each in ends[1:2]),
        "limits such as limits.leg_length.max",
        *(f"values of tasks such as {each}" for each in [name for name in tasks if name.endswith("pitch")][:1]),
    ]
    turn = [TURN] if _tool_of(tables, TURN) is not None else []
    hint = nearest(name, [*places, *rotations, *turn], [*ends, *tasks])
    return f"{hint}; also {', '.join(others)}"


def task_numbers(tables: Mapping[str, Any]) -> dict[str, _Place]:
    """Return the place of each value of a document's tasks that can be set, by name.

    A vector has a name, and a name for each component: ``task.point`` and ``task.point_x``. With several tasks, names
    have an index: ``task[0].point``.
    """
    tasks = tables.get("task", [])
    found: dict[str, _Place] = {}
    for index, task in enumerate(tasks):
        for prefix in (f"task[{index}].", *(("task.",) if len(tasks) == 1 else ())):
            for part, given in task.items():
                if isinstance(given, list):
                    names = _TWIST if part == "twist" else component_names(part, len(given))
                    found |= {f"{prefix}{each}": (given, k) for k, each in enumerate(names[: len(given)])}
                if part in ("axis", "point", "pitch", "weight"):
                    found[f"{prefix}{part}"] = (task, part)
            found.setdefault(f"{prefix}weight", (task, "weight"))
    return found


def _override_task(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace a value of a task; arguments and errors are those of :func:`override_number`."""
    places = task_numbers(tables)
    if name not in places:
        raise CaseError(name, f"cannot be set; {nearest(name, places)}")
    table, place = places[name]
    table[place] = value


def _override_place(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace or add a coordinate of the path's frame; arguments and errors are those of :func:`override_number`."""
    key, _, end = name.removeprefix(_PLACE).partition(".")
    path = tables.get("path")
    if not isinstance(path, dict):
        raise CaseError(name, "cannot be set: the case has no table [path]")
    table = path.setdefault("place", {})
    if end:
        if not isinstance(table.get(key), dict):
            raise CaseError(name, f"cannot be set: {_PLACE}{key} is fixed; set {_PLACE}{key} itself")
        table, key = table[key], end
    table[key] = value


def _override_turn(tool: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace the turn about the tool, or an end of its range; errors are those of :func:`override_number`."""
    _, _, end = name.partition(".")
    if not end:
        tool[TURN] = value
    elif not isinstance(tool.get(TURN), dict):
        raise CaseError(name, f"cannot be set: {TURN} is fixed; set {TURN} itself")
    else:
        tool[TURN][end] = value


def _places(tables: dict[str, Any], name: str) -> tuple[dict[str, _Place], list[str]]:
    """Return the places of the values of a document; a missing rotation that is to be set is added first.

    Args:
        tables: the document.
        name: name of the value to be set.

    Returns:
        Place of each value by name, and names for the rotation of each pose, also where the rotation is missing.
    """
    parameters = tables.get("robot", {}).get("parameters", {})
    given = tables.setdefault("pose", {})
    poses = given if isinstance(given, list) else [given]
    places: dict[str, _Place] = {}
    for key, written in parameters.items():
        places[parameter_name(key, len(poses))] = (parameters, key)
        if isinstance(written, list):
            for index, part in enumerate(component_names(key, len(written))):
                places[parameter_name(part, len(poses))] = (written, index)
    for key, (table, place) in list(places.items()):
        if isinstance(table[place], dict) and "tasks" in table[place]:
            own = table[place]["tasks"]
            places |= {name_of_task(key, task): (own, task) for task in range(len(own))}
    rotations = []
    for prefix, pose in zip(pose_prefixes(len(poses)), poses, strict=True):
        if isinstance(pose.get("position"), list):
            names = component_names(f"{prefix}p", 3)
            places.update({part: (pose["position"], index) for index, part in enumerate(names)})
        rotations += [f"{prefix}{part}" for part in ("angle", "axis", *_FORMS)]
        places |= {key: place for key, place in _rotation_places(pose, prefix, name).items() if key not in places}
    return places, rotations


def _separate_tasks(tables: dict[str, Any], name: str) -> None:
    """Write a common range of all tasks once for each task, if the value of one task is to be set.

    Args:
        tables: the document; changed in place.
        name: name of the value to be set.
    """
    tasks, pose = tables.get("task"), tables.get("pose")
    if not isinstance(tasks, list):
        return
    if isinstance(pose, dict) and pose.get("per") == "task" and _OF_POSE.match(name):
        shared = {key: value for key, value in pose.items() if key != "per"}
        names = [task.get("name") or f"task {k + 1}" for k, task in enumerate(tasks)]
        tables["pose"] = [{**deepcopy(shared), "task": each} for each in names]
    if _OF_TASK.search(name):
        parameters = tables.get("robot", {}).get("parameters", {})
        lists = [value for value in parameters.values() if isinstance(value, list)]
        for table, keys in [(parameters, list(parameters)), *((each, range(len(each))) for each in lists)]:
            for key in keys:
                value = table[key]
                if isinstance(value, dict) and value.get("per") == "task":
                    one = {part: given for part, given in value.items() if part != "per"}
                    table[key] = {"tasks": [dict(one) for _ in tasks]}


def _rotation_places(pose: dict[str, Any], prefix: str, name: str) -> dict[str, _Place]:
    """Return the place of the value of a pose's rotation that is to be set; a missing rotation is added."""
    for part in _FORMS:
        if name == f"{prefix}{part}":
            # It replaces a rotation in any form.
            pose["rotation"] = {part: None}
            return {name: (pose["rotation"], part)}
    for part in ("angle", "axis"):
        if name in (f"{prefix}{part}", *(f"{prefix}{part}.{end}" for end in ENDS)):
            rotation = pose.setdefault("rotation", {"axis": [0, 0, 1], "angle": 0})
            if part == "axis":
                # An axis replaces a rotation in another form.
                for other in rotation.keys() - {"axis", "angle"}:
                    del rotation[other]
            return {f"{prefix}{part}": (rotation, part)}
    return {}


def _override_limit(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace or add a value of a limit; arguments and errors are those of :func:`override_number`."""
    first, *others = name.removeprefix(_LIMITS).split(".")
    limits = tables.setdefault("limits", {})
    if first == "joint" and len(others) > 1 and all(others) and isinstance(limits, dict):
        _override_joint(limits, others, value)
        return
    if not first or len(others) > 1 or not all(others) or not isinstance(limits, dict):
        raise CaseError(name, "cannot be set; write a limit and its key, such as limits.leg_length.max")
    written = limits.get(first)
    if isinstance(written, dict):
        # A joint angle may be a plain number or a table: 45 means the same as { max = 45 }.
        written[others[0] if others else "max"] = value
    elif others and not (others == ["max"] and written is not None):
        limits[first] = {others[0]: value}
    else:
        limits[first] = value


def _override_joint(limits: dict[str, Any], parts: list[str], value: float | list[float]) -> None:
    """Replace or add a value of the limits on a joint; the name of the joint may contain dots.

    Args:
        limits: table of the limits; changed in place.
        parts: parts of the dotted key after ``limits.joint``.
        value: new value: a number, or the axis of a cone.
    """
    *joint, end = parts
    part = joint.pop() if len(joint) > 1 and joint[-1] in _PARTS_OF_JOINTS else None
    table = limits.setdefault("joint", {}).setdefault(".".join(joint), {})
    if part is not None:
        table = table.setdefault(part, {})
    table[end] = value
