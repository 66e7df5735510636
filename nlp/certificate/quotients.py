"""Upper and lower models of limbs whose function is a squared quotient, from models of numerator and denominator.

The work rate of a row in a twist is ``N / |d|``, with N a polynomial in joint coordinates and position, and its square

    N^2 / D = rho (2 N - rho D) + (N - rho D)^2 / D     for any number rho, with D > 0.

With ``rho = N / D`` at the centre of a box, the first part is linear in N and D, whose models are accurate, and the
second is a square that is 0 at the centre. The derivatives of the quotient itself have enclosures that are tens of
times as wide on large boxes: there the terms of second order of each factor are bounded by themselves.

The gradient of ``N^2 / D`` is ``r (2 grad N - r grad D)`` with ``r = N / D``: where the sign of N is known, its signs are
those of ``2 grad N - r grad D``, which is linear in r, so that its ends are those of two models.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np

from .intervals import TINY, ULP
from .limbmodels import LimbEngine, LimbModels
from .quadratic import QuadraticModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from casadi import SX

    from ...models import FloatArray

#: Rounding of sums of fewer than a hundred products, in parts of the sum of their sizes: several times the largest.
_SUM = 64 * ULP


class Quotient(NamedTuple):
    """Parts of an expression ``sign * N^2 / D``."""

    N: SX
    D: SX
    sign: int


def as_quotient(expression: SX) -> Quotient | None:
    """Return the parts of a squared quotient; None for another expression."""
    sign = 1
    while expression.is_op(ca.OP_NEG):
        expression, sign = expression.dep(0), -sign
    if expression.is_op(ca.OP_DIV) and expression.dep(0).is_op(ca.OP_SQ):
        return Quotient(expression.dep(0).dep(0), expression.dep(1), sign)
    return None


@dataclass(frozen=True, eq=False)
class _Part:
    """Models of one expression over B boxes.

    Attributes:
        L: an upper model.
        least: (B,) lower bound of the expression at the centre.
        lo, hi: (B,) ends of the expression over the box.
        g_lo, g_hi: (m, B) gradient along shared variables.
    """

    L: QuadraticModel
    least: FloatArray
    lo: FloatArray
    hi: FloatArray
    g_lo: FloatArray
    g_hi: FloatArray


class QuotientLimbEngine:
    """Upper models of a limb whose function is one squared quotient, without conditions.

    Args:
        sign: of the quotient.
        numerator, denominator: engines of the two expressions as limbs.
        opposites: engines of minus the expressions, for their lower ends.
        lower, upper: (n,) ends of the whole box.
        shared: number m of shared variables.
    """

    def __init__(
        self,
        sign: int,
        numerator: LimbEngine,
        denominator: LimbEngine,
        lower: FloatArray,
        upper: FloatArray,
        shared: int,
    ) -> None:
        self._sign, self._N, self._D = sign, numerator, denominator
        self._lower, self._upper, self._shared = lower[:, None], upper[:, None], shared

    def close(self) -> None:
        """Stop the engines' threads."""
        self._N.close()
        self._D.close()

    def limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None = None) -> LimbModels:
        """Return the models of boxes with ends (n, B); points with values below ``least`` (B,) do not matter."""
        with np.errstate(all="ignore"):
            return self._models(lower, upper, least)

    def _models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None) -> LimbModels:
        m = self._shared
        found_N, found_D = self._N.limb_models(lower, upper), self._D.limb_models(lower, upper)
        N, D = _part(found_N), _part(found_D)
        defined = found_N.defined & found_D.defined & (D.lo > 0)
        rho = N.L.middle / D.L.middle
        # E = N - rho D: its part of first order at the centre, and a bound of the rest.
        a = N.L.b - rho * D.L.b
        HE = N.L.H - rho * D.L.H
        size = np.abs(N.L.middle) + np.abs(rho * D.L.middle)
        offset = np.abs(N.L.middle - N.least) + np.abs(rho) * np.abs(D.L.middle - D.least)
        sizes = size + (np.abs(N.L.b) + np.abs(rho * D.L.b)).sum(axis=0)
        sizes = sizes + (np.abs(N.L.H) + np.abs(rho * D.L.H)).sum(axis=(0, 1))
        w = N.L.w + np.abs(rho) * D.L.w
        rest = 0.5 * np.abs(HE).sum(axis=(0, 1)) + w.sum(axis=0) + offset
        rest = rest + _SUM * sizes + N.L.rounding + np.abs(rho) * D.L.rounding
        reach = np.abs(a).sum(axis=0) * (1 + _SUM)
        # The range of r = N / D.
        ends = np.stack([N.lo / D.lo, N.lo / D.hi, N.hi / D.lo, N.hi / D.hi])
        far = (reach + rest) / D.lo
        r_lo, r_hi = np.fmax(ends.min(axis=0), rho - far), np.fmin(ends.max(axis=0), rho + far)
        r_lo, r_hi = r_lo - _SUM * np.abs(r_lo), r_hi + _SUM * np.abs(r_hi)
        # rho (2 N - rho D).
        b = 2 * rho * N.L.b - rho**2 * D.L.b
        H = 2 * rho * N.L.H - rho**2 * D.L.H
        tilt_w = 2 * np.abs(rho) * N.L.w + rho**2 * D.L.w
        centre = rho * (2 * N.L.middle - rho * D.L.middle)
        error = 2 * np.abs(rho) * offset + _SUM * (np.abs(rho) * (2 * sizes) )
        square = a[:, None] * a[None]
        cross = 2 * reach * rest
        sign = self._sign
        over = (centre + error + (cross + rest**2) / D.lo, b, H + square * (2 / D.lo))
        small = 4 * rest < reach
        under = (centre - error - np.where(small, cross / D.hi, 0.0), b, H + square * np.where(small, 2 / D.hi, 0.0))
        least_square = np.where((r_lo > 0) | (r_hi < 0), np.minimum(r_lo**2, r_hi**2), 0.0)
        most_square = np.maximum(r_lo**2, r_hi**2)
        value_hi = most_square * D.hi
        value_hi = np.fmin(value_hi, np.maximum(N.lo**2, N.hi**2) / D.lo)
        value_lo = np.fmax(least_square * D.lo, np.where((N.lo > 0) | (N.hi < 0), np.minimum(N.lo**2, N.hi**2), 0.0) / D.hi)
        value_lo, value_hi = value_lo * (1 - _SUM), value_hi * (1 + _SUM)
        if sign < 0:
            over, under = ((-u[0], -u[1], -u[2]) for u in (under, over))
            value_hi = -value_lo
        # The largest and the smallest r that matter.
        possible = np.ones(defined.shape, dtype=bool)
        p_lo, p_hi = r_lo, r_hi
        if least is not None and sign > 0:
            edge = np.sqrt(np.maximum(least, 0.0) / D.hi) * (1 - _SUM)
            edge = np.where(np.isfinite(edge), edge, 0.0)
            up, down = r_hi >= edge, -r_lo >= edge
            possible = ~defined | up | down
            p_lo = np.where(up & ~down, np.maximum(r_lo, edge), r_lo)
            p_hi = np.where(down & ~up, np.minimum(r_hi, -edge), r_hi)
        elif least is not None:
            edge = np.sqrt(np.maximum(-least, 0.0) / D.lo) * (1 + _SUM)
            edge = np.where(np.isfinite(edge), edge, np.inf)
            possible = ~defined | ((r_lo <= edge) & (r_hi >= -edge))
            p_lo, p_hi = np.maximum(r_lo, -edge), np.minimum(r_hi, edge)
        g_lo, g_hi = _slopes(N, D, r_lo, r_hi)
        slope_lo, slope_hi = _products(r_lo, r_hi, g_lo, g_hi)
        if sign < 0:
            slope_lo, slope_hi = -slope_hi, -slope_lo
        rounding = _SUM * (np.abs(over[0]) + np.abs(b).sum(axis=0) + np.abs(over[2]).sum(axis=(0, 1)) + tilt_w.sum(axis=0)) + TINY
        L = QuadraticModel(over[0], over[1], over[2], tilt_w, slope_lo, slope_hi, rounding)
        U = QuadraticModel(under[0], under[1], under[2], tilt_w, slope_lo, slope_hi, rounding)
        radius = 0.5 * (upper[:m] - lower[:m])
        s_lo = np.where(radius > 0, slope_lo[:m] / radius, -np.inf) 
        s_hi = np.where(radius > 0, slope_hi[:m] / radius, np.inf)
        s_lo, s_hi = s_lo - _SUM * np.abs(s_lo), s_hi + _SUM * np.abs(s_hi)
        left_lo, left_hi = lower.copy(), upper.copy()
        # Own variables along which the function rises, or falls, wherever it matters.
        G_lo, G_hi = _slopes(N, D, p_lo, p_hi)
        positive, negative = (p_lo > 0) & defined, (p_hi < 0) & defined
        rises = np.where(sign > 0, 1, -1) * (np.where(G_lo > 0, 1, np.where(G_hi < 0, -1, 0))) * np.where(positive, 1, np.where(negative, -1, 0))
        own = np.arange(len(lower))[:, None] >= m
        moves = own & (upper > lower) & (rises != 0)
        up, down = moves & (rises > 0), moves & (rises < 0)
        possible &= ~((up & (upper < self._upper)) | (down & (lower > self._lower))).any(axis=0)
        left_lo = np.where(up, upper, lower)
        left_hi = np.where(down, lower, upper)
        nothing = np.zeros((m, defined.size), dtype=bool)
        at_centre = np.where(np.sign(N.least) == np.sign(N.L.middle), np.minimum(N.least**2, N.L.middle**2), 0.0) / np.maximum(D.L.middle, D.least) if sign > 0 else -np.maximum(N.least**2, N.L.middle**2) / np.minimum(D.least, D.L.middle)
        at_centre = at_centre - _SUM * np.abs(at_centre)
        return LimbModels(
            is_possible=possible, defined=defined, holds=np.ones(defined.shape, dtype=bool), lower=left_lo, upper=left_hi, L=L,
            slope_lo=s_lo, slope_hi=s_hi, stops_up=nothing, stops_down=nothing, high=np.where(defined, value_hi, np.inf),
            value=np.where(defined, at_centre, -np.inf), under=U,
        )


