"""Upper models of functions that are sums of squared quotients, from those of numerators and denominators.

The work rate of a row in a twist is ``N / |d|``, with N and ``D = |d|^2`` polynomials in the joint coordinates. Its
square is

    N^2 / D = rho (2 N - rho D) + E^2 / D,    E = N - rho D,    for any number rho, with D > 0.

With ``rho = N / D`` at the centre of a box, the first part is linear in N and D, whose models are accurate. E is 0 at
the centre: with ``a.e`` its part of first order and ``|E - a.e| <= rest``,

    (1 - t) (a.e)^2 - (1 / t - 1) rest^2  <=  E^2  <=  (1 + t) (a.e)^2 + (1 + 1 / t) rest^2    for any t > 0.

With ``t = rest / reach`` and ``reach`` the largest of ``|a.e|``, these are ``(reach -+ rest)^2`` at its corner, the
best bounds there. A square is at least 0 too, the better bound where rest is larger than reach.

Enclosures of the quotient and its derivatives, operation by operation, are tens of times as wide on large boxes: there
the terms of second order of each factor are bounded by themselves.

The gradient of ``N^2 / D`` is ``r (2 grad N - r grad D)`` with ``r = N / D``. The factor in brackets is linear in r, so
that its ends are those at the two ends of r, and each of these two is one model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.enclosure.squared_quotients import Quotient

from .first_order import Enclosures
from .intervals import LARGEST, TINY, ULP
from .quadratic_models import GradientModel, SquareSums

#: Rounding of a sum of fewer than a hundred products, in parts of the sum of their sizes: several times the largest.
_SUM = 64 * ULP
#: Least D for a model of a quotient: what underflow takes from a product, over D, is less than ``TINY``.
_LEAST = 1e-20


class RowModel(NamedTuple):
    """The model ``c + b e + 1/2 e'He +- w |e| +- s`` of one row over B boxes, and its ends over the box."""

    c: FloatArray
    s: FloatArray
    b: FloatArray
    H: FloatArray
    w: FloatArray
    lo: FloatArray
    hi: FloatArray


class _Ratio(NamedTuple):
    """N, D, and ``r = N / D`` over B boxes.

    Attributes:
        rho: (B,) about the value at the centre.
        a: (n, B) the linear part of E.
        reach: (B,) the largest ``|a.e|``.
        rest: (B,) the largest ``|E - a.e|``.
        error: (B,) the largest rounding and remainder of ``rho (2 N - rho D)`` that are the same in the whole box.
        lo, hi: (B,) ends of r.
        is_defined: (B,) whether D is positive and every model is finite.
    """

    N: RowModel
    D: RowModel
    rho: FloatArray
    a: FloatArray
    reach: FloatArray
    rest: FloatArray
    error: FloatArray
    lo: FloatArray
    hi: FloatArray
    is_defined: NDArray[np.bool_]


class SquareModel(NamedTuple):
    """The upper model ``c + s + b e + 1/2 e'He + w |e|`` of ``sign N^2 / D``, and its ends over the box.

    ``c +- s`` encloses its value at the centre. Where it is not defined, s and w are infinite.
    """

    c: FloatArray
    s: FloatArray
    b: FloatArray
    H: FloatArray
    w: FloatArray
    lo: FloatArray
    hi: FloatArray


def _ratio(N: RowModel, D: RowModel) -> _Ratio:
    """Return what a quotient's models are made of."""
    rho = N.c / D.c
    size = np.abs(rho)
    a, HE, w = N.b - rho * D.b, N.H - rho * D.H, (N.w + size * D.w).sum(axis=0)
    # Sizes of all terms of E, which may cancel.
    terms = np.abs(N.c) + size * np.abs(D.c) + (np.abs(N.b) + size * np.abs(D.b)).sum(axis=0)
    terms = terms + (np.abs(N.H) + size * np.abs(D.H)).sum(axis=(0, 1)) + w
    offset = N.s + size * D.s + (_SUM * terms + TINY * (1 + np.abs(D.c)))
    rest = (0.5 * np.abs(HE).sum(axis=(0, 1)) + w + offset) * (1 + _SUM)
    reach = np.abs(a).sum(axis=0) * (1 + _SUM)
    error = 2 * size * offset + 3 * _SUM * size * terms + TINY
    # r = rho + E / D over the box.
    ends = np.stack([N.lo / D.lo, N.lo / D.hi, N.hi / D.lo, N.hi / D.hi])
    far = (reach + rest) / D.lo
    lo, hi = np.fmax(ends.min(axis=0), rho - far), np.fmin(ends.max(axis=0), rho + far)
    lo, hi = lo - (_SUM * (np.abs(lo) + size) + TINY), hi + (_SUM * (np.abs(hi) + size) + TINY)
    is_defined = (D.lo > _LEAST) & (N.s < np.inf) & (D.s < np.inf)
    is_defined &= ((size > 1 / LARGEST) & (size < LARGEST) | (rho == 0)) & np.isfinite(reach) & np.isfinite(rest)
    return _Ratio(N, D, rho, a, reach, rest, error, lo, hi, is_defined)


