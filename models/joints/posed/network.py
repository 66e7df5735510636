"""Network of links and joints between base and platform at any pose, for nested loops.

Base and platform have known displacements. Other links are displaced along a spanning tree from one of the two; the
coordinates of the tree's joints are unknowns. A joint outside the tree closes a loop: a spherical, universal or hinge
joint by the equations of a cut, any other joint by a coordinate and six equations. A link between two spherical
joints spins freely, so that only two rotations of its joint are unknowns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
from casadi import SX

from ...mechanism.topology import Classes, spanning_tree
from ..home.chain import HomeGraph, Joint
from ..home.generic import PathFrame
from ..home.motion import AxisKind, JointAxis, Motion
from .cut import Cut
from .opened import (
    LoopEquation,
    Opened,
    OpenedPath,
    Variables,
    join_joint,
    join_rigidly,
    normals_of,
    rotations_about,
)

#: Order of joint types for the tree: those that a cut can replace come last.
_RELUCTANCE = {"P": 1, "H": 1, "Pa": 1, "C": 1, "R": 2, "U": 3, "S": 9}


@dataclass(eq=False)
class OpenNetwork(Opened):
    """Network of links and joints at any pose, with opened loops.

    Attributes:
        name: name of the limb.
        graph: graph of the robot.
        joints: indices of the network's joints.
        bodies: name of the rigid body of each link, common to welded links.
        motions: displacement from home of each body, by name.
        screws: current screws (6, 1) of each joint's axes, by the joint's index; three rotations about its centre for a
            spherical joint.
        values: coordinate (1, 1) of each axis that is an unknown, by joint and number of the axis.
        points: current position (3, 1) of each joint on its first link, length.
        opened: indices of the joints outside the spanning tree, which close loops.
        unknowns: number of joint coordinates that are unknowns.
    """

    name: str
    graph: HomeGraph
    joints: tuple[int, ...]
    bodies: dict[str, str]
    motions: dict[str, Motion]
    screws: dict[int, list[SX]] = field(default_factory=dict)
    values: dict[tuple[int, int], SX] = field(default_factory=dict)
    points: dict[int, SX] = field(default_factory=dict)
    opened: list[int] = field(default_factory=list)
    unknowns: int = 0

    def joint(self, k: int) -> Joint:
        """Return a joint at home."""
        found = self.graph.joints[k].joint
        if found is None:
            raise ValueError("a weld has no joint")
        return found

    def ends(self, k: int) -> tuple[str, str]:
        """Return the two bodies that a joint connects."""
        return self.bodies[self.graph.joints[k].inner], self.bodies[self.graph.joints[k].outer]

    @property
    def base(self) -> str:
        """Name of the base's body."""
        return self.bodies[self.graph.base]

    @property
    def platform(self) -> str:
        """Name of the platform's body."""
        return self.bodies[self.graph.platform]


def open_network(name: str, joints: Sequence[int], variables: Variables, frame: PathFrame) -> OpenNetwork:
    """Return a network at any pose.

    Args:
        name: name of the limb.
        joints: indices of the network's joints in the robot's graph.
        variables: function that returns the coordinates of the axes in the spanning tree.
        frame: common data of all parts of the robot.
    """
    graph = frame.robot.graph
    if graph is None:
        raise ValueError("the robot has no graph")
    welded = Classes(graph.links, [(each.inner, each.outer) for each in graph.joints if each.joint is None])
    bodies = {link: welded.find(link) for link in graph.links}
    found = OpenNetwork(name, graph, tuple(joints), bodies, {})
    found.motions = {found.base: Motion.none(), found.platform: frame.platform}
    edges = [found.ends(k) for k in joints]
    coupled = {k for coupling in graph.couplings for k, _ in coupling}

    def reluctance(i: int) -> float:
        joint = found.joint(joints[i])
        return 0.0 if joint.actuated or joints[i] in coupled else _RELUCTANCE[joint.type]

    tree = spanning_tree([found.base, found.platform], edges, reluctance)
    for i, parent, child in tree.branches:
        _add_to_tree(found, joints[i], parent, child, variables, frame)
    for i in tree.chords:
        _close(found, joints[i], variables, frame, has_variable=joints[i] in coupled)
    for coupling in graph.couplings:
        if all(k in joints for k, _ in coupling):
            found.equations.append(_coupling_equation(found, coupling, frame))
    return found


