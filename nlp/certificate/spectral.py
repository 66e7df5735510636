"""Conditions that follow from limits on singular values, and that exclude wide boxes.

The limits are on estimates of the smallest and largest eigenvalue of ``A = J'J`` that take thousands of operations. An
enclosure of these is of use on small boxes alone. Where they hold,

    M = A - r I   has no negative eigenvalue,   r = s^2,  or  r = l / c^2  with  l = tr A^4 / tr A^3 <= lambda_max,

with the smallest singular value s, or the condition number c: the estimates are on the safe side. So no principal minor
of M is negative. Minors are polynomials in J, whose terms cancel in forms of second order. By interlacing a box with
two eigenvalues of M below 0, where the determinant is positive, has smaller minors that are negative.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import casadi as ca
import numpy as np
from casadi import SX

from ..case.limits.constraint import End, Spectral
from .form import Condition

#: Orders of the principal minors. Those of 4 and 5 exclude boxes twice as wide as the determinant alone; smaller ones
#: gain nothing more, as few poses have so many small singular values.
_ORDERS = (4, 5, 6)
#: Part of itself by which r is smaller than stated: rounding of its numbers.
_ROUNDING = 1e-9
_SIZE = 6


def spectral_conditions(name: str, spectral: Spectral, lower: float, upper: float) -> Iterator[Condition]:
    """Yield conditions on the minors of a matrix that is a function of J.

    Args:
        name: of the constraint.
        spectral: what the constraint is on.
        lower: lower bound of the smallest eigenvalue; not finite without one.
        upper: upper bound of minus the ratio of eigenvalues; not finite without one.
    """
    scale = SX([1, 1, 1, *[1 / spectral.length] * 3])
    J = spectral.matrix @ ca.diag(scale)
    A = J.T @ J
    if spectral.end is End.SMALLEST:
        if not (np.isfinite(lower) and lower > 0):
            return
        least = SX(lower)
    else:
        if not (np.isfinite(upper) and upper < 0):
            return
        square = A @ A
        # A is divided by nothing: both traces are sums of products of entries of A and of its square.
        least = -upper * ca.sumsqr(square) / ca.sum1(ca.sum2(square * A))
    M = A - (1 - _ROUNDING) * least * SX.eye(_SIZE)
    minors = _Minors(M)
    for order in _ORDERS:
        for chosen in combinations(range(_SIZE), order):
            places = "".join(str(k + 1) for k in chosen)
            yield Condition(f"{name} minor {places}", -minors.of(chosen, chosen), is_equation=False, follows=True)


class _Minors:
    """Minors of a matrix by expansion along rows, each computed once.

    Args:
        matrix: (n, n) expressions.
    """

    def __init__(self, matrix: SX) -> None:
        self._matrix = matrix
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], SX] = {}

    def of(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> SX:
        """Return the determinant (1, 1) of some rows and as many columns."""
        key = rows, columns
        if key not in self._known:
            first, *others = rows
            if not others:
                return self._matrix[first, columns[0]]
            terms = [
                (-1) ** k * self._matrix[first, column] * self.of(tuple(others), columns[:k] + columns[k + 1 :])
                for k, column in enumerate(columns)
            ]
            self._known[key] = sum(terms, SX(0))
        return self._known[key]
