"""Upper models of sums of squared quotients, for the check of a proof.

A work rate squared is ``N^2 / D`` with polynomials N and D. For any number rho, with D > 0,

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D.

The first part is linear in N and D. With ``rho`` near ``N / D`` at the centre of a box, E is small: with its linear
part ``a.e``, ``|E - a.e| <= rest`` and ``reach`` the largest ``|a.e|``, ``t = rest / reach`` gives

    E^2 <= (1 + t) (a.e)^2 + rest (rest + reach),    E^2 >= (1 - t) (a.e)^2 - rest (reach - rest)   for rest <= reach.

Operation by operation, the slopes of the quotient and of its derivatives would be many times as wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...statement.limb_separation import terms_of
from ..slopebounds import SumModel, sum_model
from ..slopes import Slope

if TYPE_CHECKING:
    from .....models import FloatArray

#: Error of a sum of a few hundred rounded terms, in parts of their sizes.
_SUMS = 1e-13
#: A number that is added to every margin, for results too small for a relative one.
_TINY = 1e-290


class Square(NamedTuple):
    """A term ``factor * N^2 / D``, each (1, 1)."""

    N: SX
    D: SX
    factor: float


@dataclass(frozen=True, eq=False)
class SquareSlopes:
    """N and D of a term over boxes, and their n derivatives."""

    N: Slope
    D: Slope
    slopes_n: Sequence[Slope]
    slopes_d: Sequence[Slope]
    factor: float

    @property
    def is_defined(self) -> FloatArray:
        """Whether the term has a value on the whole box, (N,)."""
        return np.asarray((self.D.V[0] > 0) & np.isfinite(self.D.V[1]) & np.isfinite(self.N.V[0] + self.N.V[1]))

    @property
    def high(self) -> FloatArray:
        """Upper bound (N,) of the term from the ranges of N and D, where it is defined."""
        low, high = self.N.V
        one, other = np.abs(low), np.abs(high)
        if self.factor > 0:
            most = np.maximum(one, other)
            return np.asarray(self.factor * most * (most / self.D.V[0]) * (1 + _SUMS) + _TINY)
        least = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(one, other))
        return np.asarray(self.factor * least * (least / self.D.V[1]) * (1 - _SUMS) + _TINY)

    @property
    def middle(self) -> FloatArray:
        """Approximate value (N,) at the centre."""
        N, D = (0.5 * (each.C[0] + each.C[1]) for each in (self.N, self.D))
        return np.asarray(self.factor * N * N / D)

    @property
    def gradient(self) -> FloatArray:
        """Approximate gradient (n, N) at the centre."""
        N, D = (0.5 * (each.C[0] + each.C[1]) for each in (self.N, self.D))
        slopes_n, slopes_d = (
            np.array([0.5 * (g.C[0] + g.C[1]) for g in each]) for each in (self.slopes_n, self.slopes_d)
        )
        return np.asarray(self.factor * (N / D) * (2 * slopes_n - (N / D) * slopes_d))


def squares_of(function: SX) -> tuple[SX, list[Square]]:
    """Return a function (1, 1) as a rest and squared quotients."""
    rest, found = SX(0), []
    for term in terms_of(function):
        factor, core = _without_factors(term)
        is_square = core.is_op(ca.OP_DIV) and core.dep(0).is_op(ca.OP_SQ) and not core.dep(1).is_constant()
        if is_square and np.isfinite(factor):
            found.append(Square(core.dep(0).dep(0), core.dep(1), factor))
        else:
            rest += term
    return rest, found


def _without_factors(term: SX) -> tuple[float, SX]:
    """Return the product of a term's constant factors, and what they multiply."""
    factor, core = 1.0, term
    while True:
        if core.is_op(ca.OP_NEG) or core.is_op(ca.OP_TWICE):
            factor, core = factor * (2.0 if core.is_op(ca.OP_TWICE) else -1.0), core.dep(0)
        elif core.is_op(ca.OP_MUL) and core.dep(0).is_constant():
            factor, core = factor * float(core.dep(0)), core.dep(1)
        elif core.is_op(ca.OP_MUL) and core.dep(1).is_constant():
            factor, core = factor * float(core.dep(1)), core.dep(0)
        else:
            return factor, core


