"""Polynomials of second order with a ball, for the check of a proof; :mod:`.polynomialrules` has their arithmetic.

On boxes ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, every value v is enclosed by

    v(e) in c + sum_i a_i e_i + sum_{i <= j} Q_ij e_i e_j + [-s, s]     and     v(e) in V.

``s`` holds all terms of third and higher order, bounded by sums of sizes, and all rounding. A function of one variable
is its Taylor polynomial with Lagrange's remainder of third order, or an identity that replaces it. A value keeps only
the coefficients of the variables that it depends on. Coefficients are computed in round to nearest, and ``s`` grows by
the number of roundings that an operation makes of each of its terms, counted with a margin, in parts of the sizes of
its operands.

A value that may be undefined has NaN for ``s`` and ``V``, and so has every value computed from it; NaN proves nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray
    from .intervals import Ends

#: Rounding unit of doubles.
UNIT = 2.0**-53


class Places(NamedTuple):
    """Places of the m coefficients of polynomials in d variables: constant, linear, squares, and products of two.

    Attributes:
        linear, squares, products: slices of rows.
        first, second: (d (d - 1) / 2,) the two variables of each product.
        slack: bound of the relative rounding error of sums of sizes of m coefficients and of a formula of them.
    """

    linear: slice
    squares: slice
    products: slice
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    slack: float

    @property
    def total(self) -> int:
        """Number m of coefficients."""
        return int(self.products.stop)


@cache
def places(d: int) -> Places:
    """Return the places of coefficients of polynomials in d variables."""
    first, second = np.triu_indices(d, 1)
    count = 1 + 2 * d + len(first)
    return Places(
        slice(1, 1 + d),
        slice(1 + d, 1 + 2 * d),
        slice(1 + 2 * d, count),
        first,
        second,
        2 * (count + 32) * UNIT,
    )


@cache
def _rows_in(few: tuple[int, ...], many: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the rows of coefficients in some variables among those in more variables; both sorted."""
    at = {variable: k for k, variable in enumerate(many)}
    d, small, large = len(many), places(len(few)), places(len(many))
    own = [at[variable] for variable in few]
    pair = np.zeros((d, d), dtype=np.intp)
    pair[large.first, large.second] = np.arange(large.products.start, large.total)
    products = [int(pair[own[i], own[j]]) for i, j in zip(small.first, small.second, strict=True)]
    return np.array([0, *(1 + k for k in own), *(1 + d + k for k in own), *products], dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A value over N boxes; a constant has 1 in the place of N.

    Attributes:
        on: the d variables that it depends on, in order.
        P: (m, N) coefficients at :func:`places`.
        s: (N,) radius of the ball; NaN where the value may be undefined.
        V: ends (N,) of the range.
        rad: (N,) sum of the sizes of linear coefficients.
        curved: (N,) largest size of the part of second order.
        size: (N,) sum of the sizes of all coefficients.
    """

    on: tuple[int, ...]
    P: FloatArray
    s: FloatArray
    V: Ends
    rad: FloatArray
    curved: FloatArray
    size: FloatArray

    def select(self, which: NDArray[np.intp]) -> Polynomial:
        """Return the value over some boxes; a constant is one number for all."""
        if self.P.shape[1] == 1:
            return self
        V = self.V[0][which], self.V[1][which]
        rad, curved, size = self.rad[which], self.curved[which], self.size[which]
        return Polynomial(self.on, self.P[:, which], self.s[which], V, rad, curved, size)

    def spread(self, on: tuple[int, ...]) -> FloatArray:
        """Return the coefficients (M, N) in more variables."""
        if on == self.on:
            return self.P
        P = np.zeros((places(len(on)).total, self.P.shape[1]))
        P[_rows_in(self.on, on)] = self.P
        return P


def middles(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the centres and radii (n, N) of boxes with ends (n, N); a radius is rounded up."""
    centre = np.clip(0.5 * lower + 0.5 * upper, lower, upper)
    radius = np.maximum(upper - centre, centre - lower)
    return centre, np.where(radius > 0, np.nextafter(radius, np.inf), 0.0)
