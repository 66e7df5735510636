"""A path in another place: its frame moved and turned in the world.

Lines stay lines wherever the frame is, and arcs in the plane XY stay such after a turn about z. These paths have their
numbers in the world. An arc in a tilted plane, and angles that change linearly before another turn, have none there:
such a path keeps its numbers, and has a frame.
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
    """Return a path whose frame has another place.

    Args:
        path: in the frame.
        place: (6,) of the frame: position, then roll, pitch and yaw, radians.
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
    """Return whether a turned path has arcs in planes of the world's axes, and angles that change linearly there.

    Args:
        path: in its frame.
        about_z: whether the turn is about z alone.
    """
    if len(path.arcs) and not (about_z and (path.planes == 17).all()):
        return False
    changes = np.diff(path.knots[:, 3:], axis=0).any()
    return bool(path.between is Between.SLERP or not changes or (about_z and path.order[0] == 2))


def in_world(place: FloatArray, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position (3,) and rotation (3, 3) in the world of a pose in a frame with a place (6,)."""
    R = _frame(place).rotation
    return place[:3] + R @ position, R @ rotation


def in_frame(place: FloatArray, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and rotation in a frame with a place of a pose in the world: the inverse of the above."""
    R = _frame(place).rotation
    return R.T @ (position - place[:3]), R.T @ rotation


def _frame(place: FloatArray) -> PathFrame:
    """Return the frame with a place (6,)."""
    return PathFrame(place[:3], place[3:])
