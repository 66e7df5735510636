"""Robots with nested loops or coupled joints as mechanisms at a pose: closed from home on, along their actuators."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....models import FloatArray, Model
from ....models.joints.chain import HomeRobot
from ....models.joints.mechanisms import mechanism_at_home
from ....models.limbjoints import LimbJoint
from ....models.mechanism import Mechanism, MechanismJoint
from ....models.mechanism.closing import close
from ....models.parts import Dimension
from ...errors import InputError
from .chains import Step
from .jointchains import PARTS, clean_name

#: Largest difference of the platform's pose and of joint coordinates from those of the program, radians and parts of
#: the robot's size: results are closed to the solver's accuracy, and another assembly differs by parts of 1.
_SAME = 1e-6


class NestedMechanism(NamedTuple):
    """A mechanism at a pose, and each of its joints in the words of the robot file."""

    mechanism: Mechanism
    steps: tuple[Step, ...]


def has_networks(robot: HomeRobot) -> bool:
    """Return whether a robot has joints that are no limb with branches."""
    return robot.graph is not None and bool(robot.graph.networks)


def nested_mechanism(
    model: Model,
    robot: HomeRobot,
    parameters: Mapping[str, FloatArray],
    joints: tuple[LimbJoint, ...],
    coordinates: Mapping[tuple[str, str], float],
    pose: tuple[FloatArray, FloatArray],
) -> NestedMechanism:
    """Return a robot with nested loops at a pose of the platform.

    The loops are closed at the coordinates of the actuators, so that the platform's pose is exact to rounding where
    that of the program is to the solver's accuracy.

    Args:
        model: the robot.
        robot: the same at home.
        parameters: values (1,) of its dimensions by name, radians for angles.
        joints: as limits read them.
        coordinates: known coordinates from home by label and part of a joint.
        pose: rotation (3, 3) and position (3,) of the platform.

    Raises:
        InputError: the actuators do not lead from home to the pose and to the program's coordinates.
        MechanismError: the loops do not close there.
    """
    angles = {name for name, each in robot.words.dimensions.items() if each.kind is Dimension.ANGLE}
    values = {name: float(value.item()) for name, value in parameters.items()}
    at_home = mechanism_at_home(robot, {k: math.degrees(v) if k in angles else v for k, v in values.items()})
    known = {each.name: each for each in joints}
    places = {joint.name: joint.point for joint in at_home.joints}
    steps = {joint.name: _step(joint, known, places) for joint in at_home.joints}

    def from_home(step: Step) -> float | None:
        value = coordinates.get((step.label, step.part))
        return value if value is None or step.lever is None else value / step.lever

    driven = {joint.name: from_home(steps[joint.name]) for joint in at_home.joints if joint.actuated}
    closed = close(at_home, actuators={name: value for name, value in driven.items() if value is not None})
    found = closed.mechanism
    size = float(np.linalg.norm(np.ptp([joint.point for joint in found.joints], axis=0))) or 1.0
    platform = next(link for link in found.links if link.name == found.platform)
    apart = [np.abs(platform.rotation - pose[0]).max(), np.abs(platform.position - pose[1]).max() / size]
    for joint in found.joints:
        wanted = from_home(steps[joint.name])
        if joint.name in closed.coordinates and wanted is not None:
            apart.append(_difference(joint, closed.coordinates[joint.name], wanted, size))
    if not max(apart) <= _SAME:
        fault = "moving its actuators from home leads to another assembly or pose than the answer's"
        raise InputError(f"robot {model.name!r} cannot be exported: {fault}")
    names = _actuator_names(model, joints, [steps[name].label for name in driven])
    return NestedMechanism(
        _renamed(found),
        tuple(
            replace(
                steps[joint.name],
                actuator=names.get(steps[joint.name].label, "") if joint.actuated else "",
                coordinate=closed.coordinates.get(joint.name),
            )
            for joint in found.joints
        ),
    )


def _step(joint: MechanismJoint, known: Mapping[str, LimbJoint], places: Mapping[str, FloatArray]) -> Step:
    """Return a joint in the words of the robot file; a joint that limits do not read is called by its own name."""
    given, _, number = joint.name.partition(".")
    found = known.get(given)
    kind = "" if found is None else found.type
    parts = PARTS.get(kind, ("",))
    part = parts[int(number) - 1] if number and kind in PARTS else ("" if number in ("", "1") else f"hinge {number}")
    label = given if found is None else found.label
    lever = float(np.linalg.norm(places[f"{given}.2"] - places[f"{given}.1"])) if kind == "Pa" else None
    return Step(
        joint.name,
        label,
        given,
        part,
        joint.kind,
        joint.point,
        joint.axis,
        joint.pitch,
        joint.actuated,
        follows=part.startswith("hinge"),
        lever=lever,
    )


def _difference(joint: MechanismJoint, value: float, wanted: float, size: float) -> float:
    """Return how far two coordinates are apart: parts of the robot's size, or radians within half a turn."""
    if joint.kind == "P":
        return abs(value - wanted) / size
    return abs(math.remainder(value - wanted, math.tau)) if joint.kind == "R" else abs(value - wanted)


def _actuator_names(model: Model, joints: tuple[LimbJoint, ...], driven: list[str]) -> dict[str, str]:
    """Return the name of the actuator of each driven joint by the joint's label; both are in one order in a limb."""
    found: dict[str, str] = {}
    for limb in dict.fromkeys(each.limb for each in joints):
        labels = [each.label for each in joints if each.limb == limb and each.label in driven]
        found |= dict(zip(labels, [each.name for each in model.actuators if each.limb == limb], strict=True))
    return found


def _renamed(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism whose links have names that every format takes; its ends are ``base`` and ``platform``."""
    taken: dict[str, str] = {mechanism.base: "base", mechanism.platform: "platform"}
    for link in mechanism.links:
        if link.name not in taken:
            name = clean_name(link.name)
            while name in taken.values():
                name += "_"
            taken[link.name] = name
    links = tuple(replace(link, name=taken[link.name]) for link in mechanism.links)
    joints = tuple(replace(joint, inner=taken[joint.inner], outer=taken[joint.outer]) for joint in mechanism.joints)
    return replace(mechanism, links=links, joints=joints, base="base", platform="platform")
