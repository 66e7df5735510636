"""Joints and closures of a description as elementary joints between bodies, in world coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ....models.arrays import FloatArray
from ....models.mechanism import MechanismJoint
from ....models.mechanism.graph import ElementaryKind
from ....models.mechanism.topology import Classes
from .description import Closing, Description, LoopClosure

#: Distance, relative to the robot's size, below which points coincide: rounding of values with nine digits.
SAME_POINT = 1e-9


def elements_of(given: Description, size: float) -> list[MechanismJoint]:
    """Return all elementary joints of a description.

    A coupling of a single joint fixes the joint. Two spherical closures between the same bodies are a hinge, and three
    are a rigid connection.

    Args:
        given: the description.
        size: characteristic size of the robot, length.
    """
    held = {each.factors[0][0] for each in given.couplings if len(each.factors) == 1}
    joints = [replace(joint, kind="weld", axis=np.zeros(3)) if joint.name in held else joint for joint in given.joints]
    closing = [each for closure in given.closures for each in _closing_joints(given, closure)]
    return _with_hinges(joints, closing, size)


def _closing_joints(given: Description, closure: LoopClosure) -> list[MechanismJoint]:
    """Return the elementary joints of a closure, with a massless body between two of them."""
    A = given.place_of(closure.first) @ closure.first_frame
    B = given.place_of(closure.second) @ closure.second_frame
    none, z, other = np.zeros(3), A.rotation[:, 2], B.rotation[:, 2]
    parts: dict[Closing, list[tuple[ElementaryKind, FloatArray]]] = {
        Closing.BALL: [("S", none)],
        Closing.WELD: [("weld", none)],
        Closing.HINGE: [("R", z)],
        Closing.SLIDE: [("P", z)],
        Closing.CYLINDER: [("R", z), ("P", z)],
        Closing.UNIVERSAL: [("R", z), ("R", other)],
    }
    written = parts[closure.closing]
    is_one = len(written) == 1
    bodies = [closure.first, *([] if is_one else [f"{closure.name} cross"]), closure.second]
    names = [closure.name] if is_one else [f"{closure.name} {k + 1}" for k in range(len(written))]
    return [
        MechanismJoint(name, kind, bodies[k], bodies[k + 1], A.position, axis)
        for k, (name, (kind, axis)) in enumerate(zip(names, written, strict=True))
    ]


def rigid_groups(joints: Sequence[MechanismJoint], bodies: list[str]) -> dict[str, str]:
    """Return the representative of each body: the first body of its rigid group."""
    groups, order = Classes(bodies), {name: k for k, name in enumerate(bodies)}
    for each in joints:
        if each.kind == "weld":
            one, other = sorted((groups.find(each.inner), groups.find(each.outer)), key=order.__getitem__)
            groups.merge(other, one)
    return {name: groups.find(name) for name in bodies}


def bodies_of(given: Description, joints: Sequence[MechanismJoint]) -> list[str]:
    """Return the names of all bodies, including massless bodies between the elementary joints of a closure."""
    names = [body.name for body in given.bodies]
    return list(dict.fromkeys([*names, *(name for each in joints for name in (each.inner, each.outer))]))


def _with_hinges(joints: list[MechanismJoint], closing: list[MechanismJoint], size: float) -> list[MechanismJoint]:
    """Return the joints, with several spherical closures between the same rigid bodies merged into one joint."""
    both = [*joints, *closing]
    leader = rigid_groups(both, list(dict.fromkeys(name for each in both for name in (each.inner, each.outer))))
    pairs: dict[frozenset[str], list[MechanismJoint]] = {}
    for each in closing:
        if each.kind == "S":
            pairs.setdefault(frozenset((leader[each.inner], leader[each.outer])), []).append(each)
    replaced: dict[str, MechanismJoint | None] = {}
    for balls in pairs.values():
        if len(balls) > 1:
            replaced |= {each.name: None for each in balls[1:]} | {balls[0].name: _joined(balls, size)}
    return [new for each in both if (new := replaced.get(each.name, each)) is not None]


def _joined(balls: list[MechanismJoint], size: float) -> MechanismJoint:
    """Return the joint equivalent to several spherical joints between two bodies: spherical, hinge or rigid."""
    first = balls[0]
    apart = [each.point - first.point for each in balls[1:]]
    longest = max(apart, key=lambda way: float(np.linalg.norm(way)))
    length = float(np.linalg.norm(longest))
    if length <= SAME_POINT * size:
        return first
    axis = longest / length
    straight = all(
        float(np.linalg.norm(np.cross(one - other, axis))) <= SAME_POINT * size
        for one, other in combinations([np.zeros(3), *apart], 2)
    )
    return replace(first, kind="R", axis=axis) if straight else replace(first, kind="weld")
