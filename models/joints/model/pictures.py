"""Drawing of a robot given joint by joint: links as bars and rods, rails, joint symbols, base and platform.

Each link of a network is drawn as lines between its joints, in the order of their names.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...arrays import FloatArray
from ...drawing import Body, JointKind, JointSymbol, Link, LinkKind, Point, Scene, outline
from ...parts import PoseSymbols
from ..home.chain import Limb
from ..home.generic import PathFrame
from ..posed.network import OpenNetwork
from ..posed.opened import OpenedPath
from ..posed.placed import SLIDING, Place, PlacedJoint, arc_between, placed_joints

#: Half length of a rail relative to the robot's size; it is not a dimension of the robot.
_RAIL = 0.2
#: Sine of the angle below which a slide is along a link, and distance, relative to the robot's size, below which points
#: coincide.
_SAME = 1e-9
#: Types of joints whose link transmits only tension and compression.
_ROD_ENDS = (JointKind.UNIVERSAL, JointKind.SPHERICAL)


class DrawnPath(NamedTuple):
    """Chain of a limb to be drawn.

    Attributes:
        limb: the limb.
        number: index of the chain in the limb.
        path: the chain.
        row: index, among the rows of J that belong to the limb, of the chain's row; only if the chain has one row and
            the limb several.
    """

    limb: Limb
    number: int
    path: OpenedPath
    row: int | None


@dataclass(eq=False)
class _Node:
    """Point of the drawing with its position (3,) at home and the kind of the joint there."""

    name: str
    at_home: FloatArray
    kind: JointKind | None = None


@dataclass(eq=False)
class _Sketch:
    """Builder of a drawing: points, lines and joint symbols, each added once."""

    frame: PathFrame
    size: float
    origin: SX
    carrying: Collection[str]
    points: dict[str, Point] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    joints: dict[str, JointSymbol] = field(default_factory=dict)
    outlines: dict[Body, list[_Node]] = field(default_factory=lambda: {Body.BASE: [], Body.PLATFORM: []})
    nodes: dict[str, _Node] = field(default_factory=dict)

    def node(self, name: str, place: Place, body: Body, kind: JointKind | None = None) -> _Node:
        """Return the point with a name; the point is added unless another chain has added it."""
        if name not in self.nodes:
            self.points[name] = Point(name, place.now, body)
            self.nodes[name] = _Node(name, self.frame.typical_value(place.home).ravel(), kind)
        return self.nodes[name]

    def link(self, start: _Node | None, end: _Node, drawn: DrawnPath | None, kind: LinkKind, body: Body) -> None:
        """Add a line between two points, unless it has zero length or another chain has added it."""
        if start is None or np.linalg.norm(end.at_home - start.at_home) <= _SAME * self.size:
            return
        if any((each.start, each.end) == (start.name, end.name) for each in self.links):
            return
        limb = None if drawn is None or drawn.limb.name not in self.carrying else drawn.limb.name
        row = None if drawn is None or limb is None else drawn.row
        self.links.append(Link(start.name, end.name, body, limb, kind, row))

    def symbol(self, name: str, joint: PlacedJoint, place: Place, body: Body, limb: Limb) -> None:
        """Add the symbol of a joint, unless another chain has added it."""
        axes, owner = tuple(axis.now for axis in joint.axes), limb.name if limb.name in self.carrying else None
        self.joints.setdefault(name, JointSymbol(name, joint.kind, place.now, axes, body, owner, joint.is_actuated))

    def is_along(self, start: Place, end: Place, axes: Sequence[Place]) -> bool:
        """Return True if two points differ and, at home, the line between them is along the first of some axes."""
        if not axes:
            return False
        way, direction = (self.frame.typical_value(each.home).ravel() for each in (end - start, axes[0]))
        apart = float(np.linalg.norm(way))
        return apart > _SAME * self.size and float(np.linalg.norm(np.cross(way, direction))) <= _SAME * apart

    def is_same(self, one: Place, other: Place) -> bool:
        """Return True if two points coincide at home."""
        return float(np.abs(self.frame.typical_value((one - other).home)).max()) <= _SAME * self.size


def scene_of(
    paths: Sequence[DrawnPath],
    pose: PoseSymbols,
    origin: SX,
    frame: PathFrame,
    carrying: Collection[str],
    networks: Sequence[OpenNetwork] = (),
) -> Scene:
    """Return the drawing of chains and networks at a pose.

    Args:
        paths: chains of all limbs.
        pose: symbols of the pose.
        origin: (3, 1) origin of the platform frame at home, length.
        frame: common data of all chains of the robot.
        carrying: names of the limbs with a wrench.
        networks: limbs that are networks.
    """
    sketch = _Sketch(frame, float(frame.typical_value(frame.size).item()), origin, carrying)
    for drawn in paths:
        _add_path(sketch, drawn, [each for each in paths if each.limb is drawn.limb])
    for network in networks:
        _add_network(sketch, network)
    centre = sketch.node("P", Place(pose.position, origin), Body.PLATFORM)
    for body, nodes in sketch.outlines.items():
        _add_outline(sketch, body, nodes, centre if body is Body.PLATFORM else None)
    return Scene(tuple(sketch.points.values()), tuple(sketch.links), joints=tuple(sketch.joints.values()))


def _add_path(sketch: _Sketch, drawn: DrawnPath, siblings: Sequence[DrawnPath]) -> None:
    """Add a chain to the drawing; ``siblings`` are all chains of the same limb."""
    joints = placed_joints(drawn.path, sketch.frame)
    stem = len(drawn.limb.stem) if len(drawn.limb.branches) > 1 else 0
    previous: _Node | None = None
    for k, joint in enumerate(joints):
        name = drawn.limb.label(drawn.number, joint.number - 1)
        if joint.number > stem and previous is not None and joints[k - 1].number <= stem:
            previous = _fork(sketch, drawn, siblings, previous, k)
        previous = _add_joint(sketch, drawn, joints, k, name, previous)
        if k == 0:
            base = sketch.nodes.get(f"{name} foot", previous)
            sketch.outlines[Body.BASE].append(_rail_end(sketch, name) or base)
    if previous is not None:
        sketch.outlines[Body.PLATFORM].append(previous)


def _fork(sketch: _Sketch, drawn: DrawnPath, siblings: Sequence[DrawnPath], stem: _Node, k: int) -> _Node:
    """Return the middle of the first joints of a limb's branches, at the end of a bar from the stem."""
    firsts = [placed_joints(each.path, sketch.frame)[k].foot for each in siblings]
    middle = sum(firsts, Place(SX.zeros(3), SX.zeros(3))) / len(firsts)
    fork = sketch.node(f"{drawn.limb.name}:fork", middle, Body.LIMB)
    sketch.link(stem, fork, drawn._replace(row=None), LinkKind.BAR, Body.LIMB)
    return fork


