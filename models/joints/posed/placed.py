"""Joints of a chain for drawings: positions and axes, at any pose, of the joints as they are written."""

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

#: Distance of a parallelogram's rods from its middle, relative to the rod length; it is not a dimension of the robot.
_APART = 0.05
#: Number of bends of an arc; squared sine of the angle below which axes are parallel; distance below which they
#: intersect, relative to the distance between their hinges.
_BENDS, _PARALLEL, _MEET = 8, 1e-6, 1e-9
#: Distances of the first and the last hinge of a spherical limb from its centre, relative to the robot's size.
_REACHES = (1.3, 0.7)
#: Types of joints that move their point.
SLIDING = (JointKind.PRISMATIC, JointKind.HELICAL, JointKind.CYLINDRICAL, JointKind.PARALLELOGRAM)


@dataclass(frozen=True, eq=False)
class Place:
    """Point or direction of a drawing, (3, 1) in world coordinates: at any pose, and at home.

    The points at home decide how the drawing looks; the points at any pose move it. Both are computed alike.
    """

    now: SX
    home: SX

    @classmethod
    def on(cls, body: Motion, point: SX) -> Place:
        """Return the point that is ``point`` (3, 1) at home and moves with a body."""
        return cls(body.point(point), point)

    @classmethod
    def along(cls, body: Motion, direction: SX) -> Place:
        """Return the direction that is ``direction`` (3, 1) at home and rotates with a body."""
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
    """Joint of a chain at any pose.

    Attributes:
        number: number of the written joint, 1 at the base.
        kind: kind of the joint.
        foot, place: point of the joint on the body before it and on the body after it; they differ for a slide and for
            a parallelogram, whose rod is between them.
        axes: axes of the joint; empty for a spherical joint.
        is_actuated: True if an actuator drives the joint.
        is_in_rod: True for the slide of a rod, placed at the rod's middle.
        side: half of a short side of a parallelogram; None for other joints.
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
    """Return the joints of a chain from base to platform.

    Two hinges merged into a universal joint are shown as they are written. Three hinges merged into a spherical joint
    are shown as that joint, because the middle axis is on neither side of the cut.
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
    """Return the concurrent hinges of a spherical limb, spread along their axes."""
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
    """Return two hinges with intersecting axes, each on the axis carried by the adjacent body."""
    found = []
    for k, (part, body) in enumerate(zip(parts, (before, behind), strict=True)):
        place, axes = Place.on(body, part.point), (Place.along(body, part.axes[0].axis),)
        found.append(PlacedJoint(number + k, JointKind.REVOLUTE, place, place, axes, part.actuated))
    return found


def _placed(path: OpenedPath, j: int, frame: PathFrame, number: int) -> PlacedJoint:
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
    """Return points on an arc between two hinges with intersecting axes, for a spherical link.

    The list is empty if the axes do not intersect, or intersect at one of the hinges.
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
