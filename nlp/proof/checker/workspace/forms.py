"""Affine forms of expressions and matrices over boxes, from polynomials with an error ball, and their contractions.

Over a box of coordinates ``z_i = c_i + r_i e_i``, ``|e_i| <= 1``, an expression is ``c + sum_i a_i e_i`` plus a
remainder.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models import FloatArray
from ..arithmetic import PolynomialArithmetic
from ..polynomials import UNIT, Polynomial, places

#: Relative outward rounding of a sum of nonnegative products: more than the rounding of fewer than 400 terms.
UP = 1 + 1024 * UNIT
#: Rounding of a product of matrices with fewer than 400 terms, relative to the product of absolute values.
PRODUCT = 512 * UNIT
#: Relative enlargement that turns the computed solution of a linear system into a bound: rounding errors are far
#: smaller.
ENLARGED = 1e-6
#: Number of steps of the power method; and fraction of the largest singular value below which singular values are zero.
_STEPS, _FLAT = 12, 1e-14


class AffineMatrix(NamedTuple):
    """Matrices over B boxes, enclosed by ``M + sum_k A_k e_k + [-E, E]``.

    The shapes of M, A and E are (B, m, c), (B, n, m, c) and (B, m, c).
    """

    M: FloatArray
    A: FloatArray
    E: FloatArray

    @property
    def rest(self) -> FloatArray:
        """Remainder (B, m, c), including the rounding of a product with M and A."""
        return np.asarray(self.E + PRODUCT * (np.abs(self.M) + self.spread))

    @property
    def spread(self) -> FloatArray:
        """Largest absolute values (B, m, c) of the linear parts."""
        return np.asarray(np.abs(self.A).sum(axis=1))

    def part(self, rows: slice, columns: slice = slice(None)) -> AffineMatrix:
        """Return the rows and columns of two slices."""
        return AffineMatrix(self.M[:, rows, columns], self.A[:, :, rows, columns], self.E[:, rows, columns])

    def corners(self, count: int | None = None) -> FloatArray:
        """Return the matrices without remainder at the corners of the boxes, (B, corners, m, c).

        With ``count``, only the first coordinates are at their ends; the other coordinates are at the centre.
        """
        A = self.A[:, :count]
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=A.shape[1])))
        moved = A.transpose(0, 2, 3, 1) @ signs.T
        return np.asarray(self.M[:, None] + moved.transpose(0, 3, 1, 2))

    def matmul(self, other: AffineMatrix) -> AffineMatrix:
        """Return the products of the matrices."""
        size, others = np.abs(self.M), np.abs(other.M)
        one, two = self.spread + self.E, other.spread + other.E
        rest = one @ two + size @ other.E + self.E @ others + PRODUCT * ((size + one) @ (others + two))
        A = self.A @ other.M[:, None] + self.M[:, None] @ other.A
        return AffineMatrix(self.M @ other.M, A, rest * UP)

    def contracted(
        self, C: FloatArray, moved: FloatArray | None = None
    ) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
        """Return where C (B, c, m) times M is invertible, bounds of ``|I - C M|``, and shares (B, n) of ``C A``.

        ``moved`` (B, k, c, c) has bounds of the terms of ``C A`` in another grouping; None to bound each term.
        """
        moved = np.abs(C[:, None] @ self.A) if moved is None else moved
        bound = (off_identity(C, self.M) + np.abs(C) @ self.rest + moved.sum(axis=1)) * UP
        holds, v = contraction(bound)
        return holds, bound, np.asarray((moved * v[:, None, None, :] / v[:, None, :, None]).sum(axis=(2, 3)))


class Forms(NamedTuple):
    """Expressions over B boxes, enclosed by ``c + sum_i a_i e_i + [-r, r]``; NaN if undefined.

    The shapes of c, a and r are (B, R), (B, R, n) and (B, R).
    """

    c: FloatArray
    a: FloatArray
    r: FloatArray

    def matrix(self, at: NDArray[np.intp], shape: tuple[int, int]) -> AffineMatrix:
        """Return matrices (B, m, c) with these forms as entries at rows and columns (2, R), and 0 elsewhere."""
        B, (rows, columns) = len(self.c), at
        M, A, E = np.zeros((B, *shape)), np.zeros((B, self.a.shape[2], *shape)), np.zeros((B, *shape))
        M[:, rows, columns], E[:, rows, columns] = self.c, self.r
        A[:, :, rows, columns] = self.a.transpose(0, 2, 1)
        return AffineMatrix(M, A, E)


class Values(NamedTuple):
    """Polynomials of R expressions over boxes with bounds (B, n)."""

    polynomials: list[Polynomial]
    shape: tuple[int, int]

    def forms(self, which: slice = slice(None)) -> Forms:
        """Return affine forms of some expressions: the square of a coordinate lies within 1/2 +- 1/2."""
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


class SparseMatrices(NamedTuple):
    """Nonzero entries of matrices.

    Attributes:
        at: rows and columns (2, R) of the entries of each matrix.
        shapes: shape (m, c) of each matrix.
        entries: (R, 1) expressions of all entries, one matrix after another.
    """

    at: list[NDArray[np.intp]]
    shapes: list[tuple[int, int]]
    entries: SX

    @classmethod
    def of(cls, matrices: Sequence[SX]) -> SparseMatrices:
        """Return the nonzero entries of matrices."""
        at = [np.array(each.sparsity().get_triplet(), dtype=np.intp) for each in matrices]
        entries = ca.vertcat(SX(0, 1), *[ca.vec(each.nz[:]) for each in matrices])
        return cls(at, [each.shape for each in matrices], entries)

    def forms(self, entries: Forms) -> list[AffineMatrix]:
        """Return the matrices from forms of all entries."""
        ends = np.cumsum([0, *(each.shape[1] for each in self.at)])
        parts = [Forms(*(each[:, begin:end] for each in entries)) for begin, end in itertools.pairwise(ends)]
        return [part.matrix(at, shape) for part, at, shape in zip(parts, self.at, self.shapes, strict=True)]


#: Function that returns polynomials of further inputs over boxes with ends (B, n).
Given = Callable[[FloatArray, FloatArray], Sequence[Polynomial]]


class FormArithmetic:
    """Affine forms of a vector of expressions (R, 1) of symbols (n, 1).

    Args:
        z: (n, 1) symbols: coordinates of boxes, followed by further inputs.
        expressions: (R, 1) expressions.
        given: function that returns polynomials of the further inputs; None without further inputs.

    Raises:
        UncoveredError: an expression has an operation without a rule.
    """

    def __init__(self, z: SX, expressions: SX, given: Given | None = None) -> None:
        self._given = given
        self.function = ca.Function("forms", [z], ca.cse([ca.densify(expressions)]))
        self._arithmetic = PolynomialArithmetic(self.function)

    def __call__(self, lower: FloatArray, upper: FloatArray) -> Values:
        """Return enclosures of the expressions over boxes with ends (B, n)."""
        given = () if self._given is None else self._given(lower, upper)
        return Values(self._arithmetic(lower.T, upper.T, given), lower.shape)


@np.errstate(all="ignore")
def contraction(B: FloatArray) -> tuple[NDArray[np.bool_], FloatArray]:
    """Return which nonnegative matrices (B, k, k) have a spectral radius below 1, and v with ``B v < v`` for them."""
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
    """Return approximate left inverses (B, c, m) of matrices (B, m, c); NaN where none exists.

    Singular values below the fraction ``zero`` of the largest count as 0; None sets the rounding threshold.
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
    """Return absolute values of ``I - C M``, without the rounding of the product."""
    return np.asarray(np.abs(np.eye(C.shape[-2]) - C @ M) * (1 + 2 * UNIT) + 2 * UNIT)


