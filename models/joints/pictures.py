"""The drawing of a robot given joint by joint: links as bars and rods, rails, symbols of joints, base and platform."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ..arrays import FloatArray
from ..drawing import Body, JointKind, JointSymbol, Link, LinkKind, Point, Scene
from ..parts import PoseSymbols
from .networkpictures import NetworkDrawing
from .opened import OpenedPath, PathFrame
from .outline import outline
from .placed import PlacedJoint, arc_between, placed_joints

#: Half of the length of a rail, in parts of the robot's size: it is no dimension of the robot.
_RAIL = 0.2
#: Sine of an angle, and distance in parts of the robot's size, below which a slide is along a link and points are one.
_SAME = 1e-9
#: Joints whose link between them can only push and pull.
_ROD_ENDS = (JointKind.UNIVERSAL, JointKind.SPHERICAL)


class DrawnPath(NamedTuple):
    """A path of a limb to be drawn.

    Attributes:
        limb: name of the limb.
        number: of the path among those of its limb, from 1.
        paths: number of paths of its limb.
        stem: number of joints, as they are written, that all paths of the limb share.
        path: the path.
        row: index of its row among those of the limb, where it has one only and the limb has others.
    """

    limb: str
    number: int
    paths: int
    stem: int
    path: OpenedPath
    row: int | None


@dataclass(eq=False)
class _Node:
    """A point of the drawing with its place (3,) at home, and the kind of the joint there."""

    name: str
    at_home: FloatArray
    kind: JointKind | None = None


@dataclass(eq=False)
class _Sketch:
    """The drawing while its paths are added one after the other."""

    frame: PathFrame
    size: float
    origin: SX
    carrying: Collection[str]
    points: dict[str, Point] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    joints: dict[str, JointSymbol] = field(default_factory=dict)
    outlines: dict[Body, list[_Node]] = field(default_factory=lambda: {Body.BASE: [], Body.PLATFORM: []})
    nodes: dict[str, _Node] = field(default_factory=dict)

    def node(self, name: str, place: SX, at_home: SX, body: Body, kind: JointKind | None = None) -> _Node:
        """Add a point, unless it has been drawn with another path, and return it."""
        if name not in self.nodes:
            self.points[name] = Point(name, place, body)
            self.nodes[name] = _Node(name, self.frame.typical_value(at_home).ravel(), kind)
        return self.nodes[name]

    def link(self, start: _Node | None, end: _Node, drawn: DrawnPath | None, kind: LinkKind, body: Body) -> None:
        """Add a line, unless it has no length or has been drawn with another path."""
        if start is None or np.linalg.norm(end.at_home - start.at_home) <= _SAME * self.size:
            return
        if any((each.start, each.end) == (start.name, end.name) for each in self.links):
            return
        limb = None if drawn is None or drawn.limb not in self.carrying else drawn.limb
        row = None if drawn is None or limb is None else drawn.row
        self.links.append(Link(start.name, end.name, body, limb, kind, row))

    def symbol(self, name: str, joint: PlacedJoint, place: SX, body: Body, limb: str) -> None:
        """Add the symbol of a joint, unless it has been drawn with another path."""
        owner = limb if limb in self.carrying else None
        self.joints.setdefault(name, JointSymbol(name, joint.kind, place, joint.axes, body, owner, joint.is_actuated))

    def is_along(self, start: SX, end: SX, axis: SX | None) -> bool:
        """Return whether two places (3, 1) at home are apart from each other along an axis (3, 1) at home."""
        if axis is None:
            return False
        way, direction = (self.frame.typical_value(each).ravel() for each in (end - start, axis))
        apart = float(np.linalg.norm(way))
        return apart > _SAME * self.size and float(np.linalg.norm(np.cross(way, direction))) <= _SAME * apart

    def is_same(self, one: SX, other: SX) -> bool:
        """Return whether two places at home are one."""
        return float(np.abs(self.frame.typical_value(one - other)).max()) <= _SAME * self.size


def scene_of(
    paths: Sequence[DrawnPath],
    pose: PoseSymbols,
    origin: SX,
    frame: PathFrame,
    carrying: Collection[str],
    networks: Sequence[NetworkDrawing] = (),
) -> Scene:
    """Return the drawing of paths and networks at a pose.

    Args:
        paths: of all limbs.
        pose: symbols of the pose.
        origin: (3, 1) origin of the platform frame at home, length.
        frame: values that all paths share.
        carrying: names of the limbs that have a wrench.
        networks: drawings of networks.
    """
    sketch = _Sketch(frame, float(frame.typical_value(frame.size).item()), origin, carrying)
    for drawn in paths:
        _add_path(sketch, drawn, [each for each in paths if each.limb == drawn.limb])
    for network in networks:
        _add_network(sketch, network)
    centre = sketch.node("P", pose.position, origin, Body.PLATFORM)
    for body, nodes in sketch.outlines.items():
        _add_outline(sketch, body, nodes, centre if body is Body.PLATFORM else None)
    return Scene(tuple(sketch.points.values()), tuple(sketch.links), joints=tuple(sketch.joints.values()))


def _add_network(sketch: _Sketch, network: NetworkDrawing) -> None:
    """Add a network, with its joints on base and platform among their outlines."""
    sketch.points |= {each.name: each for each in network.points}
    sketch.links += network.links
    sketch.joints |= {each.name: each for each in network.joints}
    for body, own in ((Body.BASE, network.base), (Body.PLATFORM, network.platform)):
        sketch.outlines[body] += [sketch.node(name, place, at_home, body) for name, place, at_home in own]


def _add_path(sketch: _Sketch, drawn: DrawnPath, own: Sequence[DrawnPath]) -> None:
    """Add a path of a limb, whose paths are ``own``."""
    joints = placed_joints(drawn.path, sketch.frame)
    stem = drawn.stem if drawn.paths > 1 else 0
    previous: _Node | None = None
    for k, joint in enumerate(joints):
        in_stem = joint.number <= stem
        name = (
            f"{drawn.limb}:{joint.number}"
            if in_stem or drawn.paths == 1
            else f"{drawn.limb}.{drawn.number}:{joint.number}"
        )
        if not in_stem and previous is not None and joints[k - 1].number <= stem:
            previous = _fork(sketch, drawn, own, previous, k)
        previous = _add_joint(sketch, drawn, joints, k, name, previous)
        if k == 0:
            base = sketch.nodes.get(f"{name} foot", previous)
            sketch.outlines[Body.BASE].append(_rail_end(sketch, name) or base)
    if previous is not None:
        sketch.outlines[Body.PLATFORM].append(previous)


def _fork(sketch: _Sketch, drawn: DrawnPath, own: Sequence[DrawnPath], stem: _Node, k: int) -> _Node:
    """Return the middle of the first joints of a limb's branches, at the end of a bar from the stem."""
    firsts = [placed_joints(each.path, sketch.frame)[k] for each in own]
    place = sum((each.foot for each in firsts), SX.zeros(3)) / len(firsts)
    at_home = sum((each.foot_at_home for each in firsts), SX.zeros(3)) / len(firsts)
    fork = sketch.node(f"{drawn.limb}:fork", place, at_home, Body.LIMB)
    sketch.link(stem, fork, drawn._replace(row=None), LinkKind.BAR, Body.LIMB)
    return fork