def _add_joint(
    sketch: _Sketch, drawn: DrawnPath, joints: Sequence[PlacedJoint], k: int, name: str, previous: _Node | None
) -> _Node:
    """Add a joint with the link before it, and return the point where the next link starts."""
    joint = joints[k]
    is_last = k == len(joints) - 1
    body = Body.PLATFORM if is_last else Body.BASE if k == 0 else Body.LIMB
    if joint.kind is JointKind.PARALLELOGRAM:
        return _add_parallelogram(sketch, drawn, joint, name, previous, body)
    if joint.kind is JointKind.PRISMATIC:
        return _add_slide(sketch, drawn, joints, k, name, previous)
    node = sketch.node(name, joint.place, body, joint.kind)
    kinds = {joint.kind, None if previous is None else previous.kind}
    is_rod = kinds <= set(_ROD_ENDS) or (previous is not None and previous.kind is JointKind.PRISMATIC and k > 1)
    bends = arc_between(joints[k - 1], joint, sketch.frame) if k else []
    for n, place in enumerate(bends):
        bend = sketch.node(f"{name} bend {n + 1}", place, Body.LIMB)
        sketch.link(previous, bend, drawn, LinkKind.BAR, Body.LIMB)
        previous = bend
    sketch.link(previous, node, drawn, LinkKind.ROD if is_rod else LinkKind.BAR, Body.LIMB)
    sketch.symbol(name, joint, joint.place, body, drawn.limb)
    return node


def _add_parallelogram(
    sketch: _Sketch, drawn: DrawnPath, joint: PlacedJoint, name: str, previous: _Node | None, body: Body
) -> _Node:
    """Add a parallelogram as two rods between two short sides, and return the middle of the far side."""
    near = sketch.node(f"{name} foot", joint.foot, Body.BASE if previous is None else Body.LIMB)
    sketch.link(previous, near, drawn, LinkKind.BAR, Body.LIMB)
    far = sketch.node(name, joint.place, body)
    if joint.side is None:
        return far
    corners = []
    for letter, middle, sign, driven in (
        ("a", joint.foot, 1, joint.is_actuated),
        ("b", joint.foot, -1, joint.is_actuated),
        ("c", joint.place, 1, False),
        ("d", joint.place, -1, False),
    ):
        place = middle + sign * joint.side
        corners.append(sketch.node(f"{name}{letter}", place, Body.LIMB))
        sketch.symbol(f"{name}{letter}", replace(joint, is_actuated=driven), place, Body.LIMB, drawn.limb)
    for start, end in ((0, 1), (2, 3), (0, 2), (1, 3)):
        sketch.link(corners[start], corners[end], drawn, LinkKind.ROD, Body.LIMB)
    return far


