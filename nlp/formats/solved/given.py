"""Robots given joint by joint as mechanisms at a pose, with loops closed near the joint coordinates of the program."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ....models import Dimension, Model
from ....models.catalog import definition_of
from ....models.joints.home.chain import home_of
from ....models.joints.home.mechanisms import mechanism_at_home
from ....models.joints.written.words import read_robot
from ....models.limbjoints import LimbJoint
from ....models.mechanism import Mechanism
from ....models.mechanism.closing import ClosedMechanism, close, closed_near
from ...errors import InputError
from ...evidence.state import RobotState
from .words import ExportedJoint, RobotMechanism, extent_of, framed, joint_name, link_name, renamed, unique_names

#: Elementary joints of a joint by its type: name of the coordinate, and suffix of the elementary joint's name.
_PARTS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "U": (("first", "first"), ("second", "second")),
    "C": (("angle", "angle"), ("stroke", "stroke")),
    "Pa": (("", "a"), ("back", "back_a"), ("", "b"), ("back", "back_b")),
}
#: Largest difference of pose and joint coordinates from those of the program, radians or relative to the robot's size:
#: loops of results are closed to the solver's accuracy, and another assembly mode differs by order 1.
_SAME = 1e-6

_RODS = (
    "A parallelogram has two rods with a hinge at each end. The distance between the rods, a fifth of their length, is"
    " an assumption: the robot file does not define it, and the motion of the platform does not depend on it."
)
_DRIVEN_ROD = (
    "In results, the rate of an actuated parallelogram is a length; the rate of its hinge is an angle: this length"
    " divided by the length of the rod."
)


class GivenRobot(NamedTuple):
    """Robot given joint by joint, at a pose of its program.

    Attributes:
        model: the robot.
        state: dimensions and pose of the robot.
        joints: joints of the robot.
        coordinates: known joint coordinates from home, by label and part of a joint, such as ``("2:3", "first")``.
    """

    model: Model
    state: RobotState
    joints: tuple[LimbJoint, ...]
    coordinates: Mapping[tuple[str, str], float]


def given_mechanism(robot: GivenRobot) -> RobotMechanism:
    """Return a robot given joint by joint as a mechanism at its pose.

    Raises:
        InputError: the actuators do not move the robot from home to the pose and the joint coordinates.
        MechanismError: the loops cannot be closed at the pose.
    """
    home = home_of(read_robot(definition_of(robot.model)))
    has_networks = home.graph is not None and bool(home.graph.networks)
    angles = {name for name, each in home.words.dimensions.items() if each.kind is Dimension.ANGLE}
    numbers = {name: float(value.item()) for name, value in robot.state.parameters.items()}
    values = {name: math.degrees(value) if name in angles else value for name, value in numbers.items()}
    # Limbs have the same names in robot files with limbs and with links.
    at_home = mechanism_at_home(home if has_networks else replace(home, graph=None), values)
    size = extent_of(at_home)
    words = _words(robot, at_home, by_name=has_networks)
    closed = _closed(robot, at_home, words, size)
    found = closed.mechanism if has_networks else framed(closed.mechanism, closed.coordinates, size)
    found = renamed(found, {} if has_networks else _link_names(at_home, words))
    joints = tuple(replace(joint, name=each.name) for joint, each in zip(found.joints, words, strict=True))
    exported = tuple(
        replace(each, coordinate=closed.coordinates.get(joint.name))
        for each, joint in zip(words, at_home.joints, strict=True)
    )
    mechanism = replace(found, name=robot.model.name, joints=joints)
    return RobotMechanism(mechanism, exported, size, _notes(robot, exported))


def _closed(robot: GivenRobot, at_home: Mechanism, words: Sequence[ExportedJoint], size: float) -> ClosedMechanism:
    """Return the mechanism with closed loops at the solved pose.

    The loops are closed near the solved joint coordinates, or else by moving the actuators from home.
    """
    wanted = {}
    for joint, each in zip(at_home.joints, words, strict=True):
        value = robot.coordinates.get((each.label, each.part))
        if value is not None and joint.kind != "S":
            wanted[joint.name] = value / (each.lever or 1.0)
    near = closed_near(at_home, wanted, robot.state.position, robot.state.rotation)
    if near is not None and _apart(robot, near, wanted, size) <= _SAME:
        return near
    driven = {joint.name: wanted[joint.name] for joint in at_home.joints if joint.actuated and joint.name in wanted}
    found = close(at_home, actuators=driven)
    if not _apart(robot, found, wanted, size) <= _SAME:
        fault = "its actuator coordinates lead from home to another assembly mode or pose than that of the result"
        raise InputError(f"robot {robot.model.name!r} cannot be exported: {fault}")
    return found


def _apart(robot: GivenRobot, closed: ClosedMechanism, wanted: Mapping[str, float], size: float) -> float:
    """Return the largest difference from the solved pose and joint coordinates, in radians or relative to the size."""
    found = closed.mechanism
    platform = found.link(found.platform)
    apart = [
        np.abs(platform.rotation - robot.state.rotation).max(),
        np.abs(platform.position - robot.state.position).max() / size,
    ]
    for joint in found.joints:
        if joint.name in wanted:
            difference = closed.coordinates[joint.name] - wanted[joint.name]
            apart.append(abs(math.remainder(difference, math.tau) if joint.kind == "R" else difference / size))
    return float(max(apart))


def _words(robot: GivenRobot, at_home: Mechanism, *, by_name: bool) -> list[ExportedJoint]:
    """Return the elementary joints of a mechanism with their names in the robot file, without coordinates.

    Args:
        robot: the robot.
        at_home: mechanism of the robot in the home configuration.
        by_name: If true, joints of the mechanism have the names of the robot file; if false, labels such as ``2:3``.
    """
    places = {joint.name: joint.point for joint in at_home.joints}
    known: dict[str, ExportedJoint] = {}
    driven: dict[str, list[str]] = {}
    for each in robot.joints:
        key = each.name if by_name else each.label
        parts = _PARTS.get(each.type, (("", ""),))
        names = [f"{key}.{k + 1}" for k in range(len(parts))] if len(parts) > 1 else [key]
        is_way = each.type == "Pa" and any(one.dimension is Dimension.LENGTH for one in each.coordinates)
        lever = float(np.linalg.norm(places[names[1]] - places[names[0]])) if is_way else None
        for k, (name, (part, end)) in enumerate(zip(names, parts, strict=True)):
            new = name if by_name else joint_name(each.label, end)
            known[name] = ExportedJoint(new, each.label, part, lever=lever, follows=each.type == "Pa" and k > 0)
        driven.setdefault(each.limb, []).extend(names)
    actuators = _actuators(robot, at_home, driven)
    found = [known.get(joint.name, ExportedJoint(joint.name, joint.name)) for joint in at_home.joints]
    names = unique_names(each.name for each in found)
    return [
        replace(each, name=name, actuator=actuators.get(joint.name, ""))
        for each, name, joint in zip(found, names, at_home.joints, strict=True)
    ]


def _actuators(robot: GivenRobot, at_home: Mechanism, limbs: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Return the actuator name of each actuated joint; joints and actuators of a limb are in the same order."""
    driven = {joint.name for joint in at_home.joints if joint.actuated}
    found: dict[str, str] = {}
    for limb, joints in limbs.items():
        names = [each.name for each in robot.model.actuators if each.limb == limb]
        found |= dict(zip((joint for joint in joints if joint in driven), names, strict=True))
    return found


def _link_names(at_home: Mechanism, words: Sequence[ExportedJoint]) -> dict[str, str]:
    """Return the name of each link, from the first joint that leads to it; parallelogram rods keep their suffix."""
    found: dict[str, str] = {}
    for joint, each in zip(at_home.joints, words, strict=True):
        is_shared = each.name.endswith("_back_a")
        found.setdefault(joint.outer, link_name(each.name.removesuffix("_a") if is_shared else each.name))
    return found


def _notes(robot: GivenRobot, words: Sequence[ExportedJoint]) -> tuple[str, ...]:
    """Return notes on parallelograms."""
    notes = [_RODS] if any(each.type == "Pa" for each in robot.joints) else []
    return (*notes, *([_DRIVEN_ROD] if any(each.actuator and each.lever for each in words) else []))
