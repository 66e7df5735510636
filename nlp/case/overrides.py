"""Numbers of a case file replaced by name, as ``--set`` does."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, TypeAlias

from ...models import component_names
from ..errors import CaseError, nearest
from .names import parameter_name, pose_prefixes

#: Numbers of a case by name, in its file's units: three numbers for a point, axis or direction.
Settings: TypeAlias = Mapping[str, float | list[float]]
#: Table or list of a number, and the key or index within it.
_Place: TypeAlias = tuple[Any, int | str]

#: Stands before the dotted key of a limit.
_LIMITS = "limits."
#: Stands before the name of a number of a path's place.
_PLACE = "path.place."
#: What a free number has.
ENDS = ("min", "max", "start")
#: Beginning of the name of a number of a task, such as ``task.pitch`` or ``task[1].point_x``.
_TASK = re.compile(r"task(\[\d+\])?\..+")
#: Names of the six numbers of a task's twist.
_TWIST = tuple(f"twist_{k}" for k in range(6))
#: Forms of a rotation that are one list of numbers.
_FORMS = ("rpy", "quaternion")
#: Tables within that of a joint in ``limits.joint``.
_PARTS_OF_JOINTS = ("first", "second", "angle", "stroke")


def override_number(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace a number, or the three numbers of a point, axis or direction, in a document's tables.

    Args:
        tables: the document, as ``tomllib`` returns it; changed in place.
        name: the name in the case; behind the name of a free number ``.min``, ``.max`` or ``.start`` may stand; or
            the dotted key of a limit, such as ``limits.leg_length.max``, or of a number of a task, such as
            ``task.pitch`` and ``task.point_x``, with its place among several as in ``task[1].pitch``; or of the place
            of a path, such as ``path.place.x``.
        value: a number, or three, in the file's units.

    Raises:
        CaseError: the case has no number of this name.
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
    places, rotations = _places(tables, name)
    whole, _, end = name.rpartition(".")
    if end in ENDS and whole in places:
        table, place = places[whole]
        if not isinstance(table[place], dict):
            raise CaseError(name, f"cannot be set: {whole} is not free")
        if "values" in table[place]:
            raise CaseError(name, f"cannot be set: {whole} has one of a few values, and no ends")
        table[place][end] = value
        return
    if name not in places:
        raise CaseError(name, f"cannot be set; {_allowed(name, tables, places, rotations)}")
    table, place = places[name]
    table[place] = value


def fields_of(name: str) -> tuple[str, ...]:
    """Return the fields of a case in which a number is that has a name as for :func:`override_number`."""
    if name.startswith(_LIMITS):
        return ("limits",)
    if name.startswith(_PLACE):
        return ("path",)
    if _TASK.fullmatch(name):
        return ("tasks", "displacements", "further")  # poses may follow the screw motion of a task
    return ("parameters", "position", "rotation", "displacements", "further")


def _allowed(name: str, tables: Mapping[str, Any], places: Mapping[str, _Place], rotations: list[str]) -> str:
    """Return the names that can be set, those of ends, limits and tasks by an example each, as a hint."""
    written = {each: table[place] for each, (table, place) in places.items()}
    free = [each for each, value in written.items() if isinstance(value, dict) and "values" not in value]
    ends = [f"{each}.{end}" for each in free for end in ENDS]
    tasks = sorted(task_numbers(tables), key=len)
    others = [
        *(f"ends of free numbers such as {each}" for each in ends[1:2]),
        "limits such as limits.leg_length.max",
        *(f"numbers of tasks such as {each}" for each in [name for name in tasks if name.endswith("pitch")][:1]),
    ]
    hint = nearest(name, [*places, *rotations], [*ends, *tasks])
    return f"{hint}; also {', '.join(others)}"


def task_numbers(tables: Mapping[str, Any]) -> dict[str, _Place]:
    """Return the numbers of a document's tasks that can be set: table or list, and key or index within it, by name.

    A vector has its own name and one for each component, such as ``task.point`` and ``task.point_x``. With several
    tasks, those of the first one are called ``task[0].point``.
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
    """Replace a number of a task; arguments and errors are those of :func:`override_number`."""
    places = task_numbers(tables)
    if name not in places:
        raise CaseError(name, f"cannot be set; {nearest(name, places)}")
    table, place = places[name]
    table[place] = value


