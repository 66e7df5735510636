"""The test of a sparse matrix over boxes: whether it has full column rank at every closed point.

With forms of the entries, in which the dependent coordinates are replaced by their relation to the independent ones,
``M = M0 + sum_v M_v e_v + [-R, R]``. For any matrix C, here a pseudo-inverse of M0,

    |I - C M| <= |I - C M0| + sum_v |C M_v| + |C| R  entry by entry;

the parts of the three errors of a joint centre, a vector of at most unit length, count together as that of a vector.
Where the right side has a spectral radius below 1, C M has an inverse, and M full column rank.

A matrix whose null space has d dimensions at almost all poses gets d further rows, a basis of the null space at the
middle of the box: full column rank then means that it has no more dimensions anywhere in the box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ...enclosure.forms import Encloser, Forms
from ..robot.motion_matrix import RankMatrix
from .krawczyk import ROUNDING, are_contractions, by_centres

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Tested(NamedTuple):
    """Results for B boxes.

    Attributes:
        is_regular: (B,) whether the rank is proved to be full.
        shares: (B, f) share of each independent coordinate in the bound.
        smallest: (B,) smallest singular value at the middle as a part of the largest: a computed number.
        signs: (B,) sign of the determinant of a square matrix at the middle: a computed number; 0 for other matrices.
            Where the rank is proved, it is that at every pose of the box.
    """

    is_regular: NDArray[np.bool_]
    shares: FloatArray
    smallest: FloatArray
    signs: NDArray[np.int32]


class RankTest:
    """The test of a matrix.

    Args:
        matrix: the matrix.
        z: (n, 1) symbols of the coordinates.
        start: (n,) a closed point, at which rows and columns are scaled.

    Attributes:
        entries: (E, 1) what is not constant.
        sign: of the determinant of a square matrix at the start; 0 for other matrices.
    """

    def __init__(self, matrix: RankMatrix, z: SX, start: FloatArray) -> None:
        self.nullity = matrix.nullity
        whole = matrix.matrix
        values = ca.Function("start", [z], [ca.densify(whole)])(start).full()
        is_square = values.shape[0] == values.shape[1] and not matrix.nullity
        self.sign = int(np.linalg.slogdet(values)[0]) if is_square else 0
        sizes = np.linalg.norm(values, axis=1)
        # A power of two, so that scaling rounds nothing.
        self._scale = 2.0 ** -np.round(np.log2(np.where(sizes > 0, sizes, 1.0)))
        self._constant = np.zeros(whole.shape)
        self._at: tuple[list[int], list[int]] = ([], [])
        entries = []
        rows, columns = whole.sparsity().get_triplet()
        for k, (i, j) in enumerate(zip(rows, columns, strict=True)):
            entry = whole.nz[k]
            if entry.is_constant():
                self._constant[i, j] = float(entry)
            else:
                self._at[0].append(i)
                self._at[1].append(j)
                entries.append(entry)
        self.entries: SX = ca.vertcat(SX(0, 1), *entries)
        self._constant *= self._scale[:, None]
        at = np.ascontiguousarray(np.array(self._at, dtype=np.int32).T)
        parts = at, np.ascontiguousarray(self._scale[self._at[0]]), np.ascontiguousarray(self._constant)
        self._head = (*whole.shape, matrix.nullity, parts)

    def examine_second(
        self, encloser: Encloser, lower: FloatArray, upper: FloatArray, change: FloatArray | None = None
    ) -> Tested:
        """Return the verdict on boxes from forms of second order of the entries.

        Args:
            encloser: of the entries.
            lower: (n, B) lower ends of the coordinates.
            upper: (n, B) upper ends.
            change: (E, B) by how much the entries may be off in other machines; None for the design alone.
        """
        n, count = lower.shape
        regular, signs = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int32)
        shares, smallest = np.empty((n, count)), np.empty(count)
        ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
        found = (*ends, regular, shares, smallest, signs, change)
        encloser.module.rank(n, encloser.tape.head, self._head, found, count)
        return Tested(regular.astype(bool), shares.T, smallest, signs)

    def examine(self, forms: Forms, f: int) -> Tested:
        """Return the verdict on boxes from forms of first order of the entries, whose first f terms are no errors."""
        (middle, slope, rest), (rows, columns) = forms, self._at
        scale = self._scale[rows]
        M0 = np.broadcast_to(self._constant, (len(middle), *self._constant.shape)).copy()
        R = np.zeros_like(M0)
        M0[:, rows, columns] += middle * scale
        R[:, rows, columns] = rest * scale
        M = np.zeros((len(middle), slope.shape[2], *self._constant.shape))
        M[:, :, rows, columns] = (slope * scale[:, None]).transpose(0, 2, 1)
        known = np.asarray(np.isfinite(M0).all(axis=(1, 2)) & np.isfinite(R).all(axis=(1, 2)))
        known &= np.isfinite(M).all(axis=(1, 2, 3))
        M0[~known], M[~known] = 0.0, 0.0
        return self._judged(M0, M, np.where(known[:, None, None], R, np.inf), f)

    def _judged(self, M0: FloatArray, M: FloatArray, R: FloatArray, f: int) -> Tested:
        """Return the verdict on boxes from middles (B, m, c), linear parts (B, f + e, m, c), and rests."""
        columns = M0.shape[2]
        _, values, right = np.linalg.svd(M0, full_matrices=True)
        rank = columns - self.nullity
        if self.nullity:
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
            linear = np.abs(products[:, :f])
            B = np.abs(C @ M0 - np.eye(columns)) + linear.sum(axis=1) + size @ R
            B += by_centres(products[:, f:].transpose(0, 2, 3, 1))
            # Products of fewer than 400 terms, and a sum.
            B += ROUNDING * (size @ (np.abs(M0) + np.abs(M).sum(axis=1)))
            B = np.where(np.isfinite(B), B, np.inf)
            is_regular, v = are_contractions(B * (1 + ROUNDING))
            shares = (linear * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3))
            square = M0.shape[1] == columns and not self.nullity
            signs = np.linalg.slogdet(M0)[0] if square else np.zeros(len(M0))
        return Tested(is_regular, np.nan_to_num(shares), smallest, signs.astype(np.int32))
