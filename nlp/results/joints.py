"""Joints of a robot given joint by joint at one point: freedoms, rates, singularities and assembly."""

import math
from typing import Literal

from ...models import Dimension, FloatArray
from ..evidence.assembly import assembly_of
from ..evidence.conventions import Dependence
from ..evidence.mobility import LimbPart, Mobility, mobility_of
from ..evidence.singularities import Singularity
from ..evidence.state import RobotState
from ..program.nlp import Nlp
from ..system.jsonvalues import Absent, JsonObject, finite_or_none


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
    limb_parts: Absent[tuple[LimbPart, ...]]
    centre_dependence: Absent[float]
    singularities: tuple[Singularity, ...]
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
        limb_parts=found.parts if with_task else None,
        centre_dependence=None if dependence is None else dependence.centre,
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
