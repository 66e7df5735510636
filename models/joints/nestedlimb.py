"""A network as a limb of a model: unknowns, loop equations, members, actuators and joints of nested loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ..limbjoints import JointCoordinate, LimbJoint
from ..member import Member
from ..parts import Actuator, Closure, Dimension, JointScrews, PathStructure
from ..rows import independent_rows
from .angles import rotation_angle
from .chain import HomeRobot, Joint
from .generic import RANK_TOLERANCE
from .loops import ClosedPoint
from .motion import AxisKind
from .nested import NestedMember, is_slide, measured_ranks, member_of, motions_of, nested_members, null_space
from .network import OpenNetwork, open_network
from .opened import PathFrame, Variables

#: Names of the coordinates of a joint that has two.
_PARTS: Mapping[str, tuple[str, ...]] = {"U": ("first", "second"), "C": ("angle", "stroke")}
_CUT = "it is part of nested loops, which give it no coordinate of its own"


@dataclass(eq=False)
class NestedLimb:
    """A network as a limb, with its loops opened.

    Attributes:
        name: of the limb.
        network: its links and joints at any pose.
        unknowns: number of its joint variables that are unknowns.
    """

    name: str
    network: OpenNetwork
    unknowns: int

    @property
    def closure(self) -> list[Closure]:
        """Loop equations."""
        return [Closure(f"loop {self.name} ({k + 1})", *each) for k, each in enumerate(self.network.equations)]

    @property
    def checks(self) -> list[Closure]:
        """Signs that the loop equations leave open."""
        return [Closure(f"sign {self.name} ({k + 1})", each) for k, each in enumerate(self.network.checks)]


@dataclass(frozen=True, eq=False)
class ResistingNetwork:
    """Members and actuators of a network.

    Attributes:
        members: that resist the platform.
        actuators: all actuated joints.
        positions: of the actuators from home, (1, 1) each.
        screws: of each member's joints.
        structure: of each member.
    """

    members: list[Member]
    actuators: list[Actuator]
    positions: list[SX]
    screws: list[JointScrews]
    structure: list[PathStructure]


def nested_limb(
    name: str, robot: HomeRobot, joints: Sequence[int], variables: Variables, frame: PathFrame
) -> NestedLimb:
    """Return a network as a limb with opened loops.

    Args:
        name: of the limb.
        robot: at home.
        joints: indices of the network's joints in the robot's graph.
        variables: of the axes of joints.
        frame: values that all parts of the robot share.
    """
    made: set[tuple[Joint, int]] = set()

    def counted(joint: Joint, axis: int) -> SX:
        made.add((joint, axis))
        return variables(joint, axis)

    network = open_network(robot, joints, counted, frame)
    return NestedLimb(name, network, len(made))


def resisting(
    limb: NestedLimb, robot: HomeRobot, frame: PathFrame, symbols: Sequence[SX], points: Sequence[ClosedPoint]
) -> ResistingNetwork:
    """Return members and actuators of a network, with ranks measured at closed configurations.

    Args:
        limb: the network.
        robot: at home.
        frame: values that all parts of the robot share.
        symbols: of dimensions, unknowns, rotation and position.
        points: closed configurations.
    """
    network, found = limb.network, ResistingNetwork([], [], [], [], [])
    actuated = [k for k in network.joints if network.joint(k).actuated]
    screws: dict[int, dict[str, SX]] = {k: {} for k in actuated}
    rate_sizes = {k: robot.size if is_slide(network, k) else SX(1) for k in actuated}
    open_loops = [SX(0, len(actuated))]
    members = nested_members(robot, network)
    for number, each in enumerate(members):
        label = _member_name(limb, number) if len(members) > 1 else ""
        locked = motions_of(network, frame, each.joints, [k for k in each.joints if k not in actuated])
        ranks = measured_ranks(locked, symbols, points, robot.size)
        free = motions_of(network, frame, each.joints, each.joints)
        free_ranks = measured_ranks(free, symbols, points, robot.size)
        null = null_space(locked, ranks)
        free_loops, open_columns = ca.vertcat(SX(0, len(free.columns)), *free.loops), []
        for k in actuated:
            column = free.columns.index(k)
            driven = null.driven(free.platform[:, column], free_loops[:, column])
            open_columns.append(driven.open_loops)
            if not ca.sparsify(driven.screw).is_zero():
                screws[k][label or limb.name] = driven.screw / rate_sizes[k]
        open_loops.append(ca.horzcat(*open_columns))
        if ranks.twists < 6:
            found.members.append(replace(member_of(limb.name, network, each, null.screws, ranks.twists), name=label))
        labels = tuple(f"{limb.name}:{network.graph.joints[k].name}" for k in free.columns)
        driving = tuple(i for i, k in enumerate(free.columns) if k in actuated)
        sizes = ca.horzcat(*[rate_sizes.get(k, SX(1)) for k in free.columns])
        motions, loops = (part / ca.repmat(sizes, part.shape[0], 1) for part in (free.platform, free_loops))
        ends = ranks.twists, free_ranks.twists
        names = limb.name, labels, motions, driving, *ends, label or limb.name
        found.screws.append(JointScrews(*names, loops, sum(ranks.loops)))
        found.structure.append(_structure(limb, each, number, 6 - ranks.twists, 6 - free_ranks.twists))
    relations = _relations(ca.vertcat(*open_loops), symbols, points)
    for column, k in enumerate(actuated):
        name = network.graph.joints[k].name
        (axis,) = network.joint(k).axes
        dimension = Dimension.ANGLE if axis.kind is AxisKind.ROTATION else Dimension.LENGTH
        twists, factors = ca.horzcat(SX(6, 0), *screws[k].values()), relations[:, column] / rate_sizes[k]
        found.actuators.append(Actuator(name, limb.name, tuple(screws[k]), twists, dimension, factors))
        found.positions.append(axis.way(network.values[k, 0]))
    return found


def _relations(open_loops: SX, symbols: Sequence[SX], points: Sequence[ClosedPoint]) -> SX:
    """Return independent rows (r, a) of what passive joints cannot close of loops for actuators' rates of order 1.

    Rows that are zero at almost all configurations say nothing, and are left out.
    """
    function = ca.Function("relations", list(symbols), [ca.densify(open_loops)])
    values = [function(each.dimensions, each.unknowns, each.rotation, each.position).full() for each in points]
    values = [np.where(np.abs(each) > RANK_TOLERANCE, each, 0.0) for each in values]
    known = [each for each in values if np.isfinite(each).all() and each.any()]
    if 2 * len(known) <= len(points):
        return SX(0, open_loops.shape[1])
    return open_loops[list(independent_rows(known)), :]


def _member_name(limb: NestedLimb, number: int) -> str:
    """Return the name of a member: the first one has the limb's."""
    return limb.name if number == 0 else f"{limb.name}.{number + 1}"