def _part(found: LimbModels) -> _Part:
    """Return the models of an expression from those of a limb without conditions."""
    L = found.L
    opposite = QuadraticModel(-found.value, -L.b, -L.H, L.w, -L.slope_hi, -L.slope_lo, L.rounding)
    return _Part(L, found.value, -opposite.bound(), np.fmin(L.bound(), found.high), found.slope_lo, found.slope_hi)


def _slopes(N: _Part, D: _Part, r_lo: FloatArray, r_hi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends of ``2 grad N - r grad D``, times the radii, over r in an interval."""
    lows, highs = [], []
    for r in (r_lo, r_hi):
        b = 2 * N.L.b - r * D.L.b
        H = 2 * N.L.H - r * D.L.H
        size = 2 * np.abs(N.L.b) + np.abs(r * D.L.b) + (2 * np.abs(N.L.H) + np.abs(r * D.L.H)).sum(axis=1)
        # The terms of second order of a gradient are in [p, q], w is at least (q - p) / 6, and b has (p + q) / 6 in it.
        w = 5 * (2 * N.L.w + np.abs(r) * D.L.w)
        rest = np.abs(H).sum(axis=1) + w + _SUM * (size + w)
        ends = np.stack([r * D.L.slope_lo, r * D.L.slope_hi])
        lows.append(np.fmax(b - rest, 2 * N.L.slope_lo - ends.max(axis=0)))
        highs.append(np.fmin(b + rest, 2 * N.L.slope_hi - ends.min(axis=0)))
    low, high = np.minimum(*lows), np.maximum(*highs)
    return low - _SUM * np.abs(low), high + _SUM * np.abs(high)


def _products(r_lo: FloatArray, r_hi: FloatArray, g_lo: FloatArray, g_hi: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the products of two intervals, outwards."""
    ends = np.stack([r_lo * g_lo, r_lo * g_hi, r_hi * g_lo, r_hi * g_hi])
    low, high = ends.min(axis=0), ends.max(axis=0)
    return low - _SUM * np.abs(low), high + _SUM * np.abs(high)