def _add_slide(
    sketch: _Sketch, drawn: DrawnPath, joints: Sequence[PlacedJoint], k: int, name: str, previous: _Node | None
) -> _Node:
    """Add a slide, in the middle of a telescopic leg or on a rail."""
    joint, is_last = joints[k], k == len(joints) - 1
    leg = _leg_of(sketch, joints, k)
    if leg is not None:
        middle = sketch.node(name, leg, Body.LIMB, joint.kind)
        sketch.link(previous, middle, drawn, LinkKind.BAR, Body.LIMB)
        sketch.symbol(name, joint, leg, Body.LIMB, drawn.limb)
        if not is_last:
            return middle
        tip = sketch.node(f"{name} end", _tip(sketch, joint), Body.PLATFORM)
        sketch.link(middle, tip, drawn, LinkKind.ROD, Body.LIMB)
        return tip
    body = Body.BASE if k == 0 else Body.LIMB
    foot = sketch.node(f"{name} foot", joint.foot, body)
    sketch.link(previous, foot, drawn, LinkKind.BAR, Body.LIMB)
    if joint.axes:
        half = _RAIL * sketch.frame.size * joint.axes[0]
        start = sketch.node(f"{name} rail start", joint.foot - half, body)
        end = sketch.node(f"{name} rail end", joint.foot + half, body)
        sketch.link(start, end, drawn, LinkKind.RAIL, body)
    node = sketch.node(name, joint.place, Body.PLATFORM if is_last else Body.LIMB)
    sketch.symbol(name, joint, joint.place, Body.LIMB, drawn.limb)
    return node


def _leg_of(sketch: _Sketch, joints: Sequence[PlacedJoint], k: int) -> Place | None:
    """Return the middle of the telescopic leg of a slide; None for a slide on a rail.

    A slide belongs to a leg if the slide is at one of its two neighbouring joints and moves towards the other one. If
    the slide is the last joint, its leg ends where the axis is nearest to the platform's origin.
    """
    joint = joints[k]
    if joint.is_in_rod:
        return joint.place
    if k == 0:
        return None
    before = joints[k - 1].place
    start, end = joint.foot, _tip(sketch, joint)
    if k + 1 < len(joints):
        end = joints[k + 1].foot
        if sketch.is_same(joint.place, end):
            start = before
    if not (sketch.is_same(start, before) and sketch.is_along(start, end, joint.axes)):
        return None
    return (start + end) / 2


def _tip(sketch: _Sketch, joint: PlacedJoint) -> Place:
    """Return the point on a slide's axis nearest to the platform's origin at home.

    The point moves with the body after the slide.
    """
    if not joint.axes:
        return joint.place
    way = ca.dot(sketch.origin - joint.place.home, joint.axes[0].home)
    return joint.place + way * joint.axes[0]


def _rail_end(sketch: _Sketch, name: str) -> _Node | None:
    """Return the end of a slide's rail, the farther one from the platform at home; None for a slide without a rail."""
    origin = sketch.frame.typical_value(sketch.origin).ravel()
    ends = [sketch.nodes[end] for end in (f"{name} rail start", f"{name} rail end") if end in sketch.nodes]
    return max(ends, key=lambda each: float(np.linalg.norm(each.at_home - origin)), default=None)


def _add_outline(sketch: _Sketch, body: Body, nodes: Sequence[_Node], centre: _Node | None) -> None:
    """Add the outline of base or platform, with a line to the platform's origin if the outline has no area.

    Args:
        sketch: the drawing.
        body: base or platform.
        nodes: points of the joints on this body.
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


def _add_network(sketch: _Sketch, network: OpenNetwork) -> None:
    """Add a network, with its joints on base and platform among their outlines."""
    name = network.name
    limb = name if name in sketch.carrying else None
    plates = {network.base: Body.BASE, network.platform: Body.PLATFORM}
    ends: dict[str, list[tuple[str, JointKind]]] = {}
    for k in network.joints:
        joint, label = network.joint(k), f"{name}:{network.graph.joints[k].name}"
        kind, bodies = JointKind(joint.type), network.ends(k)
        body = next((part for link, part in plates.items() if link in bodies), Body.LIMB)
        motions = [network.motions[each] for each in bodies]
        places = [Place.on(motions[0], joint.point)] * 2
        points = [label, label]
        if kind in SLIDING:
            home = joint.point + joint.axes[0].rod if kind is JointKind.PARALLELOGRAM else joint.point
            places[1], points[1] = Place.on(motions[1], home), f"{label} end"
            sketch.links.append(Link(points[0], points[1], Body.LIMB, limb))
        for link, point, place in zip(bodies, points, places, strict=True):
            sketch.points.setdefault(point, Point(point, place.now, body))
            if link in plates:
                sketch.outlines[plates[link]].append(sketch.node(point, place, plates[link]))
            else:
                ends.setdefault(link, []).append((point, kind))
        part = slice(3, 6) if kind in (JointKind.PRISMATIC, JointKind.PARALLELOGRAM) else slice(0, 3)
        shown = {JointKind.SPHERICAL: 0, JointKind.UNIVERSAL: 2}.get(kind, 1)
        axes = tuple(screw[part] for screw in network.screws[k][:shown])
        sketch.joints[label] = JointSymbol(label, kind, places[0].now, axes, body, limb, joint.actuated)
    for own in ends.values():
        is_rod = len(own) == 2 and all(kind in _ROD_ENDS for _, kind in own)
        for (one, _), (other, _) in pairwise([*own, own[0]] if len(own) > 2 else own):
            sketch.links.append(Link(one, other, Body.LIMB, limb, LinkKind.ROD if is_rod else LinkKind.BAR))
