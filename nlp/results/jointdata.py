"""Joints of a robot given joint by joint as a part of results: freedoms, actuator rates, singularities, assembly."""

from typing import Literal

from .jsondata import Absent, JsonObject


class ActuatorData(JsonObject):
    """An actuated joint of a robot given joint by joint.

    Attributes:
        name: of the actuator: its limb, with a number where the limb has several.
        kind: ``angle`` or ``length``.
        rate: for the task's motion, radians or length per unit of time; null where it cannot drive the platform.
    """

    name: str
    kind: Literal["angle", "length"]
    rate: float | None


class JointsData(JsonObject):
    """Joints of a robot given joint by joint, at its first pose.

    Attributes:
        freedoms: of the platform with free actuators.
        actuators: with their rates for the task's motion; absent where there are several tasks.
        constrained: part of F that constraints carry, which no actuator can move with; 0 for a motion that is possible.
        singularities: sentences about the singularities found.
        assembly: sentences about joints that are assembled in another way than at home, or perhaps; empty for home's.
    """

    freedoms: int
    actuators: Absent[tuple[ActuatorData, ...]]
    constrained: Absent[float]
    singularities: tuple[str, ...]
    assembly: tuple[str, ...]
