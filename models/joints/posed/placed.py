"""The joints of a path as a drawing shows them: places and axes at any pose, for the joints as they are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ...drawing import JointKind
from ..home.chain import Joint
from ..home.generic import PathFrame
from ..home.motion import Motion
from .opened import OpenedPath, directions_at_rod

#: Distance of a parallelogram's rods from its middle, in parts of the rod: it is no dimension of the robot.
_APART = 0.05
#: Number of bends of an arc, squared sine of the angle between two axes below which they are parallel, and distance
#: below which they meet, in parts of the distance between their hinges.
_BENDS, _PARALLEL, _MEET = 8, 1e-6, 1e-9
#: Distances of the first and the last hinge of a spherical limb from its centre, in parts of the robot's size.
_REACHES = (1.3, 0.7)
#: Kinds of joints that move their point.
SLIDING = (JointKind.PRISMATIC, JointKind.HELICAL, JointKind.CYLINDRICAL, JointKind.PARALLELOGRAM)


@dataclass(frozen=True, eq=False)
class Place:
    """A place or a direction, (3, 1) in world coordinates each: at any pose, and at home.

    What is drawn depends on the places at home, and moves with those at any pose: both are calculated alike.
    """

    now: SX
    home: SX

    @classmethod
    def on(cls, body: Motion, point: SX) -> Place:
        """Return a point (3, 1) at home that moves with a body."""
        return cls(body.point(point), point)

    @classmethod
    def along(cls, body: Motion, direction: SX) -> Place:
        """Return a direction (3, 1) at home that turns with a body."""
        return cls(body.rotation @ direction, direction)

    def __add__(self, other: Place) -> Place:
        return Place(self.now + other.now, self.home + other.home)

    def __sub__(self, other: Place) -> Place:
        return Place(self.now - other.now, self.home - other.home)

    def __rmul__(self, factor: SX | float) -> Place:
        return Place(factor * self.now, factor * self.home)

    def __truediv__(self, divisor: float) -> Place:
        return Place(self.now / divisor, self.home / divisor)


@dataclass(frozen=True, eq=False)
class PlacedJoint:
    """A joint of a path at any pose.

    Attributes:
        number: of the joint among those written, 1 at the base.
        kind: of the joint.
        foot, place: its point on the body before it and on the body behind it; they differ where it slides, and for a
            parallelogram, whose rod is between them.
        axes: its axes; none for a spherical joint.
        is_actuated: whether an actuator drives it.
        is_in_rod: whether it is the slide of a rod, whose place is the rod's middle.
        side: half of a short side of a parallelogram; None for another joint.
    """

    number: int
    kind: JointKind
    foot: Place
    place: Place
    axes: tuple[Place, ...]
    is_actuated: bool
    is_in_rod: bool = False
    side: Place | None = None


def placed_joints(path: OpenedPath, frame: PathFrame) -> list[PlacedJoint]:
    """Return the joints of a path from base to platform.

    Two hinges that were taken together as a universal joint are shown as they are written. Three of them, taken
    together as a spherical joint, are shown as that joint: the middle axis is on neither side of the cut.
    """
    found: list[PlacedJoint] = []
    number = 1
    for j, joint in enumerate(path.joints):
        before, behind = path.body_before(j), path.body_behind(j)
        if joint.type == "U" and joint.parts and before is not None and behind is not None:
            found += _hinges(joint.parts, before, behind, number)
        else:
            found.append(_placed(path, j, frame, number))
        number += len(joint.parts) or 1
    return _spread(found, frame)


def _spread(joints: list[PlacedJoint], frame: PathFrame) -> list[PlacedJoint]:
    """Return the hinges of a spherical limb, all at one point, apart from each other along their axes."""
    homes = [frame.typical_value(each.place.home).ravel() for each in joints]
    size = frame.typical_value(frame.size).item()
    if len(joints) < 2 or any(each.kind is not JointKind.REVOLUTE for each in joints):
        return joints
    if max(float(np.abs(home - homes[0]).max()) for home in homes) > _MEET * size:
        return joints
    places = [
        joint.place + float(reach) * frame.size * joint.axes[0]
        for joint, reach in zip(joints, np.linspace(*_REACHES, len(joints)), strict=True)
    ]
    return [replace(joint, foot=place, place=place) for joint, place in zip(joints, places, strict=True)]


def _hinges(parts: Sequence[Joint], before: Motion, behind: Motion, number: int) -> list[PlacedJoint]:
    """Return two hinges whose axes meet: each lies on an axis that the body beside it carries."""
    found = []
    for k, (part, body) in enumerate(zip(parts, (before, behind), strict=True)):
        place, axes = Place.on(body, part.point), (Place.along(body, part.axes[0].axis),)
        found.append(PlacedJoint(number + k, JointKind.REVOLUTE, place, place, axes, part.actuated))
    return found


def _placed(path: OpenedPath, j: int, frame: PathFrame, number: int) -> PlacedJoint:
    """Return one joint."""
    joint, kind = path.joints[j], JointKind(path.joints[j].type)
    before, behind = path.body_before(j), path.body_behind(j)
    foot = place = Place(path.points[j], joint.point)
    side = None
    in_rod = before is None and behind is None
    if in_rod and path.cut.far is not None:
        ends = path.joints[path.cut.joint].point + path.joints[path.cut.far].point
        foot = place = Place(path.points[j], ends / 2)
    elif kind in SLIDING and before is not None and behind is not None:
        (axis, *_), far = joint.axes, joint.point
        if kind is JointKind.PARALLELOGRAM:
            far = joint.point + axis.rod
            side = Place.along(before, _APART * ca.cross(axis.axis, axis.rod))
        foot, place = Place.on(before, joint.point), Place.on(behind, far)
    return PlacedJoint(number, kind, foot, place, _axes(path, j, frame), joint.actuated, in_rod, side)


def _axes(path: OpenedPath, j: int, frame: PathFrame) -> tuple[Place, ...]:
    """Return the current axes of a joint."""
    joint, before, behind = path.joints[j], path.body_before(j), path.body_behind(j)
    if joint.type == "S":
        return ()
    axes = [axis.axis for axis in joint.axes]
    if joint.type == "U":
        if before is not None and behind is not None:
            return Place.along(before, axes[0]), Place.along(behind, axes[1])
        body = before or behind
        if body is None:
            return ()
        known, other = directions_at_rod(path, body, frame, is_bounded=True)
        now = (known, other) if before is not None else (other, known)
        return tuple(Place(*each) for each in zip(now, axes, strict=True))
    if before is None:
        return () if path.rod is None else (Place(path.rod, axes[0]),)
    return (Place.along(before, axes[0]),)


def arc_between(one: PlacedJoint, other: PlacedJoint, frame: PathFrame) -> list[Place]:
    """Return places between two hinges whose axes meet, on an arc about their common point, as spherical links are.

    There are none where the axes do not meet, or meet at one of the hinges.
    """
    if {one.kind, other.kind} != {JointKind.REVOLUTE}:
        return []
    points = [frame.typical_value(each.place.home).ravel() for each in (one, other)]
    axes = [frame.typical_value(each.axes[0].home).ravel() for each in (one, other)]
    normal = np.cross(axes[0], axes[1])
    square = float(normal @ normal)
    if square < _PARALLEL:
        return []
    way = points[1] - points[0]
    reaches = [float(np.cross(way, axis) @ normal) / square for axis in reversed(axes)]
    size = float(np.linalg.norm(way))
    centre = points[0] + reaches[0] * axes[0]
    if min(map(abs, reaches)) <= _MEET * size or abs(float(way @ normal)) > _MEET * size:
        return []
    rays = [point - centre for point in points]
    lengths = [float(np.linalg.norm(ray)) for ray in rays]
    angle = float(np.arccos(np.clip(rays[0] @ rays[1] / (lengths[0] * lengths[1]), -1.0, 1.0)))
    if np.sin(angle) < _MEET:
        return []
    found = []
    for part in np.linspace(0.0, 1.0, _BENDS + 2)[1:-1]:
        radius = (1 - part) * lengths[0] + part * lengths[1]
        weights = np.sin([(1 - part) * angle, part * angle]) / np.sin(angle) * radius / lengths
        # The centre moves with the axis of the first hinge, and the rays with their hinges.
        middle = one.place + reaches[0] * one.axes[0]
        rays_now = float(weights[0]) * (one.place - middle), float(weights[1]) * (other.place - middle)
        found.append(middle + rays_now[0] + rays_now[1])
    return found
