"""Robot at a point as data: case, poses, motions and quantities; violated bounds and constraints of a point."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from types import MappingProxyType

import casadi as ca
import numpy as np

from ...models import FloatArray, Quantity
from .. import __version__
from ..case.case import Case
from ..case.loads import NO_LOADING
from ..evidence.conventions import dependence_of
from ..evidence.evaluation import shown_parameters
from ..evidence.kkt import FEASIBLE, linearise
from ..evidence.loads import loading_of, loads_at
from ..evidence.margins import measured_slack, measured_values, unit_of_side
from ..evidence.screwvalues import motion_of
from ..evidence.state import PlatformPose, RobotState, evaluate, stated_poses
from ..program.free_joints import FreeJoint, free_joints
from ..program.nlp import Nlp
from ..program.pairs import with_pairs_at
from ..system.jsonvalues import vector
from .joints import joints_data
from .objective import pose_objective
from .parts import (
    SCHEMA,
    ByOwner,
    HeadData,
    PosesData,
    PoseStateData,
    RobotData,
    TaskData,
    UnitsData,
    VersionsData,
    ViolationData,
)
from .rounding import TURNED

#: Size of violations, as a fraction of the worst one, below which they are left out: a failed solve leaves small ones.
_SMALL = 1e-3


def head_data(case: Case) -> HeadData:
    """Return the case of a result."""
    return HeadData.of(case, schema=SCHEMA, case=case.name, model=case.model.name, units=UnitsData.of(case.units))


def stated_pose_notice(case: Case) -> str | None:
    """Return the notice that limits over a workspace or path are taken at the stated pose only; otherwise None."""
    if case.tasks[0].measure:  # its bound covers poses of the workspace or path
        return None
    return case.stated_pose_notice or None


@cache
def versions() -> VersionsData:
    """Return the versions of the software on which the values depend."""
    return VersionsData(
        screwsynth=__version__,
        casadi=ca.CasadiMeta.version(),
        numpy=np.__version__,
        python=".".join(map(str, sys.version_info[:3])),
    )


def robot_data(nlp: Nlp, x: FloatArray, state: RobotState, task: int | None) -> RobotData:
    """Return the robot at a point.

    Args:
        nlp: nonlinear program.
        x: (n,) point.
        state: robot at the point and the first pose.
        task: index of the task to which the rates of the state belong; None for a result without task and rates.

    Raises:
        EvaluationError: a value is not finite at another pose.
    """
    case = nlp.case
    task = None if case.tasks[0].measure else task  # an actuator quantity has no task of the user
    limited = _limited_quantities(nlp, x)
    several = _poses_data(nlp, x, limited)
    dependence = None if task is None else dependence_of(nlp, x)
    return RobotData.of(
        state,
        parameters=shown_parameters(case, state),
        pose=pose_data(case, state) if several is None else several.stated_poses[0],
        task=None if task is None else task_data(case, task),
        limbs=tuple(row.limb for row in case.model.rows),
        members=tuple(row.member for row in case.model.rows),
        rates=None if task is None else vector(state.rates),
        singular=state.is_singular,
        free_motions=tuple(motion_of(twist) for twist in state.free_twists),
        task_is_free=None if task is None else state.is_zero,
        quantities=_quantities(case, state),
        limited_quantities=limited[0] if limited else None,
        characteristic_length=case.characteristic_length if case.model.has_couples else None,
        length_dependence=None if dependence is None else dependence.length,
        joints=joints_data(nlp, x, state, dependence, with_task=task is not None),
        free_joints=FreeJoint.of_each(free_joints(nlp, x), case.units) or None,
        loading=loading_of(nlp, x, state) if case.loading != NO_LOADING else None,
        several=several,
    )


def _limited_quantities(nlp: Nlp, x: FloatArray) -> list[Mapping[str, ByOwner]]:
    """Return the limited quantities that are not quantities of the model, at a point (n,), for each pose."""
    case, program = nlp.case, nlp.program
    rows = [
        {limit.key: found for limit in case.limits if (found := limit.measures(robot)) is not None}
        for robot in program.robots
    ]
    if not any(rows):
        return []
    columns = [ca.densify(measures.values) for row in rows for measures in row.values()]
    function = ca.Function("limited", [program.x, program.p], [ca.vertcat(*columns)])
    values = iter(function(x, nlp.arguments).full().ravel().tolist())
    return [
        MappingProxyType(
            {
                key: MappingProxyType(
                    {owner: case.units.shown(next(values), measures.dimension) for owner in measures.owners}
                )
                for key, measures in row.items()
            }
        )
        for row in rows
    ]


def _poses_data(nlp: Nlp, x: FloatArray, limited: Sequence[Mapping[str, ByOwner]]) -> PosesData | None:
    """Return the robot at every pose; None for one pose.

    F and rates are those of the program's task, or of the first task, where the program combines several.
    """
    case = nlp.case
    if len(nlp.program.robots) == 1:
        return None
    return PosesData(
        stated_poses=tuple(pose_data(case, pose) for pose in stated_poses(nlp, x)),
        over_poses=case.over_poses,
        poses=tuple(_pose_state(nlp, x, k, limited[k] if limited else None) for k in range(len(nlp.program.robots))),
    )


def _pose_state(nlp: Nlp, x: FloatArray, k: int, limited: Mapping[str, ByOwner] | None) -> PoseStateData:
    case, state = nlp.case, evaluate(nlp, x, k)
    return PoseStateData.of(
        state,
        F=pose_objective(case, loads_at(nlp, x, state, k)) if case.tasks[0].measure else state.F,
        pose=pose_data(case, state),
        singular=state.is_singular,
        quantities=_quantities(case, state),
        limited_quantities=limited,
    )


def pose_data(case: Case, pose: RobotState | PlatformPose) -> PlatformPose:
    """Return a pose in the case's units; without rotation its axis is z, unless the case states another axis."""
    is_held = any(each.rotation.axis is not None for each in case.poses)
    unturned = {} if is_held or abs(pose.angle) > TURNED else {"axis": (0.0, 0.0, 1.0)}
    return PlatformPose.of(pose, case.units, **unturned)


