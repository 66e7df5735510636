"""Network as a limb of a model: members, actuators and joints, with the screws that nested loops allow.

Let ``q`` be the rates of a member's passive joints along a spanning tree from the base, with the loop equations ``L q =
0`` and the platform twist ``S q``. The member allows the twists ``S N``, with the projector ``N`` on the null space of
``L``, and, for a unit rate of an actuator with the columns ``s`` and ``l``, the twist ``s - S L^+ l``. Projector and
pseudo-inverse follow from generic ranks without a choice of columns. Loops are processed one after the other, and so
are the independent equations of a loop. One recursion for all of them would lose half of the digits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...limbjoints import JointCoordinate, LimbJoint
from ...mechanism.centre import CentreRule, centre_rule
from ...mechanism.decomposition import robot_graph
from ...mechanism.topology import nearest_tree
from ...member import Member, pseudo_inverse
from ...parts import Actuator, Dimension, JointScrews, PathStructure
from ...rows import RANK_TOLERANCE, independent_rows, rank_of
from ..home.chain import HomeRobot
from ..home.generic import PathFrame
from ..home.mechanisms import mechanism_at_home
from ..home.motion import AxisKind
from .loops import ClosedPoint
from .network import OpenNetwork
from .states import COORDINATE_PARTS, rotation_angle

_CUT = "the joint is part of nested loops and has no coordinate of its own"


@dataclass(frozen=True)
class NestedMember:
    """Member of a network, by joints of the robot's graph.

    Attributes:
        passive: indices of the joints that move with locked actuators.
        joints: indices of the passive joints and of all joints on which these depend.
        still: indices of the joints in ``joints`` that locked actuators and couplings fix.
        centre: indices of the joints that determine the centre: their mean, or the intersection of their axes.
        is_meeting: True if the centre is the intersection of axes.
    """

    passive: tuple[int, ...]
    joints: tuple[int, ...]
    still: tuple[int, ...]
    centre: tuple[int, ...]
    is_meeting: bool


class Motions(NamedTuple):
    """Motions of a member that some free joints allow: loop equations and platform twists of their rates.

    Attributes:
        loops: (m, n) for each loop or coupling, rows of ``L`` in angles and relative to the robot's size.
        platform: (6, n) ``S``, platform twists for the same rates.
        columns: index of the joint of each column.
    """

    loops: tuple[SX, ...]
    platform: SX
    columns: tuple[int, ...]


class MotionRanks(NamedTuple):
    """Rank of each loop in the null space of the preceding loops, and rank of the allowed platform twists."""

    loops: tuple[int, ...]
    twists: int


def nested_members(robot: HomeRobot, network: OpenNetwork) -> list[NestedMember]:
    """Return the members of a network, from the robot's mechanism at typical dimensions."""
    mechanism = mechanism_at_home(robot)
    names = {each.name: k for k, each in enumerate(network.graph.joints)}

    def written(joints: Sequence[int]) -> tuple[int, ...]:
        found = (mechanism.joints[k].name.partition(".")[0] for k in joints)
        return tuple(dict.fromkeys(names[name] for name in found))

    members = []
    graph = robot_graph(mechanism)
    still = written(graph.still)
    for each in graph.members:
        joints = written(each.joints)
        if set(joints) <= set(network.joints):
            rule: CentreRule = centre_rule(mechanism, each)
            members.append(NestedMember(written(each.passive), joints, still, written(rule.joints), rule.is_meeting))
    return members


