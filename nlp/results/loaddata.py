"""Forces, powers and speeds of actuators, and the wrenches of constraints that hold loads, as data."""

import numpy as np

from ...models import Dimension, FloatArray
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.forces import dimension_of_force, dimension_of_speed
from ..evidence.loads import LoadState, loads_at
from ..evidence.state import RobotState, evaluate
from ..program.nlp import Nlp
from ..system.jsonvalues import Absent, JsonObject, Matrix, Vector3, Vector6, finite_or_none, matrix, vector


class ActuatorForceData(JsonObject):
    """Force of an actuator under a load, or torque of one that turns; null at a singular pose.

    Attributes:
        actuator: its name.
        value: the force of the largest size, positive in the sense of the actuator's rate.
        smallest: smallest force where the load is of any direction; the same value for others.
        largest: largest force.
        unit: of these numbers.
        power: largest size of the force times the largest speed; absent without motions.
    """

    actuator: str
    value: float | None
    smallest: float | None
    largest: float | None
    unit: str
    power: Absent[float]


class ConstraintWrenchData(JsonObject):
    """Wrench by which the constraints of a limb hold a load.

    Attributes:
        limb: its name.
        wrench: on the platform, force, then moment about the world origin; null where statics does not determine it,
            because limbs can load each other.
    """

    limb: str
    wrench: Vector6 | None


class DeflectionData(JsonObject):
    """Displacement of the platform under a load, as its actuators give way.

    Attributes:
        translation: of its origin, without the part of any direction; null at a singular pose.
        rotation: vector of the turn, in the unit of angles.
        largest: upper bound of the size of the translation with loads of any direction.
    """

    translation: Vector3 | None
    rotation: Vector3 | None
    largest: float | None


class LoadData(JsonObject):
    """A load and what holds it.

    Attributes:
        name: of the load.
        pose: number of the pose, from 1 on; absent where there is one.
        wrench: force, then moment about the world origin, without its part of any direction.
        actuators: forces of the actuators.
        constraints: wrenches of the limbs' constraints; absent for a robot without any.
        deflection: of the platform; absent where the actuators' stiffness is not known.
    """

    name: str
    pose: Absent[int]
    wrench: Vector6
    actuators: tuple[ActuatorForceData, ...]
    constraints: Absent[tuple[ConstraintWrenchData, ...]]
    deflection: Absent[DeflectionData]


class ActuatorSpeedData(JsonObject):
    """Largest speed of an actuator in the platform's fastest motions; null at a singular pose.

    Attributes:
        actuator: its name.
        pose: number of the pose, from 1 on; absent where there is one.
        value: the speed.
        unit: of the speed.
    """

    actuator: str
    pose: Absent[int]
    value: float | None
    unit: str


class LoadingData(JsonObject):
    """Forces and speeds of actuators at every pose.

    Attributes:
        loads: every load at every pose; absent without loads.
        speeds: every actuator at every pose; absent without motions.
        compliance: at the first pose, displacement of the platform, translation of its origin and turn in radians, by
            force and moment about it; absent where the actuators' stiffness is not known, and at a singular pose.
    """

    loads: Absent[tuple[LoadData, ...]]
    speeds: Absent[tuple[ActuatorSpeedData, ...]]
    compliance: Absent[Matrix]


def loading_data(nlp: Nlp, x: FloatArray, state: RobotState) -> LoadingData | None:
    """Return forces and speeds of the actuators at a point; None for a case without loads and motions.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there, at the first pose.
    """
    case = nlp.case
    if not (case.loading.loads or case.loading.motion or case.loading.stiffness):
        return None
    loads: list[LoadData] = []
    compliance: Matrix | None = None
    speeds: list[ActuatorSpeedData] = []
    joints = driven_joints(case.model)
    for k in range(len(nlp.program.robots)):
        found = loads_at(nlp, x, evaluate(nlp, x, k) if k else state, k)
        pose = k + 1 if len(nlp.program.robots) > 1 else None
        if not k and found.compliance.size and np.isfinite(found.compliance).all():
            order = [3, 4, 5, 0, 1, 2]  # force before moment, and translation before turn
            compliance = matrix(found.compliance[np.ix_(order, order)])
        loads += [_load(case, each, found.speeds, pose) for each in found.loads]
        for joint, speed in zip(joints, found.speeds.tolist(), strict=False):
            dimension = dimension_of_speed(joint)
            shown = case.units.shown(speed, dimension)
            unit = case.units.label(dimension)
            speeds.append(ActuatorSpeedData(actuator=joint.name, pose=pose, value=finite_or_none(shown), unit=unit))
    return LoadingData(loads=tuple(loads) or None, speeds=tuple(speeds) or None, compliance=compliance)


def _load(case: Case, load: LoadState, speeds: FloatArray, pose: int | None) -> LoadData:
    """Return a load at a pose."""
    actuators = []
    for k, joint in enumerate(driven_joints(case.model)):
        force = float(load.forces[k])
        actuators.append(
            ActuatorForceData(
                actuator=joint.name,
                value=finite_or_none(force),
                smallest=finite_or_none(load.smallest[k]),
                largest=finite_or_none(load.largest[k]),
                unit=case.units.label(dimension_of_force(joint)),
                power=finite_or_none(abs(force) * float(speeds[k])) if len(speeds) else None,
            )
        )
    held = tuple(
        ConstraintWrenchData(limb=limb, wrench=None if wrench is None else vector(wrench))
        for limb, wrench in load.constraints.items()
    )
    return LoadData(
        name=load.name,
        pose=pose,
        wrench=vector(load.wrench),
        actuators=tuple(actuators),
        constraints=held or None,
        deflection=_deflection(case, load) if load.displacement.size else None,
    )


def _deflection(case: Case, load: LoadState) -> DeflectionData:
    """Return the platform's displacement under a load."""
    known = bool(np.isfinite(load.displacement).all())
    turn = [case.units.shown(float(part), Dimension.ANGLE) for part in load.displacement[:3]]
    return DeflectionData(
        translation=vector(load.displacement[3:]) if known else None,
        rotation=tuple(turn) if known else None,
        largest=finite_or_none(load.deflection),
    )
