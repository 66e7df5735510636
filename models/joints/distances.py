"""Distances that follow from a path's loop equations, each without the variables of one joint.

A hinge or universal joint and the joint at which the path is opened are at a distance that the joint's own rotation
does not change: the two places, one on each side of the opened loop, have the distance that the joints between give
them. The equation lacks one or two of the unknowns, so that a search of a whole box finds where the others cannot be.
"""

from __future__ import annotations

import casadi as ca

from .generic import INCIDENT
from .motion import AxisKind, Motion
from .opened import LoopEquation, OpenedPath, PathFrame, Variables


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
        if i == j or not all(axis.kind is AxisKind.ROTATION and axis.pitch.is_zero() for axis in joint.axes):
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
