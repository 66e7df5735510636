"""The claim that errors of legs of at most 1 move the platform, to first order, by at most a number.

The platform moves by ``P d`` for errors d, with P the inverse of J with unit rows (:mod:`.inverserows`). Sizes of its
affine part are largest at corners of a box, for errors of 1 or -1.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from .....models import FloatArray
from .ballrows import CORNERS, Joints, ball_rows
from .ballslopes import UNIT, UP
from .inverserows import inverse_rows
from .pieces import WRONG, Attempt
from .poseroot import PoseRoot

#: Signs (6, 32) of the errors of legs: a pair of opposite signs has one size.
_ERRORS = CORNERS[:32].T
#: Steps in the search of the part of second order, and the part by which each is more than needed.
_STEPS, _ENLARGED = 200, 1e-6


class ErrorClaim:
    """The claim about errors of the pose to first order.

    Args:
        root: the whole box.
        joints: joint centres.
        most: the size claimed, for errors of legs of 1.
        is_rotation: whether the rotation is meant, and not the position of the platform's origin.
    """

    def __init__(self, root: PoseRoot, joints: Joints, most: float, *, is_rotation: bool) -> None:
        self._root, self._joints, self._most = root, joints, most
        self._part = slice(3, 6) if is_rotation else slice(0, 3)

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        found = inverse_rows(ball_rows(self._root, self._joints, lower, upper).rows)
        with np.errstate(all="ignore"):
            worst = np.sqrt(((found.at_corners(self._part) @ _ERRORS) ** 2).sum(axis=2)).max(axis=(1, 2))
            sums = found.rest[:, self._part].sum(axis=2)
            sizes = (np.abs(found.P0) + np.abs(found.T).sum(axis=3))[:, self._part].sum(axis=(1, 2))
            worst = (worst + np.sqrt((sums * sums).sum(axis=1)) + 64 * UNIT * sizes) * UP
            shares = np.abs(found.T[:, self._part]).sum(axis=(1, 2)) + found.shares * sums.sum(axis=1)[:, None]
            at_centre = np.linalg.norm(found.P0[:, self._part] @ _ERRORS, axis=1).max(axis=1)
        is_wrong = found.known & (at_centre > self._most * (1 + WRONG))
        return Attempt(np.asarray(found.known & (worst <= self._most)), shares, np.asarray(is_wrong))


def whole_errors(position: float, rotation: float, eps: float, shortest: float, reach: float) -> tuple[float, float]:
    """Return bounds of the whole errors of a pose, position and rotation; infinite where none is found.

    With errors of second order r in the lengths, ``p = P (eps + r)`` and ``w = Q (eps + r)``, r must be at least
    ``((p + a w)^2 / (l - p - a w) + a w^2) / 2``. A candidate is checked in fractions.

    Args:
        position: P, error of the position to first order for errors of legs of 1.
        rotation: Q, that of the rotation.
        eps: largest error of a leg, length.
        shortest: l, a length below which no leg is.
        reach: a, the largest distance of a joint from the platform's origin.
    """
    r = 0.0
    for _ in range(_STEPS):
        p, w = position * (eps + r), rotation * (eps + r)
        along = p + reach * w
        if not along < shortest:
            return math.inf, math.inf
        needed = 0.5 * (along * along / (shortest - along) + reach * w * w)  # infinite where a power would overflow
        if needed <= r and _is_enough(r, position, rotation, eps, shortest, reach):
            return p * (1 + 8 * UNIT), w * (1 + 8 * UNIT)
        r = needed * (1 + _ENLARGED)
    return math.inf, math.inf


def _is_enough(r: float, *numbers: float) -> bool:
    """Return, in fractions, whether errors of second order are at most r."""
    r_, P, Q, eps, shortest, reach = map(Fraction, (r, *numbers))
    p, w = P * (eps + r_), Q * (eps + r_)
    along = p + reach * w
    return along < shortest and (along**2 / (shortest - along) + reach * w**2) / 2 <= r_
