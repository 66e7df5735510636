"""Arrows of a load and of the forces of actuators that hold it, beside a robot."""

from __future__ import annotations

from typing import Literal, NamedTuple

import casadi as ca
import numpy as np

from ....models import Dimension, FloatArray, frozen_array
from ....models.statics import driven_joints
from ...case.forces import dimension_of_force
from ...evidence.loads import LoadState, loads_at
from ...evidence.state import RobotState
from ...program.nlp import Nlp

#: Length of the longest arrow of a force, in parts of the robot's size.
_LONGEST = 0.45
#: Forces below this part of the largest have no arrow.
_NOISE = 1e-6


class ForceArrow(NamedTuple):
    """An arrow of a force.

    Attributes:
        kind: the load, or a leg that pushes or pulls the platform.
        name: of the load or of the limb.
        ends: (2, 3) its start and its head, in the world frame.
        words: whose force it is, and how large.
    """

    kind: Literal["load", "push", "pull"]
    name: str
    ends: FloatArray
    words: str


class DrawnForces(NamedTuple):
    """Arrows of one load case, and what they mean.

    Attributes:
        arrows: those of forces.
        words: the load case with its largest force, by which arrows have their scale.
        torques: torques of actuators that turn, in words; empty without any.
    """

    arrows: tuple[ForceArrow, ...]
    words: str
    torques: str


def drawn_forces(nlp: Nlp, x: FloatArray, state: RobotState, pose: int, size: float) -> DrawnForces | None:
    """Return the arrows of a case's first load at a point; None without a load, and at a singular pose.

    Args:
        nlp: the program.
        x: (n,) the point.
        state: the robot there.
        pose: index of the pose.
        size: of the robot, length.
    """
    cases = nlp.case.loading.cases
    if not cases or state.is_singular:
        return None
    held, units = loads_at(nlp, x, state, pose).loads[0], nlp.case.units
    joints = driven_joints(nlp.case.model)
    values = held.forces
    legs = _legs(nlp, x, pose)
    forces = {joint.name: float(value) for joint, value in zip(joints, values, strict=True) if joint.limb in legs}
    given = _points_and_forces(nlp, state)
    largest = max([*map(abs, forces.values()), *(float(np.linalg.norm(force)) for _, force in given)], default=0.0)
    scale = _LONGEST * size / largest if largest > 0 else 0.0
    arrows = [
        ForceArrow(
            "load",
            cases[0].name,
            frozen_array(np.stack([at - scale * force, at]), (2, 3)),
            f"load {cases[0].name}: {float(np.linalg.norm(force)):.4g} {units.label(Dimension.FORCE)}",
        )
        for at, force in given
    ]
    for joint in joints:
        if abs(forces.get(joint.name, 0.0)) > _NOISE * largest:
            foot, head = legs[joint.limb]
            along = scale * forces[joint.name] * (head - foot) / np.linalg.norm(head - foot)
            # The arrow of a push ends at the joint on the platform, that of a pull begins there.
            ends = np.stack([head - along, head]) if forces[joint.name] > 0 else np.stack([head, head + along])
            kind: Literal["push", "pull"] = "push" if forces[joint.name] > 0 else "pull"
            words = f"leg {joint.name}: {forces[joint.name]:+.4g} {units.label(Dimension.FORCE)}"
            arrows.append(ForceArrow(kind, joint.name, frozen_array(ends, (2, 3)), words))
    turning = [(joint, value) for joint, value in zip(joints, values, strict=True) if joint.name not in forces]
    torques = ", ".join(
        f"{joint.name} {value:+.4g} {units.label(dimension_of_force(joint))}" for joint, value in turning
    )
    more = "" if len(nlp.case.loading.cases) == 1 else f", the first of {len(nlp.case.loading.cases)}"
    longest = f": longest arrow {largest:.4g} {units.label(Dimension.FORCE)}" if arrows else ""
    words = f"load {held.name}{more}{longest}{_any_words(held)}"
    return DrawnForces(tuple(arrows), words, torques)


def _any_words(held: LoadState) -> str:
    """Return what forces of legs are where a load has any direction."""
    return "" if np.array_equal(held.smallest, held.largest) else ", legs at their largest"


def _points_and_forces(nlp: Nlp, state: RobotState) -> list[tuple[FloatArray, FloatArray]]:
    """Return the points (3,) and the forces (3,) of the parts of the first load case, in the world frame."""
    case, R, p = nlp.case.loading.cases[0], state.rotation, state.position
    found = []
    for load, sign in case.parts:
        turn = R if load.in_platform else np.eye(3)
        force = sign * (turn @ np.array(load.force) + load.mass * np.array(case.gravity))
        if force.any():
            found.append((p + R @ np.array(load.point), force))
    return found


def _legs(nlp: Nlp, x: FloatArray, pose: int) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Return the centres (3,) of both joints of each straight leg, in the world frame, by its limb."""
    robot = nlp.program.robots[pose]
    if not robot.legs:
        return {}
    parts = [ca.horzcat(*[getattr(leg, part) for leg in robot.legs]) for part in ("base", "span")]
    function = ca.Function("legs", [nlp.program.x, nlp.program.p], [ca.densify(each) for each in parts])
    base, span = (each.full() for each in function(x, nlp.arguments))
    return {leg.name: (base[:, k], base[:, k] + span[:, k]) for k, leg in enumerate(robot.legs)}
