"""The claim that a matrix of motions keeps its rank at every pose of a box.

With interval slopes ``M(z) in M(c) + sum_k S_k (z_k - c_k)`` over a box, and C near a pseudo-inverse of M(c), every
``C M(z)`` has an inverse where

    |I - C M(c)| + sum_k h_k |C S_k|     has a spectral radius below 1:

M has full column rank then. A matrix with d freedoms gets d further rows first, a basis of the null space of M(c): full
column rank then says that there are no more freedoms anywhere in the box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from .....models import FloatArray
from ....certificate.paper.slopes import Slope, SlopeArithmetic
from ..ballslopes import UNIT
from ..pieces import Attempt
from ..positive import contraction
from .motions import Motions
from .posedrobot import PosedRobot

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Part of itself by which a sum of nonnegative products moves outwards: more than the rounding of fewer than 400 terms.
_UP = 1 + 1024 * UNIT
#: Rounding of a product of matrices with fewer than 400 terms, in parts of the product of sizes.
_PRODUCT = 512 * UNIT


class MotionClaim:
    """The claim that a matrix of motions has no more freedoms than it is claimed to have.

    Args:
        robot: the robot, without unknowns.
        motions: the matrix.
    """

    def __init__(self, robot: PosedRobot, motions: Motions) -> None:
        self._free, self._freedoms = list(robot.free), motions.freedoms
        whole = motions.matrix
        self._constant = np.zeros(whole.shape)
        self._at: tuple[list[int], list[int]] = ([], [])
        entries = []
        for k, (i, j) in enumerate(zip(*whole.sparsity().get_triplet(), strict=True)):
            entry = whole.nz[k]
            if entry.is_constant():
                self._constant[i, j] = float(entry)
            else:
                self._at[0].append(i)
                self._at[1].append(j)
                entries.append(entry)
        vector = ca.vertcat(ca.SX(0, 1), *entries)
        self._entries = SlopeArithmetic(ca.Function("entries", [robot.z], ca.cse([ca.densify(vector)])))
        self._count = len(entries)

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        free = self._free
        low, high = lower[:, free].T, upper[:, free].T
        centre = np.clip(0.5 * (low + high), low, high)
        h = np.nextafter(np.maximum(high - centre, centre - low), np.inf).T
        forms = balls(self._entries(low, high), self._count, h)
        B, n = h.shape
        shape = (B, *self._constant.shape)
        M, E = np.broadcast_to(self._constant, shape).copy(), np.zeros(shape)
        S = np.zeros((B, n, *self._constant.shape))
        rows, columns = self._at
        M[:, rows, columns], E[:, rows, columns] = forms[0], forms[1]
        S[:, :, rows, columns] = forms[2].transpose(0, 2, 1)
        holds, shares = self._judged(M, E, S, h)
        every = np.zeros((B, 6))
        every[:, free] = shares
        return Attempt(holds, every)

    def _judged(
        self, M: FloatArray, E: FloatArray, S: FloatArray, h: FloatArray
    ) -> tuple[NDArray[np.bool_], FloatArray]:
        """Return what is shown (B,), and shares (B, n).

        Args:
            M: (B, m, c) middles at the centre.
            E: (B, m, c) radii over the box, but for the middles of the slopes.
            S: (B, n, m, c) middles of the slopes.
            h: (B, n) half widths.
        """
        B, _, columns = M.shape
        known = np.asarray(np.isfinite(M).all(axis=(1, 2)) & np.isfinite(E).all(axis=(1, 2)))
        known &= np.isfinite(S).all(axis=(1, 2, 3))
        M = np.where(known[:, None, None], M, 0.0)
        E, S = np.where(known[:, None, None], E, 0.0), np.where(known[:, None, None, None], S, 0.0)
        # Rows are made comparable by a power of two, which rounds nothing.
        sizes = np.sqrt((M * M).sum(axis=2, keepdims=True))
        scale = 2.0 ** -np.round(np.log2(np.where(sizes > 0, sizes, 1.0)))
        M, E, S = M * scale, E * scale, S * scale[:, None]
        if self._freedoms:
            null = np.linalg.svd(M, full_matrices=True)[2][:, columns - self._freedoms :]
            zero = np.zeros_like(null)
            M, E = np.concatenate([M, null], axis=1), np.concatenate([E, zero], axis=1)
            S = np.concatenate([S, np.broadcast_to(zero[:, None], (B, S.shape[1], *zero.shape[1:]))], axis=2)
        with np.errstate(all="ignore"):
            C = np.linalg.pinv(M, rcond=1e-14)
            size = np.abs(C)
            moved = np.abs(C[:, None] @ S) * h[:, :, None, None]
            rest = E + _PRODUCT * (np.abs(M) + (np.abs(S) * h[:, :, None, None]).sum(axis=1))
            off = np.abs(np.eye(columns) - C @ M) * (1 + 2 * UNIT) + 2 * UNIT
            bound = (off + size @ rest + moved.sum(axis=1)) * _UP
            bound = np.where(known[:, None, None] & np.isfinite(bound), bound, np.inf)
            holds, v = contraction(bound)
            shares = (moved * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3))
        return np.asarray(holds & known), np.where(known[:, None], shares, np.nan)


def balls(values: list[Slope], count: int, h: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return middles at the centre (B, R), radii over the box but for them (B, R), and middles of slopes (B, R, n).

    Args:
        values: slopes of expressions.
        count: number R of those that are meant, the first ones.
        h: (B, n) half widths.
    """
    B, n = h.shape
    c, e, s = np.zeros((B, count)), np.zeros((B, count)), np.zeros((B, count, n))
    with np.errstate(all="ignore"):
        for k, value in enumerate(values[:count]):
            c[:, k], off = _ball(*value.C)
            middle, radius = _ball(*value.S)
            s[:, k] = middle.T
            e[:, k] = (off + (radius.T * h).sum(axis=1)) * _UP
    return c, e, s


def _ball(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a middle and a radius that hold an interval."""
    middle = 0.5 * low + 0.5 * high
    return middle, np.nextafter(np.maximum(high - middle, middle - low), np.inf)
