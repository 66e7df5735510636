"""Decomposition of a mechanism's graph: limbs, and members that resist the platform with locked actuators.

Limbs of robots given joint by joint are serial chains from base to platform, or branches after an actuated stem. Parts
of another shape become networks, each with the reason.

For members, links are merged if a locked joint, a weld, or a joint fixed by couplings connects them. Without base and
platform, each connected part of the rest is a member; so is a joint directly between base and platform. Coupled joints
belong to one member. A part that is connected in this way with unlocked actuators is called a *limb*; it may have any
shape. Links with a single joint are left out.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .graph import Mechanism
from .topology import Classes, parts


class GraphJoint(NamedTuple):
    """Joint of a mechanism as an edge of its graph.

    Attributes:
        one, other: names of the links of the joint.
        is_actuated: True if an actuator drives the joint.
        is_weld: True if the joint is rigid.
    """

    one: str
    other: str
    is_actuated: bool = False
    is_weld: bool = False


class Step(NamedTuple):
    """Joint of a chain: index, and True if its first link is on the base side."""

    joint: int
    is_outward: bool


@dataclass(frozen=True)
class LimbPaths:
    """Limb: joints of the stem from the base on, and of each branch; one branch for a serial limb."""

    stem: tuple[Step, ...]
    branches: tuple[tuple[Step, ...], ...]


@dataclass(frozen=True)
class Network:
    """Joints between base and platform that do not form a limb with branches, with the reason as a clause."""

    joints: tuple[int, ...]
    reason: str


@dataclass(frozen=True)
class Decomposition:
    """Decomposition of a graph into limbs and networks.

    Attributes:
        limbs: limbs in the order of their first joints.
        networks: parts between base and platform that are not limbs.
    """

    limbs: tuple[LimbPaths, ...]
    networks: tuple[Network, ...]


def decompose(
    base: str, platform: str, joints: Sequence[GraphJoint], couplings: Sequence[Collection[int]] = ()
) -> Decomposition:
    """Return the limbs of a graph, and its other parts as networks.

    Args:
        base: name of the base.
        platform: name of the platform.
        joints: joints between links.
        couplings: indices of the joints of each coupling, which belong together.
    """
    names = [name for joint in joints for name in (joint.one, joint.other)] + [base, platform]
    welded = Classes(names, [(joint.one, joint.other) for joint in joints if joint.is_weld])
    ends = [(welded.find(joint.one), welded.find(joint.other)) for joint in joints]
    root, top = welded.find(base), welded.find(platform)
    moving = [k for k, joint in enumerate(joints) if not joint.is_weld and ends[k][0] != ends[k][1]]
    coupled = {k for coupling in couplings for k in coupling}
    limbs: list[LimbPaths] = []
    networks: list[Network] = []
    for own in _joined(ends, moving, (root, top), couplings):
        kept = without_dangling(ends, own, (root, top), coupled)
        nodes = {node for k in kept for node in ends[k]}
        if not {root, top} <= nodes:
            continue
        if coupled & set(kept):
            networks.append(Network(tuple(kept), "its joints are coupled"))
            continue
        found = _limb(ends, kept, joints, (root, top))
        if isinstance(found, LimbPaths):
            limbs.append(found)
        else:
            networks.append(Network(tuple(kept), found))
    return Decomposition(tuple(limbs), tuple(networks))


def _joined(
    ends: Sequence[tuple[str, str]], joints: Sequence[int], roots: tuple[str, str], couplings: Sequence[Collection[int]]
) -> list[list[int]]:
    """Return groups of joints with common links other than base and platform, or with a coupling."""
    # Nodes are joints here; edges connect joints that share a link or a coupling.
    edges: list[tuple[int, int]] = []
    first: dict[str, int] = {}
    for k in joints:
        edges += [(k, first.setdefault(node, k)) for node in ends[k] if node not in roots]
    for coupling in couplings:
        coupled = [k for k in coupling if k in joints]
        edges += [(k, coupled[0]) for k in coupled[1:]]
    return parts(joints, edges)


def without_dangling(
    ends: Sequence[tuple[str, str]], joints: Sequence[int], roots: tuple[str, str], coupled: Collection[int]
) -> list[int]:
    """Remove links with a single joint, repeatedly, and return the remaining joints."""
    kept = list(joints)
    while True:
        count: dict[str, int] = {}
        for k in kept:
            for node in ends[k]:
                count[node] = count.get(node, 0) + 1
        loose = [
            k for k in kept if k not in coupled and any(count[node] == 1 and node not in roots for node in ends[k])
        ]
        if not loose:
            return kept
        kept = [k for k in kept if k not in loose]


def _limb(
    ends: Sequence[tuple[str, str]], part: Sequence[int], joints: Sequence[GraphJoint], roots: tuple[str, str]
) -> LimbPaths | str:
    """Return a connected part of the graph as a limb, or the reason why it is not a limb."""
    root, top = roots
    first = [k for k in part if root in ends[k]]
    if len(first) > 1:
        return f"{len(first)} of its joints are on the base and share links before the platform"
    left = list(part)

    def walk(node: str, steps: list[Step]) -> tuple[str, list[int]]:
        """Follow a chain from a node; return its last node, where it ends or splits, and the next joints."""
        while node != top:
            following = [k for k in left if node in ends[k]]
            if len(following) != 1:
                return node, following
            (k,) = following
            left.remove(k)
            steps.append(Step(k, ends[k][0] == node))
            node = ends[k][1] if ends[k][0] == node else ends[k][0]
        return node, []

    stem: list[Step] = []
    node, following = walk(root, stem)
    if node == top:
        return LimbPaths((), (tuple(stem),))
    branches = []
    for k in following:
        if k not in left:  # the branch before returned to the node by this joint
            return "its links form a loop of their own"
        left.remove(k)
        branch = [Step(k, ends[k][0] == node)]
        end, _ = walk(ends[k][1] if ends[k][0] == node else ends[k][0], branch)
        if end != top:
            return "its links form a loop of their own"
        branches.append(tuple(branch))
    if not all(joints[step.joint].is_actuated for step in stem):
        return "a passive joint is before its branches"
    return LimbPaths(tuple(stem), tuple(branches))


@dataclass(frozen=True)
class MemberGraph:
    """Member of a mechanism, by the joints of its graph.

    Attributes:
        limb: number of the member's limb, from 0.
        passive: indices of the joints that move with locked actuators.
        joints: indices of all joints on which the member's motions with unlocked actuators depend: those of the limb
            without the passive joints of other members.
        on_platform: indices of the passive joints on the platform, or on a link locked to it.
    """

    limb: int
    passive: tuple[int, ...]
    joints: tuple[int, ...]
    on_platform: tuple[int, ...]


@dataclass(frozen=True)
class RobotGraph:
    """Members and limbs of a mechanism.

    Attributes:
        members: members between base and platform with locked actuators.
        limbs: joint indices of each limb between base and platform with unlocked actuators.
        still: indices of the joints that locked actuators and couplings fix.
    """

    members: tuple[MemberGraph, ...]
    limbs: tuple[tuple[int, ...], ...]
    still: tuple[int, ...]


def robot_graph(mechanism: Mechanism) -> RobotGraph:
    """Return the members and limbs of a mechanism.

    If only locked actuators connect base and platform, each limb is one member.
    """
    joints = mechanism.joints
    names = [link.name for link in mechanism.links]
    index = {joint.name: k for k, joint in enumerate(joints)}
    couplings = [[index[name] for name, _ in coupling.factors] for coupling in mechanism.couplings]
    moving = [k for k, joint in enumerate(joints) if joint.kind != "weld"]
    welds = [(joint.inner, joint.outer) for joint in joints if joint.kind == "weld"]
    welded = Classes(names, welds)
    roots = welded.find(mechanism.base), welded.find(mechanism.platform)
    ends = [(welded.find(joint.inner), welded.find(joint.outer)) for joint in joints]
    moving = without_dangling(ends, moving, roots, {k for coupling in couplings for k in coupling})
    still = _still(mechanism, couplings)
    locked = Classes(names, [*welds, *((joints[k].inner, joints[k].outer) for k in still)])
    limbs = _members(mechanism, welded, moving, couplings)
    is_rigid = locked.find(mechanism.base) == locked.find(mechanism.platform)
    if is_rigid:
        groups = [[k for k in limb if k not in still] for limb in limbs]
        locked = welded
    else:
        groups = _members(mechanism, locked, [k for k in moving if k not in still], couplings)
    members = []
    top = locked.find(mechanism.platform)
    for number, limb in enumerate(limbs):
        own = groups if not is_rigid else [groups[number]]
        own = [group for group in own if is_rigid or set(group) <= set(limb)]
        passive = {k for group in own for k in group}
        for group in own:
            on_platform = [k for k in group if top in (locked.find(joints[k].inner), locked.find(joints[k].outer))]
            kept = tuple(k for k in limb if k not in passive or k in group)
            members.append(MemberGraph(number, tuple(group), kept, tuple(on_platform)))
    return RobotGraph(tuple(members), tuple(map(tuple, limbs)), tuple(sorted(still)))


def _still(mechanism: Mechanism, couplings: Sequence[Collection[int]]) -> set[int]:
    """Return the joints that are fixed with locked actuators, including those that couplings fix."""
    found = {k for k, joint in enumerate(mechanism.joints) if joint.actuated}
    while True:
        held = {next(k for k in each if k not in found) for each in couplings if sum(k not in found for k in each) == 1}
        if not held:
            return found
        found |= held


def _members(
    mechanism: Mechanism, classes: Classes[str], joints: Sequence[int], couplings: Sequence[Collection[int]]
) -> list[list[int]]:
    """Return groups of joints between classes of links that connect base and platform."""
    roots = classes.find(mechanism.base), classes.find(mechanism.platform)
    ends = [(classes.find(joint.inner), classes.find(joint.outer)) for joint in mechanism.joints]
    groups = _joined(ends, [k for k in joints if ends[k][0] != ends[k][1]], roots, couplings)
    return [group for group in groups if set(roots) <= {node for k in group for node in ends[k]}]
