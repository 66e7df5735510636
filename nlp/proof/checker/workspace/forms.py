"""Affine forms of expressions over boxes, from polynomials with a ball, and facts about matrices with a proof.

Over a box of coordinates ``z_i = c_i + r_i e_i``, ``|e_i| <= 1``, an expression is ``c + sum_i a_i e_i`` and a rest.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ..arithmetic import PolynomialArithmetic
from ..polynomials import UNIT, Polynomial, places

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


class Values(NamedTuple):
    """Polynomials of R expressions over boxes.

    Attributes:
        polynomials: R of them.
        shape: (B, n) of the ends of the boxes.
    """

    polynomials: list[Polynomial]
    shape: tuple[int, int]

    def forms(self, which: slice = slice(None)) -> Forms:
        """Return affine forms of some expressions: the square of a coordinate is 1/2, give or take 1/2."""
        values, (B, n) = self.polynomials[which], self.shape
        c, a, r = np.zeros((B, len(values))), np.zeros((B, len(values), n)), np.zeros((B, len(values)))
        for k, value in enumerate(values):
            at = places(len(value.on))
            squares, products = value.P[at.squares], value.P[at.products]
            c[:, k] = value.P[0] + 0.5 * squares.sum(axis=0)
            a[:, k, list(value.on)] = value.P[at.linear].T
            rest = 0.5 * np.abs(squares).sum(axis=0) + np.abs(products).sum(axis=0)
            r[:, k] = (rest + value.s + PRODUCT * value.size) * UP
        return Forms(c, a, r)

    def ends(self, which: slice = slice(None)) -> FloatArray:
        """Return the ends (2, R, B) of the ranges of some expressions."""
        ends = [[np.broadcast_to(each.V[k], self.shape[:1]) for each in self.polynomials[which]] for k in (0, 1)]
        return np.array(ends, dtype=float).reshape(2, -1, self.shape[0])


class FormArithmetic:
    """Affine forms of a vector of expressions (R, 1) of symbols (n, 1).

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, z: SX, expressions: SX) -> None:
        self.function = ca.Function("forms", [z], ca.cse([ca.densify(expressions)]))
        self._arithmetic = PolynomialArithmetic(self.function)

    def __call__(self, lower: FloatArray, upper: FloatArray) -> Values:
        """Return the expressions over boxes with ends (B, n)."""
        return Values(self._arithmetic(lower.T, upper.T), lower.shape)


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