@np.errstate(all="ignore")
def solved(A: AffineMatrix, D: AffineMatrix) -> tuple[AffineMatrix, NDArray[np.bool_], FloatArray]:
    """Return the solutions (B, c, k) of ``A Y = D``, whether each is known (B,), and shares (B, n) in the remainder.

    A (B, m, c) may have more rows than columns. With C near a left inverse of A in the middle of a box, ``Y_0 = C D_0``
    and ``B >= |I - C A|``,

        Y - Y_0 = C (D - A Y_0) + (C A)^-1 (I - C A) C (D - A Y_0).

    The first part is affine in the coordinates up to a remainder, the second at most ``(I - B)^-1 B |C (D - A Y_0)|``.
    """
    C = inverses(A.M)
    holds, bound, shares = A.contracted(C)
    Y = C @ D.M
    gap = AffineMatrix(D.M - A.M @ Y, D.A - A.A @ Y[:, None], D.rest + A.rest @ np.abs(Y))
    T = C[:, None] @ gap.A
    rest = (np.abs(C @ gap.M) + np.abs(C) @ gap.rest) * UP
    Q = (rest + np.abs(T).sum(axis=1)) * UP
    known = holds & np.isfinite(Q).all(axis=(1, 2))
    bound, Q = (np.where(known[:, None, None], each, 0.0) for each in (bound, Q))
    right = bound @ Q * UP
    wider = bound * (1 + ENLARGED)
    X = np.linalg.solve(np.eye(bound.shape[1]) - wider, right)
    # Before these steps, small entries have the rounding errors of the largest entry.
    for _ in range(2):
        X = right + wider @ np.maximum(X, 0.0)
    X *= 1 + ENLARGED
    # (I - B) X >= B Q with a spectral radius below 1: X is a bound.
    known = known & (X >= 0).all(axis=(1, 2)) & ((bound @ X) * UP + right <= X).all(axis=(1, 2))
    return AffineMatrix(Y, T, (rest + X) * UP), np.asarray(known), shares
