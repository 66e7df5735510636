"""The displacements that a case file states for a pose: along a task's screw motion, or over a grid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...models import Dimension, Displacement, axis_from_screw
from ..errors import CaseError, listing
from ..units import Units
from .pose import HERE, along_screw, over_grid
from .schema import AlongTable, GridTable, OffsetsTable, PoseTable
from .task import Task

#: Largest number of poses from one stated pose: a larger program takes too long to solve.
_MOST = 200


def read_displacements(written: PoseTable, tasks: Sequence[Task], units: Units, key: str) -> tuple[Displacement, ...]:
    """Return the displacements of a stated pose, one for each pose that the robot takes.

    Args:
        written: the table of the pose.
        tasks: the case's tasks.
        units: the file's units.
        key: dotted key of the table, for messages.

    Raises:
        CaseError: both a trajectory and a grid, a task that does not exist, crossed offsets, or too many poses.
    """
    if written.along_task is not None and written.grid is not None:
        raise CaseError(f"{key}.grid", "cannot stand beside along_task; write two poses")
    if written.along_task is not None:
        return _read_trajectory(written.along_task, tasks, units, f"{key}.along_task")
    return (HERE,) if written.grid is None else _read_grid(written.grid, f"{key}.grid")


def _read_trajectory(written: AlongTable, tasks: Sequence[Task], units: Units, key: str) -> tuple[Displacement, ...]:
    """Return the displacements along a task's screw motion; the errors are those of :func:`read_displacements`."""
    names = [task.name for task in tasks]
    if written.task is None and len(tasks) > 1:
        raise CaseError(f"{key}.task", f"is missing: there are several tasks, {listing(names)}")
    if written.task is not None and written.task not in names:
        raise CaseError(f"{key}.task", f"is no task of this case; allowed: {listing(names)}", written.task)
    if written.first == written.last:
        raise CaseError(f"{key}.last", "must differ from where the poses begin", written.last)
    twist = tasks[0 if written.task is None else names.index(written.task)].twist
    if not np.any(np.asarray(twist, dtype=np.float64)):
        raise CaseError(f"{key}.task", "has a twist of zero: it leads nowhere")
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
        raise CaseError(key, "must have offsets along x, y or z")
    if count > _MOST:
        raise CaseError(key, f"has {count} poses, of which at most {_MOST} are allowed")
    return over_grid(offsets)


def _read_offsets(written: OffsetsTable | None, key: str) -> list[float]:
    """Return the offsets along one axis, a single 0 where none are stated.

    Raises:
        CaseError: the first is not below the last.
    """
    if written is None:
        return [0.0]
    if not written.min < written.max:
        raise CaseError(f"{key}.min", f"must be below max = {written.max:g}", written.min)
    return [float(each) for each in np.linspace(written.min, written.max, written.count)]
