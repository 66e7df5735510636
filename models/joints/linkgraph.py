"""A robot of links and joints at home: its limbs where the graph has them, and the parts that are left over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..mechanism.decomposition import GraphJoint, LimbPaths, Step, decompose
from ..mechanism.topology import bridges_between, reached
from .chain import HomeGraph, HomeRobot, Joint, Limb, LinkJoint, home_head, home_robot, joint_at_home, scalar_value
from .chain import with_points as values_with_points
from .forms import RobotError
from .words import GraphWords, RobotWords


def home_of(words: RobotWords) -> HomeRobot:
    """Return a robot at home, given by limbs or by links and joints.

    Raises:
        RobotError: an expression has a fault, or the graph is no robot.
    """
    if words.graph is None:
        return home_robot(words)
    head, graph = home_head(words), words.graph
    _check_graph(graph)
    names = values_with_points("", graph.points, head.names)
    joints = tuple(
        LinkJoint(each.name, *each.between, None if each.joint is None else joint_at_home(each.joint, names))
        for each in graph.joints
    )
    index = {joint.name: k for k, joint in enumerate(joints)}
    couplings = []
    for coupling in graph.couplings:
        factors = [
            (name, scalar_value(f"{coupling.place}, {name}", text, names)) for name, text in coupling.factors.items()
        ]
        for name, factor in factors:
            if factor.is_zero():
                raise RobotError(f"{coupling.place}, {name}", "is 0; a coupled joint needs another factor")
        couplings.append(tuple((index[name], factor) for name, factor in factors))
    found = decompose(graph.base, graph.platform, _edges(graph), [[k for k, _ in each] for each in couplings])
    if not (found.limbs or found.networks):
        raise RobotError("platform", "is joined to the base by no joint that moves")
    limbs = tuple(_limb(k, limb, joints) for k, limb in enumerate(found.limbs))
    networks = tuple((each.joints, each.reason) for each in found.networks)
    return head.with_parts(
        limbs, HomeGraph(graph.links, graph.base, graph.platform, joints, tuple(couplings), networks)
    )


def _edges(graph: GraphWords) -> list[GraphJoint]:
    """Return the joints of a graph as pairs of links."""
    return [
        GraphJoint(*each.between, each.joint is not None and each.joint.actuated, each.joint is None)
        for each in graph.joints
    ]


def _check_graph(graph: GraphWords) -> None:
    """Refuse links that nothing joins to the base, and a platform on an open chain."""
    edges = [each.between for each in graph.joints]
    joined = reached(graph.base, edges)
    for link in graph.links:
        if link not in joined:
            raise RobotError(f"links, {link}", "is joined to the base by no joint, directly or through other links")
    path = bridges_between(graph.base, graph.platform, edges)
    if path.is_open:
        names = ", ".join(graph.joints[k].name for k in path.bridges)
        raise RobotError("platform", f"is at the end of an open chain ({names}); a parallel robot has closed loops")


def _limb(number: int, limb: LimbPaths, joints: Sequence[LinkJoint]) -> Limb:
    """Return a limb of the graph."""
    stem = _chain(limb.stem, joints)
    branches = tuple(_chain(branch, joints) for branch in limb.branches)
    if len(branches) == 1:
        stem, branches = (*stem, *branches[0]), ((),)
    return Limb(str(number + 1), f"limb {number + 1}", number, stem, branches, None, np.eye(3))


def _chain(steps: Sequence[Step], joints: Sequence[LinkJoint]) -> tuple[Joint, ...]:
    """Return the joints of a chain from the base's side on."""
    found = []
    for step in steps:
        joint = joints[step.joint].joint
        if joint is not None:
            found.append(joint if step.is_outward else outward(joint))
    return tuple(found)


def outward(joint: Joint) -> Joint:
    """Return a joint with its links exchanged: the axes turn over, and the coordinates keep their signs."""
    if joint.type == "S":
        return joint
    if joint.type == "Pa":
        (axis,) = joint.axes
        place = joint.point + axis.rod
        return replace(joint, point=place, axes=(replace(axis, point=place, rod=-axis.rod),))
    return replace(joint, axes=tuple(replace(axis, axis=-axis.axis) for axis in reversed(joint.axes)))
