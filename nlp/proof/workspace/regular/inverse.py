"""The inverse of J with unit rows over boxes of poses.

With C the inverse of the rows at the centre, ``J^-1 = C - C (J - J0) C + ...``. The part of first order is affine in
the coordinates. With ``B >= |C (J - J0)|`` the terms of higher order are at most ``B^2 (I - B)^-1 |C|``, entry by
entry.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .....models import FloatArray
from ...statement.machine import LEGS
from ..ranks.krawczyk import inverses
from .rows import LegRows

#: Part of its size by which a computed number may be off: rounding of products and of LAPACK.
_ROUNDING = 1e-10
#: Signs (64, 6) of the coordinates at the corners of a box.
CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))


@dataclass(frozen=True, eq=False)
class Inverse:
    """Inverses over B boxes: ``fixed + linear.e + [-rest, rest]`` with ``|e_i| <= 1``.

    Attributes:
        fixed: (B, 6, 6) position, then rotation of the platform, for unit changes of each leg's length.
        linear: (B, 6, 6, 6) for each coordinate the change over half of the box.
        rest: (B, 6, 6) infinite where no bound is known.
        shares: (B, 6) share of each coordinate in the width.
    """

    fixed: FloatArray
    linear: FloatArray
    rest: FloatArray
    shares: FloatArray

    def at_corners(self, part: slice) -> FloatArray:
        """Return the affine part at the corners of the boxes, (B, 64, rows, 6), of some rows."""
        change = np.einsum("bkil,ck->bcil", self.linear[:, :, part], CORNERS)
        return np.asarray(self.fixed[:, None, part] + change)


def inverse_over(rows: LegRows, lower: FloatArray, upper: FloatArray) -> Inverse:
    """Return the inverses of J over boxes (B, 6)."""
    middle, linear, rest = rows.over(lower, upper)
    moved = linear.transpose(0, 3, 1, 2)
    with np.errstate(all="ignore"):
        C = inverses(middle)
        size_of_C = np.abs(C)
        slopes = C[:, None] @ moved
        second = size_of_C @ rest
        # How far C is from an inverse is computed: LAPACK bounds the other residual, of the rows times C.
        second += np.abs(C @ middle - np.eye(LEGS)) + _ROUNDING * (size_of_C @ np.abs(middle))
        first = np.abs(slopes).sum(axis=1)
        B = first + second
        # |(I + C (J - J0))^-1 C| <= X with (I - B) X >= |C|: an M-matrix with a nonnegative solution.
        known = np.isfinite(B).all(axis=(1, 2))
        whole = np.where(known[:, None, None], np.eye(LEGS) - B, np.eye(LEGS))
        known &= np.abs(np.linalg.det(whole)) > 0
        whole = np.where(known[:, None, None], whole, np.eye(LEGS))
        X = np.linalg.solve(whole, np.where(known[:, None, None], size_of_C, 0.0)) * (1 + 1e-6)
        is_bound = known & (X >= 0).all(axis=(1, 2)) & (size_of_C <= X - B @ X).all(axis=(1, 2))
        further = (second + B @ B) @ X
        # The rows are divided by their lengths: |f + g| <= |f| + f.g / |f| + |g|^2 / 2|f|.
        force = middle[:, :, :3]
        size = np.linalg.norm(force, axis=2)
        left = rest[:, :, :3].sum(axis=2)
        far = np.linalg.norm(np.abs(linear[:, :, :3]).sum(axis=3), axis=2) + left
        slope = np.einsum("bli,blik->bkl", force / size[:, :, None], linear[:, :, :3])
        off = left + far**2 / (2 * size) + _ROUNDING * size
        change = C[:, None] * slope[:, :, None, :]
        change -= np.einsum("bkij,bjl->bkil", slopes, C) * size[:, None, None, :]
        most = size_of_C * off[:, None] + further * (size + far)[:, None] + first @ size_of_C * far[:, None]
    most = np.where(is_bound[:, None, None] & np.isfinite(most), most, np.inf)
    return Inverse(C * size[:, None], change, most, np.nan_to_num((slopes**2).sum(axis=(2, 3))))
