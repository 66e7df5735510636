"""Affine forms of expressions over boxes, from polynomials with a ball, and of matrices, and their contractions.

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
#: Steps of the power method, and part of the largest singular value below which others are zero.
_STEPS, _FLAT = 12, 1e-14


class AffineMatrix(NamedTuple):
    """Matrices over B boxes: in ``M + sum_k A_k e_k + [-E, E]``, with (B, m, c), (B, n, m, c) and (B, m, c)."""

    M: FloatArray
    A: FloatArray
    E: FloatArray

    @property
    def rest(self) -> FloatArray:
        """The rest (B, m, c), with the rounding of a product with M and A."""
        return np.asarray(self.E + PRODUCT * (np.abs(self.M) + np.abs(self.A).sum(axis=1)))

    def contracted(
        self, C: FloatArray, moved: FloatArray | None = None
    ) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
        """Return where C (B, c, m) times the matrices has an inverse, bounds of ``|I - C M|``, and shares (B, n) of CA.

        ``moved`` (B, k, c, c) are bounds of parts of ``C A`` in another grouping; None for the size of each.
        """
        moved = np.abs(C[:, None] @ self.A) if moved is None else moved
        bound = (off_identity(C, self.M) + np.abs(C) @ self.rest + moved.sum(axis=1)) * UP
        holds, v = contraction(bound)
        return holds, bound, np.asarray((moved * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3)))


class Forms(NamedTuple):
    """Expressions over B boxes: in ``c + sum_i a_i e_i + [-r, r]``, (B, R), (B, R, n) and (B, R), NaN if undefined."""

    c: FloatArray
    a: FloatArray
    r: FloatArray

    def matrix(self, at: NDArray[np.intp], shape: tuple[int, int]) -> AffineMatrix:
        """Return matrices (B, m, c) with these as entries at rows and columns (2, R), and 0 elsewhere."""
        B, (rows, columns) = len(self.c), at
        M, A, E = np.zeros((B, *shape)), np.zeros((B, self.a.shape[2], *shape)), np.zeros((B, *shape))
        M[:, rows, columns], E[:, rows, columns] = self.c, self.r
        A[:, :, rows, columns] = self.a.transpose(0, 2, 1)
        return AffineMatrix(M, A, E)


class Values(NamedTuple):
    """Polynomials of R expressions over boxes with ends of a shape (B, n)."""

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


@np.errstate(all="ignore")
def contraction(B: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which nonnegative matrices (B, k, k) have a spectral radius below 1, and v with ``B v < v`` there."""
    B = np.where(np.isfinite(B), B, np.inf)
    v, holds = np.ones(B.shape[:2]), np.zeros(len(B), dtype=bool)
    for _ in range(_STEPS):
        w = np.einsum("bij,bj->bi", B, v) * UP
        holds |= (w < v).all(axis=1)
        if (holds | (w >= v).all(axis=1)).all():
            break
        following = w / w.sum(axis=1, keepdims=True) + 1e-12
        v = np.where(holds[:, None], v, following)
    return holds, v


def inverses(matrices: FloatArray, zero: float | None = None) -> FloatArray:
    """Return approximate left inverses (B, c, m) of matrices (B, m, c); NaN where there is none.

    Singular values below a part ``zero`` of the largest count as 0; None for rounding alone.
    """
    good = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    found = np.full_like(np.swapaxes(matrices, 1, 2), np.nan)
    if zero is None and matrices.shape[1] == matrices.shape[2]:
        good &= np.linalg.det(np.where(good[:, None, None], matrices, 0.0)) != 0
        found[good] = np.linalg.inv(matrices[good])
    else:
        found[good] = np.linalg.pinv(matrices[good], rcond=zero or _FLAT)
    return np.asarray(found)


def off_identity(C: FloatArray, M: FloatArray) -> FloatArray:
    """Return sizes of ``I - C M``, but for the rounding of the product."""
    return np.asarray(np.abs(np.eye(C.shape[-2]) - C @ M) * (1 + 2 * UNIT) + 2 * UNIT)
