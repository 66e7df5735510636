"""Closed forms of a robot's passive joints along a tool path.

The formula of a joint angle jumps at half a turn from home, where the joint itself moves on continuously. If a joint
comes near half a turn on a path, all joint angles become unknowns of the loop equations, which have no jumps.
"""

from __future__ import annotations

import math

import numpy as np

from ....models import Dimension, FloatArray
from ....models.joints.model.closedform import ClosedForm, closed_form
from ...case.case import Case
from ...errors import InputError
from ...evidence.inverse import inverse
from ...path.path import ProgrammedPath
from ...path.sampling import spread_points
from .robot.pose_box import PoseNumbers

#: Number of points of a path at which joints are computed, and angle from home at which angles become unknowns.
_POINTS, _FAR = 512, math.radians(150)


def closed_form_along(case: Case, path: ProgrammedPath) -> ClosedForm:
    """Return a robot with fixed dimensions, with closed forms of the unknowns that are valid all along a path."""
    if path.settings.names:
        # Joint coordinates are not sampled while dimensions change.
        return closed_form(case.model, with_angles=False)
    closed = closed_form(case.model)
    left = {each.name for each in closed.model.unknowns}
    names = [each.name for each in case.model.unknowns if each.dimension is Dimension.ANGLE and each.name not in left]
    if not names:
        return closed
    try:
        found = inverse(case, *path.poses_at(*spread_points(path, _POINTS)))
    except InputError:
        return closed
    angles = found.unknowns[:, [found.joints.index(name) for name in names]]
    angles = angles[np.isfinite(angles).all(axis=1)]
    is_far = (np.abs(angles) > _FAR).any() or (np.abs(np.diff(angles, axis=0)) > np.pi).any()
    return closed_form(case.model, with_angles=False) if is_far else closed


def unknowns_at(case: Case, closed: ClosedForm, pose: PoseNumbers) -> FloatArray | None:
    """Return the robot's unknowns at a pose in the home assembly mode, angles within half a turn from home.

    The result is None if no motion from home to the pose is known.
    """
    try:
        found = inverse(case, pose.position[None], pose.rotation[None])
    except InputError:
        return None
    unknowns = found.unknowns[0, [found.joints.index(each.name) for each in closed.model.unknowns]]
    angles = np.array([each.dimension is Dimension.ANGLE for each in closed.model.unknowns])
    unknowns = np.where(angles, np.remainder(unknowns + np.pi, 2 * np.pi) - np.pi, unknowns)
    return unknowns if np.isfinite(unknowns).all() else None
