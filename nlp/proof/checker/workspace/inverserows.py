"""The inverse of J with unit rows over boxes of poses, affine in the coordinates but for a rest.

With A the rows and F the diagonal matrix of the sizes of their forces, the inverse is ``P = A^-1 F``: its columns are
the platform's motions for unit changes of the legs' lengths. With C near the inverse of A at the centre, and
``P0 = C F(c)``,

    P - P0 = A^-1 (F - A P0) = C (F - A P0) + (C A)^-1 (I - C A) C (F - A P0).

The first part is affine but for a rest, the second at most ``(I - B)^-1 B Q`` with ``B >= |I - C A|`` and
``Q >= |C (F - A P0)|``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray
from .ballrows import CORNERS
from .ballslopes import UNIT, UP, BallSlopes
from .positive import contraction
from .rankclaim import PRODUCT, preconditioned

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Part by which the solution of a system is enlarged, so that it is a bound: its rounding is far below.
_ENLARGED = 1e-6


class InverseRows(NamedTuple):
    """Inverses over B boxes: ``P0 + sum_k T_k e_k + [-rest, rest]`` with ``|e_k| <= 1``.

    Attributes:
        P0: (B, 6, 6) position, then rotation of the platform.
        T: (B, 6, 6, 6) the last index that of the coordinate.
        rest: (B, 6, 6) with the rounding of the sum.
        known: (B,) whether the rest is a bound.
        shares: (B, 6) shares of coordinates in the rest, relative to each other.
    """

    P0: FloatArray
    T: FloatArray
    rest: FloatArray
    known: NDArray[np.bool_]
    shares: FloatArray

    def at_corners(self, part: slice) -> FloatArray:
        """Return the affine parts at the corners, (B, corners, rows, 6), of some rows; fixed coordinates count once."""
        used = (self.T != 0).any(axis=(0, 1, 2))
        corners = CORNERS[(CORNERS[:, ~used] == 1).all(axis=1)]
        change = np.einsum("ck,bijk->bcij", corners, self.T[:, part], optimize=True)
        return np.asarray(self.P0[:, None, part] + change)


def inverse_rows(rows: BallSlopes) -> InverseRows:
    """Return the inverses of J from its scaled rows (B, 6, 6)."""
    forces = rows[:, :, :3]
    F = (forces * forces).sum(2).root()
    found, h = preconditioned(rows), rows.h
    C, B = found.C, found.B
    size, count, leg = np.abs(C), len(C), np.arange(6)
    with np.errstate(all="ignore"):
        P = C * F.c[:, None, :]
        # F - A P0 at the centre, its slopes, and what both may be off by.
        centre, slopes = -(rows.c @ P), -np.einsum("blik,bij->bljk", rows.s, P, optimize=True)
        sizes, radius = np.abs(rows.c) @ np.abs(P), rows.ce @ np.abs(P)
        both = np.einsum("blik,bij->bljk", rows.se + 2 * PRODUCT * np.abs(rows.s), np.abs(P), optimize=True)
        centre[:, leg, leg] += F.c
        sizes[:, leg, leg] += F.c
        radius[:, leg, leg] += F.ce
        slopes[:, leg, leg] += F.s
        both[:, leg, leg] += F.se + 2 * PRODUCT * np.abs(F.s)
        T = (C @ slopes.reshape(count, 6, 36)).reshape(count, 6, 6, 6) * h[:, None, None, :]
        wide = ((both + PRODUCT * np.abs(slopes)) @ h[:, None, :, None])[..., 0]
        rest = (np.abs(C @ centre) + size @ (radius + 2 * PRODUCT * sizes + wide)) * UP
        Q = (rest + np.abs(T).sum(axis=3)) * UP
        known, v = contraction(B, found.units)
        known = known & np.isfinite(Q).all(axis=(1, 2))
        system = np.where(known[:, None, None], np.eye(6) - B, np.eye(6))
        right = np.where(known[:, None, None], B @ Q, 0.0) * UP
        X = np.linalg.solve(system, right) * (1 + _ENLARGED) + _ENLARGED * right
        # (I - B) X >= B Q with a spectral radius below 1: X is a bound.
        known = known & (X >= 0).all(axis=(1, 2)) & ((B @ X) * UP + right <= X).all(axis=(1, 2))
        rest = (rest + X + 16 * UNIT * (np.abs(P) + np.abs(T).sum(axis=3))) * UP
        shares = h * (np.abs(found.T) * v[:, None, :, None] / v[:, :, None, None]).sum(axis=(1, 2))
    return InverseRows(P, T, rest, np.asarray(known), np.asarray(shares))
