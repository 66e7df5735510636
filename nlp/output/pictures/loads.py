"""Arrows of a load, and of the actuator forces that balance it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np

from ....models import Dimension, FloatArray, JointKind, Model, frozen_array
from ....models.statics import driven_joints
from ...case.forces import dimension_of_force
from ...case.loads import LoadCase
from ...errors import load_words
from ...evidence.loads import HeldLoad, loads_at
from ...evidence.state import RobotState, legs_at
from ...program.nlp import Nlp
from .posture import Posture

#: Length of the longest arrow of a force, and of a moment, as a fraction of the robot's size.
_LONGEST, _LONGEST_MOMENT = 0.45, 0.3
#: Size relative to the largest force below which a force has no arrow.
_NOISE = 1e-6


class ForceArrow(NamedTuple):
    """Arrow of a force, or of a moment along its axis.

    Attributes:
        kind: force or moment of the load, push or pull of a leg on the platform, or force of an actuator on its slide.
        name: name of the load or of the actuator.
        ends: (2, 3) start and head of the arrow, in the world frame.
        words: description of the force, with its magnitude.
    """

    kind: Literal["load", "moment", "push", "pull", "drive"]
    name: str
    ends: FloatArray
    words: str

    @property
    def is_beside(self) -> bool:
        """True for an arrow beside a leg or a slide; False for an arrow of the load."""
        return self.kind not in ("load", "moment")


class DrawnForces(NamedTuple):
    """Arrows of one load case, with their legend.

    Attributes:
        arrows: arrows of forces and moments.
        words: legend with the loads, the load case, and the largest force and moment, which set the scale.
        torques: torques of rotary actuators and forces without arrows, as text; may be empty.
    """

    arrows: tuple[ForceArrow, ...]
    words: str
    torques: str


def drawn_forces(
    nlp: Nlp, x: FloatArray, state: RobotState, posture: Posture, pose: int, size: float
) -> DrawnForces | None:
    """Return the arrows of the first load of a case at a point; None without a load or at a singular pose.

    Args:
        nlp: nonlinear program of the case.
        x: (n,) point.
        state: state of the robot at the point.
        posture: drawing of the robot at the point.
        pose: index of the pose.
        size: size of the robot, length.
    """
    cases, units, model = nlp.case.loading.cases, nlp.case.units, nlp.program.model
    if not cases or state.is_singular:
        return None
    held, given = loads_at(nlp, x, state, pose).loads[0], list(_parts(cases[0], state))
    lines = _slides(model, posture) | _legs(nlp, x, pose)
    joints = driven_joints(model)
    forces = [each for each in zip(joints, held.forces.tolist(), strict=True) if each[0].name in lines]
    largest = max([*(_norm(part.force) for part in given), *(abs(force) for _, force in forces)], default=0.0)
    turning = max((_norm(part.moment) for part in given), default=0.0)
    scale, turn = (part * size / (most or 1.0) for part, most in ((_LONGEST, largest), (_LONGEST_MOMENT, turning)))
    arrows = []
    for part in given:
        words = f"{part.words}: {_norm(part.force):.4g} {units.label(Dimension.FORCE)}"
        arrows.append(_arrow("load", part.name, part.point - scale * part.force, part.point, words))
        words = f"moment of {part.words}: {_norm(part.moment):.4g} {units.label(Dimension.TORQUE)}"
        arrows.append(_arrow("moment", part.name, part.point, part.point + turn * part.moment, words))
    for joint, force in forces:
        line, words = lines[joint.name], f"{joint.name}: {force:+.4g} {units.label(Dimension.FORCE)}"
        along = scale * force * line.direction if abs(force) > _NOISE * largest else np.zeros(3)
        if not line.is_leg:
            arrows.append(_arrow("drive", joint.name, line.place, line.place + along, f"actuator {words}"))
        elif force > 0:  # an arrow of a push ends at the platform joint, an arrow of a pull begins there
            arrows.append(_arrow("push", joint.name, line.place - along, line.place, f"leg {words}"))
        else:
            arrows.append(_arrow("pull", joint.name, line.place, line.place + along, f"leg {words}"))
    torques = ", ".join(
        f"{joint.name} {force:+.4g} {units.label(dimension_of_force(joint))}"
        for joint, force in zip(joints, held.forces.tolist(), strict=True)
        if joint.name not in lines
    )
    more = "" if len(cases) == 1 else f", the first of {len(cases)}"
    scales = [f"longest arrow {largest:.4g} {units.label(Dimension.FORCE)}"] if largest > 0 else []
    scales += [f"longest with two heads {turning:.4g} {units.label(Dimension.TORQUE)}"] if turning > 0 else []
    of_scales = f": {', '.join(scales)}" if scales else ""
    whole = load_words(held.name)
    shown = " and ".join(part.words for part in given if part.force.any() or part.moment.any()) or whole
    under = "" if shown == whole else f", actuator forces under {whole}"
    words = f"{shown}{under}{more}{of_scales}{_any_words(held)}"
    return DrawnForces(tuple(each for each in arrows if np.ptp(each.ends, axis=0).any()), words, torques)


def _arrow(
    kind: Literal["load", "moment", "push", "pull", "drive"],
    name: str,
    start: FloatArray,
    end: FloatArray,
    words: str,
) -> ForceArrow:
    return ForceArrow(kind, name, frozen_array(np.stack([start, end]), (2, 3)), words)


def _norm(vector: FloatArray) -> float:
    return float(np.linalg.norm(vector))


def _any_words(held: HeldLoad) -> str:
    """Return the note on actuator forces under a load of any direction; empty for other loads."""
    return (
        ", largest actuator forces over all directions"
        if any(each.smallest != each.largest for each in held.actuators)
        else ""
    )


class _Part(NamedTuple):
    """Load of a load case in the world frame: point (3,), force (3,) and moment (3,) about the point."""

    name: str
    words: str
    point: FloatArray
    force: FloatArray
    moment: FloatArray


def _parts(case: LoadCase, state: RobotState) -> Iterator[_Part]:
    """Yield the loads of a load case."""
    for load, sign in case.parts:
        turn = state.rotation if load.in_platform else np.eye(3)
        force = sign * (turn @ np.array(load.force) + load.mass * np.array(case.gravity))
        point = state.position + state.rotation @ np.array(load.point)
        words = f"weight of {load.name}" if load.mass else load_words(load.name)
        yield _Part(load.name, words, point, force, sign * (turn @ np.array(load.moment)))


class _Line(NamedTuple):
    """Line of action of an actuator's force: point (3,) for the arrow, and unit direction (3,)."""

    place: FloatArray
    direction: FloatArray
    is_leg: bool


def _legs(nlp: Nlp, x: FloatArray, pose: int) -> dict[str, _Line]:
    """Return the lines of action of straight legs, with their platform joints, by actuator."""
    base, span = legs_at(nlp, x, pose)
    limbs = [leg.name for leg in nlp.program.model.legs]
    return {
        joint.name: _Line(base[k] + span[k], span[k] / _norm(span[k]), is_leg=True)
        for joint in driven_joints(nlp.program.model)
        for k, limb in enumerate(limbs)
        if limb == joint.limb
    }


def _slides(model: Model, posture: Posture) -> dict[str, _Line]:
    """Return the lines of action of actuated slides by actuator, for limbs with actuated slides only."""
    found = {}
    for limb in model.limbs:
        joints = [joint for joint in driven_joints(model) if joint.limb == limb]
        driven = [k for k, each in enumerate(model.scene.joints) if each.limb == limb and each.is_actuated]
        if len(joints) == len(driven) and all(model.scene.joints[k].kind is JointKind.PRISMATIC for k in driven):
            for joint, k in zip(joints, driven, strict=True):
                place, direction = posture.joints[k]
                found[joint.name] = _Line(place, direction, is_leg=False)
    return found
