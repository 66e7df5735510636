"""Joints and limbs at home, as expressions of the robot's dimensions.

A limb is one chain of joints from base to platform, or several chains that share the joints of a stem. The copies of a
repeated limb are its rotations about the axis of repetition. A robot given by links and joints has limbs where its
graph has such chains; the remaining joints form networks.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...expression import ExpressionError, NoValueError, UnknownNameError, evaluate
from ...mechanism.decomposition import GraphJoint, LimbPaths, Step, decompose
from ...mechanism.topology import bridges_between, reached
from ...parts import Dimension
from ...screws import Displacement, Screw, screw_displacement, unit_vector
from ..written.forms import RobotError, UndefinedError, VectorExpression
from ..written.words import GraphWords, JointWords, LimbWords, RepeatWords, RobotWords
from .motion import UNIT_VECTORS, AxisKind, JointAxis

#: Tolerance for rounding an entry of a copy's rotation to -1, -1/2, 0, 1/2 or 1. A rotation by 120 degrees then leaves
#: no rounding errors in the expressions.
_EXACT = 1e-15
#: Largest number of characters of an expression in a message.
_LONGEST_SHOWN = 60


@dataclass(frozen=True, eq=False)
class Joint:
    """Joint at home.

    Attributes:
        place: place in the robot file (limb and joint), for messages.
        type: letter of the joint type: ``R, P, H, C, U, S`` or ``Pa``.
        point: (3, 1) centre of the joint or point of its axis, length.
        axes: axes with one coordinate each, from the base side on; the three axes of a spherical joint are along x, y
            and z.
        actuated: True if an actuator drives the joint.
        name: name of the joint in the robot file; empty for a joint without a name.
        parts: joints of the robot file that this joint replaces; empty for a joint of the robot file itself.
    """

    place: str
    type: str
    point: SX
    axes: tuple[JointAxis, ...]
    actuated: bool
    name: str = ""
    parts: tuple[Joint, ...] = ()


@dataclass(frozen=True, eq=False)
class Limb:
    """Limb at home.

    Attributes:
        name: name of the limb.
        place: place of the limb in the robot file, for messages.
        group: index of the limb in the robot file of which this limb is a copy.
        stem: joints that all chains share, from the base on.
        branches: joints of each chain after the stem; one empty chain for a limb without branches.
        centre: (3, 1) centre given by the user, length; None for the centre that a rule determines.
        turn: (3, 3) rotation of this copy relative to the limb in the robot file.
    """

    name: str
    place: str
    group: int
    stem: tuple[Joint, ...]
    branches: tuple[tuple[Joint, ...], ...]
    centre: SX | None
    turn: FloatArray

    def member(self, path: int) -> str:
        """Return the name of a chain by its index: the limb's name, with a number if the limb has several chains."""
        return f"{self.name}.{path + 1}" if len(self.branches) > 1 else self.name

    def label(self, path: int, joint: int) -> str:
        """Return the label of a joint of a chain by their indices, such as ``2:3``, or ``2.1:3`` on a branch."""
        return f"{self.name if joint < len(self.stem) else self.member(path)}:{joint + 1}"

    @property
    def paths(self) -> list[tuple[Joint, ...]]:
        """Joints of each chain from base to platform."""
        return [(*self.stem, *branch) for branch in self.branches]


@dataclass(frozen=True, eq=False)
class LinkJoint:
    """Joint between two links at home: names of joint and links; ``joint`` is None for a weld."""

    name: str
    inner: str
    outer: str
    joint: Joint | None


@dataclass(frozen=True, eq=False)
class HomeGraph:
    """Links and joints of a robot at home.

    Attributes:
        links: names of the links.
        base, platform: names of the links that are base and platform.
        joints: joints between the links.
        couplings: linear relations of joint coordinates (radians and lengths): index of each joint, with a factor (1,
            1).
        networks: joint indices of each part of the graph that belongs to no limb.
    """

    links: tuple[str, ...]
    base: str
    platform: str
    joints: tuple[LinkJoint, ...]
    couplings: tuple[tuple[tuple[int, SX], ...], ...]
    networks: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class HomeRobot:
    """Robot at home.

    Attributes:
        words: robot as it is written.
        symbols: (d, 1) symbols of the dimensions, in order; radians for angles.
        typical: (d,) typical values of the dimensions.
        home: (3, 1) origin of the platform frame, length.
        size: (1, 1) characteristic size of the robot, length; lengths are divided by this size.
        limbs: limbs of the robot.
        graph: links and joints, for a robot given by links and joints; None for a robot given limb by limb.
    """

    words: RobotWords
    symbols: SX
    typical: FloatArray
    home: SX
    size: SX
    limbs: tuple[Limb, ...]
    graph: HomeGraph | None = None

    @property
    def joints(self) -> list[Joint]:
        """All joints, of the graph or of all chains of all limbs."""
        if self.graph is not None:
            return [each.joint for each in self.graph.joints if each.joint is not None]
        return [joint for limb in self.limbs for path in limb.paths for joint in path]


