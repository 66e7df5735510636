"""The claim that J has full rank at every pose of a box.

With the rows ``A(y) in A(c) + sum_k S_k (y_k - c_k)`` and C near the inverse of A(c), every ``C A(y)`` has an inverse
where

    |I - C A(c)| + sum_k h_k |C S_k|     has a spectral radius below 1.

With a tolerance on joint centres ``|C| D`` is added, D the change of the rows by their errors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .....models import FloatArray
from ..fractions import determinant_sign
from ..proof_file import ProofError
from .ballrows import Joints, ball_rows
from .ballslopes import UNIT, UP, BallSlopes
from .pieces import Attempt
from .poseroot import PoseRoot
from .positive import contraction, inverses
from .tolerance import change_of_rows

#: Rounding of a product of matrices (6, 6), in parts of the product of sizes.
PRODUCT = 16 * UNIT


class Preconditioned(NamedTuple):
    """Rows times a matrix C over B boxes.

    Attributes:
        C: (B, 6, 6) near the inverse at the centre.
        T: (B, 6, 6, 6) middles of the slopes of C A, the last index that of the coordinate.
        B: (B, 6, 6) largest sizes of ``I - C A(y)``.
        units: (B, 6) sizes of the components of twists: a length of the rows' for velocities, 1 for rotations.
    """

    C: FloatArray
    T: FloatArray
    B: FloatArray
    units: FloatArray


def preconditioned(rows: BallSlopes, change: FloatArray | float = 0.0) -> Preconditioned:
    """Return the rows (B, 6, 6), which may change by these sizes, times a matrix near the inverse at the centre."""
    with np.errstate(all="ignore"):
        C = inverses(rows.c)
        size = np.abs(C)
        count, h = len(C), rows.h
        length = np.abs(rows.c[:, :, 3:]).max(axis=(1, 2)) / np.abs(rows.c[:, :, :3]).max(axis=(1, 2))
        units = np.where(np.arange(6) < 3, length[:, None], 1.0)
        T = (C @ rows.s.reshape(count, 6, 36)).reshape(count, 6, 6, 6)
        radius = rows.ce + PRODUCT * np.abs(rows.c) + change
        radius = radius + ((rows.se + PRODUCT * np.abs(rows.s)) @ h[:, None, :, None])[..., 0]
        B = np.abs(np.eye(6) - C @ rows.c) * (1 + 2 * UNIT) + 2 * UNIT + size @ radius
        B = B + (np.abs(T) @ h[:, None, :, None])[..., 0]
    return Preconditioned(C, T, B * UP, units)


class RankClaim:
    """The claim that J has full rank.

    Args:
        root: the whole box.
        joints: joint centres.
        tolerance: largest error of each joint centre in the machines that are meant.
    """

    def __init__(self, root: PoseRoot, joints: Joints, tolerance: float = 0.0) -> None:
        self._root, self._joints, self._tolerance = root, joints, tolerance
        self._signs: dict[int, FloatArray] = {}

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6).

        Raises:
            ProofError: two poses are known at which the determinant has opposite signs.
        """
        whole = ball_rows(self._root, self._joints, lower, upper)
        rows = whole.rows
        change = change_of_rows(whole, self._joints, self._tolerance) if self._tolerance else 0.0
        found = preconditioned(rows, change)
        holds, v = contraction(found.B, found.units)
        with np.errstate(all="ignore"):
            parts = np.abs(found.T) * v[:, None, :, None] / v[:, :, None, None]
            shares = rows.h * parts.sum(axis=(1, 2))
        left = ~np.asarray(holds, dtype=bool)
        if left.any():
            self._compare_signs(0.5 * lower[left] + 0.5 * upper[left], np.linalg.det(rows.c[left]))
        return Attempt(holds, shares)

    def _compare_signs(self, points: FloatArray, determinants: FloatArray) -> None:
        """Refuse two poses with opposite signs, which are computed again in fractions.

        Raises:
            ProofError: there are such poses.
        """
        for sign in (-1, 1):
            if sign in self._signs:
                continue
            for k in np.flatnonzero(np.sign(determinants) == sign)[:2]:
                if self._root.holds(points[k]) and self.sign_at(points[k]) == sign:
                    self._signs[sign] = points[k]
                    break
        if len(self._signs) == 2:
            raise ProofError("the determinant of the rows has opposite signs at two poses: J is singular between them")

    def sign_at(self, y: FloatArray) -> int:
        """Return the sign of the determinant of the rows at a point (6,), in fractions."""
        base, platform = self._joints.base.tolist(), self._joints.platform.tolist()
        return determinant_sign(self._root.kind, self._root.axis.tolist(), base, platform, y.tolist())
