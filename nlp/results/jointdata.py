"""Motions and wrenches as data; joints of a robot given joint by joint: freedoms, rates, singularities, assembly."""

import math
from typing import TYPE_CHECKING, Literal, TypedDict

import numpy as np

from ...models import Dimension, FloatArray, axis_from_screw
from ..evidence.assembly import assembly_of
from ..evidence.conventions import Dependence
from ..evidence.mobility import Mobility, mobility_of
from ..evidence.singularities import Singularity, SingularityKey, clause_of
from ..evidence.state import RobotState
from ..program.free_joints import free_joints
from ..program.nlp import Nlp
from ..system.jsonvalues import Absent, JsonObject, Vector3, Vector6, finite_or_none, vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class MotionData(JsonObject):
    """An instantaneous motion of the platform.

    Attributes:
        twist: angular velocity, then velocity at the world origin.
        axis: unit direction of the screw axis.
        point: the axis's point nearest to the world origin; null for a translation.
        pitch: length per radian; "inf" for a translation.
    """

    twist: Vector6
    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


class WrenchData(JsonObject):
    """A wrench of unit force, or a unit couple.

    Attributes:
        wrench: force, then moment about the world origin.
        axis: unit direction of the screw axis.
        point: the axis's point nearest to the world origin; null for a couple.
        pitch: moment along the axis per unit of force, length; "inf" for a couple.
    """

    wrench: Vector6
    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


def motion_data(twist: "ArrayLike") -> MotionData:
    """Return a twist (6,) with its axis, point and pitch; a pure translation has no point."""
    return MotionData(twist=vector(np.asarray(twist, dtype=np.float64)), **_axis_of(twist))


def wrench_data(wrench: "ArrayLike") -> WrenchData:
    """Return a wrench (6,) with its axis, point and pitch; a pure couple has no point."""
    return WrenchData(wrench=vector(np.asarray(wrench, dtype=np.float64)), **_axis_of(wrench))


class _Axis(TypedDict):
    """Axis, point and pitch of a screw, as the data have them."""

    axis: Vector3
    point: Vector3 | None
    pitch: float | Literal["inf"]


def _axis_of(coordinates: "ArrayLike") -> _Axis:
    """Return axis, point and pitch of a screw (6,); one of infinite pitch has no point."""
    screw = axis_from_screw(coordinates)
    infinite = math.isinf(screw.pitch)
    point = None if infinite else vector(screw.point)
    return {"axis": vector(screw.axis), "point": point, "pitch": "inf" if infinite else screw.pitch}


class ActuatorData(JsonObject):
    """An actuated joint of a robot given joint by joint.

    Attributes:
        name: of the actuator: its limb, with a number where the limb has several.
        kind: ``angle`` or ``length``.
        rate: for the task's motion, radians or length per unit of time; null where the motion does not determine it,
            because the actuator can move while the platform stands still.
    """

    name: str
    kind: Literal["angle", "length"]
    rate: float | None


class FreeJointData(JsonObject):
    """Position of a driven joint that the pose does not determine, at one pose: a variable of the program.

    Attributes:
        name: of the variable.
        joint: limb and place of the joint.
        kind: ``angle`` or ``length``.
        value: position from home.
        lower: smallest position: of the limits on it, or where there is none, of the search.
        upper: likewise the largest.
        limits: names of the limits on it; empty where it has none.
        lower_is_limit: whether the smallest position is a limit of the case.
        upper_is_limit: whether the largest position is a limit of the case.
    """

    name: str
    joint: str
    kind: Literal["angle", "length"]
    value: float
    lower: float
    upper: float
    limits: tuple[str, ...]
    lower_is_limit: bool
    upper_is_limit: bool


def free_joints_data(nlp: Nlp, x: FloatArray) -> tuple[FreeJointData, ...] | None:
    """Return the free positions of driven joints at a point (n,), pose after pose; None without any."""
    units, rows = nlp.case.units, []
    for each in free_joints(nlp):
        variable = nlp.program.variables[each.variable]
        value, lower, upper = (
            units.shown(float(number), variable.dimension) for number in (x[each.variable], each.lower, each.upper)
        )
        rows.append(
            FreeJointData(
                name=variable.name,
                joint=each.joint,
                kind="angle" if variable.dimension is Dimension.ANGLE else "length",
                value=value,
                lower=lower,
                upper=upper,
                limits=each.limits,
                lower_is_limit=each.is_limited[0],
                upper_is_limit=each.is_limited[1],
            )
        )
    return tuple(rows) or None


