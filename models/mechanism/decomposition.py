"""A mechanism's graph taken apart into limbs: serial chains from base to platform, and branches behind a driven stem.

The symbolic form of robots given joint by joint has these. Parts of another shape are left over, each with the reason.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .topology import Classes, parts


class GraphJoint(NamedTuple):
    """A joint in the graph.

    Attributes:
        one, other: names of its links.
        is_actuated: whether an actuator drives it.
        is_weld: whether it makes one body of its links.
    """

    one: str
    other: str
    is_actuated: bool = False
    is_weld: bool = False


class Step(NamedTuple):
    """A joint of a chain: its index, and whether its first link is on the base's side."""

    joint: int
    is_outward: bool


@dataclass(frozen=True)
class LimbPaths:
    """A limb: joints of the stem from the base on, and of each branch; one branch where the limb is serial."""

    stem: tuple[Step, ...]
    branches: tuple[tuple[Step, ...], ...]


@dataclass(frozen=True)
class Network:
    """Joints between base and platform that are no limb with branches, and the reason, as a clause."""

    joints: tuple[int, ...]
    reason: str


@dataclass(frozen=True)
class Decomposition:
    """A graph as limbs.

    Attributes:
        limbs: in the order of their first joints.
        networks: other parts that join base and platform.
        idle: joints that join nothing to the platform: on dangling links, or on loops of the base alone.
    """

    limbs: tuple[LimbPaths, ...]
    networks: tuple[Network, ...]
    idle: tuple[int, ...]


def decompose(
    base: str, platform: str, joints: Sequence[GraphJoint], couplings: Sequence[Collection[int]] = ()
) -> Decomposition:
    """Return a graph as limbs, and as networks where it is none.

    Args:
        base: name of the base.
        platform: name of the platform.
        joints: between links.
        couplings: indices of the joints of each coupling, which belong together.
    """
    welded = Classes([name for joint in joints for name in (joint.one, joint.other)] + [base, platform])
    for joint in joints:
        if joint.is_weld:
            welded.merge(joint.one, joint.other)
    ends = [(welded.find(joint.one), welded.find(joint.other)) for joint in joints]
    root, top = welded.find(base), welded.find(platform)
    moving = [k for k, joint in enumerate(joints) if not joint.is_weld and ends[k][0] != ends[k][1]]
    coupled = {k for coupling in couplings for k in coupling}
    limbs: list[LimbPaths] = []
    networks: list[Network] = []
    used: set[int] = set()
    for own in _parts(ends, moving, (root, top), couplings):
        kept = without_dangling(ends, own, (root, top), coupled)
        nodes = {node for k in kept for node in ends[k]}
        if not {root, top} <= nodes:
            continue
        used |= set(kept)
        if coupled & set(kept):
            networks.append(Network(tuple(kept), "its joints are coupled"))
            continue
        found = _limb(ends, kept, joints, (root, top))
        if isinstance(found, LimbPaths):
            limbs.append(found)
        else:
            networks.append(Network(tuple(kept), found))
    idle = tuple(k for k in moving if k not in used)
    return Decomposition(tuple(limbs), tuple(networks), idle)


def _parts(
    ends: Sequence[tuple[str, str]], moving: Sequence[int], roots: tuple[str, str], couplings: Sequence[Collection[int]]
) -> list[list[int]]:
    """Return the joints in parts that share links other than base and platform, or a coupling."""
    edges = [ends[k] for k in moving]
    nodes = list(dict.fromkeys(node for edge in edges for node in edge if node not in roots))
    part_of = {node: number for number, part in enumerate(parts(nodes, edges)) for node in part}
    names = Classes([str(k) for k in moving])
    by_part: dict[int, int] = {}
    for k in moving:
        for node in ends[k]:
            if node in part_of:
                names.merge(str(k), str(by_part.setdefault(part_of[node], k)))
    for coupling in couplings:
        own = [k for k in coupling if k in moving]
        for k in own[1:]:
            names.merge(str(k), str(own[0]))
    groups: dict[str, list[int]] = {}
    for k in moving:
        groups.setdefault(names.find(str(k)), []).append(k)
    return list(groups.values())


def without_dangling(
    ends: Sequence[tuple[str, str]], own: Sequence[int], roots: tuple[str, str], coupled: Collection[int]
) -> list[int]:
    """Return joints without those of links that hang on one joint alone, again and again."""
    kept = list(own)
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
    ends: Sequence[tuple[str, str]], own: Sequence[int], joints: Sequence[GraphJoint], roots: tuple[str, str]
) -> LimbPaths | str:
    """Return the joints of a part as a limb, or the reason why they are none."""
    root, top = roots
    first = [k for k in own if root in ends[k]]
    if len(first) > 1:
        return f"{len(first)} of its joints are on the base, and share links before the platform"
    left = list(own)

    def walk(node: str, steps: list[Step]) -> tuple[str, list[int]]:
        """Follow a chain from a node; return the node where it ends or splits, and the joints that go on from it."""
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
        if k not in left:  # the branch before has come back to the node by it
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
