"""Spectral radii below 1, and symmetric matrices that are positive definite, with a proof for the computed numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray
from .ballslopes import UP

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Steps of the power method.
_STEPS = 12
#: Part of the trace that is taken off before Cholesky's factorisation: many times the bound of its rounding for
#: matrices (6, 6), which is 8 roundings. A factorisation that ends proves the matrix positive definite (S. M. Rump,
#: *Verification of positive definiteness*, BIT 46 (2006)).
_ROUNDING = 1e-13


class Contraction(NamedTuple):
    """Whether each of B matrices has a spectral radius below 1, and the vectors (B, 6) reached."""

    holds: NDArray[np.bool_]
    v: FloatArray


def contraction(B: FloatArray, units: FloatArray | float = 1.0) -> Contraction:
    """Return which nonnegative matrices (B, 6, 6) have a spectral radius below 1: a positive v with ``B v < v``.

    Args:
        B: the matrices.
        units: (B, 6) sizes of the vectors' components, from which the power method begins.
    """
    v = np.broadcast_to(units, B.shape[:2]).astype(np.float64)
    holds = np.zeros(len(B), dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            w = np.einsum("bij,bj->bi", B, v) * UP
            holds |= (w < v).all(axis=1)
            if holds.all() or (holds | (w >= v).all(axis=1)).all():
                break
            following = w / (w / units).sum(axis=1, keepdims=True) + 1e-12 * units
            v = np.where(holds[:, None], v, following)
    return Contraction(holds, v)


def are_positive(matrices: FloatArray) -> NDArray[np.bool_]:
    """Return whether symmetric matrices (..., n, n) are positive definite; their lower triangles are read."""
    M = np.array(matrices)
    n = M.shape[-1]
    good = np.asarray(np.isfinite(M).all(axis=(-2, -1)))
    shift = _ROUNDING * np.abs(np.trace(M, axis1=-2, axis2=-1))
    for k in range(n):
        M[..., k, k] -= shift
    with np.errstate(all="ignore"):
        for k in range(n):
            pivot = M[..., k, k]
            good = np.asarray(good & (pivot > 0))
            column = M[..., k + 1 :, k] / np.sqrt(np.where(good, pivot, 1.0))[..., None]
            M[..., k + 1 :, k + 1 :] -= column[..., :, None] * column[..., None, :]
    return good


def inverses(matrices: FloatArray) -> FloatArray:
    """Return approximate inverses of matrices (B, n, n); NaN where there is none."""
    good = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    good &= np.linalg.det(np.where(good[:, None, None], matrices, 0.0)) != 0
    found = np.full_like(matrices, np.nan)
    found[good] = np.linalg.inv(matrices[good])
    return np.asarray(found)
