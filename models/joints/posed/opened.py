"""Opened chain of joints: current screws, and the equations that close its loop through base and platform.

Bodies on the base side are displaced by the joints before them; those on the platform side by the pose and the joints
after them. At the cut, equations state that the joint there holds together:

* spherical: both centres coincide (3 equations);
* universal: both centres coincide, and the angle between the axes is that at home (4);
* revolute: both centres coincide, and both axes are parallel (5);
* rod of constant length: the distance of its ends is that at home (1); for an actuated rod: none;
* no joint: both bodies coincide (6).

Each equation has a scale by which it is divided, so that its values are about 1. For lengths this is the size of the
robot.

Distance equations follow from these, each without the coordinates of one joint: the distance between a hinge or
universal joint and the joint at the cut does not change with the joint's own rotation. It equals the distance on the
other side of the cut. Such an equation lacks one or two unknowns, so that a search over boxes can exclude ranges of
the other unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...parts import Closure
from ..home.chain import Joint
from ..home.generic import INCIDENT, PathFrame
from ..home.motion import UNIT_VECTORS, Motion
from .cut import Cut

#: Squared sine of the angle below which a slide and its rod are parallel: rounding leaves 1e-16.
_STRAIGHT = 1e-14
#: Function that returns the coordinate of one axis of a joint, a symbol.
Variables = Callable[[Joint, int], SX]


class LoopEquation(NamedTuple):
    """Expression (1, 1) that is zero in a closed loop, and its size, an expression of the dimensions."""

    expression: SX
    size: SX


@dataclass(eq=False, kw_only=True)
class Opened:
    """Chain or network with opened loops.

    Attributes:
        equations: equations of the closed loops.
        checks: expressions that are 0 if the loop closes, and not 0 for the reversed closures (axis opposite, half
            turn) that the equations also allow.
    """

    equations: list[LoopEquation] = field(default_factory=list)
    checks: list[SX] = field(default_factory=list)


@dataclass(eq=False)
class OpenedPath(Opened):
    """Chain of joints at any pose, opened at its cut.

    Attributes:
        joints: joints from base to platform.
        cut: place at which the chain is opened.
        screws: current screws (6, 1) of the axes of each joint; empty for a joint of a rod with unknown axes.
        behind: displacement of the body on the platform side of each joint; None for joints between the two sides of
            the cut.
        points: (3, 1) current position of each joint on the body on its base side, length.
        sides: displacements of the bodies on the base side and on the platform side of the cut.
        rod: (3, 1) vector along the rod, to the joint at the cut; None without a rod.
    """

    joints: Sequence[Joint]
    cut: Cut
    screws: list[list[SX]]
    behind: list[Motion | None]
    points: list[SX]
    sides: tuple[Motion, Motion]
    rod: SX | None = None

    def body_before(self, j: int) -> Motion | None:
        """Return the displacement of the body on the base side of a joint; None for a rod."""
        if j in (self.cut.first, self.cut.last + 1):
            return self.sides[0 if j <= self.cut.last else 1]
        return self.behind[j - 1] if j else Motion.none()

    def body_behind(self, j: int) -> Motion | None:
        """Return the displacement of the body on the platform side of a joint; None for a rod."""
        return self.behind[j] or (self.sides[1] if j == self.cut.last else None)


def open_path(joints: Sequence[Joint], cut: Cut, variables: Variables, frame: PathFrame) -> OpenedPath:
    """Return a chain opened at a cut.

    Args:
        joints: joints from base to platform.
        cut: place at which the chain is opened.
        variables: function that returns the coordinates of the axes outside the cut.
        frame: common data of all chains of the robot.
    """
    count = len(joints)
    ends = Motion.none(), frame.platform
    path = OpenedPath(joints, cut, [[] for _ in joints], [None] * count, [joint.point for joint in joints], ends)
    base = Motion.none()
    for j in range(cut.first):
        path.points[j] = base.point(joints[j].point)
        for a, axis in enumerate(joints[j].axes):
            value = variables(joints[j], a)
            path.screws[j].append(axis.screw(value, base))
            base = base.after(axis.motion(value))
        path.behind[j] = base
    platform = frame.platform
    for j in range(count - 1, cut.last, -1):
        path.behind[j] = platform
        for a in range(len(joints[j].axes) - 1, -1, -1):
            axis, value = joints[j].axes[a], variables(joints[j], a)
            path.screws[j].insert(0, axis.screw(value, platform))
            platform = platform.after(axis.motion(value).inverse())
        path.points[j] = platform.point(joints[j].point)
    path.sides = base, platform
    if cut.far is not None:
        _join_rod(path, base, platform, frame)
    elif cut.type:
        join_joint(path, base, platform, frame)
    else:
        join_rigidly(path, base, platform, joints[min(cut.first, count - 1)].point, frame)
    return path


def closures(kind: str, name: str, sides: Iterable[tuple[SX, ...]]) -> list[Closure]:
    """Return loop equations with names by limb or chain, such as ``loop 1.2 (3)``.

    Args:
        kind: first word of the names.
        name: name of the limb or chain.
        sides: left side of each equation, and its size unless this is 1.
    """
    return [Closure(f"{kind} {name} ({k + 1})", *each) for k, each in enumerate(sides)]


def loop_equations(expressions: SX, size: SX | None = None) -> list[LoopEquation]:
    """Return equations from left sides (k, 1) and a common size; without a size, the left sides must be about 1."""
    return [LoopEquation(each, SX(1) if size is None else size) for each in ca.vertsplit(expressions)]


def join_rigidly(path: Opened, one: Motion, other: Motion, place: SX, frame: PathFrame) -> None:
    """Add the equations of two rigidly joined bodies: equal rotations, and one common point (3, 1) at home, length."""
    turn = one.rotation.T @ other.rotation
    apart = one.rotation.T @ (other.point(place) - one.point(place))
    path.equations += loop_equations(ca.inv_skew(turn - turn.T) / 2) + loop_equations(apart, frame.size)
    path.checks.append(3 - ca.trace(turn))


def join_joint(path: OpenedPath, base: Motion, platform: Motion, frame: PathFrame) -> None:
    """Add screws and equations of a joint at the cut, from the displacements of its two sides."""
    joints, j = path.joints, path.cut.joint
    joint = joints[j]
    ends = base.point(joint.point), platform.point(joint.point)
    path.equations += loop_equations(ends[0] - ends[1], frame.size)
    shorter_base = sum(len(each.axes) for each in joints[:j]) < sum(len(each.axes) for each in joints[j + 1 :])
    path.points[j] = ends[0] if shorter_base else ends[1]
    path.behind[j] = platform
    if joint.type == "S":
        path.screws[j] = rotations_about(path.points[j])
        return
    if joint.type == "U":
        first, second = joint.axes
        directions = base.rotation @ first.axis, platform.rotation @ second.axis
        # In a closed loop both axes pass through one point, so one expression of the point serves both.
        path.screws[j] = [ca.vertcat(each, ca.cross(path.points[j], each)) for each in directions]
        angle = ca.dot(first.axis, second.axis)
        path.equations += loop_equations(ca.dot(*directions) - angle)
        return
    (axis,) = joint.axes
    path.screws[j] = [axis.screw(SX(0), base)]
    across, turned = normals_of(axis.axis, frame), platform.rotation @ axis.axis
    path.equations += loop_equations(ca.vertcat(*[ca.dot(base.rotation @ normal, turned) for normal in across]))
    path.checks.append(1 - ca.dot(base.rotation @ axis.axis, turned))


def _join_rod(path: OpenedPath, base: Motion, platform: Motion, frame: PathFrame) -> None:
    """Add the screws of a rod between the two sides, and its equation of constant length."""
    joints, cut = path.joints, path.cut
    j, far, slide = cut.joint, cut.far, cut.slide
    if far is None:
        return
    sides = (base, platform) if far < j else (platform, base)
    home = joints[j].point - joints[far].point
    path.points[far] = sides[0].point(joints[far].point)
    path.points[j] = sides[1].point(joints[j].point)
    path.rod = path.points[j] - path.points[far]
    path.screws[j] = rotations_about(path.points[j])
    if joints[far].type == "S":
        path.screws[far] = rotations_about(path.points[far])
    square = ca.sumsqr(home)
    is_straight = True
    if slide is not None:
        offset = square - ca.dot(home, joints[slide].axes[0].axis) ** 2
        is_straight = bool(np.all(frame.sampled(offset / square) <= _STRAIGHT))
    if joints[far].type == "U" and is_straight:
        directions = directions_at_rod(path, sides[0], frame)
        path.screws[far] = [ca.vertcat(each, ca.cross(path.points[far], each)) for each in directions]
    if slide is None:
        path.equations += loop_equations(ca.sumsqr(path.rod) - square, 2 * square)
        return
    # A slide that is not along the rod has an unknown direction: only its component along the rod does work.
    current = ca.sumsqr(path.rod)
    part = 1 / ca.sqrt(current) if is_straight else ca.sqrt(current - offset) / current
    path.screws[slide] = [ca.vertcat(SX.zeros(3), path.rod * part * _slide_sign(path, frame))]
    path.points[slide] = (path.points[j] + path.points[far]) / 2


def directions_at_rod(path: OpenedPath, side: Motion, frame: PathFrame, *, is_bounded: bool = False) -> tuple[SX, SX]:
    """Return the current axes (3, 1) of the universal joint at the far end of a rod, from the rod's direction.

    The first axis moves with the known body. The second keeps its angles with the first axis and with the rod. With the
    first axis ``u`` and the rod's direction ``d`` it is ``a u + b d + g u x d``, where ``g`` has the sign of home. The
    expressions are undefined where the rod is along the first axis, or beyond the reach.

    Args:
        path: the chain, with its rod.
        side: displacement of the body with the first axis.
        frame: common data of all chains of the robot.
        is_bounded: If true, the axes are also defined beyond the reach.
    """
    j, far, rod = path.cut.joint, path.cut.far, path.rod
    if far is None or rod is None:
        raise ValueError("the opened loop has no rod, so the axes at the ends of a rod are undefined")
    home = path.joints[j].point - path.joints[far].point
    axes = path.joints[far].axes if far < j else path.joints[far].axes[::-1]
    first, second = (axis.axis for axis in axes)
    u, d, d_home = side.rotation @ first, rod / ca.norm_2(rod), home / ca.norm_2(home)
    across, along, w = ca.dot(first, second), ca.dot(second, d_home), ca.dot(u, d)
    a, b = (across - along * w) / (1 - w**2), (along - across * w) / (1 - w**2)
    within = a * u + b * d
    sign = -1.0 if frame.typical_value(ca.dot(second, ca.cross(first, d_home))).item() < 0 else 1.0
    square = 1 - ca.sumsqr(within)
    g = sign * ca.sqrt((ca.fmax(square, 0) if is_bounded else square) / (1 - w**2))
    return u, within + g * ca.cross(u, d)


def slide_length(path: OpenedPath, frame: PathFrame) -> SX | None:
    """Return the travel (1, 1) from home of the actuated slide of a chain's rod, length; None without such a slide."""
    cut = path.cut
    if path.rod is None or cut.slide is None or cut.far is None:
        return None
    home = path.joints[cut.joint].point - path.joints[cut.far].point
    along = ca.dot(home, path.joints[cut.slide].axes[0].axis)
    way = ca.sqrt(ca.sumsqr(path.rod) - (ca.sumsqr(home) - along**2)) - ca.fabs(along)
    return way * (_slide_sign(path, frame) if cut.far < cut.joint else -_slide_sign(path, frame))


