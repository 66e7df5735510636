"""Frames of the links of a mechanism.

The origin is at the joint by which the link hangs from the base's side. The x axis points to the link's farthest other
joint. The z axis is the axis of the first joint, or of another, as far as it is normal to x; else the world's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....models import FloatArray

#: Distance, in parts of the robot's size, below which two joints are at one place; and sine of the angle between two
#: directions below which they are parallel.
_NEAR = 1e-9
_PARALLEL = 1e-3


def link_rotation(points: Sequence[FloatArray], axes: Sequence[FloatArray], size: float) -> FloatArray:
    """Return the axes of a link's frame as columns (3, 3), in the world.

    Args:
        points: (3,) each, centres of its joints in the world; the first one is the frame's origin.
        axes: (3,) each, their unit axes in the world; zero for spherical joints.
        size: length of the order of the robot's own.
    """
    ways = [point - points[0] for point in points[1:]]
    far = max(ways, key=lambda way: float(np.linalg.norm(way)), default=np.zeros(3))
    known = [axis for axis in axes if axis.any()]
    world = [np.eye(3)[k] for k in (2, 0, 1)]
    if float(np.linalg.norm(far)) > _NEAR * size:
        x = far / np.linalg.norm(far)
        z = _across((*known, *world), x)
    else:
        z = known[0] if known else world[0]
        x = _across((*known, *world[1:], world[0]), z)
    return np.column_stack([x, np.cross(z, x), z])


def _across(directions: Sequence[FloatArray], axis: FloatArray) -> FloatArray:
    """Return the unit vector (3,) of the part normal to a unit axis of the first direction that is not along it."""
    parts = (direction - axis * float(direction @ axis) for direction in directions)
    # Of the world's three directions, which are among them, one at least is not along the axis.
    part = next(part for part in parts if float(np.linalg.norm(part)) > _PARALLEL)
    return np.asarray(part / np.linalg.norm(part))
