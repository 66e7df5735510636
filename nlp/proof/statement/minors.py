"""Conditions that follow from a limit on the smallest singular value, and that exclude wide boxes.

The limit is on an estimate of the smallest eigenvalue of ``A = J'J`` that takes thousands of operations. An enclosure
of it is of use on small boxes alone. The estimate is from below, so that where it is at least ``s^2``

    M = A - s^2 I   has no negative eigenvalue.

So no principal minor of M is negative. Minors are polynomials in J, whose terms cancel in forms of second order. By
interlacing a box with two eigenvalues of M below 0, where the determinant is positive, has smaller minors that are
negative. For condition numbers the like, with ``tr A^4 / (c^2 tr A^3)`` in the place of ``s^2``, excludes wide boxes
too, but saved no boxes of a search.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import casadi as ca
import numpy as np
from casadi import SX

from ...case.limits.constraint import End, Spectral
from .form import Condition

#: Orders of the principal minors. Those of 4 and 5 exclude boxes twice as wide as the determinant alone; smaller ones
#: gain nothing more, as few poses have so many small singular values.
_ORDERS = (4, 5, 6)
#: Part of itself by which s^2 is smaller than stated: rounding of its numbers.
_ROUNDING = 1e-9
_SIZE = 6


def spectral_conditions(name: str, spectral: Spectral, lower: float) -> Iterator[Condition]:
    """Yield conditions on the minors of a matrix that is a function of J; none for a condition number.

    Args:
        name: of the constraint.
        spectral: what the constraint is on.
        lower: lower bound of the smallest eigenvalue; not finite without one.
    """
    if spectral.end is not End.SMALLEST or not (np.isfinite(lower) and lower > 0):
        return
    scale = SX([1, 1, 1, *[1 / spectral.length] * 3])
    J = spectral.matrix @ ca.diag(scale)
    minors = _Minors(J.T @ J - (1 - _ROUNDING) * lower * SX.eye(_SIZE))
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