def motions_of(network: OpenNetwork, frame: PathFrame, member: NestedMember, free: Collection[int]) -> Motions:
    """Return loops and platform twists of a member of a network with some free joints.

    The spanning tree contains first the joints that locked actuators fix, then the shortest paths from the base. So a
    loop next to a fixed joint does not influence the platform twists: at a dead centre, the joint rates of this loop
    are undefined.

    Args:
        network: the network.
        frame: common data of all parts of the robot.
        member: the member.
        free: indices of the free joints; the tree is the same for all of them.
    """
    own = [k for k in network.joints if k in member.joints]
    moving = [k for k in own if k in free]
    start, count = {}, 0
    for k in moving:
        start[k] = count
        count += len(network.screws[k])
    columns = tuple(k for k in moving for _ in network.screws[k])

    def block(k: int) -> SX:
        """Return the twists (6, n) of a joint for scaled rates, in the columns of all free joints."""
        found = SX(6, count)
        if k in start:
            screws = ca.horzcat(*network.screws[k])
            slide = is_slide(network, k)
            found[:, start[k] : start[k] + screws.shape[1]] = screws * frame.size if slide else screws
        return found

    edges = [network.ends(k) for k in own]
    tree = nearest_tree(network.base, edges, [0 if k in member.still else len(network.screws[k]) for k in own])
    twists = {network.base: SX(6, count)}
    for i, parent, child in tree.branches:
        sign = 1 if edges[i][0] == parent else -1
        twists[child] = twists[parent] + sign * block(own[i])
    rows = _coupling_rows(network, frame, own, start, count)
    for i in tree.chords:
        relative = twists[edges[i][1]] - twists[edges[i][0]] - block(own[i])
        place = network.points[own[i]]
        velocities = [relative[3:, k] + ca.cross(relative[:3, k], place) for k in range(count)]
        rows.append(ca.vertcat(relative[:3, :], ca.horzcat(SX(3, 0), *velocities) / frame.size))
    loops = tuple(ca.sparsify(row) for row in rows)
    return Motions(loops, ca.densify(twists.get(network.platform, SX(6, count))), columns)


def is_slide(network: OpenNetwork, k: int) -> bool:
    """Return True if a joint's first unit screw is a translation, with a rate in length per unit of time."""
    return network.joint(k).axes[0].kind is not AxisKind.ROTATION


def _coupling_rows(
    network: OpenNetwork, frame: PathFrame, used: Sequence[int], start: dict[int, int], count: int
) -> list[SX]:
    """Return the equation (1, n) of each coupling with all joints in a given set."""
    rows = []
    for coupling in network.graph.couplings:
        if all(k in used for k, _ in coupling):
            row = SX(1, count)
            first, scale = coupling[0]
            scale = scale * frame.size if is_slide(network, first) else scale
            for k, factor in coupling:
                if k in start:
                    row[0, start[k]] = factor * (frame.size if is_slide(network, k) else 1) / scale
            rows.append(row)
    return rows


class MeasuredMotions(NamedTuple):
    """Values of :class:`Motions` at a closed configuration.

    Attributes:
        loops: (m, n) for each loop or coupling, rows of ``L``.
        platform: (6, n) ``S``, with velocities of the platform's origin relative to the robot's size.
    """

    loops: tuple[FloatArray, ...]
    platform: FloatArray


def measured(
    motions: Motions, symbols: Sequence[SX], points: Sequence[ClosedPoint], size: SX
) -> tuple[MeasuredMotions, ...]:
    """Return the values of motions at closed configurations; configurations with a non-finite value are omitted.

    Args:
        motions: loops and platform twists.
        symbols: symbols of dimensions, unknowns, rotation and position.
        points: closed configurations.
        size: (1, 1) size of the robot, length.
    """
    outputs = [motions.platform, size, *[ca.densify(loop) for loop in motions.loops]]
    function = ca.Function("nested", list(symbols), outputs)
    found = []
    for point in points:
        platform, length, *loops = (np.asarray(each.full(), dtype=np.float64) for each in function(*point))
        if all(np.isfinite(each).all() for each in (platform, *loops)):
            velocities = platform[3:] + np.cross(platform[:3].T, point.position).T
            found.append(MeasuredMotions(tuple(loops), np.vstack([platform[:3], velocities / length])))
    return tuple(found)