def slopes_of_square(each: SquareSlopes) -> tuple[FloatArray, FloatArray]:
    """Return the ends (n, N) of a term's gradient over boxes, ``q (2 grad N - q grad D)`` with ``q = N / D``."""
    N, D = each.N.V, each.D.V
    q = _product(N, (1 / D[1], 1 / D[0]))
    slopes_n = np.array([g.V[0] for g in each.slopes_n]), np.array([g.V[1] for g in each.slopes_n])
    slopes_d = np.array([g.V[0] for g in each.slopes_d]), np.array([g.V[1] for g in each.slopes_d])
    # The bracket is linear in q: its ends are those at the ends of q.
    low, high = np.full_like(slopes_n[0], np.inf), np.full_like(slopes_n[0], -np.inf)
    for end in q:
        part = _product((end, end), slopes_d)
        low, high = np.minimum(low, 2 * slopes_n[0] - part[1]), np.maximum(high, 2 * slopes_n[1] - part[0])
    low, high = _product(q, _wider((low, high)))
    return _wider(
        (low * each.factor, high * each.factor) if each.factor > 0 else (high * each.factor, low * each.factor)
    )


def add_square(model: SumModel, each: SquareSlopes, lower: FloatArray, upper: FloatArray) -> SumModel:
    """Return a model over boxes with ends (n, N) plus that of a term; infinite where the term has no value."""
    N, D = (0.5 * (one.C[0] + one.C[1]) for one in (each.N, each.D))
    rho = np.where(each.is_defined, N / D, 0.0)
    f, size = each.factor, abs(each.factor)
    rows, gradients = (each.N, each.D), (each.slopes_n, each.slopes_d)
    linear = sum_model(np.stack([2 * f * rho, -f * rho * rho]), rows, gradients, lower, upper)
    ones = np.ones_like(rho)
    E = sum_model(np.stack([ones, -rho]), rows, gradients, lower, upper)
    other = sum_model(np.stack([-ones, rho]), rows, gradients, lower, upper)
    reach = np.abs(E.b).sum(axis=0) * (1 + _SUMS)
    rest = np.maximum(
        E.fixed + 0.5 * np.abs(E.H).sum(axis=(0, 1)), other.fixed + 0.5 * np.abs(other.H).sum(axis=(0, 1))
    )
    rest = (np.maximum(rest, 0.0) + np.abs(E.b + other.b).sum(axis=0)) * (1 + _SUMS) + _TINY
    with np.errstate(all="ignore"):
        t = np.where(reach > 0, rest / reach, 0.0)
        if f > 0:
            scale, grow, far = size / each.D.V[0], 1 + t, rest + reach
        else:
            useful = (reach > 0) & (rest < reach)
            scale = np.where(useful, -size / each.D.V[1], 0.0)
            grow, far = np.where(useful, 1 - t, 0.0), np.where(useful, rest - reach, 0.0)
        curved = 2 * scale * grow * E.b[:, None] * E.b[None]
        # The weights of N and D are rounded, and so are the terms of E's square.
        largest = [np.maximum(np.abs(one.V[0]), np.abs(one.V[1])) for one in rows]
        rounding = size * (2 * np.abs(rho) * largest[0] + rho * rho * largest[1]) * _SUMS
        rounding = rounding + _SUMS * np.abs(scale) * (rest + reach) * (rest + reach) + _TINY * (1 + largest[1])
        low, high = slopes_of_square(each)
        fixed = np.where(each.is_defined, linear.fixed + scale * rest * far + rounding, np.inf)
        # A mean value form begins at an upper bound of the value at the centre.
        error = np.maximum(np.abs(E.total), np.abs(other.total))
        at_centre = scale * error * error * (1 + _SUMS) if f > 0 else 0.0
        total = np.where(each.is_defined, linear.total + at_centre + rounding, np.inf)
    return replace(
        model,
        total=model.total + total,
        fixed=model.fixed + fixed + _SUMS * (np.abs(linear.b).sum(axis=0) + np.abs(model.b).sum(axis=0)),
        b=model.b + linear.b,
        H=model.H + linear.H + curved,
        slope_low=_wider((model.slope_low + low, model.slope_low + low))[0],
        slope_high=_wider((model.slope_high + high, model.slope_high + high))[1],
    )


def _product(x: tuple[FloatArray, FloatArray], y: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the products of numbers of two intervals, rounded outwards."""
    every = [a * b for a in x for b in y]
    return _wider((np.minimum.reduce(every), np.maximum.reduce(every)))


def _wider(ends: tuple[FloatArray, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return ends moved outwards by more than the rounding of a few operations that do not cancel."""
    low, high = ends
    return low - _SUMS * np.abs(low) - _TINY, high + _SUMS * np.abs(high) + _TINY
