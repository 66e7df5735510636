"""Placement of a path: translation and rotation of its frame in the world frame.

Lines stay lines for every placement, and arcs in the plane XY stay in this plane after a rotation about z: such paths
are converted to world coordinates. Arcs in other planes, and linearly changing angles with another rotation of the
frame, cannot be converted: such a path keeps its coordinates and has a frame.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...models import FloatArray
from .arcs import PLANES
from .frame import PathFrame
from .options import Between
from .orientation import ORDERS, quaternions_from_angles, roll_pitch_yaw
from .path import ProgrammedPath


def placed(path: ProgrammedPath, place: Sequence[float]) -> ProgrammedPath:
    """Return a path with its frame placed in the world frame.

    Args:
        path: path in its frame.
        place: (6,) placement of the frame: position, then roll, pitch and yaw, radians.
    """
    frame = _frame(np.array(place, dtype=np.float64))
    position, angles = frame.origin, frame.angles
    if not (position.any() or angles.any()):
        return path
    about_z = not angles[:2].any()
    if angles.any() and not _has_numbers_in_world(path, about_z=about_z):
        return replace(path, frame=frame)
    knots, arcs = path.knots.copy(), path.arcs.copy()
    order = path.order
    if angles.any():
        R = frame.rotation
        knots[:, :3] = knots[:, :3] @ R.T
        arcs[:, :2] = arcs[:, :2] @ R[:2, :2].T
        arcs[:, 4] += angles[2]
        if about_z and order[0] == 2:
            turned = knots[:, 5] + angles[2]
            knots[:, 5] = turned - math.tau * round(float(turned.mean()) / math.tau)
        else:
            knots[:, 3:] = roll_pitch_yaw(frame.orientations(quaternions_from_angles(knots[:, 3:], order)))
            order = ORDERS["rpy"]
    knots[:, :3] += position
    if len(arcs):
        arcs[:, :2] += position[np.array([PLANES[plane][:2] for plane in path.planes.tolist()])]
    return replace(path, knots=knots, arcs=arcs, order=order)


def _has_numbers_in_world(path: ProgrammedPath, *, about_z: bool) -> bool:
    """Return True if a rotated path can be converted to world coordinates.

    Args:
        path: path in its frame.
        about_z: True if the rotation is about z only.
    """
    if len(path.arcs) and not (about_z and (path.planes == 17).all()):
        return False
    changes = np.diff(path.knots[:, 3:], axis=0).any()
    return bool(path.between is Between.SLERP or not changes or (about_z and path.order[0] == 2))


def in_world(place: FloatArray, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return world position (3,) and rotation (3, 3) of a pose in a frame with a placement (6,)."""
    R = _frame(place).rotation
    return place[:3] + R @ position, R @ rotation


def in_frame(place: FloatArray, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and rotation of a world pose in a frame with a placement (6,), inverse to :func:`in_world`."""
    R = _frame(place).rotation
    return R.T @ (position - place[:3]), R.T @ rotation


def _frame(place: FloatArray) -> PathFrame:
    return PathFrame(place[:3], place[3:])