def _slide_sign(path: OpenedPath, frame: PathFrame) -> float:
    """Return 1 if the slide of a chain's rod points along the rod, -1 if against it."""
    cut = path.cut
    if cut.slide is None or cut.far is None:
        return 1.0
    home = path.joints[cut.joint].point - path.joints[cut.far].point
    along = frame.typical_value(ca.dot(path.joints[cut.slide].axes[0].axis, home)).item()
    return -1.0 if along < 0 else 1.0


def rotations_about(point: SX) -> list[SX]:
    """Return three rotations (6, 1) about a point, along x, y and z."""
    return [ca.vertcat(each, ca.cross(point, each)) for each in UNIT_VECTORS]


def normals_of(axis: SX, frame: PathFrame) -> list[SX]:
    """Return two vectors (3, 1) normal to an axis, from the coordinate axes that are typically farthest from it."""
    order = np.argsort(np.abs(frame.typical_value(axis)).ravel(), kind="stable")
    first = ca.cross(axis, UNIT_VECTORS[int(order[0])])
    return [first, ca.cross(axis, first)]


def distance_equations(path: OpenedPath, variables: Variables, frame: PathFrame) -> list[LoopEquation]:
    """Return the distance equations of a chain opened at a joint; none for a chain with a rod, or opened at no joint.

    Args:
        path: the chain.
        variables: function that returns the coordinates of the axes outside the cut.
        frame: common data of all chains of the robot.
    """
    cut = path.cut
    if cut.far is not None or not cut.type:
        return []
    joints, j, size = path.joints, cut.joint, frame.size
    centre, found = joints[j].point, []
    for i, joint in enumerate(joints):
        if i == j or not all(axis.is_hinge for axis in joint.axes):
            continue
        apart = ca.norm_2(centre - joint.point) / size
        if frame.typical_value(apart).item() <= INCIDENT:
            continue
        between, side = Motion.none(), path.sides[1 if i < j else 0]
        steps = range(i + 1, j) if i < j else range(i - 1, j, -1)
        for k in steps:
            motions = [axis.motion(variables(joints[k], a)) for a, axis in enumerate(joints[k].axes)]
            for motion in motions if i < j else [each.inverse() for each in reversed(motions)]:
                between = between.after(motion)
        own = ca.sumsqr(between.point(centre) - joint.point)
        found.append(LoopEquation(ca.sumsqr(side.point(centre) - path.points[i]) - own, size**2))
    return found
