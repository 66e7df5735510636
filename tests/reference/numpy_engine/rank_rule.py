"""The rank of matrices from forms of their entries."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.enclosure.forms import Forms
from screwsynth.nlp.proof.workspace.ranks.krawczyk import ROUNDING, by_centres
from screwsynth.nlp.proof.workspace.ranks.rank_rule import RankTest, Tested

if TYPE_CHECKING:
    from numpy.typing import NDArray


#: Steps of the power method for a vector that proves a contraction.
_POWERS = 12


class NumpyRankTest(RankTest):
    """The test of a matrix in NumPy."""

    def examine(self, forms: Forms, f: int, errors: int) -> Tested:
        """Return the verdict on boxes; the arguments are those of :meth:`.RankTest.examine`."""
        M0, M, R = self.matrices(forms)
        columns, last = M0.shape[2], M.shape[1] - errors
        _, values, right = np.linalg.svd(M0, full_matrices=True)
        nullity = self._nullity
        rank = columns - nullity
        signs = np.linalg.slogdet(M0)[0] if M0.shape[1] == columns and not nullity else np.zeros(len(M0))
        if nullity:
            extra = right[:, rank:]
            M0 = np.concatenate([M0, extra], axis=1)
            M = np.concatenate([M, np.zeros((*M.shape[:2], *extra.shape[1:]))], axis=2)
            R = np.concatenate([R, np.zeros_like(extra)], axis=1)
        with np.errstate(all="ignore"):
            smallest = (
                np.nan_to_num(values[:, rank - 1] / values[:, 0]) if values.shape[1] >= rank else np.zeros(len(M0))
            )
            C = np.linalg.pinv(M0, rcond=1e-14)
            size = np.abs(C)
            products = C[:, None] @ M
            linear = np.abs(products[:, :last])
            B = np.abs(C @ M0 - np.eye(columns)) + linear.sum(axis=1) + size @ R
            B += by_centres(products[:, last:].transpose(0, 2, 3, 1))
            # Products of fewer than 400 terms, and a sum.
            B += ROUNDING * (size @ (np.abs(M0) + np.abs(M).sum(axis=1)))
            is_regular, v = are_contractions(np.where(np.isfinite(B), B, np.inf) * (1 + ROUNDING))
            shares = (linear[:, :f] * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3))
        return Tested(is_regular, np.nan_to_num(shares), smallest, signs.astype(np.int32))

    def matrices(self, forms: Forms) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return middles (B, m, c), linear parts (B, t, m, c), and rests from forms of the entries with t terms.

        Where one is not finite, the rest is infinite, and the others are 0.
        """
        (middle, slope, rest), scale, constant = forms, self._scale, self._constant
        rows, columns = self._at.T
        M0 = np.broadcast_to(constant, (len(middle), *constant.shape)).copy()
        R, M = np.zeros_like(M0), np.zeros((len(middle), slope.shape[2], *constant.shape))
        M0[:, rows, columns] += middle * scale
        R[:, rows, columns] = rest * scale
        M[:, :, rows, columns] = (slope * scale[:, None]).transpose(0, 2, 1)
        known = np.asarray(np.isfinite(M0).all(axis=(1, 2)) & np.isfinite(R).all(axis=(1, 2)))
        known &= np.isfinite(M).all(axis=(1, 2, 3))
        M0[~known], M[~known], R[~known] = 0.0, 0.0, np.inf
        return M0, M, R


def are_contractions(B: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which nonnegative matrices (B, c, c) surely have a spectral radius below 1, and positive vectors (B, c).

    ``B v < v`` for a positive v proves it (Collatz and Wielandt).
    """
    v = np.ones(B.shape[:2])
    proved = np.zeros(len(B), dtype=bool)
    active = np.asarray(np.isfinite(B).all(axis=(1, 2)))
    for _ in range(_POWERS):
        rows = np.flatnonzero(active)
        if not rows.size:
            break
        w = (B[rows] @ v[rows, :, None])[:, :, 0]
        ratio = w / v[rows]
        done = ratio.max(axis=1) < 1 - ROUNDING
        proved[rows[done]] = True
        active[rows[done | (ratio.min(axis=1) >= 1)]] = False
        going = active[rows]
        # A little of the vector before keeps every component positive.
        scale = np.maximum(w[going].max(axis=1, keepdims=True), 1e-300)
        v[rows[going]] = w[going] / scale + 1e-9 * v[rows[going]]
    return proved, v
