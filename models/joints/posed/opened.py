"""A path of joints whose loop through base and platform is opened: its current screws, and the equations that close it.

From the base on, a body is displaced by the joints before it; from the platform on, by the pose and the joints behind
it. The two sides meet at the cut, where equations say that the joint there holds together:

* spherical: its two centres coincide (3 equations);
* universal: the same, and the angle between its axes is that at home (4);
* R: its two centres coincide, and its two axes are parallel (5);
* a rod of constant length: the distance of its ends is that at home (1); of a rod that is driven: none;
* no joint: the two bodies coincide (6).

Each equation has a size, by which it becomes a number of order 1: for lengths the robot's.

Distances follow from these equations, each without the variables of one joint: a hinge or universal joint and the joint
at the cut are at a distance that the joint's own rotation does not change. The two places, one on each side of the cut,
have the distance that the joints between give them. Such an equation lacks one or two of the unknowns, so that a search
of a whole box finds where the others cannot be.
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

#: Squared sine of the angle between a slide and its rod below which they are parallel: rounding leaves 1e-16.
_STRAIGHT = 1e-14
#: Returns the variable of one axis of a joint, a symbol.
Variables = Callable[[Joint, int], SX]


class LoopEquation(NamedTuple):
    """An expression (1, 1) that is zero where a loop is closed, and its size, an expression of the dimensions."""

    expression: SX
    size: SX


@dataclass(eq=False, kw_only=True)
class Opened:
    """What is opened, a path or a network.

    Attributes:
        equations: that hold where its loops are closed.
        checks: further expressions that are zero there: signs that the equations leave open.
    """

    equations: list[LoopEquation] = field(default_factory=list)
    checks: list[SX] = field(default_factory=list)


@dataclass(eq=False)
class OpenedPath(Opened):
    """A path of joints at any pose.

    Attributes:
        joints: from base to platform.
        cut: where it is opened.
        screws: current screws (6, 1) of the axes of each joint; none for a joint of a rod whose axes are not known.
        behind: displacement of the body behind each joint, on the platform's side; none for joints between two sides.
        points: (3, 1) current place of each joint on the body before it, on the base's side, length.
        sides: displacement of the bodies on the base's and on the platform's side of the cut.
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
        """Return the displacement of the body on the base's side of a joint; None for a rod."""
        if j in (self.cut.first, self.cut.last + 1):
            return self.sides[0 if j <= self.cut.last else 1]
        return self.behind[j - 1] if j else Motion.none()

    def body_behind(self, j: int) -> Motion | None:
        """Return the displacement of the body on the platform's side of a joint; None for a rod."""
        return self.behind[j] or (self.sides[1] if j == self.cut.last else None)


