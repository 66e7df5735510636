"""How far errors of joint centres change the rows and J, in the arithmetic of the check.

With e and f the errors of both joints of a leg in the world frame, up to t, and ``u = R a``, its row times s,
``s (p + u - b, u x (p - b))``, changes by

    s (f - e,  f x (p - b) - u x e - f x e).

A component of a vector product with f is at most t times the size of the two other components of the other vector.
"""

from __future__ import annotations

import math

import numpy as np

from ......models import FloatArray
from ....statement.machine import Legs
from ...polynomials import UNIT

#: Part of itself by which a sum of a few products moves outwards.
UP = 1 + 64 * UNIT
#: Indices after a component, and before it, of a vector.
_AFTER, _BEFORE = [1, 2, 0], [2, 0, 1]


def change_of_rows(
    scale: FloatArray, span: FloatArray, arm: FloatArray, tolerance: float, length: float = 1.0
) -> FloatArray:
    """Return bounds (B, 6, 6) of the change of the rows, entry by entry, by errors within a tolerance.

    Args:
        scale: (B,) largest s.
        span: (B, 6, 3) largest sizes of ``p - b``.
        arm: (B, 6, 3) largest sizes of ``s R a``.
        tolerance: t.
        length: by which moments are divided.
    """
    s = scale[:, None, None]
    across, along = (np.hypot(each[..., _AFTER], each[..., _BEFORE]) for each in (span, arm))
    # |f x e| is at most t^2, and so is each of its components.
    moments = (s * (across + tolerance) + along) * UP / length
    return np.concatenate([np.broadcast_to(2 * s, moments.shape), moments], axis=2) * tolerance * UP


def change_of_jacobian(joints: Legs, tolerance: float, length: float, shortest: float) -> float:
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
