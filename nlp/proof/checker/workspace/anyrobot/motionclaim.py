"""The claim that a matrix of motions keeps its rank at every pose of a box, with closed loops.

With interval slopes ``M(z) in M(c) + sum_k S_k (z_k - c_k)`` over a box, in which :mod:`.assembly` replaces the
dependent coordinates, and C near a pseudo-inverse of M(c), every ``C M(z)`` has an inverse where

    |I - C M(c)| + sum_k h_k |C S_k| + |C| E     has a spectral radius below 1,

E being the rests: M has full column rank then. A matrix with d freedoms gets d further rows first, a basis of the null
space of M(c): full column rank then says that there are no more freedoms anywhere in the box.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ......models import FloatArray
from ...fractions import sign_of_determinant
from ...slopes import SlopeArithmetic
from ..pieces import Attempt
from ..positive import contraction, inverses
from .assembly import Assembly, Enclosed
from .connected import Pieces, refuse_apart
from .interval import PRODUCT, UP, Balls, balls, half_widths, off_identity
from .motions import Motions
from .posedrobot import PosedRobot

if TYPE_CHECKING:
    from numpy.typing import NDArray


class MotionClaim:
    """The claim that a matrix of motions has no more freedoms than it is claimed to have.

    Args:
        robot: the robot.
        motions: the matrix.
        assembly: its closed loops.

    Raises:
        UncoveredError: an entry holds an operation without a rule.
    """

    def __init__(self, robot: PosedRobot, motions: Motions, assembly: Assembly) -> None:
        self._freedoms, self._assembly = motions.freedoms, assembly
        # Independent coordinates as those of poses.
        self._free = [robot.free[j] for j in assembly.independent]
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
        self._shown: list[Pieces] = []

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        low, high = lower[:, self._free], upper[:, self._free]
        closed = self._assembly.enclosed(low, high, self._assembly.near(low, high))
        holds, shares = np.zeros(len(lower), dtype=bool), np.zeros((len(lower), 6))
        shares[:, self._free] = closed.shares
        rows = np.flatnonzero(closed.is_known)
        if rows.size:
            part = closed.some(rows)
            good, own = self._examined(part)
            holds[rows] = good
            shares[rows[:, None], self._free] = own
            if self._assembly.dependent:
                self._shown.append(Pieces(part.lower[good], part.upper[good], part.near[good]))
        return Attempt(holds, shares)

    def finish(self) -> None:
        """Refuse boxes with closed loops that do not belong together, after all were shown.

        Raises:
            ProofError: they are not shown to be those of one assembly.
        """
        if self._shown:
            refuse_apart(self._assembly, Pieces(*(np.concatenate(each) for each in zip(*self._shown, strict=True))))

    @property
    def is_square(self) -> bool:
        """Whether the matrix is J itself, with rows that are neither normalised nor zero, over poses without loops."""
        return self._constant.shape == (6, 6) and not self._freedoms and not self._assembly.dependent

    def signs_at(self, y: FloatArray) -> list[int]:
        """Return the signs of the determinant at poses (K, 6); 0 where a sign is not shown.

        With ``|I - C M|`` of a spectral radius below 1 the determinant of ``C M`` is positive: that of M has the sign
        of that of C, which is computed in fractions.
        """
        at = y[:, self._free]
        M, E, _, _ = self._matrices(self._assembly.enclosed(at, at, self._assembly.near(at, at)))
        C = inverses(M)
        with np.errstate(all="ignore"):
            bound = (off_identity(C, M) + np.abs(C) @ (E + PRODUCT * np.abs(M))) * UP
        known = contraction(np.where(np.isfinite(bound), bound, np.inf)).holds
        return [sign_of_determinant(each.tolist()) if good else 0 for each, good in zip(C, known, strict=True)]

    def has_values(self, lower: FloatArray, upper: FloatArray) -> bool:
        """Return whether all entries surely have values over a box (6,), in which they are continuous."""
        low, high = lower[None, self._free], upper[None, self._free]
        M, E, S, _ = self._matrices(self._assembly.enclosed(low, high, self._assembly.near(low, high)))
        return bool(np.isfinite(M).all() and np.isfinite(E).all() and np.isfinite(S).all())

    def values_at(self, y: FloatArray) -> FloatArray:
        """Return the matrices (K, m, c) at poses (K, 6) without loops: computed numbers."""
        low = y[:, self._free]
        return self._matrices(self._assembly.enclosed(low, low, self._assembly.near(low, low)))[0]

    def _examined(self, closed: Enclosed) -> tuple[NDArray[np.bool_], FloatArray]:
        """Return where the rank is shown (B,), and shares (B, f), of boxes with known closed loops."""
        return self._judged(*self._matrices(closed))

    def _matrices(self, closed: Enclosed) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return middles at the centre, radii over the boxes, middles of slopes, and half widths."""
        own, D = self._assembly.independent, self._assembly.dependent
        low, high = closed.lower.T, closed.upper.T
        h = half_widths(low, high)
        forms = balls(self._entries(low, high), h)
        middle, rest, slopes = replaced(forms, closed, own, D, h)
        B, f = len(h), len(own)
        shape = (B, *self._constant.shape)
        M, E = np.broadcast_to(self._constant, shape).copy(), np.zeros(shape)
        S = np.zeros((B, f, *self._constant.shape))
        rows, columns = self._at
        M[:, rows, columns], E[:, rows, columns] = middle, rest
        S[:, :, rows, columns] = slopes.transpose(0, 2, 1)
        return M, E, S, h[:, own]

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
            C = np.asarray(np.linalg.pinv(M, rcond=1e-14), dtype=float)
            size = np.abs(C)
            moved = np.abs(C[:, None] @ S) * h[:, :, None, None]
            rest = E + PRODUCT * (np.abs(M) + (np.abs(S) * h[:, :, None, None]).sum(axis=1))
            off = off_identity(C, M)
            bound = (off + size @ rest + moved.sum(axis=1)) * UP
            bound = np.where(known[:, None, None] & np.isfinite(bound), bound, np.inf)
            holds, v = contraction(bound)
            shares = (moved * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3))
        return np.asarray(holds & known), np.where(known[:, None], shares, np.nan)


def replaced(forms: Balls, closed: Enclosed, independent: list[int], dependent: list[int], h: FloatArray) -> Balls:
    """Return expressions over boxes with dependent coordinates replaced: slopes are those of the independent ones.

    Args:
        forms: over boxes of all coordinates.
        closed: the closed loops.
        independent: indices of these coordinates.
        dependent: indices of the others.
        h: (B, n) half widths.
    """
    own, others = forms.s[:, :, dependent], forms.s[:, :, independent]
    size, width = np.abs(own), h[:, independent]
    with np.errstate(all="ignore"):
        c = forms.c + (own @ closed.off[:, :, None])[:, :, 0]
        s = others - own @ closed.T
        most = np.abs(closed.off) + (np.abs(closed.T) * width[:, None]).sum(axis=2)
        terms = np.abs(forms.c) + (np.abs(others) * width[:, None]).sum(axis=2) + (size @ most[:, :, None])[:, :, 0]
        e = forms.e + (size @ closed.rho[:, :, None])[:, :, 0] + PRODUCT * terms
    return Balls(c, e * UP, s)