def _square(ratio: _Ratio, sign: int) -> SquareModel:
    """Return the model of a squared quotient with a sign."""
    N, D, rho, reach, rest = ratio.N, ratio.D, ratio.rho, ratio.reach, ratio.rest
    b, H = 2 * rho * N.b - rho**2 * D.b, 2 * rho * N.H - rho**2 * D.H
    w = 2 * np.abs(rho) * N.w + rho**2 * D.w
    part = np.where(reach > 0, rest / reach, 0.0)
    known = rest < reach
    kept = 2 * (1 + part) / D.lo if sign > 0 else np.where(known, 2 * (1 - part) / D.hi, 0.0)
    more = rest * (reach + rest) / D.lo if sign > 0 else np.where(known, rest * (reach - rest) / D.hi, 0.0)
    added = ratio.a[:, None] * ratio.a[None] * kept
    error = ratio.error + _SUM * (more + np.abs(added).sum(axis=(0, 1)))
    high = sign * (rho * (2 * N.c - rho * D.c)) + more + error
    numerator = np.maximum(np.abs(N.c) - N.s, 0.0) if sign > 0 else np.abs(N.c) + N.s
    low = sign * numerator**2 / (D.c + D.s if sign > 0 else D.c - D.s)
    low = low - (_SUM * np.abs(low) + TINY)
    half = 0.5 * (high - low) + _SUM * (np.abs(high) + np.abs(low))
    is_defined = ratio.is_defined & ~np.isnan(half)
    lost = TINY * (1 + D.hi)
    most = np.fmin(np.maximum(ratio.lo**2, ratio.hi**2) * D.hi, np.maximum(N.lo**2, N.hi**2) / D.lo) * (1 + _SUM) + lost
    fewest = np.minimum(ratio.lo**2, ratio.hi**2) * D.lo * (1 - _SUM) - lost
    fewest = np.where((ratio.lo > 0) | (ratio.hi < 0), fewest, 0.0)
    return SquareModel(
        c=0.5 * (high + low),
        s=np.where(is_defined, half, np.inf),
        b=sign * b,
        H=sign * (H + added),
        w=np.where(is_defined, w + _SUM * (np.abs(b) + np.abs(H).sum(axis=1) + w), np.inf),
        lo=fewest if sign > 0 else -most,
        hi=most if sign > 0 else -fewest,
    )


def with_quotients(
    model: GradientModel, quotients: Sequence[Quotient], R: int, radius: FloatArray, least: FloatArray | None = None
) -> GradientModel:
    """Return the model of R expressions, given that of their E rows.

    A function's value at the centre is enclosed as ``c +- s``, c + s being the middle of the upper model. The ends of
    its gradient, times the radii, are for the whole box; those that are not scaled are for its points that matter.

    Args:
        model: of the rows, as in :class:`SearchRows`.
        quotients: the terms of the functions.
        R: number of functions and conditions.
        radius: (n, B) half widths of the boxes.
        least: (B,) points of the only quotient with a lesser value do not matter; None where all do.
    """
    if not quotients:
        return model
    whole = {name: values[:R].copy() for name, values in vars(model).items() if isinstance(values, np.ndarray)}
    value = {name: values[:R].copy() for name, values in vars(model.value).items()}
    J, n, B = 1 + max(each.function for each in quotients), radius.shape[0], radius.shape[1]
    sums = SquareSums(np.zeros((J, n, n, B)), np.zeros((J, n, B)))
    for k, (j, sign) in enumerate((each.function, each.sign) for each in quotients):
        at = R + 2 * k
        ratio = _ratio(_row(model, at), _row(model, at + 1))
        square = _square(ratio, sign)
        for name in ("c", "s", "lo", "hi"):
            value[name][j] += getattr(square, name)
        value["a"][j] += square.b
        value["q"][j] += (0.5 * np.abs(square.H).sum(axis=(0, 1)) + square.w.sum(axis=0)) * (1 + _SUM)
        whole["b"][j] += square.b
        sums.H[j] += square.H
        sums.w[j] += square.w
        slopes = model.slope_lo[at : at + 2], model.slope_hi[at : at + 2]
        low, high = _product(ratio.lo, ratio.hi, *_gradient_factor(ratio, *slopes, ratio.lo, ratio.hi), sign)
        whole["slope_lo"][j] += low
        whole["slope_hi"][j] += high
        if least is not None and len(quotients) == 1:
            ends = _where_it_matters(ratio, sign, least)
            low, high = _product(*ends, *_gradient_factor(ratio, *slopes, *ends), sign)
        scale = np.where(radius > 0, radius, 1.0)
        low, high = np.where(radius > 0, low / scale, -np.inf), np.where(radius > 0, high / scale, np.inf)
        whole["gradient_lo"][j] += low - _SUM * np.abs(low)
        whole["gradient_hi"][j] += high + _SUM * np.abs(high)
    return replace(model, value=Enclosures(**value), **whole, squares=sums)


