"""Rules for functions of one variable: value, slope and curvature over an interval, each with its rounding error."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from screwsynth.nlp.proof.enclosure.tape import Op

from .intervals import LIBRARY, TINY, ULP, widen

if TYPE_CHECKING:
    from screwsynth.models import FloatArray

#: Error of a library's function, in parts of its size.
_LIBRARY_ERROR = LIBRARY * ULP


class Rule(NamedTuple):
    """A function ``f(c + Y) in f(c) + f'(c) Y + [least, most] Y^2`` over an interval that holds ``c``, (B,) each.

    Attributes:
        value: ``f(c)``.
        slope: ``f'(c)``.
        least, most: half of the least and largest second derivative on the interval.
        error: rounding error of the value.
        slope_error: that of the slope, and of half the curvature. It is 0 where a few roundings in parts of themselves
            are all, which each operation covers, as for the root of a square of lengths.
        lo, hi: range of the function on the interval.
    """

    value: FloatArray
    slope: FloatArray
    least: FloatArray
    most: FloatArray
    error: FloatArray
    slope_error: FloatArray
    lo: FloatArray
    hi: FloatArray


def _sqrt(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Return the rule of the root; NaN below 0.

    ``sqrt(c + Y) = r + Y / (2 r) - Y^2 / (2 r (sqrt(c + Y) + r)^2)`` with ``r = sqrt(c)``.
    """
    root, low, high = np.sqrt(c), np.sqrt(lo), np.sqrt(hi)
    slope = 0.5 / root
    least, most = -slope / ((low + root) * (low + root)), -slope / ((high + root) * (high + root))
    return Rule(root, slope, least, most, _LIBRARY_ERROR * root, np.zeros_like(c), *widen(low, high))


def _wave(c: FloatArray, lo: FloatArray, hi: FloatArray, shifted: bool) -> Rule:
    """Return the rule of the sine, or of the cosine.

    Within r of the interval's middle it differs from its value there by at most ``|f'| r + r^2 / 2``.
    """
    middle = 0.5 * lo + 0.5 * hi
    radius = np.maximum(hi - middle, middle - lo) * (1 + ULP) + TINY
    centred = np.cos(middle) if shifted else np.sin(middle)
    steep = np.abs(np.sin(middle)) if shifted else np.abs(np.cos(middle))
    spread = steep * radius + 0.5 * radius * radius
    spread = spread + 2 * _LIBRARY_ERROR * (1 + spread)
    least, most = np.maximum(centred - spread, -1.0), np.minimum(centred + spread, 1.0)
    sine, cosine = np.sin(c), np.cos(c)
    value, slope = (cosine, -sine) if shifted else (sine, cosine)
    # The second derivative is minus the function; errors are of order 1, not of the value's own size.
    error = np.full_like(c, 4 * _LIBRARY_ERROR)
    return Rule(value, slope, -0.5 * most, -0.5 * least, error, error, least, most)


def _exp(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    value, low, high = np.exp(c), np.exp(lo), np.exp(hi)
    least = np.maximum(low * (1 - _LIBRARY_ERROR) - TINY, 0.0)
    most = high * (1 + _LIBRARY_ERROR) + TINY
    error = 2 * _LIBRARY_ERROR * value
    return Rule(value, value, 0.5 * least, 0.5 * most, error, error, least, most)


def _log(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Return the rule of the logarithm; NaN unless the whole interval is positive."""
    lo = np.where(lo > 0, lo, np.nan)
    low, high, value, slope = np.log(lo), np.log(hi), np.log(c), 1 / c
    grown = 1 + _LIBRARY_ERROR
    ends = low - (np.abs(low) * _LIBRARY_ERROR + TINY), high + (np.abs(high) * _LIBRARY_ERROR + TINY)
    least, most = -0.5 * grown / (lo * lo), -0.5 / (grown * hi * hi)
    return Rule(value, slope, least, most, 2 * _LIBRARY_ERROR * np.abs(value), np.zeros_like(c), *ends)


def _atan(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Return the rule of the arc tangent.

    Its second derivative ``-2 v / (1 + v^2)^2`` is at most 0.6496 in size, and has the sign of ``-v``.
    """
    low, high, value = np.arctan(lo), np.arctan(hi), np.arctan(c)
    most = np.where(lo >= 0, 0.0, np.minimum(0.325, -lo * (1 + ULP)))
    least = np.where(hi <= 0, 0.0, np.maximum(-0.325, -hi * (1 + ULP)))
    ends = low - (np.abs(low) * _LIBRARY_ERROR + TINY), high + (np.abs(high) * _LIBRARY_ERROR + TINY)
    error = 2 * _LIBRARY_ERROR * (np.abs(value) + 1)
    return Rule(value, 1 / (1 + c * c), least, most, error, error, *ends)


def _ramp(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Return the rule of ``max(v, 0)``: over an interval with 0 in it, between the chord and its parallel through 0."""
    slope = np.where(lo >= 0, 1.0, np.where(hi <= 0, 0.0, hi / (hi - lo)))
    half = np.where((lo < 0) & (hi > 0), -0.5 * slope * lo, 0.0)
    error = half + np.where((lo < 0) & (hi > 0), 8 * ULP * (hi - lo) + TINY, 0.0)
    nothing = np.zeros_like(c)
    return Rule(slope * c + half, slope, nothing, nothing, error, nothing, np.maximum(lo, 0.0), np.maximum(hi, 0.0))


def _step(c: FloatArray, lo: FloatArray, hi: FloatArray) -> Rule:
    """Return the rule of the step, which is 1 from 0 on; over an interval with 0 in it, anything between."""
    least, most = np.where(lo > 0, 1.0, 0.0), np.where(hi < 0, 0.0, 1.0)
    nothing = np.zeros_like(c)
    return Rule(0.5 * (least + most), nothing, nothing, nothing, 0.5 * (most - least), nothing, least, most)


#: The rule of each operation of one variable, from its centre and the ends of its interval.
RULES: Mapping[Op, Callable[[FloatArray, FloatArray, FloatArray], Rule]] = {
    Op.SQRT: _sqrt,
    Op.SIN: lambda c, lo, hi: _wave(c, lo, hi, shifted=False),
    Op.COS: lambda c, lo, hi: _wave(c, lo, hi, shifted=True),
    Op.EXP: _exp,
    Op.LOG: _log,
    Op.ATAN: _atan,
    Op.RAMP: _ramp,
    Op.STEP: _step,
}
