"""The claim that errors of legs of at most 1 move the platform, to first order, by at most a number.

With A the rows and F the diagonal matrix of the sizes of their forces, the platform moves by ``P d``, ``P = A^-1 F``,
for errors d. With C near the inverse of A at the centre and ``P0 = C F(c)``,

    P - P0 = A^-1 (F - A P0) = C (F - A P0) + (C A)^-1 (I - C A) C (F - A P0).

The first part is affine in the coordinates but for a rest, the second at most ``(I - B)^-1 B Q`` with
``B >= |I - C A|`` and ``Q >= |C (F - A P0)|``. Sizes of the affine part are largest at corners, for errors of 1 or -1.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np

from ....models import FloatArray
from .ballrows import CORNERS, Joints, ball_rows
from .ballslopes import UNIT, UP
from .pieces import Attempt
from .poseroot import PoseRoot
from .positive import contraction
from .rankclaim import PRODUCT, preconditioned

#: Signs (6, 32) of the errors of legs: a pair of opposite signs has one size.
_ERRORS = CORNERS[:32].T
#: Part by which the solution of a system is enlarged, so that it is a bound: its rounding is far below.
_ENLARGED = 1e-6
#: Steps in the search of the part of second order.
_STEPS = 200


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
        rows = ball_rows(self._root, self._joints, lower, upper).rows
        forces = rows[:, :, :3]
        F = (forces * forces).sum(2).root()
        found, h = preconditioned(rows), rows.h
        C, B = found.C, found.B
        size, count = np.abs(C), len(C)
        leg = np.arange(6)
        with np.errstate(all="ignore"):
            P = C * F.c[:, None, :]
            # F - A P0 at the centre, and its slopes.
            centre, slopes = -(rows.c @ P), -np.einsum("blik,bij->bljk", rows.s, P, optimize=True)
            sizes = np.abs(rows.c) @ np.abs(P)
            slope_sizes = np.einsum("blik,bij->bljk", np.abs(rows.s), np.abs(P), optimize=True)
            radius = rows.ce @ np.abs(P)
            slope_radius = np.einsum("blik,bij->bljk", rows.se, np.abs(P), optimize=True)
            centre[:, leg, leg] += F.c
            sizes[:, leg, leg] += F.c
            radius[:, leg, leg] += F.ce
            slopes[:, leg, leg] += F.s
            slope_sizes[:, leg, leg] += np.abs(F.s)
            slope_radius[:, leg, leg] += F.se
            slope_radius = slope_radius + 2 * PRODUCT * slope_sizes
            T = (C @ slopes.reshape(count, 6, 36)).reshape(count, 6, 6, 6)
            wide = ((slope_radius + PRODUCT * np.abs(slopes)) @ h[:, None, :, None])[..., 0]
            rest = (np.abs(C @ centre) + size @ (radius + 2 * PRODUCT * sizes + wide)) * UP
            Q = (rest + (np.abs(T) @ h[:, None, :, None])[..., 0]) * UP
            known, v = contraction(B)
            known = known & np.isfinite(Q).all(axis=(1, 2))
            system = np.where(known[:, None, None], np.eye(6) - B, np.eye(6))
            right = np.where(known[:, None, None], B @ Q, 0.0) * UP
            X = np.linalg.solve(system, right) * (1 + _ENLARGED) + _ENLARGED * right
            # (I - B) X >= B Q with a spectral radius below 1: X is a bound.
            holds = known & (X >= 0).all(axis=(1, 2)) & ((B @ X) * UP + right <= X).all(axis=(1, 2))
            rest = (rest + X)[:, self._part]
            corners = P[:, None, self._part] + np.einsum(
                "ck,bijk->bcij", CORNERS, T[:, self._part] * h[:, None, None, :], optimize=True
            )
            worst = np.sqrt(((corners @ _ERRORS) ** 2).sum(axis=2)).max(axis=(1, 2)) if count else np.zeros(0)
            sums = rest.sum(axis=2)
            rounding = 64 * UNIT * (np.abs(P[:, self._part]) + Q[:, self._part]).sum(axis=(1, 2))
            worst = (worst + np.sqrt((sums * sums).sum(axis=1)) + rounding) * UP
            shares = h * np.abs(T[:, self._part]).sum(axis=(1, 2))
            shares += (
                h
                * (np.abs(found.T) * v[:, None, :, None] / v[:, :, None, None]).sum(axis=(1, 2))
                * X[:, self._part].sum(axis=(1, 2))[:, None]
            )
        return Attempt(np.asarray(holds & (worst <= self._most)), shares)


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
        needed = 0.5 * (along**2 / (shortest - along) + reach * w**2)
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