def home_of(words: RobotWords, values: Mapping[str, float] = MappingProxyType({})) -> HomeRobot:
    """Return a robot at home, from limbs or from links and joints.

    Args:
        words: robot as it is written.
        values: values of dimensions that are numbers, radians for angles; the other dimensions are symbols.

    Raises:
        UndefinedError: an expression has no finite value with these dimensions.
        RobotError: an expression has another fault, or the graph is not a parallel robot.
    """
    dimensions = words.dimensions.items()
    symbols = {name: SX(values[name]) if name in values else SX.sym(name) for name in words.dimensions}
    typical = [math.radians(item.typical) if item.kind is Dimension.ANGLE else item.typical for _, item in dimensions]
    names: dict[str, SX] = dict(symbols)
    for name, text in words.derived.items():
        later = [each for each in words.derived if each not in names]
        names[name] = scalar_value(f"derived, {name}", text, names, later)
    home, graph = _vector("home", words.home, names), None
    limbs = [limb for group, written in enumerate(words.limbs) for limb in _limbs(group, written, names)]
    if words.graph is not None:
        graph, limbs = _linked(words.graph, names)
    stacked = ca.vertcat(SX(0, 1), *symbols.values())
    lengths = [symbols[name] for name, item in dimensions if item.kind is Dimension.LENGTH]
    robot = HomeRobot(words, stacked, np.array(typical), home, SX(1), tuple(limbs), graph)
    return replace(robot, size=_size(lengths, robot))


def _size(lengths: Sequence[SX], robot: HomeRobot) -> SX:
    """Return the characteristic size of a robot (1, 1), length: smooth, and positive for nonzero dimensions.

    The size is the norm of all dimensions that are lengths and of the largest literal coordinate in the robot file. A
    robot without any of these has size 1.
    """
    points = ca.veccat(SX(0), *[joint.point for joint in robot.joints])
    is_length = np.array([item.kind is Dimension.LENGTH for item in robot.words.dimensions.values()], dtype=bool)
    own = [k for k, symbol in enumerate(ca.vertsplit(robot.symbols)) if symbol.is_symbolic()]
    function = ca.Function("points", [robot.symbols[own]], [ca.densify(points)])
    left = function(np.where(is_length, 0.0, robot.typical)[own]).full()
    written = float(np.abs(left[np.isfinite(left)]).max(initial=0.0))
    parts = [*lengths, *([SX(written)] if written else [])]
    return ca.norm_2(ca.vertcat(*parts)) if parts else SX(1)


def _limbs(group: int, words: LimbWords, names: Mapping[str, SX]) -> list[Limb]:
    known = _with_points(f"{words.place}, ", words.points, names)
    stem = tuple(_joint_at_home(joint, known) for joint in words.stem)
    branches = tuple(tuple(_joint_at_home(joint, known) for joint in branch) for branch in words.branches) or ((),)
    centre = None if words.centre is None else _vector(f"{words.place}, centre", words.centre, known)
    first = Limb("", words.place, group, stem, branches, centre, np.eye(3))
    turns = [None] if words.repeat is None else _turns(words.repeat)
    return [_turned(first, name, turn) for name, turn in zip(words.names, turns, strict=True)]


def _with_points(place: str, points: Mapping[str, VectorExpression], names: Mapping[str, SX]) -> dict[str, SX]:
    """Return the values of names and points, (3, 1) for each point.

    Args:
        place: beginning of the place in messages.
        points: points by name.
        names: values of the names that are defined before these points.
    """
    known = dict(names)
    for name, written in points.items():
        if name in known:
            raise RobotError(f"{place}point {name}", "has the name of a dimension")
        later = [each for each in points if each not in known]
        known[name] = _vector(f"{place}point {name}", written, known, later)
    return known


