"""Poses near home with the coordinates and limits of all actuators, for the comparison with a controller's formula."""

from __future__ import annotations

import math
from typing import NamedTuple

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.arrays import values_at
from ...evidence.inverse import inverse
from ..kinematics import Kinematics, matrix_of_rpy
from ..kinematicslimits import limits_of

#: Number of poses, the seed of their random choice, and their largest distances from home in parts of the robot's size.
_POSES, _SEED = 96, 5
_SPREADS = (0.2, 0.1, 0.05, 0.02)
#: Part of the poses that the robot has to take.
_ENOUGH = 0.5
#: Largest difference of two limits that are equal, in sizes of the coordinate.
_SAME = 1e-9


class Samples(NamedTuple):
    """Poses that the robot takes, in the conventions of the case.

    Attributes:
        positions: (N, 3) origins of the platform frame.
        rotations: (N, 3, 3) platform to world coordinates.
        coordinates: (N, a) actuator coordinates, radians or length.
        unknowns: (N, u) coordinates of the passive joints.
        turned: largest angle of a rotation from the rotation at home, radians.
    """

    positions: FloatArray
    rotations: FloatArray
    coordinates: FloatArray
    unknowns: FloatArray
    turned: float


def samples_of(robot: Kinematics) -> Samples:
    """Return poses near home; rotations differ from the rotation at home if the robot can turn freely."""
    rng = np.random.default_rng(_SEED)
    size, home = robot.size / robot.transform.scale, robot.start[:9].reshape(3, 3).T
    given = rng.uniform(-1, 1, (_POSES, 6)) * np.isin(range(6), robot.coordinates)
    for spread in _SPREADS:
        p = robot.start[9:12] + spread * size * given[:, :3]
        R = np.array([matrix_of_rpy(*each) for each in 2 * spread * given[:, 3:]]) @ home
        found = inverse(robot.case, p, R)
        closed = found.closed
        if closed.mean() >= _ENOUGH:
            break
    # The Frobenius norm of the difference is 2 sqrt(2) sin(angle / 2).
    chords = np.linalg.norm(found.rotations[closed] - home, axis=(1, 2)) / math.sqrt(8)
    turned = 2 * math.asin(min(1.0, float(chords.max(initial=0.0))))
    arrays = (found.positions, found.rotations, found.coordinates, found.unknowns)
    p, R, q, unknowns = (each[closed] for each in arrays)
    return Samples(p, R, q, unknowns, turned)


class Range(NamedTuple):
    """Limits of an actuator coordinate in the controller's unit; None where the case has no limit."""

    least: float | None
    most: float | None


def ranges_of(robot: Kinematics, samples: Samples) -> tuple[Range, ...]:
    """Return the limits of the case on each actuator coordinate, in the conventions of the controller.

    A limit of the case counts as a limit on a coordinate if its margin differs from the coordinate by a constant.
    """
    limits = limits_of(robot)
    q = robot.transform.coordinates(samples.coordinates)
    if not limits or not len(q):
        return (Range(None, None),) * len(robot.drives)
    poses = robot.transform.poses(samples.positions, samples.rotations)
    points = np.array([robot.point(*each) for each in zip(poses, samples.unknowns, strict=True)])
    function = ca.Function("margins", [robot.z], [ca.densify(ca.vertcat(*[each.margin for each in limits]))])
    margins: FloatArray = values_at(function, points)[0][:, :, 0]

    def bounds(k: int, sense: float) -> list[float]:
        """Return the bounds below (sense 1) or above (sense -1) a coordinate."""
        offsets = q[:, k, None] - sense * margins
        constant = np.ptp(offsets, axis=0) <= _SAME * robot.motor_sizes[k]
        return [float(each) for each in offsets.mean(axis=0)[constant]]

    return tuple(
        Range(max(bounds(k, 1.0), default=None), min(bounds(k, -1.0), default=None)) for k in range(len(robot.drives))
    )