def _add_joint(
    sketch: _Sketch, drawn: DrawnPath, joints: Sequence[PlacedJoint], k: int, name: str, previous: _Node | None
) -> _Node:
    """Add a joint with the link before it, and return the point from which the next link goes on."""
    joint = joints[k]
    is_last = k == len(joints) - 1
    body = Body.PLATFORM if is_last else Body.BASE if k == 0 else Body.LIMB
    if joint.kind is JointKind.PARALLELOGRAM:
        return _add_parallelogram(sketch, drawn, joint, name, previous, body)
    if joint.kind is JointKind.PRISMATIC:
        return _add_slide(sketch, drawn, joints, k, name, previous)
    node = sketch.node(name, joint.place, joint.at_home, body, joint.kind)
    kinds = {joint.kind, None if previous is None else previous.kind}
    is_rod = kinds <= set(_ROD_ENDS) or (previous is not None and previous.kind is JointKind.PRISMATIC and k > 1)
    bends = arc_between(joints[k - 1], joint, sketch.frame) if k else []
    for n, (place, at_home) in enumerate(bends):
        bend = sketch.node(f"{name} bend {n + 1}", place, at_home, Body.LIMB)
        sketch.link(previous, bend, drawn, LinkKind.BAR, Body.LIMB)
        previous = bend
    sketch.link(previous, node, drawn, LinkKind.ROD if is_rod else LinkKind.BAR, Body.LIMB)
    sketch.symbol(name, joint, joint.place, body, drawn.limb)
    return node


