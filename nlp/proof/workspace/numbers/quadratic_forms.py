"""Second-order forms of quantities over boxes: sums, products, norms, and solutions of linear systems.

A form is ``c + a.e + sum q_ij e_i e_j + [-r, r]`` with ``|e_i| <= 1`` for each coordinate of the pose. First-order
forms have no products; their last e may be joint-centre errors, vectors of norm at most 1. Terms of higher order and
rounding are in r. Boxes are the last axis of all arrays.

The solution Y of ``A Y = D``, where A may have more rows than columns, is that of ``(I + E) Y = Z``, ``E = C A - I``,
``Z = C D``, with C near a left inverse of A in the middle of the box. Let Y' be its terms up to the second order. The
rest of Y is ``(I + E)^-1 (Z - (I + E) Y')`` with terms of third order, and at most V where ``(I - |E|) V`` is at least
``|Z - (I + E) Y'|`` (an M-matrix).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .....models import FloatArray
from ....evidence.closed_loops import inverses
from ...enclosure.forms import Forms, QuadraticModel
from ..ranks.krawczyk import ROUNDING, bounds_of_inverses, by_centres

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative singular value of the middle matrix that counts as zero.
_ZERO = 1e-14
#: Upper bound of the underflow error of a sum or a product.
_TINY = 1e-290


@dataclass(frozen=True, eq=False)
class Quadratics:
    """Matrices of forms over B boxes.

    Attributes:
        c: (n, m, B) values at the centres.
        a: (n, m, t, B) linear parts.
        q: (n, m, p, B) coefficients of the products ``e_i e_j``, i <= j, of f coordinates, row by row; p is 0 for
            first-order forms.
        r: (n, m, B) bounds of the remainder; infinite where no form is known.
        errors: number of joint-centre errors, which are the last linear terms.
    """

    c: FloatArray
    a: FloatArray
    q: FloatArray
    r: FloatArray
    errors: int = 0

    @classmethod
    def of(cls, forms: Forms, count: int, errors: int, shape: tuple[int, int]) -> Quadratics:
        """Return a matrix from forms of its entries, column by column, with squares written as ``1/2 + 1/2 e``.

        Args:
            forms: forms of the entries.
            count: number f of coordinates, whose terms come first.
            errors: number of joint-centre errors, which are the last terms.
            shape: shape of the matrix.
        """
        c, a, r = forms.c.T, forms.a.transpose(1, 2, 0), forms.r.T
        end = a.shape[1] - errors
        q = a[:, count:end]
        if q.shape[1]:
            square = np.equal(*np.triu_indices(count))
            q, c = q.copy(), c - q[:, square].sum(axis=1)
            r = r + ROUNDING * (np.abs(c) + np.abs(q[:, square]).sum(axis=1))
            q[:, square] *= 2.0
        a = np.concatenate([a[:, :count], a[:, end:]], axis=1) if errors else a[:, :count]
        rows, columns = shape
        c, a, q, r = (each.reshape(columns, rows, *each.shape[1:]).swapaxes(0, 1) for each in (c, a, q, r))
        return cls(c, a, q, r, errors)

    @property
    def parts(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """The four arrays c, a, q and r."""
        return self.c, self.a, self.q, self.r

    @cached_property
    def linear(self) -> FloatArray:
        """Largest absolute values (n, m, B) of the linear parts."""
        t = self.a.shape[2] - self.errors
        sizes = np.abs(self.a[:, :, :t]).sum(axis=2)
        return np.asarray(sizes + by_centres(np.moveaxis(self.a[:, :, t:], 2, 3)) if self.errors else sizes)

    @cached_property
    def varying(self) -> FloatArray:
        """Largest absolute values (n, m, B) of linear parts and products together."""
        return np.asarray(self.linear + np.abs(self.q).sum(axis=2)) if self.q.shape[2] else self.linear

    @cached_property
    def size(self) -> FloatArray:
        """Largest absolute values (n, m, B) of the entries over the boxes."""
        return np.asarray((np.abs(self.c) + self.varying + self.r) * (1 + ROUNDING))

    def made(self, parts: Iterable[FloatArray]) -> Quadratics:
        """Return forms with the same errors and the given arrays c, a, q and r."""
        c, a, q, r = parts
        return Quadratics(c, a, q, r, self.errors)

    def __getitem__(self, which: slice | tuple[Any, ...]) -> Quadratics:
        """Return selected rows, columns, or, after an ellipsis, boxes."""
        return self.made(each[which] for each in self.parts)

    @property
    def transposed(self) -> Quadratics:
        """The transposed matrices."""
        return self.made(each.swapaxes(0, 1) for each in self.parts)

    def sums(self, axis: int) -> Quadratics:
        """Return the sums along axis 0 or 1; this axis keeps the length 1."""
        found = self.made(each.sum(axis=axis, keepdims=True) for each in self.parts)
        return replace(found, r=found.r + ROUNDING * self.size.sum(axis=axis, keepdims=True))

    def times(self, factors: FloatArray | float) -> Quadratics:
        """Return the entries times factors that broadcast to (n, m, B)."""
        by = np.atleast_3d(factors)
        c, a, q = self.c * by, self.a * by[:, :, None], self.q * by[:, :, None]
        return Quadratics(c, a, q, np.abs(by) * (self.r + ROUNDING * self.size), self.errors)

    def plus(self, other: Quadratics) -> Quadratics:
        """Return the sums of the entries."""
        c, a, q, r = (one + two for one, two in zip(self.parts, other.parts, strict=True))
        return Quadratics(c, a, q, r + ROUNDING * (self.size + other.size), self.errors)

    def by(self, other: Quadratics) -> Quadratics:
        """Return the products of the entries, which broadcast."""
        (c, a, q, r), (d, b, p, s) = self.parts, other.parts
        new = c[:, :, None] * b + a * d[:, :, None]
        square = c[:, :, None] * p + q * d[:, :, None]
        rest = np.abs(c) * s + np.abs(d) * r + (self.varying + r) * (other.varying + s)
        if q.shape[2]:
            _add_products(square, a, b)
            rest = np.maximum(rest - self.linear * other.linear, 0.0)
        return Quadratics(c * d, new, square, rest + 4 * ROUNDING * self.size * other.size + _TINY, self.errors)

    def matmul(self, other: Quadratics) -> Quadratics:
        """Return the matrix products."""
        (c, a, q, r), (d, b, p, s) = self.parts, other.parts
        new, square = _contracted(a, d[:, :, None]), _contracted(q, d[:, :, None])
        if c.any():
            new += _contracted(c[:, :, None], b)
            square += _contracted(c[:, :, None], p)
        rest = _product(np.abs(c), s) + _product(r, np.abs(d)) + _product(self.varying + r, other.varying + s)
        if q.shape[2]:
            for k in range(c.shape[1]):
                _add_products(square, a[:, k : k + 1], b[None, k])
            rest = np.maximum(rest - _product(self.linear, other.linear), 0.0)
        rest += 4 * ROUNDING * _product(self.size, other.size) + _TINY
        return Quadratics(_product(c, d), new, square, rest, self.errors)

    def lengths(self) -> Quadratics:
        """Return forms (1, m) whose upper bounds are at least the norms of the columns.

        A norm is at most ``(g / t + t) / 2``, with its square g and any t > 0, here the largest norm.
        """
        g = self.by(self).sums(0)
        with np.errstate(all="ignore"):
            t = np.sqrt(np.maximum(g.upper(), _TINY))
            found = _where(np.isfinite(t), g).times(np.where(np.isfinite(t), 0.5 / t, 0.0))
        return replace(found, c=found.c + 0.5 * t, r=found.r + ROUNDING * t)

    def upper(self) -> FloatArray:
        """Return upper bounds (n, m, B) of the entries over the boxes; infinite where no form is known."""
        f, total = self.a.shape[2] - self.errors, self.c + self.r
        if not self.q.shape[2]:
            return np.asarray(total + self.varying + 4 * ROUNDING * self.size)
        b, q = (np.moveaxis(each, 2, 0).reshape(each.shape[2], -1) for each in (self.a, self.q))
        H, (rows, columns) = np.zeros((f, f, b.shape[1])), np.triu_indices(f)
        H[rows, columns] += q
        H[columns, rows] += q
        across, rounding = np.abs(H).sum(axis=1), 16 * ROUNDING * self.size.ravel()
        slopes = b - across - rounding, b + across + rounding
        model = QuadraticModel(total.ravel(), b, H, np.zeros_like(b), *slopes, rounding)
        return model.bound().reshape(total.shape)


def _add_products(square: FloatArray, a: FloatArray, b: FloatArray) -> None:
    """Add the products of two linear parts (n, m, f, B), which broadcast, to coefficients (n, m, p, B)."""
    f, begin = a.shape[2], 0
    for i in range(f):
        end = begin + f - i
        square[:, :, begin:end] += a[:, :, i : i + 1] * b[:, :, i:]
        square[:, :, begin + 1 : end] += a[:, :, i + 1 :] * b[:, :, i : i + 1]
        begin = end


def _contracted(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return products of matrices of terms (n, k, t, B) and (k, m, t, B), one of which has t = 1."""
    return np.asarray(sum(one[:, k, None] * other[None, k] for k in range(one.shape[1])))


