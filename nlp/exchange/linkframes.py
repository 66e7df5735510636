"""Frames of the links of a mechanism.

The origin is at the joint by which the link hangs from the base's side. The x axis points to the link's farthest other
joint. The z axis is the axis of the first joint, or of another, as far as it is normal to x; else the world's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...models import FloatArray

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
        z = next(filter(None.__ne__, (_across(axis, x) for axis in (*known, *world))))
    else:
        z = known[0] if known else world[0]
        x = next(filter(None.__ne__, (_across(axis, z) for axis in (*known, *world[1:], world[0]))))
    if z is None or x is None:  # three directions of the world are never all parallel to a fourth
        return np.eye(3)
    return np.column_stack([x, np.cross(z, x), z])


def _across(direction: FloatArray, axis: FloatArray) -> FloatArray | None:
    """Return the unit vector (3,) of a direction's part normal to a unit axis; None where they are parallel."""
    part = direction - axis * float(direction @ axis)
    sine = float(np.linalg.norm(part))
    return None if sine < _PARALLEL else part / sine