def _row(model: GradientModel, r: int) -> RowModel:
    """Return the model of a row from the form of its gradient."""
    value, p, q, A = model.value, model.p[r], model.q[r], model.A[r]
    b, w, H = model.b[r] + (p + q) / 6, (q - p) / 6 + model.s[r], 0.5 * (A + np.swapaxes(A, 0, 1))
    c, s = value.c[r], value.s[r]
    reach = (np.abs(b) + w).sum(axis=0) + 0.5 * np.abs(H).sum(axis=(0, 1)) + s
    reach = reach + _SUM * (np.abs(c) + reach)
    return RowModel(c, s, b, H, w, np.fmax(value.lo[r], c - reach), np.fmin(value.hi[r], c + reach))


def _where_it_matters(ratio: _Ratio, sign: int, least: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the ``r`` for which ``sign r^2 D`` can be at least a value (B,)."""
    r_lo, r_hi, D = ratio.lo, ratio.hi, ratio.D
    if sign < 0:
        edge = np.sqrt(np.maximum(-least, 0.0) / D.lo) * (1 + _SUM)
        edge = np.where(np.isnan(edge), np.inf, edge)
        return np.maximum(r_lo, -edge), np.minimum(r_hi, edge)
    edge = np.sqrt(np.maximum(least, 0.0) / D.hi) * (1 - _SUM)
    edge = np.where(np.isnan(edge), 0.0, edge)
    up, down = r_hi >= edge, -r_lo >= edge
    low = np.where(up & ~down, np.maximum(r_lo, edge), r_lo)
    high = np.where(down & ~up, np.minimum(r_hi, -edge), r_hi)
    return low, high


def _gradient_factor(
    ratio: _Ratio, slope_lo: FloatArray, slope_hi: FloatArray, r_lo: FloatArray, r_hi: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ends (n, B) of ``2 grad N - r grad D``, times the radii, over r in an interval.

    The slopes (2, n, B) are interval gradients of N and D, times the radii.
    """
    N, D = ratio.N, ratio.D
    lows, highs = [], []
    for r in (r_lo, r_hi):
        b, H = 2 * N.b - r * D.b, 2 * N.H - r * D.H
        size = np.abs(r)
        # A gradient's terms of second order lie in [p, q]; w is at least (q - p) / 6, and b has (p + q) / 6 in it.
        w = 5 * (2 * N.w + size * D.w)
        terms = 2 * np.abs(N.b) + size * np.abs(D.b) + (2 * np.abs(N.H) + size * np.abs(D.H)).sum(axis=1) + w
        reach = np.abs(H).sum(axis=1) + w + _SUM * terms
        ends = r * slope_lo[1], r * slope_hi[1]
        lows.append(np.fmax(b - reach, 2 * slope_lo[0] - np.maximum(*ends) - _SUM * np.abs(ends).max(axis=0)))
        highs.append(np.fmin(b + reach, 2 * slope_hi[0] - np.minimum(*ends) + _SUM * np.abs(ends).max(axis=0)))
    low, high = np.minimum(*lows), np.maximum(*highs)
    return low - _SUM * np.abs(low), high + _SUM * np.abs(high)


def _product(
    r_lo: FloatArray, r_hi: FloatArray, g_lo: FloatArray, g_hi: FloatArray, sign: int
) -> tuple[FloatArray, FloatArray]:
    """Return the ends of ``sign`` times the product of two intervals, outwards."""
    ends = np.stack([r_lo * g_lo, r_lo * g_hi, r_hi * g_lo, r_hi * g_hi])
    low, high = ends.min(axis=0), ends.max(axis=0)
    low, high = low - (_SUM * np.abs(low) + TINY), high + (_SUM * np.abs(high) + TINY)
    return (low, high) if sign > 0 else (-high, -low)
