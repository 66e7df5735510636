"""Krawczyk's operator for loop equations: dependent coordinates over a box, as a linear relation with a remainder.

With forms ``g + A e + [-r, r]`` of the equations over a box, let Y be close to the inverse of the columns of the
dependent coordinates D. Every point of the box with closed loops then satisfies

    e_D = off - T e_I + [-rho, rho],    off = -Y g,   T = Y A_I,   rho = |Y| r + |Y A_D - I|  (+ rounding).

Joint-centre errors are additional columns E, ``- Y A_E e_E``; errors of one centre are a vector of norm at most 1. If
the right side is inside the box for all ``|e_I| <= 1``, Brouwer's theorem gives a point with closed loops for each
value of the independent coordinates. The point is unique if the derivatives with respect to D are also regular over
the box [1].

Source: 1. R. Krawczyk, *Newton-Algorithmen zur Bestimmung von Nullstellen mit Fehlerschranken*, Computing 4 (1969); the
form with parameters is in A. Neumaier, *Interval Methods for Systems of Equations*, 1990, Section 5.6.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray
from ....evidence.closed_loops import inverses
from ...enclosure.forms import Forms

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Rounding error of a computed product, relative to the sum of the absolute values of all terms: products here have
#: fewer than 400 terms, each with a rounding of 2^-53.
ROUNDING = 1e-13
#: Relative enlargement of the bound of an inverse, so that rounding errors do not decide whether it is proved.
_ROOM = 1e-6
#: Number of refinements that make the rounding error of each entry of this bound relative to the entry.
_REFINED = 2
#: Upper bound of the underflow error of a sum of squares.
_TINY = 1e-300


class Coordinates(NamedTuple):
    """Indices of the independent coordinates, of the dependent coordinates, and of the joint-centre errors."""

    independent: list[int]
    dependent: list[int]
    errors: list[int]


class Relation(NamedTuple):
    """Dependent coordinates over B boxes, relative to their half widths.

    Attributes:
        off: (B, k) values at the centre of the independent coordinates.
        T: (B, k, f) negative derivatives with respect to the independent coordinates.
        rho: (B, k) remainder; infinite where no relation is known.
        E: (B, k, 3 m) negative derivatives with respect to the errors of m joint centres.
    """

    off: FloatArray
    T: FloatArray
    rho: FloatArray
    E: FloatArray

    @property
    def of_errors(self) -> FloatArray:
        """Largest absolute contributions (B, k) of the joint-centre errors."""
        return by_centres(self.E)

    @property
    def reach(self) -> FloatArray:
        """Largest absolute values (B, k) over the box."""
        return np.asarray((np.abs(self.off) + np.abs(self.T).sum(axis=2) + self.of_errors + self.rho) * (1 + ROUNDING))


def by_centres(slopes: FloatArray) -> FloatArray:
    """Return the largest absolute values (...) of linear parts (..., 3 m) in errors of m centres of norm at most 1."""
    parts = slopes.reshape(*slopes.shape[:-1], slopes.shape[-1] // 3, 3)
    return np.asarray(np.sqrt((parts * parts).sum(axis=-1) + _TINY).sum(axis=-1) * (1 + ROUNDING))


def bounds_of_inverses(E: FloatArray, right: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return X (B, n, k) with ``(I - E) X >= right`` for nonnegative E (B, n, n), and whether this is proved (B,).

    If every row of ``right`` has a positive sum, a nonnegative X proves that ``I - E`` is an M-matrix. Then X is at
    least ``(I - E)^-1 right``.
    """
    wider = E * (1 + _ROOM)
    X = inverses(np.eye(E.shape[1]) - wider) @ right
    for _ in range(_REFINED):
        X = right + wider @ np.maximum(X, 0.0)
    X = X * (1 + _ROOM)
    holds = (X >= 0).all(axis=(1, 2)) & (right <= (X - E @ X) * (1 - ROUNDING)).all(axis=(1, 2))
    return np.asarray(X), np.asarray(holds)


def no_relation(count: int, of: Coordinates) -> Relation:
    """Return a relation with infinite remainders, for boxes without a known relation."""
    f, k, e = map(len, of)
    return Relation(np.zeros((count, k)), np.zeros((count, k, f)), np.full((count, k), np.inf), np.zeros((count, k, e)))


def relation_of(equations: Forms, of: Coordinates) -> Relation:
    """Return the relation of the dependent coordinates, from the forms of k equations over boxes."""
    A = equations.a[:, :, of.dependent]
    other, own = equations.a[:, :, of.independent], equations.a[:, :, of.errors]
    Y = inverses(A)
    size = np.abs(Y)
    with np.errstate(all="ignore"):
        T, E = Y @ other, Y @ own
        off = -(Y @ equations.c[:, :, None])[:, :, 0]
        defect = np.abs(Y @ A - np.eye(len(of.dependent))).sum(axis=2) + ROUNDING * (size @ np.abs(A)).sum(axis=2)
        terms = np.abs(equations.c) + np.abs(other).sum(axis=2) + np.abs(own).sum(axis=2)
        rho = ((size @ equations.r[:, :, None])[:, :, 0] + defect) * (1 + ROUNDING)
        rho += ROUNDING * (size @ terms[:, :, None])[:, :, 0]
    rho = np.where(np.isfinite(rho), rho, np.inf)
    return Relation(np.nan_to_num(off), np.nan_to_num(T), rho, np.nan_to_num(E))


def with_relation(forms: Forms, relation: Relation, of: Coordinates) -> Forms:
    """Return forms in the independent coordinates and errors; the relation replaces the dependent coordinates."""
    own, others = forms.a[:, :, of.dependent], forms.a[:, :, [*of.independent, *of.errors]]
    size = np.abs(own)
    with np.errstate(all="ignore"):
        middle = forms.c + (own @ relation.off[:, :, None])[:, :, 0]
        slopes = others - own @ np.concatenate([relation.T, relation.E], axis=2)
        rest = forms.r + (size @ relation.rho[:, :, None])[:, :, 0]
        terms = np.abs(forms.c) + np.abs(others).sum(axis=2) + (size @ relation.reach[:, :, None])[:, :, 0]
        return Forms(middle, slopes, rest * (1 + ROUNDING) + ROUNDING * terms)