def _add_parallelogram(
    sketch: _Sketch, drawn: DrawnPath, joint: PlacedJoint, name: str, previous: _Node | None, body: Body
) -> _Node:
    """Add a parallelogram as two rods between two short sides, and return the middle of the far side."""
    near = sketch.node(f"{name} foot", joint.foot, joint.foot_at_home, Body.BASE if previous is None else Body.LIMB)
    sketch.link(previous, near, drawn, LinkKind.BAR, Body.LIMB)
    far = sketch.node(name, joint.place, joint.at_home, body)
    if joint.side is None or joint.side_at_home is None:
        return far
    corners = []
    for letter, place, at_home, sign, driven in (
        ("a", joint.foot, joint.foot_at_home, 1, joint.is_actuated),
        ("b", joint.foot, joint.foot_at_home, -1, joint.is_actuated),
        ("c", joint.place, joint.at_home, 1, False),
        ("d", joint.place, joint.at_home, -1, False),
    ):
        corner = f"{name}{letter}"
        corners.append(sketch.node(corner, place + sign * joint.side, at_home + sign * joint.side_at_home, Body.LIMB))
        sketch.symbol(corner, replace(joint, is_actuated=driven), place + sign * joint.side, Body.LIMB, drawn.limb)
    for start, end in ((0, 1), (2, 3), (0, 2), (1, 3)):
        sketch.link(corners[start], corners[end], drawn, LinkKind.ROD, Body.LIMB)
    return far


def _add_slide(
    sketch: _Sketch, drawn: DrawnPath, joints: Sequence[PlacedJoint], k: int, name: str, previous: _Node | None
) -> _Node:
    """Add a slide: in the middle of a leg that it lengthens, or on a rail."""
    joint, is_last = joints[k], k == len(joints) - 1
    leg = _leg_of(sketch, joints, k)
    if leg is not None:
        middle = sketch.node(name, leg.place, leg.at_home, Body.LIMB, joint.kind)
        sketch.link(previous, middle, drawn, LinkKind.BAR, Body.LIMB)
        sketch.symbol(name, joint, leg.place, Body.LIMB, drawn.limb)
        if not is_last:
            return middle
        tip = sketch.node(f"{name} end", *_tip(sketch, joint), Body.PLATFORM)
        sketch.link(middle, tip, drawn, LinkKind.ROD, Body.LIMB)
        return tip
    body = Body.BASE if k == 0 else Body.LIMB
    foot = sketch.node(f"{name} foot", joint.foot, joint.foot_at_home, body)
    sketch.link(previous, foot, drawn, LinkKind.BAR, Body.LIMB)
    if joint.axes and joint.axis_at_home is not None:
        half, half_at_home = (_RAIL * sketch.frame.size * axis for axis in (joint.axes[0], joint.axis_at_home))
        start = sketch.node(f"{name} rail start", joint.foot - half, joint.foot_at_home - half_at_home, body)
        end = sketch.node(f"{name} rail end", joint.foot + half, joint.foot_at_home + half_at_home, body)
        sketch.link(start, end, drawn, LinkKind.RAIL, body)
    node = sketch.node(name, joint.place, joint.at_home, Body.PLATFORM if is_last else Body.LIMB)
    sketch.symbol(name, joint, joint.place, Body.LIMB, drawn.limb)
    return node