def _product(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return products of matrices (n, k, B) and (k, m, B)."""
    return np.asarray(np.einsum("nkb,kmb->nmb", one, other))


def solved(A: Quadratics, D: Quadratics) -> Quadratics:
    """Return the solutions (n, k) of ``A Y = D`` for matrices (m, n); remainders are infinite without a proof."""
    known = np.asarray(np.isfinite(A.size).all(axis=(0, 1)) & np.isfinite(D.size).all(axis=(0, 1)))
    A, D, n = _where(known, A), _where(known, D), A.c.shape[1]
    eye = np.eye(n)
    with np.errstate(all="ignore"):
        middle = np.where(known[:, None, None], A.c.transpose(2, 0, 1), np.eye(*A.c.shape[:2]))
        inverse = inverses if n == A.c.shape[0] else partial(np.linalg.pinv, rcond=_ZERO)
        C = np.ascontiguousarray(inverse(middle).transpose(1, 2, 0))
        E, Z = _fixed_times(C, A), _fixed_times(C, D)
        # The difference of C A and I in the middle goes into the remainder.
        E = replace(E, c=np.zeros_like(E.c), r=E.r + np.abs(E.c - eye[:, :, None]) * (1 + ROUNDING))
        # Coefficients that make both sides of (I + E) Y = Z equal up to the second order.
        new, square = Z.a - _contracted(E.a, Z.c[:, :, None]), Z.q - _contracted(E.q, Z.c[:, :, None])
        if square.shape[2]:
            for k in range(n):
                _add_products(square, -E.a[:, k : k + 1], new[None, k])
        Y = Quadratics(Z.c, new, square, np.zeros_like(Z.r), Z.errors)
        squares, others = Y.varying - Y.linear, E.varying - E.linear
        left = Z.r + _product(E.r, Y.size) + _product(others, Y.varying)
        left += _product(E.linear, squares if square.shape[2] else Y.linear)
        left += 4 * ROUNDING * (Z.size + _product(E.size, Y.size)) + _TINY
        right = np.concatenate([left, np.ones((n, 1, len(known)))], axis=1) * (1 + ROUNDING)
        size = np.where(np.isfinite(E.size), E.size, 0.0)
        V, holds = bounds_of_inverses(size.transpose(2, 0, 1), right.transpose(2, 0, 1))
        known &= holds
        rest = V.transpose(1, 2, 0)[:, :-1]
    rest = np.where(known & np.isfinite(rest) & np.isfinite(E.size).all(axis=(0, 1)), rest, np.inf)
    return replace(Y, r=rest)


def _fixed_times(factors: FloatArray, of: Quadratics) -> Quadratics:
    """Return constant matrices (k, n, B) times forms (n, m)."""
    size = np.abs(factors)
    a, q = (np.einsum("knb,nmtb->kmtb", factors, each) for each in (of.a, of.q))
    rest = _product(size, of.r) + 2 * ROUNDING * _product(size, of.size) + _TINY
    return Quadratics(_product(factors, of.c), a, q, rest, of.errors)


def _where(known: NDArray[np.bool_], of: Quadratics) -> Quadratics:
    """Return the forms, with zeros where they are not known."""
    each = known if known.ndim == 1 else known[:, :, None]
    return of.made(np.where(each if part.ndim == 4 else known, part, 0.0) for part in of.parts)
