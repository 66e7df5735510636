"""Joints of a robot given joint by joint at a point, as data."""

from __future__ import annotations

import math

from ...models import Dimension, FloatArray
from ..evidence.assembly import assembly_of
from ..evidence.conventions import Dependence
from ..evidence.mobility import Mobility, mobility_of
from ..evidence.singularities import Singularity, clause_of
from ..evidence.state import RobotState
from ..program.nlp import Nlp
from .jointdata import ActuatorData, JointsData, LimbPartData, SingularityData
from .jsondata import finite_or_none
from .motiondata import motion_data, wrench_data


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
