"""Straight legs of a robot given joint by joint: limbs with an actuated slide along the line of two joint centres.

A limb is a straight leg if it is one chain with one slide, which is actuated, and

* the axes of all rotations before the slide intersect in one point, the *centre* on the base, and those after it in one
  on the platform;
* the slide is parallel to the line of both centres at home.

No joint moves the centre on its own body, so the slide always lies on the line of the centres. The distance of the
centres is the leg length, and changes by the travel of the slide. A single hinge has its centre where the line of the
leg meets its axis. For a rotation about this line, such as the spin of a leg, every point of the line is a centre.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import SX

from ...parts import Leg
from .chain import Joint, Limb
from .generic import INCIDENT, PathFrame, meeting_point

#: Squared sine of the angle below which a slide and the line of the centres are parallel: numbers with five digits, as
#: of an imported robot, leave less. The leg length differs from the travel by half of this relative value.
_STRAIGHT = 1e-8


def straight_legs(frame: PathFrame) -> tuple[Leg, ...]:
    """Return the straight legs among the limbs of a robot.

    Args:
        frame: common data of all chains of the robot.
    """
    every = (_straight_leg(limb, frame) for limb in frame.robot.limbs)
    return tuple(leg for leg in every if leg is not None)


def _straight_leg(limb: Limb, frame: PathFrame) -> Leg | None:
    """Return a limb as a straight leg; None for any other limb."""
    joints = limb.paths[0]
    slides = [j for j, joint in enumerate(joints) for axis in joint.axes if not axis.is_hinge]
    if len(limb.branches) > 1 or len(slides) != 1:
        return None
    slide = joints[slides[0]]
    sides = joints[: slides[0]][::-1], joints[slides[0] + 1 :]
    if slide.type != "P" or not slide.actuated or not all(sides):
        return None
    along = slide.axes[0].axis
    turning = [[joint for joint in side if not _spins(frame, joint, along)] for side in sides]
    if not all(turning):
        return None
    # Most joints are written at their centres.
    written = turning[0][0].point, turning[1][0].point
    ends = written if _are_centres(frame, written, sides, along) else _met(frame, sides, along)
    if ends is None or not _are_centres(frame, ends, sides, along):
        return None
    base, platform = ends
    # The error of joints with a common centre has the name of the first joint.
    places = frame.sampled(ca.vertcat(*[joint.point / frame.size for joint in joints])).reshape(-1, len(joints), 3)
    apart = [np.abs(places - places[:, [joints.index(own[0])]]).max(axis=(0, 2)) for own in turning]
    first, last = (limb.label(0, int(np.argmax(each < INCIDENT))) for each in apart)
    return Leg(limb.name, base, platform - frame.robot.home, centres=(first, last))


def _spins(frame: PathFrame, joint: Joint, along: SX) -> bool:
    """Return True if all rotations of a joint are about lines along a slide."""
    return len(joint.axes) == 1 and frame.are_parallel(joint.axes[0].axis, along)


def _are_centres(frame: PathFrame, ends: tuple[SX, SX], sides: Sequence[Sequence[Joint]], along: SX) -> bool:
    """Return True if all axes before and after a slide pass through two points (3, 1) on a line along the slide."""
    off = [
        ca.norm_2(ca.cross(end - axis.point, axis.axis)) / frame.size
        for end, side in zip(ends, sides, strict=True)
        for joint in side
        for axis in joint.axes
    ]
    span = ends[1] - ends[0]
    sine = ca.sumsqr(ca.cross(span, along)) / ca.sumsqr(span)
    found = frame.sampled(ca.vertcat(ca.norm_2(span) / frame.size, sine, *off))
    return bool(np.all(found[:, 0] > INCIDENT) and np.all(found[:, 1] <= _STRAIGHT) and np.all(found[:, 2:] < INCIDENT))


def _met(frame: PathFrame, sides: Sequence[Sequence[Joint]], along: SX) -> tuple[SX, SX] | None:
    """Return the points (3, 1) where the axes before a slide, and those after it, intersect; None without such points.

    A single hinge on one side counts with the point where its axis meets the leg's line.
    """
    base, platform = (_centre(frame, side) for side in sides)
    if base is None and platform is None:
        base = sides[0][0].point
    if platform is None and base is not None:
        platform = _on_hinge(frame, sides[1], base, along)
    elif base is None and platform is not None:
        base = _on_hinge(frame, sides[0], platform, along)
    return None if base is None or platform is None else (base, platform)


def _centre(frame: PathFrame, side: Sequence[Joint]) -> SX | None:
    """Return the common point (3, 1) of the joint axes on one side of a slide.

    The result is None if the axes do not intersect or are all parallel.
    """
    first, *others = (axis for joint in side for axis in joint.axes)
    across = [each for each in others if not frame.are_parallel(first.axis, each.axis)]
    if not across:
        return None
    return meeting_point(frame, [(each.point, each.axis) for each in (first, *across)])


def _on_hinge(frame: PathFrame, side: Sequence[Joint], centre: SX, along: SX) -> SX | None:
    """Return the point where a hinge axis meets a leg's line through ``centre`` (3, 1); None without such a point."""
    axis = side[0].axes[0]
    if frame.are_parallel(axis.axis, along):
        return None
    return meeting_point(frame, [(axis.point, axis.axis), (centre, along)])
