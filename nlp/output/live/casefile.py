"""Text of a case file in parts: fixed text, and the names of values that a page fills in."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Iterator, Sequence
from typing import Any, TypedDict

import numpy as np

from ....models import Parameter
from ...case.case import Case
from ...case.names import name_of_task
from ...case.toml import toml_lines
from ...errors import CaseError

#: Sections of a case file that do not belong to another point.
_DROPPED = ("expect", "published")
#: Values of a task that a page can change.
TASK_KEYS = ("axis", "point", "pitch")
#: Table of a pose that is set for every task.
_COMMON_POSE = re.compile(r'^\[pose\]\n(?:(?!\[).*\n)*?per = "task"\n', re.MULTILINE)
_NUMBER = r"[-+]?[0-9.]+(?:e[-+]?\d+)?"


class SetPart(TypedDict):
    """Place of a value by its name, as for ``--set``."""

    set: str


def case_parts(case: Case, limits: Collection[str]) -> list[str | SetPart]:
    """Return the parts of a case file of a case with fixed variables; empty if no case file can state it.

    Args:
        case: the case.
        limits: keys of the limits that the page can change.
    """
    try:
        text = case.to_toml()
    except CaseError:
        return []
    found: list[str | SetPart] = []
    for part in _parts(case, _with_each_pose(case, text), limits):
        if isinstance(part, str) and found and isinstance(found[-1], str):
            found[-1] += part
        else:
            found.append(part)
    return found


def stated_tasks(case: Case) -> list[dict[str, Any]]:
    """Return axis, point and pitch of each task as a case file states them; empty tables for other tasks."""
    try:
        tasks = tomllib.loads(case.to_toml())["task"]
    except (CaseError, KeyError):
        return [{} for _ in case.tasks]
    found = [{key: value for key, value in task.items() if key in TASK_KEYS} for task in tasks]
    return [each if {"axis", "pitch"} <= each.keys() else {} for each in found]


def _with_each_pose(case: Case, text: str) -> str:
    """Return a text of :meth:`.Case.to_toml` in which every task has a table for its pose."""
    found = _COMMON_POSE.search(text)
    if found is None or not case.pose_per_task:
        return text
    lines = found[0].removeprefix("[pose]\n").replace('per = "task"\n', "").strip("\n")
    tables = [f"[[pose]]\n{lines}\n{toml_lines({'task': task.name})[0]}\n" for task in case.tasks]
    return f"{text[: found.start()]}{chr(10).join(tables)}{text[found.end() :]}"


def _parts(case: Case, text: str, limits: Collection[str]) -> Iterator[str | SetPart]:
    """Yield the parts of a text of :meth:`.Case.to_toml`."""
    names = {item.name: _names(case, item) for item in case.model.parameters}
    tasks = stated_tasks(case)
    section, pose, task, is_dropped = "", -1, -1, False
    for line in text.splitlines(keepends=True):
        if line.startswith("["):
            section = line.strip().strip("[]")
            is_dropped = section.partition(".")[0] in _DROPPED
            pose += section == "pose"
            task += section == "task"
        if is_dropped:
            continue
        key, equals, _ = line.partition(" = ")
        key = key.strip().strip('"')
        if equals and section == "robot.parameters" and key in names:
            yield from _assigned(line, names[key])
        elif equals and section == "pose" and key == "position":
            yield from _assigned(line, [[f"{case.pose_prefixes[pose]}p_{letter}"] for letter in "xyz"])
            yield from _rotation(case, pose)
        elif equals and section == "pose" and key == "rotation":
            continue
        elif equals and section == "task" and key in tasks[task]:
            yield f"{key} = "
            yield {"set": f"task[{task}].{key}"}
            yield "\n"
        elif equals and section.startswith("limits"):
            yield from _limit(line, ".".join([section, key]), limits)
        else:
            yield line


def _names(case: Case, item: Parameter) -> list[list[str]]:
    """Return the names of the values of each component of a parameter: several if it changes from task to task."""
    own, tasks = case.dimensions_per_task, range(len(case.tasks))
    named = zip(item.components, case.component_names(item), strict=True)
    return [[name_of_task(name, k) for k in tasks] if key in own else [name] for key, name in named]


def _assigned(line: str, names: Sequence[Sequence[str]]) -> Iterator[str | SetPart]:
    """Yield a line with values in place of its own: a number or a list, each with a value for each task if needed."""
    yield f"{line.partition(' = ')[0]} = {'[' if len(names) > 1 else ''}"
    for k, several in enumerate(names):
        yield ", " if k else ""
        yield "{ tasks = [" if len(several) > 1 else ""
        for j, name in enumerate(several):
            yield ", " if j else ""
            yield {"set": name}
        yield "] }" if len(several) > 1 else ""
    yield "]\n" if len(names) > 1 else "\n"


def _rotation(case: Case, pose: int) -> Iterator[str | SetPart]:
    """Yield the rotation of a pose by axis and angle."""
    axis, prefix = case.poses[pose].rotation.axis, case.pose_prefixes[pose]
    yield "rotation = { axis = "
    if axis is None:
        yield {"set": f"{prefix}axis"}
    else:
        yield f"[{', '.join(map(repr, np.ravel(axis).tolist()))}]"
    yield ", angle = "
    yield {"set": f"{prefix}angle"}
    yield " }\n"


def _limit(line: str, key: str, limits: Collection[str]) -> Iterator[str | SetPart]:
    """Yield a line of a limit with values in place of the numbers of its keys."""
    at = 0
    for match in re.finditer(rf"(\w+) = ({_NUMBER})(?=[ ,}}\n])", line):
        if f"{key}.{match[1]}".removeprefix("limits.") not in limits:
            continue
        yield line[at : match.start(2)]
        yield {"set": f"{key}.{match[1]}"}
        at = match.end(2)
    yield line[at:]
