"""Actuator forces and speeds at a point, and the constraint wrenches of the limbs that balance the loads.

The constraint wrenches of a limb do no work in its actuators: they are the part of its row forces that is orthogonal to
the space that its actuators drive. Statics determines them if the wrenches of the limb are independent of those of all
other limbs; else the robot is overconstrained, and the limbs can load each other without any external load.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, rank_of_rows
from ...models.basis import is_apart
from ...models.instance import length_of
from ...models.statics import Statics, driven_joints, statics_of
from ..case.forces import CaseForces, PosedForces, dimension_of_force, dimension_of_speed, forces_at
from ..program.nlp import Nlp
from ..system.jsonvalues import (
    Absent,
    Hidden,
    JsonObject,
    Matrix,
    Measure,
    Vector3,
    Vector6,
    finite_or_none,
    matrix,
    vector,
)
from .paths import velocities_at
from .state import RobotState, evaluate

#: Work rates of a limb's rows below this fraction of the largest count as zero.
_DRIVES = 1e-9


class ActuatorLoad(JsonObject):
    """Force or torque of an actuator under a load; null at a singular pose.

    Attributes:
        actuator: name of the actuator.
        value: force or torque with the largest absolute value, positive in the sense of the actuator rate.
        smallest: smallest force or torque over all directions of the load; equal to ``value`` for a fixed load.
        largest: largest force or torque over all directions of the load.
        unit: unit of ``value``, ``smallest`` and ``largest``.
        power: largest absolute force times largest speed; absent without motions.
    """

    actuator: str
    value: float | None
    smallest: float | None
    largest: float | None
    unit: str
    power: Absent[float]


class ConstraintLoad(JsonObject):
    """Constraint wrench of a limb under a load.

    Attributes:
        limb: name of the limb.
        wrench: wrench on the platform: force, then moment about the world origin; null if statics does not
            determine it, because limbs can load each other.
    """

    limb: str
    wrench: Vector6 | None


class PlatformDeflection(JsonObject):
    """Displacement of the platform under a load, from the compliance of the actuators.

    Attributes:
        translation: displacement of the platform's origin under the fixed part of the load; null at a singular pose.
        rotation: rotation vector of the platform, in the unit of angles.
        largest: upper bound of the translation's length over all directions of the load.
    """

    translation: Vector3 | None
    rotation: Annotated[Vector3 | None, Dimension.ANGLE]
    largest: float | None


class HeldLoad(JsonObject):
    """A load with the actuator forces and constraint wrenches that balance it.

    Attributes:
        name: name of the load.
        pose: number of the pose, from 1; absent for a single pose.
        wrench: force, then moment about the world origin, without the part of unknown direction.
        actuators: forces or torques of the actuators.
        constraints: constraint wrenches of the limbs; absent for a robot without constraints.
        deflection: displacement of the platform; absent if the stiffness of an actuator is unknown.
    """

    name: str
    pose: Absent[int]
    wrench: Vector6
    actuators: tuple[ActuatorLoad, ...]
    constraints: Absent[tuple[ConstraintLoad, ...]]
    deflection: Absent[PlatformDeflection]

    @property
    def forces(self) -> FloatArray:
        """Force (a,) with the largest absolute value of each actuator; NaN at a singular pose."""
        return np.array([each.value for each in self.actuators], dtype=np.float64)


class TopSpeed(JsonObject):
    """Largest speed of an actuator in the platform's fastest motions; null at a singular pose.

    Attributes:
        actuator: name of the actuator.
        pose: number of the pose, from 1; absent for a single pose.
        value: largest speed.
        unit: unit of the speed.
        dimension: dimension of the speed; rotary actuators have radians.
    """

    actuator: str
    pose: Absent[int]
    value: Annotated[float | None, Measure.NUMBER]
    unit: str
    dimension: Hidden[Dimension] = Dimension.NUMBER


class ActuatorLoading(JsonObject):
    """Forces and speeds of the actuators at every pose.

    Attributes:
        loads: balance of every load at every pose; absent without loads.
        speeds: largest speed of every actuator at every pose; absent without motions.
        compliance: compliance of the platform at the first pose: translation of its origin and rotation in radians, per
            force and moment about the origin; absent at a singular pose, or if the stiffness of an actuator is not
            known.
    """

    loads: Absent[tuple[HeldLoad, ...]]
    speeds: Absent[tuple[TopSpeed, ...]]
    compliance: Absent[Matrix]


class PoseLoads(NamedTuple):
    """Forces of all load cases at a pose; speeds and compliance, which do not depend on loads.

    Attributes:
        loads: load cases with their balance.
        speeds: largest speeds of the actuators; empty without a motion.
        compliance: (6, 6) displacement of the platform (rotation, then translation of its origin) per moment and force
            about the origin; empty if the stiffness of an actuator is not known.
    """

    loads: tuple[HeldLoad, ...]
    speeds: tuple[TopSpeed, ...]
    compliance: FloatArray


def loading_of(nlp: Nlp, x: FloatArray, state: RobotState) -> ActuatorLoading:
    """Return forces and speeds of the actuators at every pose of a point, in the case's units.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        state: state of the robot at the point, at the first pose.
    """
    poses = range(len(nlp.program.robots))
    found, units = [loads_at(nlp, x, evaluate(nlp, x, k) if k else state, k) for k in poses], nlp.case.units
    compliance = found[0].compliance
    known = compliance.size and np.isfinite(compliance).all()
    order = [3, 4, 5, 0, 1, 2]  # force before moment, and translation before rotation
    return ActuatorLoading(
        loads=HeldLoad.of_each([load for each in found for load in each.loads], units) or None,
        speeds=TopSpeed.of_each([speed for each in found for speed in each.speeds], units) or None,
        compliance=matrix(compliance[np.ix_(order, order)]) if known else None,
    )


def loads_at(nlp: Nlp, x: FloatArray, state: RobotState, pose: int = 0) -> PoseLoads:
    """Return forces and speeds of the actuators of a robot at a pose.

    Args:
        nlp: the nonlinear program.
        x: (n,) the point.
        state: state of the robot at the point.
        pose: index of the pose.
    """
    model, loading = nlp.program.model, nlp.case.loading
    at = velocities_at(nlp, x, nlp.program.kernels.robot_states[pose](x, nlp.arguments), pose)
    J, D, p, R = (SX(ca.DM(each)) for each in (at.jacobian, at.driven, state.position, state.rotation))
    statics = statics_of(model, J, D, p)
    values = [float(each) for item in model.parameters for each in np.ravel(state.parameters[item.name])]
    found = forces_at(model, statics, R, loading, SX(length_of(model, values)))
    held = {} if state.is_singular else _constraints(nlp, statics)
    number = pose + 1 if len(nlp.program.robots) > 1 else None
    speeds = _top_speeds(nlp, _numbers(found.speeds, state), number)
    loads = tuple(_load(nlp, case, state, found, held, speeds, number) for case in found.cases)
    is_elastic = bool(found.stiffness.numel())
    compliance = _numbers(ca.vec(found.compliance), state).reshape(6, 6) if is_elastic else np.zeros((0, 0))
    return PoseLoads(loads, speeds, compliance)


def largest_of(found: PoseLoads, measure: str) -> float:
    """Return the largest ``actuator_force``, ``actuator_speed`` or ``actuator_power`` over the actuators at a pose."""
    speeds = np.array([each.value for each in found.speeds], dtype=np.float64)
    if measure == "actuator_speed":
        return float(speeds.max())
    factor = speeds if measure == "actuator_power" else 1.0
    return float((factor * np.abs([each.forces for each in found.loads])).max())


def _top_speeds(nlp: Nlp, speeds: FloatArray, pose: int | None) -> tuple[TopSpeed, ...]:
    """Return the largest speeds (a,) of the actuators at a pose, by the number of the pose; empty without a motion."""
    return tuple(
        TopSpeed(
            actuator=joint.name,
            pose=pose,
            value=finite_or_none(speed),
            unit=nlp.case.units.label(dimension_of_speed(joint)),
            dimension=dimension_of_speed(joint),
        )
        for joint, speed in zip(driven_joints(nlp.program.model), speeds.tolist(), strict=False)
    )


def _load(
    nlp: Nlp,
    case: CaseForces,
    state: RobotState,
    posed: PosedForces,
    held: "Mapping[str, FloatArray | None]",
    speeds: Sequence[TopSpeed],
    pose: int | None,
) -> HeldLoad:
    """Return the balance of one load case; ``held`` has the matrix from row forces to the wrench of each limb."""
    phi = _numbers(posed.statics.row_forces(case.wrench), state) if held else np.zeros(0)
    ends = zip(_numbers(case.smallest, state).tolist(), _numbers(case.largest, state).tolist(), strict=True)
    actuators = []
    for k, (joint, (low, high)) in enumerate(zip(driven_joints(nlp.program.model), ends, strict=True)):
        force = high if abs(high) >= abs(low) else low
        speed = speeds[k].value if speeds else None
        actuators.append(
            ActuatorLoad(
                actuator=joint.name,
                value=finite_or_none(force),
                smallest=finite_or_none(low),
                largest=finite_or_none(high),
                unit=nlp.case.units.label(dimension_of_force(joint)),
                power=None if speed is None else finite_or_none(abs(force) * speed),
            )
        )
    constraints = tuple(
        ConstraintLoad(limb=limb, wrench=None if part is None else vector(_about_world(part @ phi, state.position)))
        for limb, part in held.items()
    )
    return HeldLoad(
        name=case.case.name,
        pose=pose,
        wrench=vector(_about_world(np.array(ca.DM(case.wrench)).ravel(), state.position)),
        actuators=tuple(actuators),
        constraints=constraints or None,
        deflection=_deflection(case, posed, state) if posed.stiffness.numel() else None,
    )


def _deflection(case: CaseForces, posed: PosedForces, state: RobotState) -> PlatformDeflection:
    """Return the platform's displacement under a load case."""
    displacement = _numbers(posed.displacement(case), state)
    known = bool(np.isfinite(displacement).all())
    return PlatformDeflection(
        translation=vector(displacement[3:]) if known else None,
        rotation=vector(displacement[:3]) if known else None,
        largest=finite_or_none(float(_numbers(posed.deflection(case), state)[0])),
    )


