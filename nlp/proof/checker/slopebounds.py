"""Upper bounds of sums from the interval slopes of their gradients, for the check of a proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .slopes import Slope

if TYPE_CHECKING:
    from ....models import FloatArray

#: Error of a sum of a few hundred rounded terms, in parts of their sizes.
_SUMS = 1e-13
#: More than underflow can cost a sum.
_TINY = 1e-290


@dataclass(frozen=True, eq=False)
class SumModel:
    """An upper model ``fixed + b e + 1/2 e'He`` of a weighted sum over N boxes, e in [-1, 1]^n.

    Attributes:
        total: (N,) upper bound of the sum at the centre.
        fixed: (N,) the same, with the widths of all intervals and rounding.
        b: (n, N).
        H: (n, n, N) symmetric.
        loose: (n, N) part of the width of the second derivatives in ``fixed`` that each variable has a share in.
        slope_low, slope_high: (n, N) gradient over the box.
        radius: (n, N) half widths, rounded up.
    """

    total: FloatArray
    fixed: FloatArray
    b: FloatArray
    H: FloatArray
    loose: FloatArray
    slope_low: FloatArray
    slope_high: FloatArray
    radius: FloatArray

    def bound(self) -> FloatArray:
        """Return an upper bound (N,) over the boxes."""
        steep = np.maximum(np.abs(self.slope_low), np.abs(self.slope_high))
        mean = self.total + (steep * self.radius).sum(axis=0) * (1 + _SUMS) + _SUMS * np.abs(self.total)
        # Where the sum rises along a variable on the whole box, it is largest on that face.
        margin = _SUMS * steep
        s = np.where(self.slope_low - margin > 0, 1.0, np.where(self.slope_high + margin < 0, -1.0, 0.0))
        return np.asarray(np.fmin(mean, self.fixed + _largest(self.b, self.H, s)) + _TINY)

    def change(self) -> FloatArray:
        """Return how much (n, N) the bound can gain from halving each variable."""
        return np.asarray(np.abs(self.H).sum(axis=0) + self.loose + 0.3 * np.abs(self.b))


def sum_model(
    weights: FloatArray,
    expressions: Sequence[Slope],
    gradients: Sequence[Sequence[Slope]],
    lower: FloatArray,
    upper: FloatArray,
) -> SumModel:
    """Return the upper model of a weighted sum of expressions over boxes, from the slopes of its gradient.

    ``L(c + h) in L(c) + g h + 1/2 h'S h``, with intervals for ``g`` and ``S``.

    Args:
        weights: (R, N).
        expressions: R slopes.
        gradients: n slopes of each expression's derivatives.
        lower: (n, N) lower ends of the boxes.
        upper: (n, N) upper ends of the boxes.
    """
    n, N = lower.shape
    r = 0.5 * (upper - lower) * (1 + 1e-14) + np.abs(lower) * 1e-15
    total, b_low, b_high = np.zeros(N), np.zeros((n, N)), np.zeros((n, N))
    slope_low, slope_high = np.zeros((n, N)), np.zeros((n, N))
    S_low, S_high = np.zeros((n, n, N)), np.zeros((n, n, N))
    sizes = np.zeros(N)
    for weight, expression, gradient in zip(weights, expressions, gradients, strict=True):
        used, positive = weight != 0, weight >= 0
        if not used.any():
            continue
        ends = (expression.C[0], expression.C[1])
        total += np.where(used, weight * np.where(positive, ends[1], ends[0]), 0.0)
        sizes += np.where(used, np.abs(weight * ends[0]), 0.0)
        for i, g in enumerate(gradient):
            for low, high, source in ((b_low, b_high, g.C), (slope_low, slope_high, g.V), (S_low, S_high, g.S)):
                one, other = np.where(positive, source[0], source[1]), np.where(positive, source[1], source[0])
                low[i] += np.where(used, weight * one, 0.0)
                high[i] += np.where(used, weight * other, 0.0)
    total = total + _SUMS * sizes
    S_low, S_high = S_low * r[:, None] * r[None], S_high * r[:, None] * r[None]
    S_low, S_high = 0.5 * (S_low + S_low.swapaxes(0, 1)), 0.5 * (S_high + S_high.swapaxes(0, 1))
    H, loose = 0.5 * (S_low + S_high), 0.5 * (S_high - S_low).sum(axis=0)
    b = 0.5 * (b_low + b_high) * r
    spread = (0.5 * (b_high - b_low) * r).sum(axis=0)
    sizes = sizes + np.abs(b).sum(axis=0) + np.abs(S_low).sum(axis=(0, 1)) + np.abs(S_high).sum(axis=(0, 1))
    fixed = total + 0.5 * loose.sum(axis=0) + spread + _SUMS * sizes
    return SumModel(total, fixed, b, H, loose, slope_low, slope_high, r)


def _largest(b: FloatArray, H: FloatArray, s: FloatArray) -> FloatArray:
    """Return an upper bound (N,) of ``b e + 1/2 e'He`` for e in [-1, 1]^n, with ``e_i = s_i`` where ``s_i`` is not 0.

    It is the lesser of two: the sum over free variables one by one, with absolute values of the terms that couple them;
    and that from a tangent plane to a concave part, which Gershgorin's circles give.
    """
    Hs = np.einsum("ijb,jb->ib", H, s)
    base = (b * s).sum(axis=0) + 0.5 * (s * Hs).sum(axis=0)
    free = s == 0
    b, H = np.where(free, b + Hs, 0.0), np.where(free[:, None] & free[None], H, 0.0)
    diagonal = np.einsum("iib->ib", H)
    others = np.abs(H).sum(axis=1) - np.abs(diagonal)
    peak = (diagonal < 0) & (np.abs(b) < -diagonal)
    alone = np.where(peak, b * (b / np.where(peak, -2 * diagonal, 1.0)), np.abs(b) + 0.5 * diagonal)
    separate = (alone + 0.5 * others).sum(axis=0)
    shift = np.maximum(diagonal + others, 0.0)
    C = H.copy()
    for i in range(len(b)):
        C[i, i] -= shift[i]
    e = np.zeros_like(b)
    for _ in range(3):
        for i in range(len(b)):
            rest = b[i] + np.einsum("jb,jb->b", C[i], e) - C[i, i] * e[i]
            step = np.where(C[i, i] < 0, rest / np.where(C[i, i] < 0, -C[i, i], 1.0), np.sign(rest))
            e[i] = np.clip(np.where(np.isfinite(step), step, 0.0), -1.0, 1.0)
    Ce = np.einsum("ijb,jb->ib", C, e)
    plane = np.abs(b + Ce).sum(axis=0) - 0.5 * (e * Ce).sum(axis=0) + 0.5 * shift.sum(axis=0)
    return np.asarray(base + np.fmin(separate, plane))