def task_data(case: Case, task: int) -> TaskData:
    """Return a task of the case, by its index."""
    chosen = case.tasks[task]
    return TaskData.of(
        chosen,
        motion=motion_of(chosen.twist),
        stated_point=None if chosen.point is None else vector(np.asarray(chosen.point, dtype=np.float64)),
    )


def _quantities(case: Case, state: RobotState) -> Mapping[str, ByOwner]:
    """Return the finite quantities of the model, by name and owner, in the case's units."""
    return MappingProxyType(
        {
            item.name: _by_owner(case, item, state.quantities[item.name])
            for item in case.model.quantities
            if np.isfinite(state.quantities[item.name]).all()
        }
    )


def _by_owner(case: Case, quantity: Quantity, values: FloatArray) -> ByOwner:
    """Return the values of a quantity by limb or joint, in the case's units."""
    pairs = zip(quantity.owners, values, strict=True)
    return MappingProxyType({owner: case.units.shown(float(value), quantity.dimension) for owner, value in pairs})


def objective(nlp: Nlp, x: FloatArray, state: RobotState | None) -> float:
    """Return F at a point (n,): F of the state, or the sum, mean or worst F over several poses."""
    is_other = bool(nlp.case.tasks[0].measure) or nlp.program.places.epigraph is not None
    return nlp.evaluate(x)[0] if state is None or is_other or len(nlp.program.robots) > 1 else state.F


def violations(nlp: Nlp, x: FloatArray) -> tuple[ViolationData, ...]:
    """Return the violated bounds and constraints of a point (n,), in the case's words and units.

    Violations a thousand times smaller than the worst one are left out, as they come from the failed solve.
    """
    nlp = with_pairs_at(nlp, [x])
    at, g = linearise(nlp, x), nlp.evaluate(x)[1]
    slack, units = measured_slack(nlp, x, at), nlp.case.units
    worst = -float(np.min(slack, initial=0.0)) if np.isfinite(slack).all() else math.inf
    least = -max(FEASIBLE, _SMALL * worst)
    outside = [j for j in range(len(slack)) if not slack[j] >= least]
    measured = measured_values(nlp, x) if outside else []
    rows: list[ViolationData] = []
    for j in outside:
        side, limit = nlp.sides.sides[j], float(nlp.sides.limit[j])
        if side.constraint is None:
            value, dimension = float(x[side.variable or 0]), nlp.program.variables[side.variable or 0].dimension
        else:
            reading = nlp.program.constraints[side.constraint].reading
            dimension, limit, value = reading.dimension, reading.from_value(limit), measured[side.constraint]
            # Equations are no limits: only the program measures them.
            is_equation = not any(nlp.program.constraints[side.constraint].keys)
            value = reading.from_value(float(g[side.constraint])) if is_equation else value
        shown, allowed = units.shown(value, dimension), units.shown(limit, dimension)
        unit = unit_of_side(nlp.case, side.name, dimension) or None
        rows.append(ViolationData(name=side.name, bound=side.bound, value=shown, limit=allowed, unit=unit))
    return tuple(rows)