def _structure(limb: NestedLimb, member: NestedMember, number: int, wrenches: int, constraints: int) -> PathStructure:
    """Return the structure of a member; the first one has the loops of all."""
    network = limb.network
    letters = (
        f"{network.joint(k).type}*" if network.joint(k).actuated else network.joint(k).type for k in member.joints
    )
    names = ", ".join(network.graph.joints[k].name for k in network.opened)
    count = len(network.equations) if number == 0 else 0
    return PathStructure(
        limb=limb.name,
        name=_member_name(limb, number),
        joints=" ".join(letters),
        opened=f"nested: {names}" if number == 0 else "as before",
        wrenches=wrenches,
        constraints=constraints,
        unknowns=limb.unknowns if number == 0 else 0,
        equations=count,
        kept=count,
        nested=tuple(network.graph.joints[k].name for k in member.joints),
    )


def nested_joints(limb: NestedLimb) -> list[LimbJoint]:
    """Return the joints of a network as limits read them; a joint at which a loop is opened may have no coordinate."""
    network = limb.network
    found = []
    for k in network.joints:
        joint, name = network.joint(k), network.graph.joints[k].name
        own = [network.values[k, a] for a in range(len(joint.axes)) if (k, a) in network.values]
        coordinates: list[JointCoordinate] = []
        if own:
            for value, axis, part in zip(own, joint.axes, _PARTS.get(joint.type, ("",)), strict=True):
                dimension = Dimension.ANGLE if axis.kind is AxisKind.ROTATION else Dimension.LENGTH
                coordinates.append(JointCoordinate(part, dimension, axis.way(value)))
        elif joint.type == "R":
            base, other = (network.motions[body] for body in network.ends(k))
            angle = rotation_angle(joint.axes[0].axis, base.rotation.T @ other.rotation)
            coordinates.append(JointCoordinate("", Dimension.ANGLE, ca.densify(angle.sine), ca.densify(angle.cosine)))
        unknown = "" if coordinates else _CUT
        found.append(LimbJoint(f"{limb.name}:{name}", name, limb.name, joint.type, tuple(coordinates), unknown=unknown))
    return found
