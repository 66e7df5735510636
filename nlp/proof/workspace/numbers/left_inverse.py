"""Left inverses of J over boxes of poses: for singular values, and for errors of the pose.

J has rows A divided by sizes l, which :class:`.ScaledRows` chooses so that A is nearly a polynomial of the coordinates.
Let C be a pseudo-inverse of A at the middle of a box, where l is 1. Then ``(C A)^-1 C diag(l)`` is a left inverse of J,
and with ``C A = I + E`` and ``|E| <= B``, entry by entry,

    (I + E)^-1 C = C - E C + ...,    where the terms of higher order are at most  B^2 (I - B)^-1 |C|.

What is of first order in the coordinates is kept as it is, so that a convex number is largest at a corner of the box.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .....models import FloatArray
from ...enclosure.forms import Forms
from ..ranks.krawczyk import by_centres

#: Part of its size by which a computed number may be off: rounding of products and of LAPACK.
ROUNDING = 1e-10
#: Part of C below which a singular value of the middle matrix is zero.
_ZERO = 1e-14
#: Part by which a computed bound of an inverse is made larger, so that it surely is one.
_ROOM = 1e-6


@dataclass(frozen=True, eq=False)
class LeftInverses:
    """Left inverses over B boxes: ``fixed + linear.e + [-rest, rest]`` with ``|e_i| <= 1``.

    Attributes:
        fixed: (B, 6, m) position, then rotation times a length, for unit values of the rows.
        linear: (B, f, 6, m) for each coordinate the change over half of the box.
        rest: (B, 6, m) infinite where no bound is known.
        shares: (B, f) share of each coordinate in the width.
    """

    fixed: FloatArray
    linear: FloatArray
    rest: FloatArray
    shares: FloatArray

    def at_corners(self, rows: slice) -> FloatArray:
        """Return the affine part at the corners of the boxes, (B, 2^f, rows, m), of some rows."""
        return self.fixed[:, None, rows] + at_corners(self.linear[:, :, rows])


def at_corners(linear: FloatArray) -> FloatArray:
    """Return the sums (B, 2^f, r, m) of linear parts (B, f, r, m) at the corners of boxes."""
    f = linear.shape[1]
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=f))).reshape(2**f, f)
    return np.asarray(np.einsum("sf,bfij->bsij", signs, linear))


@dataclass(frozen=True, eq=False)
class RowsOver:
    """Rows A and sizes l over B boxes, scaled so that the middle of each size is 1.

    Attributes:
        A: (B, m, 6) middles.
        terms: (B, t, m, 6) coefficients of ``|e| <= 1``: f coordinates, then products of two, then errors of centres.
        rest: (B, m, 6).
        bend, slack: (B, t, m) coefficients, and (B, m) rests, of sizes.
        count, errors: number f of coordinates, and number of the terms that are errors.
    """

    A: FloatArray
    terms: FloatArray
    rest: FloatArray
    bend: FloatArray
    slack: FloatArray
    count: int
    errors: int

    def spread(self, linear: FloatArray) -> FloatArray:
        """Return the largest sizes (B, ...) of linear parts (B, t, ...); the errors of a centre are a vector."""
        t = linear.shape[1] - self.errors
        return np.asarray(np.abs(linear[:, :t]).sum(axis=1) + by_centres(np.moveaxis(linear[:, t:], 1, -1)))


def rows_over(forms: Forms, scale: FloatArray, count: int, errors: int) -> RowsOver:
    """Return the rows over boxes.

    Args:
        forms: of the rows (m, 6), column by column, and of their sizes.
        scale: (6,) by which the columns are multiplied.
        count: number of the first terms that are coordinates.
        errors: number of the last terms that are errors of joint centres; those between are products of coordinates.
    """
    B, entries, t = forms.a.shape
    m = entries // 7
    sizes = forms.c[:, 6 * m :]
    with np.errstate(all="ignore"):
        unit = 1 / np.where(sizes > 0, sizes, np.nan)
        A = forms.c[:, : 6 * m].reshape(B, 6, m).transpose(0, 2, 1) * scale * unit[:, :, None]
        terms = forms.a[:, : 6 * m].reshape(B, 6, m, t).transpose(0, 3, 2, 1) * scale * unit[:, None, :, None]
        rest = forms.r[:, : 6 * m].reshape(B, 6, m).transpose(0, 2, 1) * scale * unit[:, :, None]
        bend = forms.a[:, 6 * m :].transpose(0, 2, 1) * unit[:, None]
        slack = forms.r[:, 6 * m :] * unit
    return RowsOver(A, terms, rest * (1 + ROUNDING), bend, slack * (1 + ROUNDING) + ROUNDING, count, errors)


def left_inverses(rows: RowsOver) -> LeftInverses:
    """Return left inverses of J over boxes."""
    known = np.asarray(np.isfinite(rows.A).all(axis=(1, 2)) & np.isfinite(rows.terms).all(axis=(1, 2, 3)))
    A = np.where(known[:, None, None], rows.A, np.eye(rows.A.shape[1], 6))
    f, eye = rows.count, np.eye(6)
    with np.errstate(all="ignore"):
        C = np.linalg.pinv(A, rcond=_ZERO)
        size = np.abs(C)
        slopes = C[:, None] @ np.where(known[:, None, None, None], rows.terms, 0.0)
        far = size @ rows.rest + np.abs(C @ A - eye) + ROUNDING * (size @ np.abs(A))
        first = rows.spread(slopes)
        E = first + far
        known &= np.isfinite(E).all(axis=(1, 2))
        E = np.where(known[:, None, None], E, 0.0)
        # |(I + E)^-1 C| <= X with (I - B) X >= |C|: an M-matrix with a nonnegative solution.
        X = _solutions(eye - E, size) * (1 + _ROOM)
        known &= (X >= 0).all(axis=(1, 2)) & (size <= X - E @ X).all(axis=(1, 2))
        # Rows are divided by 1 + d with |d| <= spread of the sizes.
        change = C[:, None] * rows.bend[:, :, None] - slopes @ C[:, None]
        d = rows.spread(rows.bend) + rows.slack
        rest = rows.spread(change[:, f:]) + size * rows.slack[:, None]
        rest += (far @ size + E @ E @ X) * (1 + d)[:, None] + first @ size * d[:, None]
        rest += ROUNDING * (size + rows.spread(change))
    rest = np.where(known[:, None, None] & np.isfinite(rest), rest, np.inf)
    shares = np.nan_to_num((slopes[:, :f] ** 2).sum(axis=(2, 3)))
    return LeftInverses(C, change[:, :f], rest, shares)


def _solutions(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solutions of systems (B, 6, 6) with right sides (B, 6, m); -1 for singular ones."""
    good = np.abs(np.linalg.det(matrices)) > 0
    found: FloatArray = np.full_like(right, -1.0)
    found[good] = np.linalg.solve(matrices[good], right[good])
    return found
