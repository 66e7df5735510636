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

from ..parts import Leg
from .chain import Joint, Limb
from .generic import INCIDENT, PathFrame, meeting_point

#: Squared sine of the angle between a slide and the line of the centres below which they are parallel: numbers of five
#: digits, as of an imported robot, leave less. The leg's length differs from the way of the slide by half of this part.
_STRAIGHT = 1e-8


def straight_leg(limb: Limb, frame: PathFrame) -> Leg | None:
    """Return the straight leg that a limb is; None where it is another limb.

    Args:
        limb: the limb.
        frame: values that all paths of the robot share.
    """
    joints = limb.paths[0]
    slides = [j for j, joint in enumerate(joints) for axis in joint.axes if not axis.is_hinge]
    if len(limb.branches) > 1 or len(slides) != 1:
        return None
    slide = joints[slides[0]]
    sides = joints[: slides[0]][::-1], joints[slides[0] + 1 :]
    if slide.type != "P" or not slide.actuated or not all(sides):
        return None
    along = slide.axes[0].axis
    base, platform = (_centre(frame, side) for side in sides)
    if base is None and platform is None:
        base = sides[0][0].point
    if platform is None and base is not None:
        platform = _on_hinge(frame, sides[1], base, along)
    elif base is None and platform is not None:
        base = _on_hinge(frame, sides[0], platform, along)
    if base is None or platform is None or not _is_straight(frame, platform - base, along):
        return None
    labels = []
    for side, centre in zip(sides, (base, platform), strict=True):
        turning = [joint for joint in side if any(not frame.are_parallel(each.axis, along) for each in joint.axes)]
        off = [ca.cross(centre - axis.point, axis.axis) / frame.size for joint in side for axis in joint.axes]
        if not turning or not frame.is_zero(ca.vertcat(*off)):
            return None
        # Errors of joints that have one centre have the name of the first of them.
        first = next(j for j, each in enumerate(joints) if frame.coincide(each.point, turning[0].point))
        labels.append(limb.label(0, first))
    return Leg(limb.name, base, platform - frame.robot.home, centres=(labels[0], labels[1]))


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


def _is_straight(frame: PathFrame, span: SX, along: SX) -> bool:
    """Return whether a vector (3, 1) between centres has a length, and is parallel to a slide for all dimensions."""
    length = frame.sampled(ca.norm_2(span) / frame.size)
    sine = frame.sampled(ca.sumsqr(ca.cross(span, along)) / ca.sumsqr(span))
    return bool(np.all(length > INCIDENT) and np.all(sine <= _STRAIGHT))
