"""What a case file says about building, as values: limits and displaced poses, with degrees made radians."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ....models import Dimension, Model, axis_from_screw
from ...errors import CaseError, listing
from ...units import Units
from ..pose import HERE, Step, along_screw, over_grid
from ..schema import PoseTable
from ..task import Task
from .buildtables import (
    AlongTable,
    ConditionTable,
    ConeTable,
    GridTable,
    HomeTable,
    IntervalTable,
    LimitsTable,
    OffsetsTable,
    SmallestTable,
)
from .limits import Actuator, Cone, Footprint, Homogenised, Interval, Limits, MountingPose, Triple

#: Poses of one stated pose, beyond which a program would be too large to solve while one waits.
_MOST = 200


def limits(written: LimitsTable | None, model: Model, units: Units) -> Limits:
    """The limits of a case file.

    Raises:
        CaseError: a joint's cone is about a home pose that is not stated, or the other way round.
    """
    if written is None:
        return Limits()
    dimensions = {quantity.name: quantity.dimension for quantity in model.quantities}
    cones = (written.base_joint_angle, written.platform_joint_angle)
    about = [cone.about for cone in cones if isinstance(cone, ConeTable)]
    if written.home is not None and "home" not in about:
        raise CaseError("limits.home", 'means nothing unless a joint angle has about = "home"')
    home = None if written.home is None else _home(written.home, units)
    return Limits(
        leg_length=_interval(written.leg_length, units, Dimension.LENGTH),
        actuator=None
        if written.actuator is None
        else Actuator(written.actuator.stroke_max, written.actuator.dead_length),
        base_joint_angle=_cone(written.base_joint_angle, home, units, "base_joint_angle"),
        platform_joint_angle=_cone(written.platform_joint_angle, home, units, "platform_joint_angle"),
        joint_spacing=None if written.joint_spacing is None else written.joint_spacing.min,
        footprint=None if written.footprint is None else Footprint(written.footprint.base, written.footprint.platform),
        radius_ratio=_interval(written.radius_ratio, units, Dimension.NUMBER),
        leg_clearance=None if written.leg_clearance is None else written.leg_clearance.min,
        condition_number=_homogenised(written.condition_number),
        smallest_singular_value=_homogenised(written.smallest_singular_value),
        rate_share=None if written.rate_share is None else written.rate_share.max,
        custom=tuple(written.custom),
        quantities={
            name: Interval(*_sides(given, units, dimensions.get(name, Dimension.NUMBER)))
            for name, given in (written.__pydantic_extra__ or {}).items()
        },
    )


def _sides(written: IntervalTable, units: Units, dimension: Dimension) -> tuple[float | None, float | None]:
    lower, upper = (None if side is None else units.to_internal(side, dimension) for side in (written.min, written.max))
    return lower, upper


def _interval(written: IntervalTable | None, units: Units, dimension: Dimension) -> Interval | None:
    return None if written is None else Interval(*_sides(written, units, dimension))


def _homogenised(written: SmallestTable | ConditionTable | None) -> Homogenised | None:
    if written is None:
        return None
    return Homogenised(written.min if isinstance(written, SmallestTable) else written.max, written.length)


def _home(written: HomeTable, units: Units) -> MountingPose:
    return MountingPose(
        _triple(written.position), _triple(written.axis), units.to_internal(written.angle, Dimension.ANGLE)
    )


def _cone(written: float | ConeTable | None, home: MountingPose | None, units: Units, key: str) -> Cone | None:
    if written is None:
        return None
    if not isinstance(written, ConeTable):
        return Cone(units.to_internal(written, Dimension.ANGLE))
    largest = units.to_internal(written.max, Dimension.ANGLE)
    match written.about:
        case "normal":
            return Cone(largest)
        case "home":
            if home is None:
                raise CaseError("limits.home", f'is missing: limits.{key} has about = "home"')
            return Cone(largest, home)
        case axes:
            rows = [row for row in axes if isinstance(row, list)]
            flat = [part for part in axes if not isinstance(part, list)]
            return Cone(largest, tuple(_triple(row) for row in rows or [flat]))


def _triple(values: Sequence[float]) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z


def steps(written: PoseTable, tasks: Sequence[Task], units: Units, key: str) -> tuple[Step, ...]:
    """The displacements that a stated pose has.

    Raises:
        CaseError: both a trajectory and a grid, a task that does not exist, crossed offsets, or too many poses.
    """
    if written.along_task is not None and written.grid is not None:
        raise CaseError(f"{key}.grid", "cannot stand beside along_task; write two poses")
    if written.along_task is not None:
        return _along(written.along_task, tasks, units, f"{key}.along_task")
    return (HERE,) if written.grid is None else _grid(written.grid, f"{key}.grid")


def _along(written: AlongTable, tasks: Sequence[Task], units: Units, key: str) -> tuple[Step, ...]:
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


def _grid(written: GridTable, key: str) -> tuple[Step, ...]:
    offsets = [
        _offsets(axis, f"{key}.{name}") for name, axis in zip("xyz", (written.x, written.y, written.z), strict=True)
    ]
    count = math.prod(map(len, offsets))
    if count == 1:
        raise CaseError(key, "must have offsets along x, y or z")
    if count > _MOST:
        raise CaseError(key, f"has {count} poses, of which at most {_MOST} are allowed")
    return over_grid(offsets)


def _offsets(written: OffsetsTable | None, key: str) -> list[float]:
    if written is None:
        return [0.0]
    if not written.min < written.max:
        raise CaseError(f"{key}.min", f"must be below max = {written.max:g}", written.min)
    return [float(each) for each in np.linspace(written.min, written.max, written.count)]
