"""A path in another place: its frame moved and turned in the world.

Lines stay lines wherever the frame is. An arc is in one of the three planes of the axes, and of angles that change
linearly only the last turn is about a fixed axis: with arcs in the plane XY, or with roll, pitch and yaw that change,
the frame may be turned about z alone. A path without arcs, with angles that stay or with shortest turns, may be turned
in any way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...models import FloatArray
from ..errors import InputError
from .arcs import PLANES
from .options import Between
from .orientation import (
    ORDERS,
    matrices_from_quaternions,
    quaternion_products,
    quaternions_from_angles,
    roll_pitch_yaw,
)
from .path import ProgrammedPath


def placed(path: ProgrammedPath, place: Sequence[float]) -> ProgrammedPath:
    """Return a path whose frame has another place.

    Args:
        path: in the frame.
        place: (6,) of the frame: position, then roll, pitch and yaw, radians.

    Raises:
        InputError: the path has an arc, or angles that change, and is not covered after such a turn.
    """
    position, angles = np.array(place[:3], dtype=np.float64), np.array(place[3:], dtype=np.float64)
    if not (position.any() or angles.any()):
        return path
    knots, arcs = path.knots.copy(), path.arcs.copy()
    order = path.order
    if angles.any():
        about_z = not angles[:2].any()
        _check(path, about_z=about_z)
        turn = quaternions_from_angles(angles[None], ORDERS["rpy"])
        R = matrices_from_quaternions(turn)[0]
        knots[:, :3] = knots[:, :3] @ R.T
        arcs[:, :2] = arcs[:, :2] @ R[:2, :2].T
        arcs[:, 4] += angles[2]
        if about_z and order[0] == 2:
            turned = knots[:, 5] + angles[2]
            knots[:, 5] = turned - math.tau * round(float(turned.mean()) / math.tau)
        else:
            knots[:, 3:] = roll_pitch_yaw(quaternion_products(turn, quaternions_from_angles(knots[:, 3:], order)))
            order = ORDERS["rpy"]
    knots[:, :3] += position
    if len(arcs):
        arcs[:, :2] += position[np.array([PLANES[plane][:2] for plane in path.planes.tolist()])]
    return replace(path, knots=knots, arcs=arcs, order=order)


def _check(path: ProgrammedPath, *, about_z: bool) -> None:
    """Refuse a path that is not covered after a turn.

    Args:
        path: the path.
        about_z: whether the turn is about z alone.

    Raises:
        InputError: it is not.
    """
    beyond = path.arc_segments if not about_z else path.arc_segments[path.planes != 17]
    what = "roll or pitch" if not about_z else "yaw"
    if len(beyond):
        fault = f"an arc{'' if not about_z else ' outside of the plane XY'} is not covered with {what} in path.place"
        raise InputError(f"{path.source}: line {path.lines[beyond[0]]}: {fault}")
    changes = np.flatnonzero(np.diff(path.knots[:, 3:], axis=0).any(axis=1))
    if path.between is Between.ANGLES and len(changes) and not (about_z and path.order[0] == 2):
        fault = f"angles that change linearly are not covered with {what} in path.place"
        raise InputError(f"{path.source}: line {path.lines[changes[0]]}: {fault}")


def in_world(place: FloatArray, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position (3,) and rotation (3, 3) in the world of a pose in a frame with a place (6,)."""
    R = _rotation(place)
    return place[:3] + R @ position, R @ rotation


def in_frame(place: FloatArray, position: FloatArray, rotation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and rotation in a frame with a place of a pose in the world: the inverse of the above."""
    R = _rotation(place)
    return R.T @ (position - place[:3]), R.T @ rotation


def _rotation(place: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) of a place (6,)."""
    return np.asarray(matrices_from_quaternions(quaternions_from_angles(place[None, 3:], ORDERS["rpy"]))[0])
