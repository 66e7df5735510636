"""A spanning tree of a mechanism from its base, and the constraints that close its loops.

Joints with one coordinate come into the tree first, balls where no other way reaches a link. A ball that is left
closes a loop as a point that two links share. Any other joint that is left comes into the tree as well, with a copy of
its outer link, and the copy is welded to the link: so every coordinate of the mechanism is one of the tree.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ....models import FloatArray
from ....models.mechanism import Mechanism, MechanismError, MechanismJoint, MechanismLink, topology
from ..solved.words import unique_names

#: Order in which joints come into the tree.
_WEIGHTS = {"weld": 0, "R": 1, "P": 1, "H": 1, "S": 2}


@dataclass(frozen=True, eq=False)
class Edge:
    """A joint of the tree.

    Attributes:
        joint: the joint.
        parent: name of the link on the tree's base side.
        child: the other link, or a copy of it.
        axis: (3,) direction about which the child turns, or along which it slides, by the joint's coordinate: the
            opposite one where the child is the joint's inner link.
        is_copy: whether the child is a copy.
    """

    joint: MechanismJoint
    parent: str
    child: MechanismLink
    axis: FloatArray
    is_copy: bool = False


@dataclass(frozen=True, eq=False)
class Closing:
    """A constraint that closes a loop.

    Attributes:
        name: of the joint that it closes.
        kind: ``connect`` for a point that two links share, ``weld`` for a rigid connection.
        first, second: names of the links; the first one of a weld may be a copy.
        point: (3,) the shared point, or the joint's, in the world, length.
    """

    name: str
    kind: Literal["connect", "weld"]
    first: str
    second: str
    point: FloatArray


@dataclass(frozen=True, eq=False)
class Tree:
    """A mechanism as a tree and its closings.

    Attributes:
        mechanism: the mechanism.
        edges: joints of the tree, in their order below each link.
        closings: constraints that close the loops.
    """

    mechanism: Mechanism
    edges: tuple[Edge, ...]
    closings: tuple[Closing, ...]

    @property
    def base(self) -> MechanismLink:
        """The base."""
        return self.mechanism.link(self.mechanism.base)

    def below(self, link: str) -> Iterator[Edge]:
        """Return the edges from a link to its children."""
        return (edge for edge in self.edges if edge.parent == link)


def spanning_tree(mechanism: Mechanism) -> Tree:
    """Return a spanning tree of a mechanism from its base.

    Raises:
        MechanismError: a link is not connected with the base.
    """
    links, joints = {link.name: link for link in mechanism.links}, mechanism.joints
    order = [(_WEIGHTS[joint.kind], k) for k, joint in enumerate(joints)]
    ends = [(joint.inner, joint.outer) for joint in joints]
    branches, chords = topology.spanning_tree([mechanism.base], ends, lambda k: order[k][0])
    apart = next((name for name in links if name not in {mechanism.base, *(each.child for each in branches)}), None)
    if apart is not None:
        raise MechanismError(f"link {apart}", "is not connected with the base")
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