def ranks_of(points: Sequence[MeasuredMotions], loops: Sequence[int]) -> MotionRanks:
    """Return the most frequent ranks at closed configurations.

    Args:
        points: values of the motions at closed configurations.
        loops: indices of the loops in use.
    """
    found: Counter[MotionRanks] = Counter()
    for point in points:
        ranks, null = [], np.eye(point.platform.shape[1])
        for k in loops:
            _, singular, right = np.linalg.svd(point.loops[k] @ null)
            # A loop that others close already leaves only rounding errors.
            ranks.append(rank_of(singular, 1.0))
            null = null @ right[ranks[-1] :].T
        twists = rank_of(np.linalg.svd(point.platform @ null)[1], 1.0) if null.size else 0
        found[MotionRanks(tuple(ranks), twists)] += 1
    return max(found, key=lambda ranks: (found[ranks], ranks))


def platform_loops(points: Sequence[MeasuredMotions]) -> list[int]:
    """Return the indices of the loops that determine the platform twists: the shortest loops that suffice.

    The other loops may lose rank, for example at a dead centre, although the platform twists keep their rank.
    """
    kept = list(range(len(points[0].loops)))
    twists = ranks_of(points, kept).twists
    for k in sorted(kept, key=lambda k: np.count_nonzero(points[0].loops[k].any(axis=0)), reverse=True):
        rest = [other for other in kept if other != k]
        if ranks_of(points, rest).twists == twists:
            kept = rest
    return kept


@dataclass(frozen=True, eq=False)
class NullSpace:
    """Null space of a member's loops; each loop is restricted to the null space of the preceding loops.

    Attributes:
        projector: (n, n) projector on the rates that close all loops.
        equations: (m, n) equations of each loop; independent equations are separate entries.
        inverses: (n, m) pseudo-inverse of each entry of ``equations``, within the rates that satisfy the preceding
            entries.
        platform: (6, n) platform twists for unit rates.
    """

    projector: SX
    equations: tuple[SX, ...]
    inverses: tuple[SX, ...]
    platform: SX

    @property
    def screws(self) -> SX:
        """Platform twists (6, n) that free joints allow, for a unit value of each rate."""
        return self.platform @ self.projector

    def driven(self, screw: SX, loops: SX) -> tuple[SX, SX]:
        """Return the motion for a unit rate of an actuated joint with the other actuators at rest.

        Args:
            screw: (6, 1) platform twist of the joint.
            loops: (m, 1) coefficients of the joint in all loops, one below the other.

        Returns:
            Platform twist (6, 1), up to the twists that the member allows; and the residual (m, 1) that passive joints
            cannot close, 0 if the actuator can move by itself.
        """
        rates = SX(self.projector.shape[0], 1)
        open_loops = [SX(0, 1)]
        for inverse, loop in zip(self.inverses, self.equations, strict=True):
            own, loops = loops[: loop.shape[0], :], loops[loop.shape[0] :, :]
            rates -= inverse @ (own + loop @ rates)
            open_loops.append(own + loop @ rates)
        return screw + self.platform @ rates, ca.vertcat(*open_loops)


def null_space(motions: Motions, loops: Sequence[int], ranks: MotionRanks) -> NullSpace:
    """Return the null space of a member's loops.

    Args:
        motions: loops and platform twists.
        loops: indices of the loops in use.
        ranks: ranks of these loops.
    """
    projector = SX.eye(motions.platform.shape[1])
    equations, inverses = [], []
    for k, rank in zip(loops, ranks.loops, strict=True):
        loop = motions.loops[k]
        is_regular = rank == loop.shape[0]
        for each in ca.vertsplit(loop) if is_regular else [loop]:
            left = ca.densify(each @ projector @ projector)
            inverse = pseudo_inverse(left, 1 if is_regular else rank)
            equations.append(each)
            inverses.append(inverse)
            projector -= inverse @ left
    return NullSpace(projector, tuple(equations), tuple(inverses), motions.platform)