def open_path(joints: Sequence[Joint], cut: Cut, variables: Variables, frame: PathFrame) -> OpenedPath:
    """Return a path that is opened at a cut.

    Args:
        joints: from base to platform.
        cut: where it is opened.
        variables: of the axes of all joints that are not between the two sides.
        frame: values that all paths of the robot share.
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
    """Return equations with the name of their limb or path, such as ``loop 1.2 (3)``.

    Args:
        kind: first word of the names.
        name: of the limb or path.
        sides: left side of each, and its size where it is not 1.
    """
    return [Closure(f"{kind} {name} ({k + 1})", *each) for k, each in enumerate(sides)]


def loop_equations(expressions: SX, size: SX | None = None) -> list[LoopEquation]:
    """Return equations from their left sides (k, 1) and a common size; without one they are of order 1."""
    return [LoopEquation(each, SX(1) if size is None else size) for each in ca.vertsplit(expressions)]


def join_rigidly(path: Opened, one: Motion, other: Motion, place: SX, frame: PathFrame) -> None:
    """Add the equations by which two bodies coincide: their rotations, and a place (3, 1) at home on both, length."""
    turn = one.rotation.T @ other.rotation
    apart = one.rotation.T @ (other.point(place) - one.point(place))
    path.equations += loop_equations(ca.inv_skew(turn - turn.T) / 2) + loop_equations(apart, frame.size)
    path.checks.append(3 - ca.trace(turn))


def join_joint(path: OpenedPath, base: Motion, platform: Motion, frame: PathFrame) -> None:
    """Add screws and equations of a joint at the cut, between displacements of its two sides."""
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
        # Both axes pass through one point where the loop is closed: the expressions of the point are the same then.
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
    """Add screws, and the equation of a constant length, of a rod between the two sides."""
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
    # The slide's own direction is not known where it is not along the rod: only its part along the rod does work.
    current = ca.sumsqr(path.rod)
    part = 1 / ca.sqrt(current) if is_straight else ca.sqrt(current - offset) / current
    path.screws[slide] = [ca.vertcat(SX.zeros(3), path.rod * part * _slide_sign(path, frame))]
    path.points[slide] = (path.points[j] + path.points[far]) / 2


def directions_at_rod(path: OpenedPath, side: Motion, frame: PathFrame, *, is_bounded: bool = False) -> tuple[SX, SX]:
    """Return the current axes (3, 1) of the universal joint at the far end of a rod, whose direction it follows.

    One axis moves with the known body. The other keeps its angles against the first axis and against the rod. With the
    first axis ``u`` and the rod's direction ``d`` it is ``a u + b d + g u x d``, where ``g`` has the sign of home. The
    expressions have no value where the rod is along the first axis, or would have to be bent beyond its reach.

    Args:
        path: the path, with its rod.
        side: displacement of the body that the first axis moves with.
        frame: values that all paths of the robot share.
        is_bounded: whether the axes have a value beyond the reach too.
    """
    j, far, rod = path.cut.joint, path.cut.far, path.rod
    if far is None or rod is None:
        raise ValueError("the path has no rod")
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
    """Return the way (1, 1) of the actuated slide of a path's rod from home, length; None without such a slide."""
    cut = path.cut
    if path.rod is None or cut.slide is None or cut.far is None:
        return None
    home = path.joints[cut.joint].point - path.joints[cut.far].point
    along = ca.dot(home, path.joints[cut.slide].axes[0].axis)
    way = ca.sqrt(ca.sumsqr(path.rod) - (ca.sumsqr(home) - along**2)) - ca.fabs(along)
    return way * (_slide_sign(path, frame) if cut.far < cut.joint else -_slide_sign(path, frame))


def _slide_sign(path: OpenedPath, frame: PathFrame) -> float:
    """Return whether the slide of a path's rod points along the rod (1) or against it (-1)."""
    cut = path.cut
    if cut.slide is None or cut.far is None:
        return 1.0
    home = path.joints[cut.joint].point - path.joints[cut.far].point
    along = frame.typical_value(ca.dot(path.joints[cut.slide].axes[0].axis, home)).item()
    return -1.0 if along < 0 else 1.0


def rotations_about(point: SX) -> list[SX]:
    """Return three rotations (6, 1) about a point."""
    return [ca.vertcat(each, ca.cross(point, each)) for each in UNIT_VECTORS]


def normals_of(axis: SX, frame: PathFrame) -> list[SX]:
    """Return two vectors (3, 1) across an axis, along those coordinates that are farthest from it typically."""
    order = np.argsort(np.abs(frame.typical_value(axis)).ravel(), kind="stable")
    first = ca.cross(axis, UNIT_VECTORS[int(order[0])])
    return [first, ca.cross(axis, first)]


def distance_equations(path: OpenedPath, variables: Variables, frame: PathFrame) -> list[LoopEquation]:
    """Return the equations of a path that is opened at a joint; none of a path with a rod, or opened at no joint.

    Args:
        path: the path.
        variables: of the axes of its joints that are not between the two sides.
        frame: values that all paths of the robot share.
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
