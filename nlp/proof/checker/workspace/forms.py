"""Affine forms of expressions over boxes, from polynomials with a ball, and facts about matrices with a proof.

Over a box of coordinates ``z_i = c_i + r_i e_i``, ``|e_i| <= 1``, an expression is ``c + sum_i a_i e_i`` and a rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ..polynomials import UNIT, Polynomial, PolynomialArithmetic, places

#: Part of itself by which a sum of nonnegative products moves outwards: more than the rounding of fewer than 400 terms.
UP = 1 + 1024 * UNIT
#: Rounding of a product of matrices with fewer than 400 terms, in parts of the product of sizes.
PRODUCT = 512 * UNIT
#: Steps of the power method.
_STEPS = 12
#: Part of the trace that is taken off before Cholesky's factorisation: many times the bound of its rounding for
#: matrices (6, 6), which is 8 roundings. A factorisation that ends proves the matrix positive definite (S. M. Rump,
#: *Verification of positive definiteness*, BIT 46 (2006)).
_CHOLESKY = 1e-13


class Forms(NamedTuple):
    """R expressions over B boxes: in ``c + sum_i a_i e_i + [-r, r]``, with NaN where an expression may be undefined.

    Attributes:
        c: (B, R).
        a: (B, R, n).
        r: (B, R).
    """

    c: FloatArray
    a: FloatArray
    r: FloatArray


class FormArithmetic:
    """Affine forms of a vector of expressions.

    Args:
        z: (n, 1) symbols.
        expressions: (R, 1).

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, z: SX, expressions: SX) -> None:
        self.function = ca.Function("forms", [z], ca.cse([ca.densify(expressions)]))
        self._arithmetic = PolynomialArithmetic(self.function)

    def ranges(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return the ends (2, B, R) of the expressions over boxes with ends (B, n)."""
        return _ranges(self._arithmetic(lower.T, upper.T), len(lower))

    def __call__(self, lower: FloatArray, upper: FloatArray, count: int | None = None) -> tuple[Forms, FloatArray]:
        """Return the forms of the first expressions over boxes with ends (B, n), and the ends of the others."""
        values = self._arithmetic(lower.T, upper.T)
        return _forms(values[:count], lower.shape), _ranges(
            values[len(values) if count is None else count :], len(lower)
        )


def _ranges(values: Sequence[Polynomial], boxes: int) -> FloatArray:
    """Return the ends (2, B, R) of values."""
    ends = [[np.broadcast_to(each.V[side], boxes) for each in values] for side in (0, 1)]
    return np.asarray(np.reshape(ends, (2, len(values), boxes)).transpose(0, 2, 1))


def _forms(values: Sequence[Polynomial], shape: tuple[int, ...]) -> Forms:
    """Return the affine forms of values over boxes of a shape (B, n): a square is 1/2, give or take 1/2."""
    (B, n), count = shape, len(values)
    c, a, r = np.zeros((B, count)), np.zeros((B, count, n)), np.zeros((B, count))
    for k, value in enumerate(values):
        at = places(len(value.on))
        squares, products = value.P[at.squares], value.P[at.products]
        c[:, k] = value.P[0] + 0.5 * squares.sum(axis=0)
        a[:, k, list(value.on)] = value.P[at.linear].T
        rest = 0.5 * np.abs(squares).sum(axis=0) + np.abs(products).sum(axis=0)
        r[:, k] = (rest + value.s + PRODUCT * value.size) * UP
    return Forms(c, a, r)


def contraction(B: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which nonnegative matrices (B, k, k) have a spectral radius below 1, and v with ``B v < v`` there."""
    v, holds = np.ones(B.shape[:2]), np.zeros(len(B), dtype=bool)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            w = np.einsum("bij,bj->bi", B, v) * UP
            holds |= (w < v).all(axis=1)
            if (holds | (w >= v).all(axis=1)).all():
                break
            following = w / w.sum(axis=1, keepdims=True) + 1e-12
            v = np.where(holds[:, None], v, following)
    return holds, v


def inverses(matrices: FloatArray) -> FloatArray:
    """Return approximate inverses of matrices (B, n, n); NaN where there is none."""
    good = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    good &= np.linalg.det(np.where(good[:, None, None], matrices, 0.0)) != 0
    found = np.full_like(matrices, np.nan)
    found[good] = np.linalg.inv(matrices[good])
    return np.asarray(found)


def off_identity(C: FloatArray, M: FloatArray) -> FloatArray:
    """Return sizes of ``I - C M``, but for the rounding of the product."""
    return np.asarray(np.abs(np.eye(C.shape[-2]) - C @ M) * (1 + 2 * UNIT) + 2 * UNIT)


def are_positive(matrices: FloatArray) -> NDArray[np.bool_]:
    """Return whether symmetric matrices (..., n, n) are positive definite; their lower triangles are read."""
    M = np.array(matrices)
    n = M.shape[-1]
    good = np.asarray(np.isfinite(M).all(axis=(-2, -1)))
    shift = _CHOLESKY * np.abs(np.trace(M, axis1=-2, axis2=-1))
    for k in range(n):
        M[..., k, k] -= shift
    with np.errstate(all="ignore"):
        for k in range(n):
            pivot = M[..., k, k]
            good = np.asarray(good & (pivot > 0))
            column = M[..., k + 1 :, k] / np.sqrt(np.where(good, pivot, 1.0))[..., None]
            M[..., k + 1 :, k + 1 :] -= column[..., :, None] * column[..., None, :]
    return good
