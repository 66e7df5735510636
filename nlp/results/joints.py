"""Joints of a robot at one point: degrees of freedom, rates, singularities and assembly mode."""

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
    """Actuated joint of a robot defined by joints.

    Attributes:
        name: name of the actuator: the limb, with a number if the limb has several actuators.
        kind: ``angle`` or ``length``.
        rate: rate for the task's motion, radians or length per unit of time; null if the motion does not determine
            the rate, because the actuator can move while the platform stands still.
    """

    name: str
    kind: Literal["angle", "length"]
    rate: float | None


class JointsData(JsonObject):
    """Joints of a robot defined by joints, at its first pose.

    Attributes:
        freedoms: degrees of freedom of the platform with unlocked actuators.
        feasible: If true, the platform can make the task's motion with unlocked actuators; absent with several tasks.
        actuators: actuators with their rates for the task's motion; absent with several tasks.
        constrained: fraction of F from constraint wrenches, 0 to 1; 0 for a motion that the platform can make.
        limb_parts: F by limb, split into actuation and constraint wrenches; absent with several tasks.
        centre_dependence: largest relative change of F where the centre of a limb's wrenches moves by the
            characteristic length along the axis of its last passive joint; absent with several tasks, and without such
            a centre.
        singularities: singularities at the pose.
        assembly: sentences about an assembly mode that is not, or may not be, that of home; empty for the home mode.
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
    """Return the joints of a robot defined by joints; None for a robot defined by its rows.

    Args:
        nlp: nonlinear program.
        x: (n,) point.
        state: robot at the point and the first pose.
        dependence: dependence of F on conventions; None if unknown.
        with_task: If true, the rates of the state belong to a task.
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
