"""Displacements of a stated pose in a case file: along a task's screw motion, over a grid, or as a list."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pydantic import ValidationError

from ...models import Dimension, Displacement, axis_from_screw
from ..errors import CaseError, listing
from ..units import Units
from .pose import NO_DISPLACEMENT, along_screw, over_grid
from .schema import AlongTable, DisplacementTable, GridTable, OffsetsTable, PoseTable
from .task import Task
from .toml import TomlValue

#: Largest number of poses from one stated pose: more make a nonlinear program that takes too long to solve.
_MOST = 200
#: Largest error of ``R R'`` of a rotation matrix: files give its entries with a dozen digits.
_ROTATION = 1e-9
#: Digits to which first and last of a trajectory are rounded when displacements are written as a trajectory.
_DIGITS = 12


def read_displacements(written: PoseTable, tasks: Sequence[Task], units: Units, key: str) -> tuple[Displacement, ...]:
    """Return the displacements of a stated pose, one for each pose that the robot takes.

    Args:
        written: table of the pose.
        tasks: tasks of the case.
        units: units of the file.
        key: dotted key of the table, for messages.

    Raises:
        CaseError: the table has two of a trajectory, a grid and a list; a matrix is not a rotation; the task does not
            exist; offsets are crossed; or there are too many poses.
    """
    ways = [way for way in ("along_task", "grid", "displacements") if getattr(written, way) is not None]
    if len(ways) > 1:
        raise CaseError(f"{key}.{ways[1]}", f"conflicts with {ways[0]}; write two [[pose]] tables")
    if written.displacements is not None:
        return _read_list(written.displacements, f"{key}.displacements")
    if written.along_task is not None:
        return _read_trajectory(written.along_task, tasks, units, f"{key}.along_task")
    return (NO_DISPLACEMENT,) if written.grid is None else _read_grid(written.grid, f"{key}.grid")


def _read_trajectory(written: AlongTable, tasks: Sequence[Task], units: Units, key: str) -> tuple[Displacement, ...]:
    """Return the displacements along a task's screw motion; the errors are those of :func:`read_displacements`."""
    names = [task.name for task in tasks]
    if written.task is None and len(tasks) > 1:
        raise CaseError(f"{key}.task", f"is missing: give the name of one of the tasks {listing(names)}")
    if written.task is not None and written.task not in names:
        raise CaseError(f"{key}.task", f"no such task; allowed: {listing(names)}", written.task)
    if written.first == written.last:
        raise CaseError(f"{key}.last", f"must differ from first = {written.first:g}", written.last)
    twist = tasks[0 if written.task is None else names.index(written.task)].twist
    if not np.any(np.asarray(twist, dtype=np.float64)):
        raise CaseError(f"{key}.task", "must be a task with a motion; the twist of this task is zero")
    dimension = Dimension.LENGTH if math.isinf(axis_from_screw(twist).pitch) else Dimension.ANGLE
    first, last = (units.to_internal(end, dimension) for end in (written.first, written.last))
    return along_screw(twist, [float(each) for each in np.linspace(first, last, written.count)])


def _read_grid(written: GridTable, key: str) -> tuple[Displacement, ...]:
    """Return the displacements over a grid; the errors are those of :func:`read_displacements`."""
    offsets = [
        _read_offsets(axis, f"{key}.{name}")
        for name, axis in zip("xyz", (written.x, written.y, written.z), strict=True)
    ]
    count = math.prod(map(len, offsets))
    if count == 1:
        raise CaseError(key, "is empty: give offsets along x, y or z, such as x = { min = -5, max = 5, count = 3 }")
    if count > _MOST:
        raise CaseError(key, f"must have at most {_MOST} poses, got {count}")
    return over_grid(offsets)


