"""The joints of a path as a drawing shows them: places and axes at any pose, for the joints as they are written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ..drawing import JointKind
from .chain import Joint
from .motion import Motion
from .opened import OpenedPath, PathFrame

#: Distance of a parallelogram's rods from its middle, in parts of the rod: it is no dimension of the robot.
_APART = 0.05
#: Number of bends of an arc, squared sine of the angle between two axes below which they are parallel, and distance
#: below which they meet, in parts of the distance between their hinges.
_BENDS, _PARALLEL, _MEET = 8, 1e-6, 1e-9
#: Distances of the first and the last hinge of a spherical limb from its centre, in parts of the robot's size.
_REACHES = (1.3, 0.7)
#: Kinds of joints that move their point.
_SLIDING = (JointKind.PRISMATIC, JointKind.HELICAL, JointKind.CYLINDRICAL, JointKind.PARALLELOGRAM)


@dataclass(frozen=True, eq=False)
class PlacedJoint:
    """A joint of a path at any pose.

    Attributes:
        number: of the joint among those written, 1 at the base.
        kind: of the joint.
        foot, place: (3, 1) its point on the body before it and on the body behind it, length; they differ where it
            slides, and for a parallelogram, whose rod is between them.
        foot_at_home, at_home: (3, 1) the same at home.
        axes: each (3, 1) in world coordinates; none for a spherical joint.
        axis_at_home: (3, 1) its first axis at home; None for a spherical joint.
        is_actuated: whether an actuator drives it.
        is_in_rod: whether it is the slide of a rod, whose place is the rod's middle.
        side, side_at_home: (3, 1) half of a short side of a parallelogram; None for another joint.
    """

    number: int
    kind: JointKind
    foot: SX
    place: SX
    foot_at_home: SX
    at_home: SX
    axes: tuple[SX, ...]
    axis_at_home: SX | None
    is_actuated: bool
    is_in_rod: bool = False
    side: SX | None = None
    side_at_home: SX | None = None


def placed_joints(path: OpenedPath, frame: PathFrame) -> list[PlacedJoint]:
    """Return the joints of a path from base to platform.

    Two hinges that were taken together as a universal joint are shown as they are written. Three of them, taken
    together as a spherical joint, are shown as that joint: the middle axis is on neither side of the cut.
    """
    found: list[PlacedJoint] = []
    number = 1
    for j, joint in enumerate(path.joints):
        before, behind = _before(path, j), _behind(path, j)
        if joint.type == "U" and joint.parts and before is not None and behind is not None:
            found += _hinges(joint.parts, before, behind, number)
        else:
            found.append(_placed(path, j, frame, number))
        number += len(joint.parts) or 1
    return _spread(found, frame)


def _spread(joints: list[PlacedJoint], frame: PathFrame) -> list[PlacedJoint]:
    """Return the hinges of a spherical limb, all at one point, apart from each other along their axes."""
    homes = [frame.typical_value(each.at_home).ravel() for each in joints]
    size = frame.typical_value(frame.size).item()
    if len(joints) < 2 or any(each.kind is not JointKind.REVOLUTE for each in joints):
        return joints
    if max(float(np.abs(home - homes[0]).max()) for home in homes) > _MEET * size:
        return joints
    found = []
    for joint, reach in zip(joints, np.linspace(*_REACHES, len(joints)), strict=True):
        away, at_home = float(reach) * frame.size * joint.axes[0], joint.at_home
        if joint.axis_at_home is not None:
            at_home = at_home + float(reach) * frame.size * joint.axis_at_home
        place = joint.place + away
        found.append(replace(joint, foot=place, place=place, foot_at_home=at_home, at_home=at_home))
    return found


def _before(path: OpenedPath, j: int) -> Motion | None:
    """Return the displacement of the body before a joint; None within a rod."""
    if j <= path.cut.first:
        return path.sides[0] if j == path.cut.first else path.behind[j - 1] if j else Motion.none()
    if j <= path.cut.last:
        return None
    return path.sides[1] if j == path.cut.last + 1 else path.behind[j - 1]


def _behind(path: OpenedPath, j: int) -> Motion | None:
    """Return the displacement of the body behind a joint; None within a rod."""
    if path.cut.first <= j <= path.cut.last:
        return path.sides[1] if j == path.cut.last else None
    return path.behind[j]


def _hinges(parts: Sequence[Joint], before: Motion, behind: Motion, number: int) -> list[PlacedJoint]:
    """Return two hinges whose axes meet: each lies on an axis that the body beside it carries."""
    found = []
    for k, (part, body) in enumerate(zip(parts, (before, behind), strict=True)):
        place, axis = body.point(part.point), part.axes[0].axis
        axes = (body.rotation @ axis,)
        found.append(
            PlacedJoint(number + k, JointKind.REVOLUTE, place, place, part.point, part.point, axes, axis, part.actuated)
        )
    return found


def _placed(path: OpenedPath, j: int, frame: PathFrame, number: int) -> PlacedJoint:
    """Return one joint."""
    joint, kind = path.joints[j], JointKind(path.joints[j].type)
    before, behind = _before(path, j), _behind(path, j)
    foot = place = path.points[j]
    foot_at_home = at_home = joint.point
    side = side_at_home = None
    in_rod = before is None and behind is None
    if in_rod and path.cut.far is not None:
        ends = path.joints[path.cut.joint].point + path.joints[path.cut.far].point
        foot_at_home = at_home = ends / 2
    elif kind in _SLIDING and before is not None and behind is not None:
        if kind is JointKind.PARALLELOGRAM:
            at_home = joint.point + joint.axes[0].rod
            side_at_home = _APART * ca.cross(joint.axes[0].axis, joint.axes[0].rod)
            side = before.rotation @ side_at_home
        foot, place = before.point(joint.point), behind.point(at_home)
    axes = _axes(path, j, before, behind, frame)
    axis = None if kind is JointKind.SPHERICAL else joint.axes[0].axis
    return PlacedJoint(
        number,
        kind,
        foot,
        place,
        foot_at_home,
        at_home,
        axes,
        axis,
        joint.actuated,
        in_rod,
        side,
        side_at_home,
    )


def _axes(path: OpenedPath, j: int, before: Motion | None, behind: Motion | None, frame: PathFrame) -> tuple[SX, ...]:
    """Return the current axes of a joint."""
    joint = path.joints[j]
    if joint.type == "S":
        return ()
    if joint.type == "U":
        first, second = (axis.axis for axis in joint.axes)
        if before is not None and behind is not None:
            return before.rotation @ first, behind.rotation @ second
        return _axes_at_rod(path, before, behind, first, second, frame)
    if before is None:
        return () if path.rod is None else (path.rod,)
    return (before.rotation @ joint.axes[0].axis,)


def _axes_at_rod(
    path: OpenedPath, before: Motion | None, behind: Motion | None, first: SX, second: SX, frame: PathFrame
) -> tuple[SX, ...]:
    """Return the axes of the universal joint at the end of a rod.

    One axis moves with the body beside the rod. The other one keeps its angles with it and with the rod.
    """
    body = before or behind
    if body is None or path.rod is None or path.cut.far is None:
        return ()
    home = path.joints[path.cut.joint].point - path.joints[path.cut.far].point
    home, rod = home / ca.norm_2(home), path.rod / ca.norm_2(path.rod)
    known_at_home, other_at_home = (first, second) if before is not None else (second, first)
    known = body.rotation @ known_at_home
    cos_known, cos_rod, cos_between = (
        ca.dot(other_at_home, known_at_home),
        ca.dot(other_at_home, home),
        ca.dot(known, rod),
    )
    square = 1 - cos_between**2
    x = (cos_known - cos_between * cos_rod) / square
    y = (cos_rod - cos_between * cos_known) / square
    rest = ca.fmax(1 - x * cos_known - y * cos_rod, 0)
    across = ca.dot(ca.cross(known_at_home, home), other_at_home)
    sign = -1.0 if float(frame.typical_value(across).item()) < 0 else 1.0
    other = x * known + y * rod + sign * ca.sqrt(rest / square) * ca.cross(known, rod)
    return (known, other) if before is not None else (other, known)


def arc_between(one: PlacedJoint, other: PlacedJoint, frame: PathFrame) -> list[tuple[SX, SX]]:
    """Return places between two hinges whose axes meet, on an arc about their common point, as spherical links are.

    Each is (3, 1) in world coordinates and (3, 1) at home. There are none where the axes do not meet, or meet at one of
    the hinges.
    """
    if {one.kind, other.kind} != {JointKind.REVOLUTE} or one.axis_at_home is None or other.axis_at_home is None:
        return []
    points = [frame.typical_value(each.at_home).ravel() for each in (one, other)]
    axes = [frame.typical_value(each).ravel() for each in (one.axis_at_home, other.axis_at_home)]
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
        now = one.place + reaches[0] * one.axes[0]
        home = one.at_home + reaches[0] * one.axis_at_home
        place = now + float(weights[0]) * (one.place - now) + float(weights[1]) * (other.place - now)
        at_home = home + float(weights[0]) * (one.at_home - home) + float(weights[1]) * (other.at_home - home)
        found.append((place, at_home))
    return found