def _turns(repeat: RepeatWords) -> list[Displacement]:
    """Return the displacement of each copy of a repeated limb."""
    axis = unit_vector(repeat.axis)
    screw = Screw(axis, np.array(repeat.through), 0.0, 1.0)
    turns = []
    for angle in repeat.angles:
        rotation = np.array(screw_displacement(screw, math.radians(angle)).rotation)
        for exact in (-1.0, -0.5, 0.0, 0.5, 1.0):
            rotation[np.abs(rotation - exact) < _EXACT] = exact
        through = np.array(repeat.through)
        turns.append(Displacement.by(rotation, through - rotation @ through))
    return turns


def _turned(limb: Limb, name: str, turn: Displacement | None) -> Limb:
    if turn is None or turn.is_identity:
        return replace(limb, name=name)
    Q, t = SX(turn.rotation.tolist()), SX(turn.translation.tolist())

    def joint(each: Joint) -> Joint:
        axes = each.axes if each.type == "S" else tuple(replace(one, axis=Q @ one.axis) for one in each.axes)
        axes = tuple(replace(one, point=Q @ one.point + t, rod=Q @ one.rod) for one in axes)
        return replace(each, point=Q @ each.point + t, axes=axes)

    return replace(
        limb,
        name=name,
        stem=tuple(joint(each) for each in limb.stem),
        branches=tuple(tuple(joint(each) for each in branch) for branch in limb.branches),
        centre=None if limb.centre is None else Q @ limb.centre + t,
        turn=turn.rotation,
    )


def _joint_at_home(words: JointWords, names: Mapping[str, SX]) -> Joint:
    point = _vector(f"{words.place}, at", words.at, names)
    given = [_direction(f"{words.place}, axis", each, names) for each in words.axes]

    def axis(kind: AxisKind, direction: SX) -> JointAxis:
        return JointAxis(kind, direction, point, words.actuated)

    match words.type:
        case "S":
            axes = [axis(AxisKind.ROTATION, each) for each in UNIT_VECTORS]
        case "P":
            axes = [axis(AxisKind.TRANSLATION, given[0])]
        case "C":
            axes = [axis(AxisKind.ROTATION, given[0]), axis(AxisKind.TRANSLATION, given[0])]
        case "H":
            pitch = scalar_value(f"{words.place}, pitch", words.pitch, names)
            axes = [replace(axis(AxisKind.ROTATION, given[0]), pitch=pitch)]
        case "Pa":
            to = _vector(f"{words.place}, to", words.to if words.to is not None else words.at, names)
            axes = [replace(axis(AxisKind.PARALLELOGRAM, given[0]), rod=to - point)]
        case _:
            axes = [axis(AxisKind.ROTATION, each) for each in given]
    return Joint(words.place, words.type, point, tuple(axes), words.actuated, words.name)


def _direction(place: str, written: VectorExpression, names: Mapping[str, SX]) -> SX:
    vector = _vector(place, written, names)
    if vector.is_constant():
        numbers = np.array(ca.DM(vector)).ravel()
        if not numbers.any():
            raise UndefinedError(place, f"is {written!r}, which is zero; a direction is needed", {})
        return SX(unit_vector(numbers).tolist())
    return vector / ca.norm_2(vector)


def _vector(place: str, written: VectorExpression, names: Mapping[str, SX], later: Collection[str] = ()) -> SX:
    """Return the value of a vector expression, (3, 1); ``later`` has names that the robot file defines later."""
    if not isinstance(written, str):
        return ca.vertcat(*[scalar_value(place, each, names, later) for each in written])
    value = _evaluated(place, written, names, later)
    if value.shape != (3, 1):
        raise RobotError(place, f"is {written!r}, which is a number; a vector is needed")
    return value


def scalar_value(place: str, written: str | float, names: Mapping[str, SX], later: Collection[str] = ()) -> SX:
    """Return the value of a scalar expression, (1, 1); ``later`` has names that the robot file defines later."""
    value = _evaluated(place, written, names, later)
    if not value.is_scalar():
        raise RobotError(place, f"is {written!r}, which is a vector; a number is needed")
    return value


