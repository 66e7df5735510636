"""How far errors of joint centres change the rows and J, in the arithmetic of the check.

With e and f the errors of both joints of a leg in the world frame, up to t, its row ``(s (p - b) + u, u x (p - b))``
changes by

    (s (f - e),  s f x (p - b) - u x e - s f x e).

A component of a vector product with f is at most t times the size of the two other components of the other vector.
"""

from __future__ import annotations

import math

import numpy as np

from ......models import FloatArray
from ..ballrows import AFTER, BEFORE, BallRows, Joints
from ..ballslopes import UNIT, UP, BallSlopes


def change_of_rows(found: BallRows, joints: Joints, tolerance: float) -> FloatArray:
    """Return bounds (B, 6, 6) of the change of the rows, entry by entry, by errors within a tolerance."""
    s = _most(found.scale)[:, None, None]
    span, arm = _most(found.position[:, None].plus(-joints.base)), _most(found.arm)
    # |f x e| is at most t^2, and so is each of its components.
    moments = s * (np.hypot(span[..., AFTER], span[..., BEFORE]) * UP + tolerance)
    moments = moments + np.hypot(arm[..., AFTER], arm[..., BEFORE]) * UP
    forces = np.broadcast_to(2 * s, moments.shape)
    return np.concatenate([forces, moments], axis=2) * tolerance * UP


def _most(numbers: BallSlopes) -> FloatArray:
    """Return the largest sizes of numbers."""
    return np.asarray((np.abs(numbers.c) + numbers.spread) * UP)


def change_of_jacobian(joints: Joints, tolerance: float, length: float, shortest: float) -> float:
    """Return a bound of the Frobenius norm of the change of J, by which every singular value changes at most.

    The unit force of a leg changes by at most ``h = 2 t / (l - 2 t)``, and its moment by ``|a| h + t``.

    Args:
        joints: joint centres of the exact machine.
        tolerance: t.
        length: by which moments are divided.
        shortest: no leg of the exact machine is shorter.

    Returns:
        Infinite where the errors may take up a whole leg.
    """
    least = (shortest - 2 * tolerance) * (1 - 4 * UNIT)
    if not least > 0:
        return math.inf
    turned = 2 * tolerance / least * UP
    moments = (np.linalg.norm(joints.platform, axis=1) * UP * turned + tolerance) / length * UP
    return float(np.sqrt((turned * turned + moments * moments).sum()) * UP)
