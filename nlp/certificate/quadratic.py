"""Quadratic models of functions over boxes, from the Taylor forms of their gradients: sums, ends, and contraction.

See :mod:`screwsynth.nlp.certificate.bounding` for the formula, and ``docs/certificate.md`` for how it comes about.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .enclosure import TINY, ULP, Forms

if TYPE_CHECKING:
    from ...models import FloatArray

#: What is taken off the level that a quadratic must reach, in parts of its terms: far more than its root's rounding.
_ROOT_SLACK = 1e-12


@dataclass(frozen=True, eq=False)
class GradientModel:
    """The expressions over the boxes: R of them, the first J are functions."""

    value: Forms  # (R, ...)
    b: FloatArray  # (R, n, B)
    A: FloatArray  # (R, n, n, B), coefficients of the gradient times r_i
    p: FloatArray  # (R, n, B), what the gradient has of second order, times r_i
    q: FloatArray
    s: FloatArray  # (R, n, B), its rounding errors times r_i
    slope_lo: FloatArray  # (R, n, B) interval gradients times r_i
    slope_hi: FloatArray
    gradient_lo: FloatArray  # (R, n, B)
    gradient_hi: FloatArray

    def expression(self, r: int, sign: float) -> Quadratic:
        """The upper model of ``sign`` times one expression."""
        low, high, p, q = self.slope_lo[r], self.slope_hi[r], self.p[r], self.q[r]
        if sign < 0:
            low, high, p, q = -high, -low, -q, -p
        middle, size = sign * self.value.c[r] + self.value.s[r], np.abs(self.value.c[r])
        return Quadratic.made(middle, sign * self.b[r], sign * self.A[r], p, q, self.s[r], low, high, size)


@dataclass(frozen=True, eq=False)
class Quadratic:
    """An upper model ``middle + b e + 1/2 e'He + w |e|`` of a function on the box, e in [-1, 1]^n."""

    middle: FloatArray  # (B,) upper bound of its value at the centre
    b: FloatArray  # (n, B)
    H: FloatArray  # (n, n, B)
    w: FloatArray  # (n, B)
    slope_lo: FloatArray  # (n, B)
    slope_hi: FloatArray
    rounding: FloatArray  # (B,) what all sums of the bound may have lost

    def reaching(self, level: float) -> tuple[FloatArray, FloatArray]:
        """Ends (n, B) of the e_i for which the model can reach a level, the other e_j being anything."""
        diagonal = np.einsum("iib->ib", self.H)
        others = np.abs(self.H).sum(axis=(0, 1)) - np.abs(diagonal).sum(axis=0)
        most = largest(np.abs(self.b) + self.w, diagonal)
        total = self.middle + self.rounding + 0.5 * others + most.sum(axis=0)
        need = level - (total - most)
        size = np.abs(need) + np.abs(self.b) + self.w + np.abs(diagonal) + np.abs(total) + abs(level)
        need = need - (_ROOT_SLACK * size + TINY)
        right_first, right_last = _roots(self.b + self.w, diagonal, need)
        left_first, left_last = _roots(-self.b + self.w, diagonal, need)
        # No solution on one side: its last is below its first, and the other side's first is the end.
        low = np.where(left_last >= left_first, -left_last, right_first)
        high = np.where(right_last >= right_first, right_last, -left_first)
        # What is not finite says nothing.
        known = np.isfinite(need) & np.isfinite(self.b) & np.isfinite(self.w) & np.isfinite(diagonal)
        return np.where(known, low, -1.0), np.where(known, high, 1.0)

    @classmethod
    def combined(cls, model: GradientModel, weights: FloatArray) -> Quadratic:
        """The model of a sum of expressions, weighted by (R, B)."""
        size = np.abs(weights)
        used = size > 0
        keep = used[:, None]

        def total(values: FloatArray, by: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("rb,r...b->...b", by, values))

        middle = total(np.where(used, model.value.c, 0.0), weights) + total(np.where(used, model.value.s, 0.0), size)
        b = total(np.where(keep, model.b, 0.0), weights)
        A = total(np.where(keep[:, None], model.A, 0.0), weights)
        s = total(np.where(keep, model.s, 0.0), size)
        positive = (weights > 0)[:, None]

        def ends(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
            least, most = np.where(positive, low, high), np.where(positive, high, low)
            return total(np.where(keep, least, 0.0), weights), total(np.where(keep, most, 0.0), weights)

        largest = total(np.where(used, np.abs(model.value.c), 0.0), size)
        p, q = ends(model.p, model.q)
        return cls.made(middle, b, A, p, q, s, *ends(model.slope_lo, model.slope_hi), largest)

    @classmethod
    def made(
        cls,
        middle: FloatArray,
        b: FloatArray,
        A: FloatArray,
        p: FloatArray,
        q: FloatArray,
        s: FloatArray,
        low: FloatArray,
        high: FloatArray,
        largest: FloatArray,
    ) -> Quadratic:
        """The model from the parts of a gradient's form; ``low`` and ``high`` are the gradient's ends from elsewhere.

        Along the ray to ``e`` what is of second order grows with ``t^2``, whose integral is 1/3.
        """
        across = np.abs(A).sum(axis=1)
        rounding = 64 * ULP * (largest + (np.abs(b) + 2 * across + q - p + s).sum(axis=0)) + TINY
        margin = 64 * ULP * (np.abs(b) + across + q - p + s) + TINY
        low, high = np.fmax(low, b - across + p - s) - margin, np.fmin(high, b + across + q + s) + margin
        b, w = b + (p + q) / 6, (q - p) / 6 + s
        return cls(middle, b, 0.5 * (A + np.swapaxes(A, 0, 1)), w, low, high, rounding)


def reaching_affine(forms: Forms, r: int, sign: float, level: float) -> tuple[FloatArray, FloatArray]:
    """As :meth:`Quadratic.reaching`, for ``sign`` times an expression, from its affine form.

    ``c + sum a_i e_i + q + s >= level`` bounds each ``a_i e_i`` by what the others leave.
    """
    a = sign * forms.a[r]
    rad = np.abs(a).sum(axis=0)
    most = forms.q[r] if sign > 0 else -forms.p[r]
    slack = most + forms.s[r] + (np.abs(forms.c[r]) + rad + most + abs(level)) * (64 * ULP) + TINY
    needed = (level - sign * forms.c[r] - slack - (rad - np.abs(a))) / a
    margin = np.abs(needed) * (8 * ULP)
    low = np.where((a > 0) & (needed > -1), needed - margin, -1.0)
    high = np.where((a < 0) & (needed < 1), needed + margin, 1.0)
    return low, high


def _roots(linear: FloatArray, quadratic: FloatArray, need: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and last t in [0, 1] with ``linear t + 1/2 quadratic t^2 >= need``; last < first where there is none."""
    at_end = linear + 0.5 * quadratic >= need
    at_start = need <= 0
    root = np.sqrt(np.maximum(linear * linear + 2 * quadratic * need, 0.0))
    # The roots of 1/2 q t^2 + l t - need, each in the form without cancellation.
    small = np.where(linear >= 0, 2 * need / (linear + root), (root - linear) / quadratic)
    large = np.where(linear >= 0, -(linear + root) / quadratic, 2 * need / (linear - root))
    peak = (quadratic < 0) & (linear > 0) & (linear < -quadratic) & (linear * linear >= -2 * quadratic * need)
    # Rising to a peak and falling again: both roots. From a start that holds, down: where it first fails.
    down = np.where(quadratic < 0, large, np.where(linear < 0, large, 1.0))
    last = np.where(
        at_end, 1.0, np.where(at_start, np.clip(down, 0.0, 1.0), np.where(peak, np.clip(large, 0.0, 1.0), -1.0))
    )
    first = np.where(at_start, 0.0, np.where(at_end | peak, np.clip(small, 0.0, 1.0), 2.0))
    return first, last


def largest(linear: FloatArray, quadratic: FloatArray) -> FloatArray:
    """Largest of ``linear t + 1/2 quadratic t^2`` for t in [0, 1], linear not negative."""
    inside = (quadratic < 0) & (linear < -quadratic)
    peak = np.where(inside, linear * linear / np.where(inside, -2 * quadratic, 1.0), 0.0)
    return np.where(inside, peak, linear + 0.5 * quadratic)
