"""Members of a mechanism by its graph: the parts that resist the platform while all actuators are locked.

Lock all actuators. Links that a locked joint, a weld, or a joint that couplings hold still joins become one. Without
base and platform, each connected part of the rest is a member; so is a joint directly between base and platform. Joints
that a coupling relates belong to one member. A *limb* is the same with free actuators. Links that hang on one joint are
left out.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from .decomposition import without_dangling
from .graph import Mechanism
from .topology import Classes, parts


@dataclass(frozen=True)
class MemberGraph:
    """A member in the graph.

    Attributes:
        limb: number of the limb that it is part of, from 0.
        passive: indices of the joints that move while actuators are locked.
        joints: indices of these joints and of all others between base and platform that the member's freedoms with free
            actuators depend on: those of the limb but for the passive ones of other members.
        on_platform: indices of the passive joints on the platform, or on a link that is locked to it.
    """

    limb: int
    passive: tuple[int, ...]
    joints: tuple[int, ...]
    on_platform: tuple[int, ...]


@dataclass(frozen=True)
class LimbGraph:
    """A limb in the graph: indices of its joints, welds left out."""

    joints: tuple[int, ...]


@dataclass(frozen=True)
class RobotGraph:
    """Members and limbs of a mechanism that join its base and its platform."""

    members: tuple[MemberGraph, ...]
    limbs: tuple[LimbGraph, ...]


def robot_graph(mechanism: Mechanism) -> RobotGraph:
    """Return the members and limbs of a mechanism.

    Where locked actuators alone join base and platform, each limb is one member.
    """
    joints = mechanism.joints
    names = [link.name for link in mechanism.links]
    index = {joint.name: k for k, joint in enumerate(joints)}
    couplings = [[index[name] for name, _ in coupling.factors] for coupling in mechanism.couplings]
    welded, locked = Classes(names), Classes(names)
    moving = [k for k, joint in enumerate(joints) if joint.kind != "weld"]
    for joint in joints:
        if joint.kind == "weld":
            welded.merge(joint.inner, joint.outer)
            locked.merge(joint.inner, joint.outer)
    roots = welded.find(mechanism.base), welded.find(mechanism.platform)
    ends = [(welded.find(joint.inner), welded.find(joint.outer)) for joint in joints]
    moving = without_dangling(ends, moving, roots, {k for coupling in couplings for k in coupling})
    still = _still(mechanism, couplings)
    for k in still:
        locked.merge(joints[k].inner, joints[k].outer)
    limbs = _joined(mechanism, welded, moving, couplings)
    is_rigid = locked.find(mechanism.base) == locked.find(mechanism.platform)
    if is_rigid:
        groups = [[k for k in limb if k not in still] for limb in limbs]
        locked = welded
    else:
        groups = _joined(mechanism, locked, [k for k in moving if k not in still], couplings)
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
    return RobotGraph(tuple(members), tuple(LimbGraph(tuple(limb)) for limb in limbs))


def _still(mechanism: Mechanism, couplings: Sequence[Collection[int]]) -> set[int]:
    """Return the joints that stand still with locked actuators: these, and those that couplings then hold."""
    found = {k for k, joint in enumerate(mechanism.joints) if joint.actuated}
    while True:
        held = {next(k for k in each if k not in found) for each in couplings if sum(k not in found for k in each) == 1}
        if not held:
            return found
        found |= held


def _joined(
    mechanism: Mechanism, classes: Classes, joints: Sequence[int], couplings: Sequence[Collection[int]]
) -> list[list[int]]:
    """Return joints in groups that share a link other than base and platform, or a coupling.

    Groups that do not join base and platform are left out.
    """
    base, platform = classes.find(mechanism.base), classes.find(mechanism.platform)
    ends = {k: (classes.find(mechanism.joints[k].inner), classes.find(mechanism.joints[k].outer)) for k in joints}
    own = [k for k in joints if ends[k][0] != ends[k][1]]
    # A joint is a node here; joints that share a link, or a coupling, have an edge.
    edges: list[tuple[int, int]] = []
    first: dict[str, int] = {}
    for k in own:
        edges += [(k, first.setdefault(node, k)) for node in ends[k] if node not in (base, platform)]
    for coupling in couplings:
        coupled = [k for k in coupling if k in own]
        edges += [(k, coupled[0]) for k in coupled[1:]]
    groups = parts(own, edges)
    return [group for group in groups if {base, platform} <= {node for k in group for node in ends[k]}]
