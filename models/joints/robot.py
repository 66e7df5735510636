"""A robot given joint by joint as a :class:`~screwsynth.models.model.Model`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np
from casadi import SX

from ..arrays import FloatArray
from ..basis import basis_of_member, constraint_rows, rank_of_rows
from ..instance import Substitution, jacobian
from ..limbjoints import LimbJoint, LimbLink
from ..member import Member, resisted_parts, scaled_twists
from ..model import Model
from ..parts import (
    Actuator,
    AssemblySign,
    Closure,
    Dimension,
    GenericRanks,
    JointScrews,
    Parameter,
    PathStructure,
    PoseSymbols,
    Quantity,
    Unknown,
)
from ..wrench import Wrench
from .chain import HomeRobot, Joint, Limb, home_robot
from .cut import choose_cut, simplified
from .distances import distance_equations
from .faults import examine_geometry
from .forms import Expression, RobotError, VectorExpression, plain
from .generic import sampled_dimensions
from .loops import ClosedPoint, PoseOf, examine_loops
from .modes import joint_signs, mode_signs
from .motion import AxisKind, Motion
from .opened import OpenedPath, PathFrame, Variables, open_path, slide_length
from .pictures import DrawnPath, scene_of
from .resistance import Ranks, path_ranks, resistance
from .segments import limb_links, with_shared_places
from .states import PathJoints
from .structure import joint_screws, member_remarks, structure_of, with_kept
from .words import RobotWords, read_words

#: Range of an unknown from home: half a turn for an angle; for a slide, four times the robot's size.
_TURN = float(np.pi)
_WAY = 4.0


def robot(
    name: str,
    *,
    limb: Sequence[Mapping[str, object]],
    home: VectorExpression = (0.0, 0.0, 0.0),
    dimensions: Mapping[str, Mapping[str, object]] | None = None,
    derived: Mapping[str, Expression] | None = None,
    description: str = "",
    length_unit: str = "",
) -> Model:
    """Return a robot that is given joint by joint, at home; the arguments are the keys of a robot file.

    Args:
        name: the robot's name.
        limb: its limbs, each a mapping with ``joints`` from base to platform, and optionally ``name``, ``repeat``,
            ``points``, ``branch`` and ``centre``.
        home: origin of the platform frame at home, where its axes are parallel to those of the world.
        dimensions: its dimensions by name, each a mapping with ``typical`` and optionally ``kind`` (``"length"``,
            ``"angle"`` or ``"number"``) and ``description``. The typical value of an angle is in degrees.
        derived: further numbers by name, as expressions of the dimensions and of earlier ones.
        description: one sentence for people.
        length_unit: unit of the typical dimensions, such as ``"m"``; empty for proportions in any unit.

    Raises:
        RobotError: a key or value is not allowed, or the robot cannot be put together near home.
    """
    tables = {
        "name": name,
        "limb": limb,
        "home": home,
        "dimensions": dimensions,
        "derived": derived,
        "description": description,
        "length_unit": length_unit,
    }
    definition = {key: plain(value) for key, value in tables.items() if value is not None and value != ""}
    return _model(read_words(tables), definition)


@dataclass(eq=False)
class _Builder:
    """The parts of a robot's model while its limbs are added one after the other."""

    robot: HomeRobot
    frame: PathFrame
    samples: FloatArray
    wrenches: list[Wrench] = field(default_factory=list)
    members: list[Member] = field(default_factory=list)
    unknowns: list[Unknown] = field(default_factory=list)
    closure: list[Closure] = field(default_factory=list)
    checks: list[Closure] = field(default_factory=list)
    signs: list[AssemblySign] = field(default_factory=list)
    distances: list[Closure] = field(default_factory=list)
    actuators: list[Actuator] = field(default_factory=list)
    positions: list[SX] = field(default_factory=list)
    screws: list[JointScrews] = field(default_factory=list)
    paths: list[DrawnPath] = field(default_factory=list)
    joints: list[LimbJoint] = field(default_factory=list)
    links: list[tuple[OpenedPath, list[LimbLink]]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    ranks: dict[tuple[int, int], Ranks] = field(default_factory=dict)
    structure: list[PathStructure] = field(default_factory=list)

    def add_limb(self, limb: Limb) -> None:
        """Add a limb: its unknowns, equations, rows, members and actuators."""
        passive = [joint for joint in limb.stem if not joint.actuated]
        if len(limb.branches) > 1 and passive:
            fault = "is passive and before the branches of its limb; only actuated joints may stand there"
            raise RobotError(passive[0].place, fault)
        known: dict[tuple[int, int], SX] = {}
        driven: dict[int, tuple[Joint, OpenedPath, int]] = {}
        labels: dict[int, str] = {}
        count, opened = len(self.unknowns), []
        for index, joints in enumerate(limb.paths):
            new = _labels(limb, index, joints, labels)
            labels |= new
            path = self._path(limb, index, joints, self._variables(limb, known), labels)
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
                    driven.setdefault(id(joint), (joint, path, j))
        if driven and limb.name not in self.carrying:
            fault = (
                "has an actuated joint that drives nothing, because its passive joints alone leave the platform free; "
                "remove actuated = true or a passive joint"
            )
            raise RobotError(limb.place, fault)
        self.signs += mode_signs(limb.name, opened, self.unknowns[count:], self.frame)
        several = len(driven) > 1
        for k, (joint, path, j) in enumerate(driven.values()):
            name = f"{limb.name}.{k + 1}" if several else limb.name
            (axis,) = joint.axes
            is_angle = axis.kind is AxisKind.ROTATION
            dimension = Dimension.ANGLE if is_angle else Dimension.LENGTH
            self.actuators.append(Actuator(name, limb.name, path.screws[j][0], dimension))
            way = slide_length(path, self.frame) if j == path.cut.slide else axis.way(known[id(joint), 0])
            self.positions.append(SX(0) if way is None else way)

    @property
    def carrying(self) -> set[str]:
        """Names of the limbs that resist the platform."""
        return {row.limb for row in self.wrenches} | {member.limb for member in self.members}

    def _remark_idle(self, limb: Limb) -> None:
        """Add the remark that a limb carries nothing, once for all copies."""
        remark = f"{limb.place} carries nothing: its passive joints leave the platform free"
        if remark not in self.remarks:
            self.remarks.append(remark)

    def _path(
        self, limb: Limb, index: int, joints: Sequence[Joint], variables: Variables, labels: Mapping[int, str]
    ) -> OpenedPath | None:
        """Add one path of a limb, and return it; None for a path that constrains nothing and drives nothing."""
        robot = self.robot
        joints = simplified(robot, joints, self.samples)
        cut = choose_cut(joints, len(limb.stem) if len(limb.branches) > 1 else 0, with_rods=limb.centre is None)
        key = limb.group, index
        if key not in self.ranks:
            self.ranks[key] = path_ranks(robot, joints, cut, self.samples)
        ranks = self.ranks[key]
        if ranks.passive == 6 and not any(joint.actuated for joint in joints):
            return None
        count = len(self.unknowns)
        path = open_path(joints, cut, variables, self.frame)
        rows, member = resistance(limb.name, path, ranks, limb.centre)
        before = sum(row.limb == limb.name for row in self.wrenches)
        row = before if len(limb.branches) > 1 and len(rows) == 1 else None
        self.paths.append(DrawnPath(limb.name, index + 1, len(limb.branches), len(limb.stem), path, row))
        several = len(limb.branches) > 1
        name = f"{limb.name}.{index + 1}" if several else limb.name
        self.wrenches += [replace(each, member=name) for each in rows] if several else rows
        self.members += [] if member is None else [replace(member, name=name if several else "")]
        self.closure += [Closure(f"loop {name} ({k + 1})", *each) for k, each in enumerate(path.equations)]
        self.checks += [Closure(f"sign {name} ({k + 1})", each) for k, each in enumerate(path.checks)]
        own = distance_equations(path, variables, self.frame)
        self.distances += [Closure(f"distance {name} ({k + 1})", *each) for k, each in enumerate(own)]
        self.signs += joint_signs(limb.name, name, path)
        self.structure.append(structure_of(limb.name, name, path, ranks, len(self.unknowns) - count))
        screws = joint_screws(limb.name, path, ranks, labels)
        self.screws += [] if screws is None else [screws]
        return path

    def _variables(self, limb: Limb, known: dict[tuple[int, int], SX]) -> Variables:
        """Return the function that gives the variable of a joint's axis, as a new unknown at its first use."""

        def variable(joint: Joint, axis: int) -> SX:
            key = id(joint), axis
            if key not in known:
                name = f"q{limb.name}_{len(known) + 1}"
                symbol = SX.sym(name)
                slides = joint.axes[axis].kind is AxisKind.TRANSLATION
                reach, size = (_WAY, self.robot.size) if slides else (_TURN, SX(1))
                dimension = Dimension.LENGTH if slides else Dimension.ANGLE
                words = "way of a slide" if slides else "angle of a joint"
                self.unknowns.append(Unknown(name, symbol, dimension, f"{words}, from home", -reach, reach, size))
                known[key] = symbol
            return known[key]

        return variable


def _labels(limb: Limb, index: int, joints: Sequence[Joint], known: Mapping[int, str]) -> dict[int, str]:
    """Return the label of each joint of a path that has none yet, such as ``2:3``, by the joint's identity.

    Args:
        limb: the limb.
        index: of the path among those of the limb.
        joints: of the path.
        known: labels of joints of other paths, which share the joints of the stem.
    """
    found = {}
    for j, joint in enumerate(joints):
        branch = f".{index + 1}" if j >= len(limb.stem) and len(limb.branches) > 1 else ""
        if id(joint) not in known:
            found[id(joint)] = f"{limb.name}{branch}:{j + 1}"
    return found


def _model(words: RobotWords, definition: Mapping[str, object]) -> Model:
    """Return the model of a robot from its words, and the tables that state them."""
    at_home = home_robot(words)
    samples = sampled_dimensions(at_home)
    remarks = examine_geometry(at_home, samples)
    pose = PoseSymbols()
    platform = Motion(pose.rotation, at_home.home, pose.position)
    frame = PathFrame(at_home.size, platform, at_home.symbols, at_home.typical, samples)
    builder = _Builder(at_home, frame, samples)
    for limb in at_home.limbs:
        builder.add_limb(limb)
    if not (builder.wrenches or builder.members):
        raise RobotError("", "no limb resists the platform: each has six or more independent passive joints")
    if not builder.actuators:
        fault = "is given at no joint of the robot; write actuated = true at each joint that a motor drives"
        raise RobotError("actuated", fault)
    unknowns = ca.vertcat(SX(0, 1), *[item.symbol for item in builder.unknowns])
    closure = builder.closure
    loops = examine_loops(at_home, closure, PoseOf(pose.rotation, pose.position), builder.unknowns, samples)
    numbers = [at_home.symbols, unknowns, pose.rotation, pose.position]
    members = [_with_kinds(member, builder, numbers, loops.points[0]) for member in builder.members]
    independent = tuple(closure[k] for k in loops.independent)
    everything = [replace(each, name=f"{each.name} in full") for each in (*closure, *builder.checks)]
    model = Model(
        name=words.name,
        description=words.description,
        length_unit=words.length_unit,
        options={"definition": definition},
        parameters=_parameters(at_home),
        pose=pose,
        home=frame.typical_triple(at_home.home),
        wrenches=tuple(builder.wrenches),
        members=tuple(members),
        quantities=_quantities(builder),
        scene=scene_of(builder.paths, pose, at_home.home, frame, builder.carrying),
        unknowns=tuple(builder.unknowns),
        closure=independent,
        loops=tuple(everything),
        signs=tuple(builder.signs),
        distances=tuple(builder.distances),
        actuators=tuple(builder.actuators),
        joint_screws=tuple(builder.screws),
        structure=with_kept(builder.structure, independent),
        joints=tuple(builder.joints),
        links=with_shared_places(builder.links, frame),
        remarks=(*remarks, *builder.remarks, *member_remarks(builder.structure)),
    )
    return replace(model, generic=_generic_ranks(model, at_home, loops.points))


def _generic_ranks(model: Model, robot: HomeRobot, points: Sequence[ClosedPoint]) -> GenericRanks:
    """Return the largest ranks of a robot's rows and constraints over closed configurations."""
    own = Substitution.identity(model)
    size = ca.Function("size", [robot.symbols], [robot.size])
    length = SX.sym("length")
    screws = ca.horzcat(SX(6, 0), *[each.screw for each in model.actuators])
    rows = jacobian(model.wrenches, length, model.members)
    function = ca.Function("rows", [*own.all, length], [ca.densify(rows), ca.densify(screws)])
    ranks = []
    for point in points:
        reach = float(size(point.dimensions))
        values = function(point.dimensions, point.unknowns, point.rotation, point.position, reach)
        J, driven = (each.full() for each in values)
        if np.isfinite(J).all():
            constraints = constraint_rows(model, J, driven)
            ranks.append([rank_of_rows(each, point.position, reach) for each in (J, constraints)])
    most = np.max(np.array(ranks).reshape(-1, 2), axis=0, initial=0)
    return GenericRanks(int(most[0]), int(most[1]))


def _with_kinds(member: Member, builder: _Builder, numbers: Sequence[SX], point: ClosedPoint) -> Member:
    """Return a member with the kinds of its wrenches, measured at a closed configuration."""
    size = builder.robot.size
    columns = scaled_twists(member.screws, member.centre, size, member.size)
    driving = [each.screw for each in builder.actuators if each.limb == member.limb]
    actuated = scaled_twists(ca.horzcat(SX(6, 0), *driving), member.centre, size, member.size)
    vectors = resisted_parts(columns, member.rank, ca.horzcat(SX.eye(member.size), actuated))
    function = ca.Function("kinds", list(numbers), [ca.densify(vectors)])
    found = function(point.dimensions, point.unknowns, point.rotation, point.position).full()
    basis = basis_of_member(found[:, : member.size], found[:, member.size :], member.size - member.rank)
    return replace(member, kinds=basis.kinds)


def _parameters(robot: HomeRobot) -> tuple[Parameter, ...]:
    """Return the dimensions of a robot as parameters of its model."""
    return tuple(
        Parameter(name, robot.symbols[k], item.kind, item.description or "dimension", (float(robot.typical[k]),))
        for k, (name, item) in enumerate(robot.words.dimensions.items())
    )


def _quantities(builder: _Builder) -> tuple[Quantity, ...]:
    """Return the positions of the actuators from home, angles and lengths apart."""
    found = []
    for dimension, name in ((Dimension.ANGLE, "actuator_angle"), (Dimension.LENGTH, "actuator_length")):
        own = [
            (each.name, position)
            for each, position in zip(builder.actuators, builder.positions, strict=True)
            if each.dimension is dimension
        ]
        if own:
            owners, values = zip(*own, strict=True)
            words = f"{dimension.value} by which an actuator is away from home"
            found.append(Quantity(name, owners, ca.vertcat(*values), dimension, words))
    return tuple(found)