class _Place(NamedTuple):
    """A place (3, 1) in world coordinates and at home, length."""

    place: SX
    at_home: SX


def _leg_of(sketch: _Sketch, joints: Sequence[PlacedJoint], k: int) -> _Place | None:
    """Return the middle of the leg that a slide lengthens; None where it is on a rail.

    A slide lengthens a leg where it is at one of the joints beside it and slides towards the other one. A last slide
    lengthens a leg that ends where its axis is nearest to the platform's origin.
    """
    joint = joints[k]
    if joint.is_in_rod:
        return _Place(joint.place, joint.at_home)
    if k == 0:
        return None
    before = joints[k - 1]
    start, end = _Place(joint.foot, joint.foot_at_home), _tip(sketch, joint)
    if k + 1 < len(joints):
        after = joints[k + 1]
        end = _Place(after.foot, after.foot_at_home)
        if sketch.is_same(joint.at_home, after.foot_at_home):
            start = _Place(before.place, before.at_home)
    if not (
        sketch.is_same(start.at_home, before.at_home)
        and sketch.is_along(start.at_home, end.at_home, joint.axis_at_home)
    ):
        return None
    return _Place((start.place + end.place) / 2, (start.at_home + end.at_home) / 2)


def _tip(sketch: _Sketch, joint: PlacedJoint) -> _Place:
    """Return the point of a slide's axis, on the body behind it, that is nearest to the platform's origin at home."""
    if not joint.axes or joint.axis_at_home is None:
        return _Place(joint.place, joint.at_home)
    way = ca.dot(sketch.origin - joint.at_home, joint.axis_at_home)
    return _Place(joint.place + way * joint.axes[0], joint.at_home + way * joint.axis_at_home)


def _rail_end(sketch: _Sketch, name: str) -> _Node | None:
    """Return the end of a rail that is farther from the platform at home; None where a slide has no rail."""
    origin = sketch.frame.typical_value(sketch.origin).ravel()
    ends = [sketch.nodes[end] for end in (f"{name} rail start", f"{name} rail end") if end in sketch.nodes]
    return max(ends, key=lambda each: float(np.linalg.norm(each.at_home - origin)), default=None)


def _add_outline(sketch: _Sketch, body: Body, nodes: Sequence[_Node], centre: _Node | None) -> None:
    """Add the outline of base or platform; where it is no area, a line to the platform's origin too.

    Args:
        sketch: the drawing.
        body: base or platform.
        nodes: points of the joints on it.
        centre: origin of the platform frame; None for the base.
    """
    corners = [nodes[k] for k in outline(np.array([node.at_home for node in nodes]))]
    if len(corners) > 2:
        for one, other in zip(corners, [*corners[1:], corners[0]], strict=True):
            sketch.link(one, other, None, LinkKind.BAR, body)
        return
    sketch.link(corners[0], corners[-1], None, LinkKind.BAR, body)
    if centre is not None:
        ends = [each.at_home for each in corners]
        nearest = min(corners, key=lambda each: float(np.linalg.norm(each.at_home - centre.at_home)))
        around = sum(float(np.linalg.norm(each - centre.at_home)) for each in ends)
        if len(ends) == 1 or around > (1 + _SAME) * float(np.linalg.norm(ends[0] - ends[1])):
            sketch.link(nearest, centre, None, LinkKind.BAR, body)
