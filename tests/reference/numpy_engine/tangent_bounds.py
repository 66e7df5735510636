"""Lower bounds of sums of squares by tangents, for a minimum of F: the first pass again, without its quotients.

A term of F is ``N^2 / D``, with N and D polynomials in the joint coordinates, and ``D > 0``. For every number ``rho``

    N^2 / D >= 2 rho N - rho^2 D,

since the difference is ``(N - rho D)^2 / D``. The right side has neither quotient nor square, so that its form of
second order is accurate on large boxes. ``rho`` is ``N / D`` at a point where the sum of squares is small, found with N
as its linear form: there the right side is a tangent plane to a convex function, and the largest of all of them is that
function. Any other point gives a bound that holds too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from screwsynth.models import FloatArray

from .intervals import LARGEST, TINY, ULP
from .second_order import Forms, monomials

#: Sweeps over the variables in the search for a point where the sum of squares is small.
_SWEEPS = 8


class TangentForms(NamedTuple):
    """Forms of second order of functions with tangents, and whether they may be used (B,)."""

    forms: Forms
    usable: NDArray[np.bool_]


def tangent_forms(rows: Forms, squared: tuple[int, ...], count: int) -> TangentForms:
    """Return forms of functions that are nowhere below J functions, from the forms of their rows.

    Args:
        rows: of the rows for tangents.
        squared: (K,) number of the function of each pair.
        count: number J of functions.
    """
    N, D = slice(count, None, 2), slice(count + 1, None, 2)
    usable = np.asarray((rows.lo[D] > 0).all(axis=0) & (rows.s < np.inf).all(axis=0))
    every: list[Forms] = []
    for j in range(count):
        of = np.array(squared) == j
        e = _low_point(rows.c[N][of], rows.a[N][of], rows.c[D][of])
        values = _values(rows, e)
        ratio = np.where(values[D][of] > 0, values[N][of] / values[D][of], 0.0)
        # Any ratio gives a bound: one whose square neither underflows nor overflows.
        ratio = np.where((np.abs(ratio) > 1 / LARGEST) & (np.abs(ratio) < LARGEST), ratio, 0.0)
        weights = np.zeros_like(rows.c)
        weights[j] = 1.0
        weights[count + 2 * np.flatnonzero(of)] = -2 * ratio
        weights[count + 1 + 2 * np.flatnonzero(of)] = ratio * ratio
        every.append(_sum(rows, weights))
    return TangentForms(Forms(*(np.stack([getattr(each, name) for each in every]) for name in vars(rows))), usable)


def _low_point(c: FloatArray, a: FloatArray, D: FloatArray) -> FloatArray:
    """Return a point (n, B) of the boxes where the sum of ``(c + a.e)^2 / D`` is small, K terms each."""
    e, left = np.zeros(a.shape[1:]), c.copy()
    scale = np.where(D > 0, 1 / D, 0.0)
    curvature = (scale[:, None] * a * a).sum(axis=0)
    for _ in range(_SWEEPS):
        for i in range(len(e)):
            step = (scale * left * a[:, i]).sum(axis=0) / curvature[i]
            new = np.where(curvature[i] > 0, np.clip(e[i] - step, -1.0, 1.0), e[i])
            left += a[:, i] * (new - e[i])
            e[i] = new
    return e


def _values(rows: Forms, e: FloatArray) -> FloatArray:
    """Return the values (R, B) of forms at points (n, B), apart from their remainders."""
    at = monomials(len(e))
    return np.asarray(
        rows.c + np.einsum("rib,ib->rb", rows.a, e) + np.einsum("rqb,qb->rb", rows.Q, e[at.first] * e[at.second])
    )


def _sum(rows: Forms, weights: FloatArray) -> Forms:
    """Return the form of a sum of values with weights (R, B)."""
    size = np.abs(weights)
    matrix = 2 * np.abs(rows.Q)
    of_row = np.abs(rows.c) + (rows.q - rows.p) + rows.s + np.abs(rows.a).sum(axis=1) + matrix.sum(axis=1)
    positive = weights > 0
    s = (size * rows.s + 64 * ULP * (size * of_row) + TINY).sum(axis=0)
    return Forms(
        c=(rows.c * weights).sum(axis=0),
        a=(rows.a * weights[:, None]).sum(axis=0),
        Q=(rows.Q * weights[:, None]).sum(axis=0),
        p=(np.where(positive, rows.p, rows.q) * weights).sum(axis=0),
        q=(np.where(positive, rows.q, rows.p) * weights).sum(axis=0),
        s=s,
        lo=np.full(s.shape, -np.inf),
        hi=np.full(s.shape, np.inf),
    )
