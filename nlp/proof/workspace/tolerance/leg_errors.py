"""Errors of the joint centres of straight legs: worst machines of strokes and clearances, and the change of J."""

from __future__ import annotations

import math

import numpy as np

from .....models import FloatArray
from ...statement.machine import LEGS, CentreErrors, JointErrors, Legs
from ..robot.pose_box import PoseNumbers
from ..robot.posed_robot import steepest

#: Part of itself by which the bound moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12


def of_legs(errors: CentreErrors) -> JointErrors:
    """Return the errors of a machine as those of its legs: of their joints on the base, and on the platform."""
    each = errors.vectors.reshape(LEGS, 2, 3)
    return JointErrors(each[:, 0], each[:, 1])


def spans(legs: Legs, pose: PoseNumbers) -> FloatArray:
    """Return the vectors (6, 3) from the base joints to the platform joints at a pose, in the world frame."""
    return np.asarray(pose.position + legs.platform @ pose.rotation.T - legs.base)


def along(legs: Legs, rotation: FloatArray, base: FloatArray, platform: FloatArray) -> JointErrors:
    """Return errors as large as the tolerance along vectors (6, 3) in the world frame, none for a vector of zero."""
    return JointErrors(steepest(base, legs.tolerance), steepest(platform @ rotation, legs.tolerance))


def change_of_rows(legs: Legs, length: float, shortest: float) -> float:
    """Return a bound of the Frobenius norm of the change of J by errors within the legs' tolerance.

    Args:
        legs: joint centres.
        length: by which moments are divided.
        shortest: no leg of any of the machines is shorter.

    Returns:
        0 without a tolerance; infinite where the errors may take up a whole leg.
    """
    t = legs.tolerance
    if not t:
        return 0.0
    if not shortest > 0:
        return math.inf
    turned = 2 * t / shortest
    moments = (np.linalg.norm(legs.platform, axis=1) * turned + t) / length
    return float(np.sqrt((turned**2 + moments**2).sum())) * _OUTWARDS
