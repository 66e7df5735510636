"""Robots with straight legs as mechanisms at a pose.

A leg with only a force becomes a universal joint at the base, a prismatic joint and a spherical joint at the platform.
The axes of the universal joint are an assumption: the first is normal to the leg and to the z axis of the base, the
second is normal to the first and to the leg. A leg with a force and a couple, as in a 3-UPU, becomes U, P and U: the
axes on the platform are those of the robot; those on the base are parallel to them, which makes the couple pure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....models import Body, FloatArray, Model, WrenchKind
from ....models.mechanism import Mechanism, MechanismJoint, MechanismLink
from ....models.mechanism.graph import ElementaryKind
from ...errors import InputError
from .words import ExportedJoint, RobotMechanism, extent_of, framed, joint_name, link_name, unique_names

#: Sine of the angle below which a leg and the z axis are parallel.
_PARALLEL = 1e-9

_UPS = (
    "Legs are U, P and S joints. The model of the robot has only lines between joint centres, so the axes of each U are"
    " assumptions: the first one is fixed to the base, normal to the leg and to the z axis of the base at this pose;"
    " the second one is normal to the first one and to the leg."
)
_UPU = (
    "Limbs are U, P and U joints. The axes on the platform are those of the model. The model does not define the axes"
    " on the base, which are assumed to be parallel to those on the platform at this pose."
)


@dataclass(frozen=True, eq=False)
class PosedLeg:
    """Leg at a pose, in the world frame.

    Attributes:
        name: name of the limb.
        base: (3,) centre of the base joint, length.
        platform: (3,) centre of the platform joint, length.
        axes: (3,) each, axes of the upper universal joint, the one on the platform first; empty for a spherical joint.
    """

    name: str
    base: FloatArray
    platform: FloatArray
    axes: tuple[FloatArray, ...] = ()


def check_legs(model: Model) -> None:
    """Refuse a robot given by its rows if not all of them belong to straight legs.

    Raises:
        InputError: a limb is not a straight leg, or its rows are neither a force nor a force and a couple.
    """
    kinds: dict[str, list[WrenchKind]] = {leg.name: [] for leg in model.legs}
    drawn: Mapping[str, int] = {name: len(axes_of(model, name)) for name in kinds}
    for row in model.rows:
        kinds.setdefault(row.limb, []).append(row.kind)
    for limb, found in kinds.items():
        is_leg = limb in drawn and found == [WrenchKind.FORCE]
        is_limb = limb in drawn and found == [WrenchKind.FORCE, WrenchKind.COUPLE] and drawn[limb] == 2
        if not (is_leg or is_limb):
            fault = "the joints of its limbs are not known; use a robot with straight legs, or a robot file"
            raise InputError(f"robot {model.name!r} cannot be exported: {fault}")


def axes_of(model: Model, limb: str) -> list[int]:
    """Return the indices of the platform joint axes of a limb among the directions of the drawing."""
    return [k for k, each in enumerate(model.scene.directions) if each.limb == limb and each.body is Body.PLATFORM]


def leg_mechanism(name: str, legs: Sequence[PosedLeg], rotation: FloatArray, position: FloatArray) -> RobotMechanism:
    """Return legs at a pose as a mechanism.

    Args:
        name: name of the robot.
        legs: legs at the pose.
        rotation: (3, 3) rotation ``R`` of the pose, from platform to world coordinates.
        position: (3,) position ``p`` of the pose, length.

    Raises:
        InputError: a leg has zero length.
    """
    steps = [step for leg in legs for step in _steps(leg)]
    names = unique_names(joint_name(step.label, step.part) for step in steps)
    words, joints, links, inner = [], [], [], "base"
    for k, (step, called) in enumerate(zip(steps, names, strict=True)):
        is_last = k + 1 == len(steps) or steps[k + 1].leg != step.leg
        outer = "platform" if is_last else link_name(called)
        links += [] if is_last else [MechanismLink(outer)]
        is_slide = step.kind == "P"
        joints.append(MechanismJoint(called, step.kind, inner, outer, step.point, step.axis, actuated=is_slide))
        words.append(ExportedJoint(called, step.label, step.part, step.leg if is_slide else ""))
        inner = "base" if is_last else outer
    platform = MechanismLink("platform", position, rotation)
    mechanism = Mechanism(name, (MechanismLink("base"), *links, platform), tuple(joints), "base", "platform")
    size, note = extent_of(mechanism), _UPU if any(leg.axes for leg in legs) else _UPS
    return RobotMechanism(framed(mechanism, {}, size), tuple(words), size, (note,))


class _Step(NamedTuple):
    """Elementary joint of a leg: name of the leg, label of the joint, its part, its kind, centre and axis."""

    leg: str
    label: str
    part: str
    kind: ElementaryKind
    point: FloatArray
    axis: FloatArray


def _steps(leg: PosedLeg) -> tuple[_Step, ...]:
    """Return the joints of a leg, from the base on."""
    span = leg.platform - leg.base
    length = float(np.linalg.norm(span))
    if not length > 0:
        raise InputError(f"limb {leg.name!r} cannot be exported: it has zero length, so it has no direction")
    along = span / length

    def step(number: int, part: str, kind: ElementaryKind, point: FloatArray, axis: FloatArray) -> _Step:
        return _Step(leg.name, f"{leg.name}:{number}", part, kind, point, axis)

    slide = step(2, "", "P", leg.base, along)
    if leg.axes:
        outer, inner = (axis / np.linalg.norm(axis) for axis in leg.axes)
        return (
            step(1, "first", "R", leg.base, outer),
            step(1, "second", "R", leg.base, inner),
            slide,
            step(3, "first", "R", leg.platform, inner),
            step(3, "second", "R", leg.platform, outer),
        )
    first = np.cross([0.0, 0.0, 1.0], along)
    sine = float(np.linalg.norm(first))
    first = np.array([1.0, 0.0, 0.0]) if sine < _PARALLEL else first / sine
    return (
        step(1, "first", "R", leg.base, first),
        step(1, "second", "R", leg.base, np.cross(along, first)),
        slide,
        step(3, "", "S", leg.platform, np.zeros(3)),
    )
