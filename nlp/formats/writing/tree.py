"""Spanning tree of a mechanism from its base, and constraints that close its loops.

Joints with one coordinate are preferred to spherical joints. A spherical joint outside of the tree closes a loop by a
common point of two links. Any other joint outside of the tree is added with a copy of its outer link, and the copy is
welded to the link, so that the tree has every joint coordinate of the mechanism.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism, MechanismError, MechanismJoint, MechanismLink, topology
from ..solved.words import unique_names

#: Order in which joints are added to the tree, by kind.
_WEIGHTS = {"weld": 0, "R": 1, "P": 1, "H": 1, "S": 2}


@dataclass(frozen=True, eq=False)
class Edge:
    """Joint of the spanning tree.

    Attributes:
        joint: joint of the mechanism.
        parent: name of the link on the base side of the tree.
        child: other link of the joint, or a copy of this link.
        axis: (3,) axis of rotation or direction of translation of the child for a positive joint coordinate; opposite
            to the joint's axis if the child is the joint's inner link.
        is_copy: True if the child is a copy of a link.
    """

    joint: MechanismJoint
    parent: str
    child: MechanismLink
    axis: FloatArray
    is_copy: bool = False


@dataclass(frozen=True, eq=False)
class Closing:
    """Constraint that closes a loop.

    Attributes:
        name: name of the joint at which the loop is closed.
        kind: ``connect`` for a common point of two links, ``weld`` for a rigid connection.
        first: name of the first link; for a weld, it may be a copy of a link.
        second: name of the second link.
        point: (3,) common point, or centre of the joint, in the world frame, length.
    """

    name: str
    kind: Literal["connect", "weld"]
    first: str
    second: str
    point: FloatArray


@dataclass(frozen=True, eq=False)
class Tree:
    """Spanning tree of a mechanism.

    Attributes:
        mechanism: the mechanism.
        edges: joints of the tree, in the order of the children of each link.
        closings: constraints that close the loops.
    """

    mechanism: Mechanism
    edges: tuple[Edge, ...]
    closings: tuple[Closing, ...]

    @property
    def base(self) -> MechanismLink:
        """Base link."""
        return self.mechanism.link(self.mechanism.base)

    def below(self, link: str) -> Iterator[Edge]:
        """Return the edges from a link to its children."""
        return (edge for edge in self.edges if edge.parent == link)


def spanning_tree(mechanism: Mechanism) -> Tree:
    """Return the spanning tree of a mechanism from its base.

    Raises:
        MechanismError: a link is not connected to the base.
    """
    links, joints = {link.name: link for link in mechanism.links}, mechanism.joints
    order = [(_WEIGHTS[joint.kind], k) for k, joint in enumerate(joints)]
    ends = [(joint.inner, joint.outer) for joint in joints]
    branches, chords = topology.spanning_tree([mechanism.base], ends, lambda k: order[k][0])
    apart = next((name for name in links if name not in {mechanism.base, *(each.child for each in branches)}), None)
    if apart is not None:
        raise MechanismError(f"link {apart}", "is not connected to the base by joints")
    edges = [
        Edge(joints[k], parent, links[child], joints[k].axis if joints[k].inner == parent else -joints[k].axis)
        for k, parent, child in sorted(branches, key=lambda each: order[each.edge])
    ]
    closings = []
    for joint in (joints[k] for k in chords):
        if joint.kind == "S":
            closings.append(Closing(joint.name, "connect", joint.outer, joint.inner, joint.point))
        elif joint.kind == "weld":
            closings.append(Closing(joint.name, "weld", joint.outer, joint.inner, joint.point))
        else:
            copy = replace(links[joint.outer], name=unique_names([f"end_of_{joint.name}"], links)[0])
            edges.append(Edge(joint, joint.inner, copy, np.array(joint.axis), is_copy=True))
            closings.append(Closing(joint.name, "weld", copy.name, joint.outer, joint.point))
    return Tree(mechanism, tuple(edges), tuple(closings))
