"""Straight legs of a robot given joint by joint: limbs that are a driven slide along the line of two joint centres.

A limb is a straight leg where it is one path with one slide, which is driven, and

* the axes of all rotations before the slide meet in one point, the *centre* on the base, and those behind it in one on
  the platform;
* the slide is parallel to the line of both centres at home.

No motion of a joint moves the centre on its own body, so that the slide lies on the line of the centres always. The
distance of the centres is then the length of the leg, and it changes by the way of the slide. A single hinge has a
centre where the line of the leg meets its axis. A rotation about this line, as of a leg that can spin, has every point
of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from casadi import SX

from ...parts import Leg
from .chain import Joint, Limb
from .generic import INCIDENT, PathFrame, meeting_point

#: Squared sine of the angle between a slide and the line of the centres below which they are parallel: numbers of five
#: digits, as of an imported robot, leave less. The leg's length differs from the way of the slide by half of this part.
_STRAIGHT = 1e-8


def straight_legs(frame: PathFrame) -> tuple[Leg, ...]:
    """Return the straight legs among the limbs of a robot.

    Args:
        frame: values that all paths of the robot share.
    """
    every = (_straight_leg(limb, frame) for limb in frame.robot.limbs)
    return tuple(leg for leg in every if leg is not None)


def _straight_leg(limb: Limb, frame: PathFrame) -> Leg | None:
    """Return the straight leg that a limb is; None where it is another limb."""
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
    # Joints are mostly written at their centres.
    written = turning[0][0].point, turning[1][0].point
    ends = written if _are_centres(frame, written, sides, along) else _met(frame, sides, along)
    if ends is None or not _are_centres(frame, ends, sides, along):
        return None
    base, platform = ends
    # Errors of joints that have one centre have the name of the first of them.
    places = frame.sampled(ca.vertcat(*[joint.point / frame.size for joint in joints])).reshape(-1, len(joints), 3)
    apart = [np.abs(places - places[:, [joints.index(own[0])]]).max(axis=(0, 2)) for own in turning]
    first, last = (limb.label(0, int(np.argmax(each < INCIDENT))) for each in apart)
    return Leg(limb.name, base, platform - frame.robot.home, centres=(first, last))


def _spins(frame: PathFrame, joint: Joint, along: SX) -> bool:
    """Return whether all rotations of a joint are about lines along a slide."""
    return len(joint.axes) == 1 and frame.are_parallel(joint.axes[0].axis, along)


def _are_centres(frame: PathFrame, ends: tuple[SX, SX], sides: Sequence[Sequence[Joint]], along: SX) -> bool:
    """Return whether all axes before and behind a slide pass through two points (3, 1), whose line is along it."""
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
    """Return the points (3, 1) where axes before and behind a slide meet, or a hinge meets the line of the leg."""
    base, platform = (_centre(frame, side) for side in sides)
    if base is None and platform is None:
        base = sides[0][0].point
    if platform is None and base is not None:
        platform = _on_hinge(frame, sides[1], base, along)
    elif base is None and platform is not None:
        base = _on_hinge(frame, sides[0], platform, along)
    return None if base is None or platform is None else (base, platform)


def _centre(frame: PathFrame, side: Sequence[Joint]) -> SX | None:
    """Return the point (3, 1) where the axes of joints meet; None where they do not, or are all parallel."""
    first, *others = (axis for joint in side for axis in joint.axes)
    across = [each for each in others if not frame.are_parallel(first.axis, each.axis)]
    if not across:
        return None
    return meeting_point(frame, [(each.point, each.axis) for each in (first, *across)])


def _on_hinge(frame: PathFrame, side: Sequence[Joint], centre: SX, along: SX) -> SX | None:
    """Return where the line of a leg from the other centre (3, 1) meets the axis of a hinge; None where it does not."""
    axis = side[0].axes[0]
    if frame.are_parallel(axis.axis, along):
        return None
    return meeting_point(frame, [(axis.point, axis.axis), (centre, along)])