def _evaluated(place: str, written: str | float, names: Mapping[str, SX], later: Collection[str]) -> SX:
    try:
        return evaluate(written, names)
    except UnknownNameError as error:
        if error.name not in later:
            raise RobotError(place, f"is {_shown(written)}, which {error}") from None
        fault = f"is {_shown(written)}, which uses {error.name!r} before its definition; use names defined above"
        raise RobotError(place, fault) from None
    except NoValueError as error:
        raise UndefinedError(place, f"is {_shown(written)}, which {error}", error.values) from None
    except ExpressionError as error:
        raise RobotError(place, f"is {_shown(written)}, which {error}") from None


def _shown(written: str | float) -> str:
    """Return an expression for a message, shortened to a readable length."""
    text = repr(written)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[: _LONGEST_SHOWN - 3]}..."


def _linked(words: GraphWords, names: Mapping[str, SX]) -> tuple[HomeGraph, list[Limb]]:
    """Return links and joints at home, and the limbs that they form."""
    _check_graph(words)
    known = _with_points("", words.points, names)
    joints = tuple(
        LinkJoint(each.name, *each.between, None if each.joint is None else _joint_at_home(each.joint, known))
        for each in words.joints
    )
    index = {joint.name: k for k, joint in enumerate(joints)}
    couplings = []
    for coupling in words.couplings:
        factors = []
        for name, text in coupling.factors.items():
            factors.append((index[name], scalar_value(f"{coupling.place}, {name}", text, known)))
        for k, factor in factors:
            if factor.is_zero():
                raise RobotError(
                    f"{coupling.place}, {joints[k].name}", "is 0; the factor of a coupled joint must not be 0"
                )
        couplings.append(tuple(factors))
    edges = [
        GraphJoint(*each.between, each.joint is not None and each.joint.actuated, each.joint is None)
        for each in words.joints
    ]
    found = decompose(words.base, words.platform, edges, [[k for k, _ in each] for each in couplings])
    if not (found.limbs or found.networks):
        raise RobotError("platform", "is welded to the base; at least one movable joint between them is needed")
    networks = tuple(each.joints for each in found.networks)
    graph = HomeGraph(words.links, words.base, words.platform, joints, tuple(couplings), networks)
    return graph, [_limb(k, limb, joints) for k, limb in enumerate(found.limbs)]


def _check_graph(graph: GraphWords) -> None:
    """Refuse links without a connection to the base, and a platform on an open chain."""
    edges = [each.between for each in graph.joints]
    joined = reached(graph.base, edges)
    for link in graph.links:
        if link not in joined:
            raise RobotError(f"links, {link}", "is not connected to the base, neither directly nor through other links")
    path = bridges_between(graph.base, graph.platform, edges)
    coupled = {name for coupling in graph.couplings for name in coupling.factors}
    if path.is_open and not any(graph.joints[k].name in coupled for k in path.bridges):
        names = ", ".join(graph.joints[k].name for k in path.bridges)
        raise RobotError("platform", f"is at the end of an open chain ({names}); a parallel robot has closed loops")


def _limb(number: int, limb: LimbPaths, joints: Sequence[LinkJoint]) -> Limb:
    stem = _chain(limb.stem, joints)
    branches = tuple(_chain(branch, joints) for branch in limb.branches)
    if len(branches) == 1:
        stem, branches = (*stem, *branches[0]), ((),)
    return Limb(str(number + 1), f"limb {number + 1}", number, stem, branches, None, np.eye(3))


def _chain(steps: Sequence[Step], joints: Sequence[LinkJoint]) -> tuple[Joint, ...]:
    """Return the joints of a chain, from the base side on."""
    found = []
    for step in steps:
        joint = joints[step.joint].joint
        if joint is not None:
            found.append(joint if step.is_outward else _outward(joint))
    return tuple(found)


def _outward(joint: Joint) -> Joint:
    """Return a joint with exchanged links: reversed axes, and coordinates with the same signs."""
    if joint.type == "S":
        return joint
    if joint.type == "Pa":
        (axis,) = joint.axes
        place = joint.point + axis.rod
        return replace(joint, point=place, axes=(replace(axis, point=place, rod=-axis.rod),))
    return replace(joint, axes=tuple(replace(axis, axis=-axis.axis) for axis in reversed(joint.axes)))