def _slide(network: OpenNetwork, member: NestedMember) -> SX | None:
    """Return the current unit axis (3, 1) along which the centre is arbitrary; None if the centre is determined."""
    if member.is_meeting or len(member.centre) != 1 or network.joint(member.centre[0]).type in ("S", "U", "Pa"):
        return None
    (k,) = member.centre
    return network.joint(k).axes[-1].direction(network.screws[k][-1])


def _centre(network: OpenNetwork, member: NestedMember) -> SX:
    """Return the centre (3, 1) of a member in the world frame, length; joints move with their second link."""
    if member.is_meeting:
        # Both hinges of a universal joint count as one joint.
        if len(member.centre) == 1:
            return network.points[member.centre[0]]
        one, other = member.centre
        first, second = (network.screws[k][0][:3] for k in (one, other))
        apart = network.points[other] - network.points[one]
        normal = ca.cross(first, second)
        return network.points[one] + first * (ca.dot(ca.cross(apart, second), normal) / ca.sumsqr(normal))
    places = [network.motions[network.ends(k)[1]].point(network.joint(k).point) for k in member.centre]
    return sum(places, SX.zeros(3)) * (1 / len(places))


@dataclass(eq=False, kw_only=True)
class ResistingParts:
    """Members and actuators that resist or drive the platform, collected limb after limb.

    Attributes:
        members: members that resist the platform.
        actuators: all actuated joints.
        positions: (1, 1) coordinate of each actuator from home.
        screws: screws of the joints of chains, and of each member of networks.
        structure: structure of these chains and members.
    """

    members: list[Member] = field(default_factory=list)
    actuators: list[Actuator] = field(default_factory=list)
    positions: list[SX] = field(default_factory=list)
    screws: list[JointScrews] = field(default_factory=list)
    structure: list[PathStructure] = field(default_factory=list)


def add_resisting(
    parts: ResistingParts,
    network: OpenNetwork,
    frame: PathFrame,
    symbols: Sequence[SX],
    points: Sequence[ClosedPoint],
) -> None:
    """Add members and actuators of a network, with ranks measured at closed configurations.

    Args:
        parts: members and actuators so far; those of the network are added.
        network: network at any pose.
        frame: common data of all parts of the robot.
        symbols: symbols of dimensions, unknowns, rotation and position.
        points: closed configurations.
    """
    robot, limb = frame.robot, network.name
    actuated = [k for k in network.joints if network.joint(k).actuated]
    screws: dict[int, dict[str, SX]] = {k: {} for k in actuated}
    rate_sizes = {k: robot.size if is_slide(network, k) else SX(1) for k in actuated}
    open_loops = [SX(0, len(actuated))]
    members = nested_members(robot, network)
    for number, each in enumerate(members):
        label = _member_name(network, number) if len(members) > 1 else ""
        locked = motions_of(network, frame, each, [k for k in each.joints if k not in actuated])
        at_points = measured(locked, symbols, points, robot.size)
        every = range(len(locked.loops))
        ranks = ranks_of(at_points, every)
        free = motions_of(network, frame, each, each.joints)
        free_ranks = ranks_of(measured(free, symbols, points, robot.size), every)
        null = null_space(locked, every, ranks)
        free_loops, open_columns = ca.vertcat(SX(0, len(free.columns)), *free.loops), []
        for k in actuated:
            column = free.columns.index(k)
            screw, left_open = null.driven(free.platform[:, column], free_loops[:, column])
            open_columns.append(left_open)
            if not ca.sparsify(screw).is_zero():
                screws[k][label or limb] = screw / rate_sizes[k]
        open_loops.append(ca.horzcat(*open_columns))
        place = _centre(network, each)
        if ranks.twists < 6:
            slide, needed = _slide(network, each), platform_loops(at_points)
            allowed = null_space(locked, needed, ranks_of(at_points, needed)).screws
            parts.members.append(Member(limb, place, allowed, ranks.twists, (), slide=slide, name=label))
        labels = tuple(f"{limb}:{network.graph.joints[k].name}" for k in free.columns)
        driving = tuple(i for i, k in enumerate(free.columns) if k in actuated)
        sizes = ca.horzcat(*[rate_sizes.get(k, SX(1)) for k in free.columns])
        motions, loops = (part / ca.repmat(sizes, part.shape[0], 1) for part in (free.platform, free_loops))
        ends = ranks.twists, free_ranks.twists
        names = limb, labels, motions, driving, *ends, label or limb
        parts.screws.append(JointScrews(*names, loops, sum(ranks.loops), place))
        parts.structure.append(_structure(network, each, number, 6 - ranks.twists, 6 - free_ranks.twists))
    relations = _relations(ca.vertcat(*open_loops), symbols, points)
    for column, k in enumerate(actuated):
        name = network.graph.joints[k].name
        (axis,) = network.joint(k).axes
        twists, factors = ca.horzcat(SX(6, 0), *screws[k].values()), relations[:, column] / rate_sizes[k]
        label = f"{limb}:{name}"
        parts.actuators.append(Actuator(name, limb, tuple(screws[k]), twists, axis.dimension, factors, label))
        parts.positions.append(axis.travel(network.values[k, 0]))