def _add_to_tree(network: OpenNetwork, k: int, parent: str, child: str, variables: Variables, frame: PathFrame) -> None:
    """Add a joint of the spanning tree, and the displacement of the link after it."""
    joint, at = network.joint(k), network.motions[parent]
    outward = network.ends(k)[0] == parent
    axes = _spanning_axes(network, k, child, frame) if joint.type == "S" else joint.axes
    stated = joint if axes is joint.axes else replace(joint, axes=axes)
    screws: list[SX] = []
    place = at.point(joint.point)
    for a in range(len(axes)) if outward else range(len(axes) - 1, -1, -1):
        value = variables(stated, a)
        if joint.type != "S":
            network.values[k, a] = value
        screw = axes[a].screw(value, at)
        screws = [*screws, screw] if outward else [screw, *screws]
        motion = axes[a].motion(value)
        at = at.after(motion if outward else motion.inverse())
    network.motions[child] = at
    network.points[k] = place if outward else at.point(joint.point)
    network.screws[k] = rotations_about(place) if joint.type == "S" else screws


def _spanning_axes(network: OpenNetwork, k: int, child: str, frame: PathFrame) -> tuple[JointAxis, ...]:
    """Return the axes of a spherical joint in the tree: two normal to a rod between spherical joints, otherwise three.

    Args:
        network: the network.
        k: index of the joint.
        child: body after the joint.
        frame: common data of all parts of the robot.
    """
    joint = network.joint(k)
    others = [j for j in network.joints if child in network.ends(j)]
    if len(others) != 2 or any(network.joint(j).type != "S" for j in others):
        return joint.axes
    (other,) = (j for j in others if j != k)
    rod = network.joint(other).point - joint.point
    directions = [each / ca.norm_2(each) for each in normals_of(rod / ca.norm_2(rod), frame)]
    return tuple(JointAxis(AxisKind.ROTATION, each, joint.point) for each in directions)


def _close(network: OpenNetwork, k: int, variables: Variables, frame: PathFrame, *, has_variable: bool) -> None:
    """Add a joint that closes a loop, with its equations."""
    joint = network.joint(k)
    base, platform = (network.motions[body] for body in network.ends(k))
    network.opened.append(k)
    if joint.type in ("S", "U", "R") and not joint.actuated and not has_variable:
        path = OpenedPath([joint], Cut(joint.type, 0, 0, 0), [[]], [None], [joint.point], (base, platform))
        join_joint(path, base, platform, frame)
        network.screws[k], network.points[k] = path.screws[0], base.point(joint.point)
        network.equations += path.equations
        network.checks += path.checks
        return
    at, screws = base, []
    for a, axis in enumerate(joint.axes):
        network.values[k, a] = value = variables(joint, a)
        screws.append(axis.screw(value, at))
        at = at.after(axis.motion(value))
    network.screws[k], network.points[k] = screws, base.point(joint.point)
    join_rigidly(network, at, platform, joint.point, frame)


def _coupling_equation(network: OpenNetwork, coupling: Sequence[tuple[int, SX]], frame: PathFrame) -> LoopEquation:
    """Return the equation of a coupling, divided by its first factor."""
    first, factor = coupling[0]
    slides = network.joint(first).axes[0].kind is AxisKind.TRANSLATION
    total = sum((each * network.values[k, 0] for k, each in coupling), SX(0))
    return LoopEquation(total / factor, frame.size if slides else SX(1))