def _read_list(written: Sequence[DisplacementTable], key: str) -> tuple[Displacement, ...]:
    """Return the displacements of a list.

    Raises:
        CaseError: a matrix is not a rotation, or there are too many displacements.
    """
    if len(written) > _MOST:
        raise CaseError(key, f"must have at most {_MOST} poses, got {len(written)}")
    found = tuple(Displacement.by(each.rotation, each.translation) for each in written)
    for index, each in enumerate(found):
        error = np.abs(each.rotation @ each.rotation.T - np.eye(3)).max()
        if not error <= _ROTATION or np.linalg.det(each.rotation) < 0:
            raise CaseError(f"{key}[{index}].rotation", "must be a rotation matrix: orthogonal, with determinant 1")
    return found


def written_displacements(
    displacements: Sequence[Displacement], tasks: Sequence[Task], units: Units
) -> dict[str, TomlValue]:
    """Return the keys for the displacements in the table of a pose: inverse of :func:`read_displacements`.

    Args:
        displacements: displacements of a stated pose.
        tasks: tasks of the case.
        units: units of the file.

    Returns:
        No key for the stated pose only; a trajectory or a grid if it gives the same displacements to the last bit;
        otherwise a list of all displacements.
    """
    if len(displacements) == 1 and displacements[0].is_identity:
        return {}
    for way in (_written_grid(displacements), *(_written_trajectory(displacements, task, units) for task in tasks)):
        if way is not None and _are_equal(_read_again(way, tasks, units), displacements):
            return way
    eye = np.eye(3)
    tables: list[TomlValue] = [
        {
            "rotation": None if np.array_equal(each.rotation, eye) else each.rotation.tolist(),
            "translation": each.translation.tolist(),
        }
        for each in displacements
    ]
    return {"displacements": tables}


def _written_grid(displacements: Sequence[Displacement]) -> dict[str, TomlValue] | None:
    """Return a grid with the first and the last displacement as opposite corners; None if there is no such grid."""
    translations = np.array([each.translation for each in displacements])
    axes: dict[str, TomlValue] = {}
    for name, values in zip("xyz", translations.T, strict=True):
        count = len(np.unique(values))
        if count > 1:
            axes[name] = {"min": float(values[0]), "max": float(values[-1]), "count": count}
        elif values[0] != 0:
            return None
    return {"grid": axes} if axes else None


def _written_trajectory(displacements: Sequence[Displacement], task: Task, units: Units) -> dict[str, TomlValue] | None:
    """Return a trajectory along a task's screw from the first to the last displacement; None if both are equal."""
    screw = axis_from_screw(task.twist)
    ends = []
    for each in (displacements[0], displacements[-1]):
        if math.isinf(screw.pitch):
            amount, dimension = float(screw.axis @ each.translation), Dimension.LENGTH
        else:
            R = each.rotation
            turned = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
            amount, dimension = math.atan2(float(screw.axis @ turned), float(np.trace(R)) - 1), Dimension.ANGLE
        # Files give the ends with few digits.
        ends.append(float(f"{units.shown(amount, dimension):.{_DIGITS}g}"))
    if ends[0] == ends[1]:
        return None
    return {"along_task": {"task": task.name, "first": ends[0], "last": ends[1], "count": len(displacements)}}


def _read_again(way: dict[str, TomlValue], tasks: Sequence[Task], units: Units) -> tuple[Displacement, ...]:
    """Return the displacements of the keys of a pose's table; empty if the keys are refused."""
    try:
        table = PoseTable.model_validate({"position": [0, 0, 0], **way})
        return read_displacements(table, tasks, units, "pose")
    except (CaseError, ValidationError):
        return ()


def _are_equal(some: Sequence[Displacement], others: Sequence[Displacement]) -> bool:
    """Return whether two lists of displacements are equal to the last bit."""
    return len(some) == len(others) and all(
        np.array_equal(part, other)
        for one, two in zip(some, others, strict=True)
        for part, other in zip(one, two, strict=True)
    )


def _read_offsets(written: OffsetsTable | None, key: str) -> list[float]:
    """Return the offsets along one axis; a single 0 without a table.

    Raises:
        CaseError: the first offset is not below the last one.
    """
    if written is None:
        return [0.0]
    if not written.min < written.max:
        raise CaseError(f"{key}.min", f"must be below max = {written.max:g}", written.min)
    return [float(each) for each in np.linspace(written.min, written.max, written.count)]
