"""Joints of a robot given joint by joint as a part of results: freedoms, rates, singularities, F by limb, assembly."""

from typing import Literal

from ..evidence.singularities import SingularityKey
from .jsondata import Absent, JsonObject
from .motiondata import MotionData, WrenchData


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