def _override_place(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace or add a number of a path's place; arguments and errors are those of :func:`override_number`."""
    key, _, end = name.removeprefix(_PLACE).partition(".")
    path = tables.get("path")
    if not isinstance(path, dict):
        raise CaseError(name, "cannot be set: the case has no path")
    table = path.setdefault("place", {})
    if end:
        if not isinstance(table.get(key), dict):
            raise CaseError(name, f"cannot be set: {_PLACE}{key} is not free")
        table, key = table[key], end
    table[key] = value


def _places(tables: dict[str, Any], name: str) -> tuple[dict[str, _Place], list[str]]:
    """Return where the numbers of a document are; a rotation that is to be set, and lacks, is made first.

    Args:
        tables: the document.
        name: name of the number to be set.

    Returns:
        The place of each number by its name, and the names of the rotation of each pose, which it may lack.
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
    rotations = []
    for prefix, pose in zip(pose_prefixes(len(poses)), poses, strict=True):
        if isinstance(pose.get("position"), list):
            names = component_names(f"{prefix}p", 3)
            places.update({part: (pose["position"], index) for index, part in enumerate(names)})
        rotations += [f"{prefix}{part}" for part in ("angle", "axis", *_FORMS)]
        places |= {key: place for key, place in _rotation_places(pose, prefix, name).items() if key not in places}
    return places, rotations


def _rotation_places(pose: dict[str, Any], prefix: str, name: str) -> dict[str, _Place]:
    """Return the place of the number of a pose's rotation that is to be set, which is made where it lacks."""
    for part in _FORMS:
        if name == f"{prefix}{part}":
            # It takes the place of a rotation in any form.
            pose["rotation"] = {part: None}
            return {name: (pose["rotation"], part)}
    for part in ("angle", "axis"):
        if name in (f"{prefix}{part}", *(f"{prefix}{part}.{end}" for end in ENDS)):
            rotation = pose.setdefault("rotation", {"axis": [0, 0, 1], "angle": 0})
            if part == "axis":
                # An axis takes the place of a rotation in another form; it then needs an angle of its own.
                for other in rotation.keys() - {"axis", "angle"}:
                    del rotation[other]
            return {f"{prefix}{part}": (rotation, part)}
    return {}


def _override_limit(tables: dict[str, Any], name: str, value: float | list[float]) -> None:
    """Replace or add a number of the limits; arguments and errors are those of :func:`override_number`."""
    first, *others = name.removeprefix(_LIMITS).split(".")
    limits = tables.setdefault("limits", {})
    if first == "joint" and len(others) > 1 and all(others) and isinstance(limits, dict):
        _override_joint(limits, others, value)
        return
    if not first or len(others) > 1 or not all(others) or not isinstance(limits, dict):
        raise CaseError(name, "cannot be set; write a limit and its number, such as limits.leg_length.max")
    written = limits.get(first)
    if isinstance(written, dict):
        # An angle's limit alone is its largest value: { max = 45, about = "home" } and 45 have one key in results.
        written[others[0] if others else "max"] = value
    elif others and not (others == ["max"] and written is not None):
        limits[first] = {others[0]: value}
    else:
        limits[first] = value


def _override_joint(limits: dict[str, Any], parts: list[str], value: float | list[float]) -> None:
    """Replace or add a number of the limits on a joint, whose name may hold dots.

    Args:
        limits: the table of the limits; changed in place.
        parts: of the dotted key behind ``limits.joint``.
        value: the number, or the axis of a cone.
    """
    *joint, end = parts
    part = joint.pop() if len(joint) > 1 and joint[-1] in _PARTS_OF_JOINTS else None
    table = limits.setdefault("joint", {}).setdefault(".".join(joint), {})
    if part is not None:
        table = table.setdefault(part, {})
    table[end] = value