class LimbPartData(JsonObject):
    """The part of F that a limb has.

    Attributes:
        limb: its name.
        F: sum of the squared work rates of its wrenches; of actuation and constraints.
        actuation: part that its actuators can move with.
        constraints: part that no actuator can move with: 0 in every limb for a motion that is possible.
    """

    limb: str
    F: float
    actuation: float
    constraints: float


class SingularityData(JsonObject):
    """A singularity.

    Attributes:
        kind: its kind.
        limb: limb that it belongs to; absent for one of the whole robot.
        joints: dependent joints of the limb, by label; absent for one of the whole robot.
        words: the same as a clause.
        gained: basis of the motions that the platform gains; absent for one of a limb.
        locking: wrenches that the limb resists with in addition, so that the platform loses the motions in which they
            do work; absent for one of the whole robot.
    """

    kind: SingularityKey
    limb: Absent[str]
    joints: Absent[tuple[str, ...]]
    words: str
    gained: Absent[tuple[MotionData, ...]]
    locking: Absent[tuple[WrenchData, ...]]


class JointsData(JsonObject):
    """Joints of a robot given joint by joint, at its first pose.

    Attributes:
        freedoms: of the platform with free actuators.
        feasible: whether the platform can make the task's motion with free actuators; absent with several tasks.
        actuators: with their rates for the task's motion; absent where there are several tasks.
        constrained: part of F that constraints carry, which no actuator can move with; 0 for a motion that is possible.
        limb_parts: actuation and constraints in F, limb by limb; absent where there are several tasks.
        centre_dependence: largest change of F, as a part of it, where the centre of a limb's wrenches moves by the
            characteristic length along the axis of its last passive joint; absent where no limb's wrenches have such a
            centre, and with several tasks.
        singularities: that were found.
        assembly: sentences about joints that are assembled in another way than at home, or perhaps; empty for home's.
    """

    freedoms: int
    feasible: Absent[bool]
    actuators: Absent[tuple[ActuatorData, ...]]
    constrained: Absent[float]
    limb_parts: Absent[tuple[LimbPartData, ...]]
    centre_dependence: Absent[float]
    singularities: tuple[SingularityData, ...]
    assembly: tuple[str, ...]


def joints_data(
    nlp: Nlp, x: FloatArray, state: RobotState, dependence: Dependence | None, *, with_task: bool
) -> JointsData | None:
    """Return the joints of a robot given joint by joint; None for others.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there, at the first pose.
        dependence: of F on conventions; None where it is not known.
        with_task: whether the state's rates belong to a task.
    """
    found = mobility_of(nlp, x, state)
    if found is None:
        return None
    assembly = assembly_of(nlp, x, state)
    return JointsData.of(
        found,
        feasible=found.constrained == 0 if with_task else None,
        actuators=_actuators(nlp, found) if with_task else None,
        constrained=found.constrained if with_task else None,
        limb_parts=_limb_parts(found) if with_task else None,
        centre_dependence=None if dependence is None else dependence.centre,
        singularities=tuple(_singularity(each) for each in found.singularities),
        assembly=() if assembly is None else assembly.sentences,
    )


def _actuators(nlp: Nlp, found: Mobility) -> tuple[ActuatorData, ...]:
    """Return the actuators with their rates."""
    return tuple(
        ActuatorData.of(
            each,
            kind="angle" if each.dimension is Dimension.ANGLE else "length",
            rate=finite_or_none(found.actuator_rates.get(each.name, math.inf)),
        )
        for each in nlp.program.model.actuators
    )


def _limb_parts(found: Mobility) -> tuple[LimbPartData, ...]:
    """Return actuation and constraints in F, limb by limb."""
    return tuple(
        LimbPartData(
            limb=limb, F=part.actuation + part.constraint, actuation=part.actuation, constraints=part.constraint
        )
        for limb, part in found.parts.items()
    )


def _singularity(each: Singularity) -> SingularityData:
    """Return a singularity."""
    return SingularityData(
        kind=each.kind.key,
        limb=each.limb,
        joints=None if each.limb is None else each.joints,
        words=clause_of(each.kind, each.limb, each.joints),
        gained=None if each.gained is None else tuple(motion_data(row) for row in each.gained),
        locking=None if each.locking is None else tuple(wrench_data(row) for row in each.locking),
    )
