"""Model of a robot given joint by joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...fileversions import VERSION_KEY
from ...limbjoints import LimbJoint, LimbLink
from ...model import Model
from ...parts import (
    Actuator,
    AssemblySign,
    Closure,
    Dimension,
    Leg,
    Parameter,
    PoseSymbols,
    Unknown,
)
from ...wrench import Wrench
from ..home.chain import HomeRobot, Joint, Limb, home_of
from ..home.faults import examine_geometry
from ..home.generic import PathFrame, sampled_dimensions
from ..home.motion import AxisKind, Motion
from ..home.straight import straight_legs
from ..posed.cut import choose_cut, simplified
from ..posed.loops import examine_loops
from ..posed.modes import joint_signs, mode_signs
from ..posed.nested import ResistingParts, add_resisting, nested_joints
from ..posed.network import OpenNetwork, open_network
from ..posed.opened import OpenedPath, Variables, closures, distance_equations, open_path, slide_length
from ..posed.resistance import Ranks, path_ranks, resistance
from ..posed.states import PathJoints, limb_links, with_shared_places
from ..written.forms import Expression, RobotError, VectorExpression, plain
from ..written.words import read_robot
from .modelparts import (
    actuator_name,
    generic_ranks,
    joint_screws,
    member_remarks,
    parameters,
    quantities,
    rank_remarks,
    structure_of,
    with_all_relations,
    with_kept,
    with_kinds,
)
from .pictures import DrawnPath, scene_of

#: Range of an unknown from home: half a turn for an angle, four times the robot's size for a slide.
_TURN = float(np.pi)
_WAY = 4.0


def robot(
    name: str,
    *,
    limb: Sequence[Mapping[str, object]] | None = None,
    home: VectorExpression = (0.0, 0.0, 0.0),
    dimensions: Mapping[str, Mapping[str, object]] | None = None,
    derived: Mapping[str, Expression] | None = None,
    description: str = "",
    length_unit: str = "",
    links: Sequence[str] | None = None,
    base: str | None = None,
    platform: str | None = None,
    points: Mapping[str, VectorExpression] | None = None,
    joint: Sequence[Mapping[str, object]] | None = None,
    coupling: Sequence[Mapping[str, object]] | None = None,
    schema: int = 1,
) -> Model:
    """Return the model of a robot given joint by joint, at home; the arguments are the keys of a robot file.

    Args:
        name: name of the robot.
        limb: limbs, each a mapping with ``joints`` from base to platform, and optionally ``name``, ``repeat``,
            ``points``, ``branch`` and ``centre``.
        home: origin of the platform frame at home, where its axes are parallel to the world axes.
        dimensions: dimensions by name, each a mapping with ``typical`` and optionally ``kind`` (``"length"``,
            ``"angle"`` or ``"number"``) and ``description``. The typical value of an angle is in degrees.
        derived: derived quantities by name, as expressions of the dimensions and of earlier ones.
        description: one sentence for people.
        length_unit: unit of the typical dimensions, such as ``"m"``; empty for proportions in any unit.
        links: names of all links, for a robot given by links and joints instead of limbs.
        base: name of the base link; ``"base"`` by default.
        platform: name of the platform link; ``"platform"`` by default.
        points: points by name, at home.
        joint: joints, each a mapping with ``name``, ``type``, ``between`` (two links, the base side first) and the keys
            of a limb's joint; a joint of type ``"weld"`` has no other keys.
        coupling: linear relations of joint coordinates, each a mapping with ``factors`` by joint.
        schema: version of these keys.

    Raises:
        RobotError: a key or value is not allowed, or the robot cannot be assembled near home.
    """
    tables = {
        "name": name,
        "limb": limb,
        "home": home,
        "dimensions": dimensions,
        "derived": derived,
        "description": description,
        "length_unit": length_unit,
        "links": links,
        "base": base,
        "platform": platform,
        "points": points,
        "joint": joint,
        "coupling": coupling,
    }
    definition = {key: plain(value) for key, value in tables.items() if value is not None and value != ""}
    at_home = home_of(read_robot({VERSION_KEY: schema, **definition}))
    return model_of_home(at_home, sampled_dimensions(at_home), definition)


class _LimbModes(NamedTuple):
    """Data from which the sign of a limb's working mode is computed.

    Attributes:
        place: index of the sign among all signs of the model.
        limb: name of the limb.
        paths: opened chains of the limb.
        unknowns: range of the limb's unknowns in the model.
    """

    place: int
    limb: str
    paths: list[OpenedPath]
    unknowns: slice


@dataclass(eq=False)
class _Builder(ResistingParts):
    """Builder of a robot's model: unknowns, equations, rows, members and actuators, limb after limb."""

    frame: PathFrame
    wrenches: list[Wrench] = field(default_factory=list)
    unknowns: list[Unknown] = field(default_factory=list)
    closure: list[Closure] = field(default_factory=list)
    checks: list[Closure] = field(default_factory=list)
    signs: list[AssemblySign] = field(default_factory=list)
    distances: list[Closure] = field(default_factory=list)
    paths: list[DrawnPath] = field(default_factory=list)
    joints: list[LimbJoint] = field(default_factory=list)
    links: list[tuple[OpenedPath, list[LimbLink]]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    ranks: dict[tuple[int, int], Ranks] = field(default_factory=dict)
    networks: list[OpenNetwork] = field(default_factory=list)
    driven: list[tuple[SX, str]] = field(default_factory=list)
    modes: list[_LimbModes] = field(default_factory=list)

    @property
    def robot(self) -> HomeRobot:
        """The robot at home."""
        return self.frame.robot

    def add_network(self, joints: Sequence[int]) -> None:
        """Add a network of joints: its unknowns and equations; its members follow from closed loops."""
        name = str(len(self.robot.limbs) + len(self.networks) + 1)
        count = len(self.unknowns)
        network = open_network(name, joints, self._variables(name, {}), self.frame)
        network.unknowns = len(self.unknowns) - count
        self.networks.append(network)
        self.closure += closures("loop", name, network.equations)
        self.checks += closures("sign", name, zip(network.checks, strict=True))
        self.joints += nested_joints(network)
        actuated = [k for k in joints if network.joint(k).actuated]
        self.driven += [(network.values[k, 0], f"{name}:{network.graph.joints[k].name}") for k in actuated]

    def add_limb(self, limb: Limb) -> None:
        """Add a limb: its unknowns, equations, rows, members and actuators."""
        passive = [joint for joint in limb.stem if not joint.actuated]
        if len(limb.branches) > 1 and passive:
            fault = "is passive and before the branches of its limb; only actuated joints are allowed there"
            raise RobotError(passive[0].place, fault)
        known: dict[tuple[Joint, int], SX] = {}
        driven: dict[int, list[tuple[Joint, OpenedPath, int, str]]] = {}
        labels: dict[int, str] = {}
        count, opened = len(self.unknowns), []
        for index, joints in enumerate(limb.paths):
            new = joint_labels(limb, index, joints, labels)
            labels |= new
            path = self._path(limb, index, joints, self._variables(limb.name, known), labels)
            if path is None:
                self._remark_idle(limb)
                fault = "its limb neither resists nor drives the platform"
                self.joints += [
                    LimbJoint(new[id(each)], each.name, limb.name, each.type, unknown=fault)
                    for each in joints
                    if id(each) in new
                ]
                continue
            opened.append(path)
            self.joints += PathJoints(limb, path, known, self.frame).states(new)
            self.links.append((path, limb_links(path, labels, self.frame)))
            for j, joint in enumerate(path.joints):
                if joint.actuated:
                    driven.setdefault(id(joint), []).append((joint, path, j, limb.member(index)))
        carrying = {row.label.member for row in self.wrenches} | {member.label for member in self.members}
        if any(carrying.isdisjoint(member for *_, member in each) for each in driven.values()):
            fault = (
                "has an actuated joint without effect, because its passive joints leave the platform free; "
                "remove actuated = true or a passive joint"
            )
            raise RobotError(limb.place, fault)
        self.modes.append(_LimbModes(len(self.signs), limb.name, opened, slice(count, len(self.unknowns))))
        for k, places in enumerate(driven.values()):
            joint, path, j, _ = places[0]
            name = actuator_name(self.robot, limb, joint, k + 1) if len(driven) > 1 else limb.name
            members = tuple(member for *_, member in places)
            (axis,) = joint.axes
            screws = ca.repmat(path.screws[j][0], 1, len(members))
            label = labels[id(joint)]
            self.actuators.append(Actuator(name, limb.name, members, screws, axis.dimension, joint=label))
            self.driven += [(known[joint, 0], label)] if (joint, 0) in known else []
            way = slide_length(path, self.frame) if j == path.cut.slide else axis.travel(known[joint, 0])
            self.positions.append(SX(0) if way is None else way)

    def add_modes(self) -> None:
        """Add the sign of each limb's working mode; the free actuator coordinates must be known."""
        for each in reversed(self.modes):
            own = self.unknowns[each.unknowns]
            self.signs[each.place : each.place] = mode_signs(each.limb, each.paths, own, self.frame)

    @property
    def carrying(self) -> set[str]:
        """Names of the limbs that resist the platform."""
        return {row.limb for row in self.wrenches} | {member.limb for member in self.members}

    def _remark_idle(self, limb: Limb) -> None:
        """Add the remark that a limb carries no load, once for all copies."""
        remark = f"{limb.place} carries no load: its passive joints leave the platform free"
        if remark not in self.remarks:
            self.remarks.append(remark)

    def _path(
        self, limb: Limb, index: int, joints: Sequence[Joint], variables: Variables, labels: Mapping[int, str]
    ) -> OpenedPath | None:
        """Add one chain of a limb and return it; None for a chain that neither constrains nor drives the platform."""
        joints = simplified(self.frame, joints)
        cut = choose_cut(joints, len(limb.stem) if len(limb.branches) > 1 else 0, with_rods=limb.centre is None)
        key = limb.group, index
        if key not in self.ranks:
            self.ranks[key] = path_ranks(self.frame, joints, cut)
        ranks = self.ranks[key]
        if ranks.passive == 6 and not any(joint.actuated for joint in joints):
            return None
        count = len(self.unknowns)
        path = open_path(joints, cut, variables, self.frame)
        rows, member = resistance(limb.name, path, ranks, limb.centre)
        before = sum(row.limb == limb.name for row in self.wrenches)
        row = before if len(limb.branches) > 1 and len(rows) == 1 else None
        self.paths.append(DrawnPath(limb, index, path, row))
        several, name = len(limb.branches) > 1, limb.member(index)
        self.wrenches += [replace(each, member=name) for each in rows] if several else rows
        self.members += [] if member is None else [replace(member, name=name if several else "")]
        self.closure += closures("loop", name, path.equations)
        self.checks += closures("sign", name, zip(path.checks, strict=True))
        self.distances += closures("distance", name, distance_equations(path, variables, self.frame))
        self.signs += joint_signs(limb.name, name, path)
        self.structure.append(structure_of(limb.name, name, path, ranks, len(self.unknowns) - count))
        screws = joint_screws(limb.name, path, ranks, labels)
        self.screws += [] if screws is None else [screws]
        return path

    def _variables(self, limb: str, known: dict[tuple[Joint, int], SX]) -> Variables:
        """Return the function that returns the coordinate of a joint's axis, as a new unknown at first use."""

        def variable(joint: Joint, axis: int) -> SX:
            key = joint, axis
            if key not in known:
                name = f"q{limb}_{len(known) + 1}"
                symbol = SX.sym(name)
                slides = joint.axes[axis].kind is AxisKind.TRANSLATION
                reach, size = (_WAY, self.robot.size) if slides else (_TURN, SX(1))
                dimension = Dimension.LENGTH if slides else Dimension.ANGLE
                words = "travel of a slide" if slides else "angle of a joint"
                self.unknowns.append(Unknown(name, symbol, dimension, f"{words}, from home", -reach, reach, size))
                known[key] = symbol
            return known[key]

        return variable


def joint_labels(limb: Limb, index: int, joints: Sequence[Joint], known: Mapping[int, str]) -> dict[int, str]:
    """Return a label, such as ``2:3``, for each unlabelled joint of a chain, by the joint's identity.

    Args:
        limb: the limb.
        index: index of the chain in the limb.
        joints: joints of the chain.
        known: labels of joints of other chains, which share the joints of the stem.
    """
    return {id(joint): limb.label(index, j) for j, joint in enumerate(joints) if id(joint) not in known}


def model_of_home(
    at_home: HomeRobot,
    samples: FloatArray,
    definition: Mapping[str, object],
    more: Sequence[Parameter] = (),
    legs: Sequence[Leg] | None = None,
) -> Model:
    """Return the model of a robot at home.

    Args:
        at_home: the robot.
        samples: (s, d) values of the dimensions at which ranks are measured.
        definition: tables of the robot file.
        more: parameters of the model in addition to the dimensions.
        legs: straight legs of the robot; if None, they are derived from the limbs.

    Raises:
        RobotError: the robot cannot be assembled near home.
    """
    words = at_home.words
    pose = PoseSymbols()
    frame = PathFrame(at_home, samples, Motion(pose.rotation, at_home.home, pose.position))
    remarks = examine_geometry(frame)
    builder = _Builder(frame)
    for limb in at_home.limbs:
        builder.add_limb(limb)
    for joints in () if at_home.graph is None else at_home.graph.networks:
        builder.add_network(joints)
    if not builder.networks:
        _check_carrying(builder)
    x, y, z = map(float, frame.typical_value(at_home.home).ravel())
    unknowns = ca.vertcat(SX(0, 1), *[item.symbol for item in builder.unknowns])
    closure = builder.closure
    labels = {symbol.element_hash(): label for symbol, label in builder.driven}
    driven = [k for k, each in enumerate(builder.unknowns) if each.symbol.element_hash() in labels]
    loops = examine_loops(frame, closure, builder.unknowns, driven)
    for k in loops.free:
        each = builder.unknowns[k]
        builder.unknowns[k] = replace(each, joint=labels[each.symbol.element_hash()])
    builder.add_modes()
    numbers = [at_home.symbols, unknowns, pose.rotation, pose.position]
    for network in builder.networks:
        add_resisting(builder, network, frame, numbers, loops.points)
    _check_carrying(builder)
    actuators = with_all_relations(builder.actuators)
    members = [with_kinds(member, actuators, at_home.size, numbers, loops.points) for member in builder.members]
    independent = tuple(closure[k] for k in loops.independent)
    everything = [replace(each, name=f"{each.name} in full") for each in (*closure, *builder.checks)]
    model = Model(
        name=words.name,
        description=words.description,
        length_unit=words.length_unit,
        size=at_home.size,
        options={"definition": definition},
        parameters=(*parameters(at_home), *more),
        pose=pose,
        home=(x, y, z),
        wrenches=tuple(builder.wrenches),
        legs=straight_legs(frame) if legs is None else tuple(legs),
        members=tuple(members),
        quantities=quantities(builder.actuators, builder.positions),
        scene=scene_of(builder.paths, pose, at_home.home, frame, builder.carrying, builder.networks),
        unknowns=tuple(builder.unknowns),
        closure=independent,
        loops=tuple(everything),
        signs=tuple(builder.signs),
        distances=tuple(builder.distances),
        actuators=actuators,
        joint_screws=tuple(builder.screws),
        structure=with_kept(builder.structure, independent),
        joints=tuple(builder.joints),
        links=with_shared_places(builder.links, frame),
        remarks=(*remarks, *builder.remarks, *member_remarks(builder.structure)),
    )
    ranks = generic_ranks(model, at_home, loops.points)
    return replace(model, generic=ranks, remarks=(*model.remarks, *rank_remarks(ranks.jacobian, builder.structure)))


def _check_carrying(builder: _Builder) -> None:
    """Refuse a robot without limbs that resist the platform, or without actuated joints."""
    if not (builder.wrenches or builder.members):
        raise RobotError(
            "", "no limb resists any motion of the platform: each limb has six or more independent passive joints"
        )
    if not builder.actuators:
        fault = "is given at no joint of the robot; write actuated = true at each joint that a motor drives"
        raise RobotError("actuated", fault)
