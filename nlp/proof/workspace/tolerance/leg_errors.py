"""Errors of the joint centres of six straight legs: the change of J, and the worst machines of its singular values.

With ``s = u . J v`` a singular value of J, u and v its vectors, the row of a leg with unit force n and moment
``R a x n`` about the platform's origin, divided by L, changes s by

    u_i (q - n n.q).(f - e) / l + u_i f.(n x v_m) / L,      q = v_f + v_m x R a / L,

for errors e of the base joint and f of the platform joint, turned into the world frame.
"""

from __future__ import annotations

import math

import numpy as np

from .....models import FloatArray
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import steepest

#: Part of itself by which the bound moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12


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


def worst_rows(
    legs: Legs, box: PoseBox, points: FloatArray, length: float, is_condition: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the machines within the legs' tolerance that are worst at poses (K, 6).

    Args:
        legs: joint centres.
        box: the poses.
        points: in its coordinates.
        length: by which moments are divided.
        is_condition: whether the condition number is meant, or the smallest singular value.

    Returns:
        (K, 6, 6) force and moment of their legs, of any length; (K, 6, 3) errors of base and of platform joints, each
        in its own frame.
    """
    turn = box.rotations(points)
    arm = np.einsum("kij,lj->kli", turn, legs.platform)
    d = points[:, None, :3] + arm - legs.base
    l = np.linalg.norm(d, axis=2, keepdims=True)  # noqa: E741 - the symbol in the formulas above
    n = d / l
    J = np.concatenate([n, np.cross(arm, n) / length], axis=2)
    u, s, v = np.linalg.svd(np.nan_to_num(J))
    base, platform = np.zeros_like(d), np.zeros_like(d)
    # The logarithm of the condition number falls with that of the smallest singular value, and grows with the largest.
    for k, weight in ((5, -1.0), (0, 1.0)) if is_condition else ((5, -1.0),):
        share = (weight / s[:, k, None] * u[:, :, k])[:, :, None]
        force, moment = v[:, k, None, :3], v[:, k, None, 3:]
        q = force + np.cross(moment, arm) / length
        across = (q - n * (q * n).sum(axis=2, keepdims=True)) / l
        base -= share * across
        platform += share * (across + np.cross(n, moment) / length)
    base, platform = (steepest(each, legs.tolerance) for each in (base, platform))
    moved = arm + platform
    d = points[:, None, :3] + moved - legs.base - base
    return np.concatenate([d, np.cross(moved, d)], axis=2), base, np.einsum("kji,klj->kli", turn, platform)