def _numbers(expression: SX, state: RobotState) -> FloatArray:
    """Return the values (k,) of a constant expression (k, 1); NaN at a singular pose."""
    values = np.array(ca.DM(expression), dtype=np.float64).reshape(-1)
    return np.full(values.shape, np.nan) if state.is_singular else values


def _about_world(wrench: FloatArray, position: FloatArray) -> FloatArray:
    """Return a wrench (6,) with its moment about the world origin, from a moment about the platform's origin."""
    return np.concatenate([wrench[:3], wrench[3:] + np.cross(position, wrench[:3])])


def _constraints(nlp: Nlp, statics: Statics) -> "dict[str, FloatArray | None]":
    """Return the matrix (6, m) from row forces to each limb's constraint wrench; None for an undetermined wrench."""
    model = nlp.program.model
    rows, driven = (np.array(ca.DM(each), dtype=np.float64) for each in (statics.rows, statics.driven))
    limbs = np.array([row.limb for row in model.frame_rows])
    wrenches = rows[:, [3, 4, 5, 0, 1, 2]]
    origin, length = np.zeros(3), float(np.abs(wrenches[:, 3:]).max(initial=0.0)) or 1.0
    found: dict[str, FloatArray | None] = {}
    for limb in model.limbs:
        own = limbs == limb
        left, values, _ = np.linalg.svd(driven[own])
        free = left[:, int(np.count_nonzero(values > _DRIVES * values.max(initial=0.0))) :]
        rank = rank_of_rows(free.T @ wrenches[own], origin, length)
        if not rank:
            continue
        matrix = np.zeros((6, len(limbs)))
        matrix[:, own] = wrenches[own].T @ free @ free.T
        found[limb] = matrix if is_apart(wrenches, own, origin, length) else None
    return found