def _relations(open_loops: SX, symbols: Sequence[SX], points: Sequence[ClosedPoint]) -> SX:
    """Return the independent relations (r, a) that the loops impose on scaled actuator rates.

    Rows that are zero at almost all configurations are left out.
    """
    function = ca.Function("relations", list(symbols), [ca.densify(open_loops)])
    values = [function(*each).full() for each in points]
    values = [np.where(np.abs(each) > RANK_TOLERANCE, each, 0.0) for each in values]
    known = [each for each in values if np.isfinite(each).all() and each.any()]
    if 2 * len(known) <= len(points):
        return SX(0, open_loops.shape[1])
    return open_loops[list(independent_rows(known)), :]


def _member_name(network: OpenNetwork, number: int) -> str:
    """Return the name of a member; the first member has the name of the limb."""
    return network.name if number == 0 else f"{network.name}.{number + 1}"


def _structure(
    network: OpenNetwork, member: NestedMember, number: int, wrenches: int, constraints: int
) -> PathStructure:
    """Return the structure of a member; the first member of a network counts all loops."""
    letters = (
        f"{network.joint(k).type}*" if network.joint(k).actuated else network.joint(k).type for k in member.joints
    )
    names = ", ".join(network.graph.joints[k].name for k in network.opened)
    count = len(network.equations) if number == 0 else 0
    return PathStructure(
        limb=network.name,
        name=_member_name(network, number),
        joints=" ".join(letters),
        opened=f"nested: {names}" if number == 0 else "as before",
        wrenches=wrenches,
        constraints=constraints,
        unknowns=network.unknowns if number == 0 else 0,
        equations=count,
        kept=count,
        nested=tuple(network.graph.joints[k].name for k in member.joints),
    )


def nested_joints(network: OpenNetwork) -> list[LimbJoint]:
    """Return the joints of a network for limits; a joint at which a loop is opened may have no coordinate."""
    limb, found = network.name, []
    for k in network.joints:
        joint, name = network.joint(k), network.graph.joints[k].name
        own = [network.values[k, a] for a in range(len(joint.axes)) if (k, a) in network.values]
        coordinates: list[JointCoordinate] = []
        if own:
            for value, axis, part in zip(own, joint.axes, COORDINATE_PARTS.get(joint.type, ("",)), strict=True):
                coordinates.append(JointCoordinate(part, axis.dimension, axis.travel(value)))
        elif joint.type == "R":
            base, other = (network.motions[body] for body in network.ends(k))
            angle = rotation_angle(joint.axes[0].axis, base.rotation.T @ other.rotation)
            coordinates.append(JointCoordinate("", Dimension.ANGLE, ca.densify(angle.sine), ca.densify(angle.cosine)))
        unknown = "" if coordinates else _CUT
        found.append(LimbJoint(f"{limb}:{name}", name, limb, joint.type, tuple(coordinates), unknown=unknown))
    return found
