"""Upper models of expressions over boxes as the package has them, with squared quotients, and bounded in NumPy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.enclosure import quadratic_models
from screwsynth.nlp.proof.enclosure.quadratic_models import Ends

from .intervals import TINY, ULP

#: Rounds of the coordinate-wise search for a tangent point: any result of it gives a bound.
_TANGENT_ROUNDS = 3
#: Part of its terms by which a quadratic's level is lowered before its roots: far more than their rounding.
_ROOT_SLACK = 1e-12
#: Least size of the terms of a quadratic whose roots are taken; its inverse is the largest.
_LEAST_SIZE = 1e-140


@dataclass(frozen=True, eq=False)
class SquareSums:
    """Upper models of the quotients of J functions over B boxes, beside what :class:`GradientModel` has of them.

    Attributes:
        H: (J, n, n, B) matrices of the models.
        w: (J, n, B) bounds of their remainders.
    """

    H: FloatArray
    w: FloatArray


@dataclass(frozen=True, eq=False)
class GradientModel(quadratic_models.GradientModel):
    """Enclosures of expressions, with those of quotients that are left out of their forms.

    Attributes:
        squares: upper models of the functions' quotients, whose ``b`` is in that of the functions; None without them.
    """

    squares: SquareSums | None = None

    def sum_model(self, weights: FloatArray) -> QuadraticModel:
        """Return the upper model of a sum of all expressions with weights (R, B)."""
        total = self.total(weights)
        if self.squares is None:
            return QuadraticModel(**vars(total.integral()))
        _, b, A, p, q, s, low, high, _ = total
        J = len(self.squares.H)
        H, w = (np.einsum("rb,r...b->...b", weights[:J], each) for each in (self.squares.H, self.squares.w))
        # The slopes of the quotients are in the other enclosure alone.
        whole = total._replace(low=np.full_like(low, np.nan), high=np.full_like(high, np.nan)).integral()
        margin = 64 * ULP * (np.abs(b) + np.abs(A).sum(axis=1) + q - p + s) + TINY
        return QuadraticModel(
            whole.middle,
            whole.b,
            whole.H + H,
            whole.w + w,
            low - margin,
            high + margin,
            whole.rounding + 64 * ULP * (np.abs(H).sum(axis=(0, 1)) + w.sum(axis=0)),
        )


class QuadraticModel(quadratic_models.QuadraticModel):
    """An upper model that NumPy bounds."""

    def bound(self) -> FloatArray:
        """Return an upper bound (B,) over the box."""
        mean = self.middle + np.maximum(np.abs(self.slope_lo), np.abs(self.slope_hi)).sum(axis=0)
        # Where the slope has a sign, the largest value is on that face.
        s = np.where(self.slope_lo >= 0, 1.0, np.where(self.slope_hi <= 0, -1.0, 0.0))
        free = s == 0
        Hs = np.einsum("ijb,jb->ib", self.H, s)
        fixed = self.middle + (self.b * s).sum(axis=0) + 0.5 * (s * Hs).sum(axis=0) + (self.w * np.abs(s)).sum(axis=0)
        b = np.where(free, self.b + Hs, 0.0)
        w = np.where(free, self.w, 0.0)
        H = np.where(free[:, None] & free[None], self.H, 0.0)
        diagonal = np.einsum("iib->ib", H).copy()
        others = np.abs(H).sum(axis=1) - np.abs(diagonal)
        separate = fixed + (largest_on_unit_interval(np.abs(b) + w, diagonal) + 0.5 * others).sum(axis=0)
        shift = np.maximum(diagonal + others, 0.0)
        tangent = fixed + _tangent(b, H, diagonal - shift) + (0.5 * shift + w).sum(axis=0)
        best = np.fmin(mean, np.fmin(separate, tangent))
        return np.asarray(best + self.rounding)

    def ends_reaching(self, level: float | FloatArray) -> Ends:
        """Return the ends of the ``e_i`` for which the model can reach a level, one or (B,), for any other ``e_j``."""
        diagonal = np.einsum("iib->ib", self.H)
        others = np.abs(self.H).sum(axis=(0, 1)) - np.abs(diagonal).sum(axis=0)
        most = largest_on_unit_interval(np.abs(self.b) + self.w, diagonal)
        total = self.middle + self.rounding + 0.5 * others + most.sum(axis=0)
        need = level - (total - most)
        size = np.abs(need) + np.abs(self.b) + self.w + np.abs(diagonal) + np.abs(total) + np.abs(level)
        need = need - (_ROOT_SLACK * size + TINY)
        right_first, right_last = _ends_of_solutions(self.b + self.w, diagonal, need)
        left_first, left_last = _ends_of_solutions(-self.b + self.w, diagonal, need)
        # A side without a solution has last < first: then the other side's first solution is the end.
        low = np.where(left_last >= left_first, -left_last, right_first)
        high = np.where(right_last >= right_first, right_last, -left_first)
        # Numbers that are not finite, or whose squares may underflow or overflow, exclude nothing.
        known = (size > _LEAST_SIZE) & (size < 1 / _LEAST_SIZE)
        return Ends(np.where(known, low, -1.0), np.where(known, high, 1.0))


def largest_on_unit_interval(linear: FloatArray, quadratic: FloatArray) -> FloatArray:
    """Return the largest ``linear t + 1/2 quadratic t^2`` for t in [0, 1], linear not negative."""
    inside = (quadratic < 0) & (linear < -quadratic)
    # In this order: the square of a small number may underflow.
    peak = np.where(inside, linear * (linear / np.where(inside, -2 * quadratic, 1.0)), 0.0)
    return np.where(inside, peak, linear + 0.5 * quadratic)


def _tangent(b: FloatArray, H: FloatArray, diagonal: FloatArray) -> FloatArray:
    """Return the largest value over the box of a tangent plane to the concave ``b e + 1/2 e' C e``.

    ``C`` is ``H`` with another diagonal. A tangent plane of a concave function is nowhere below it; this one
    touches it near its maximum.
    """
    n = len(b)
    t = np.zeros_like(b)
    gradient = b.copy()
    for _ in range(_TANGENT_ROUNDS):
        for i in range(n):
            curvature = diagonal[i]
            new = np.where(curvature < 0, t[i] - gradient[i] / curvature, np.sign(gradient[i]))
            new = np.clip(np.where(np.isfinite(new), new, 0.0), -1.0, 1.0)
            change = new - t[i]
            t[i] = new
            gradient += change * H[i]
            gradient[i] += change * (curvature - H[i, i])
    # The plane at t: b t + 1/2 t'Ct + gradient (e - t), where gradient = b + C t.
    Ct = np.einsum("ijb,jb->ib", H, t) + (diagonal - np.einsum("iib->ib", H)) * t
    gradient = b + Ct
    return np.asarray(-0.5 * (t * Ct).sum(axis=0) + np.abs(gradient).sum(axis=0))


def _ends_of_solutions(linear: FloatArray, quadratic: FloatArray, need: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return first and last t in [0, 1] with ``linear t + 1/2 quadratic t^2 >= need``; last < first without one."""
    at_end = linear + 0.5 * quadratic >= need
    at_start = need <= 0
    root = np.sqrt(np.maximum(linear * linear + 2 * quadratic * need, 0.0))
    # The roots of 1/2 q t^2 + l t - need, each in the form without cancellation.
    small = np.where(linear >= 0, 2 * need / (linear + root), (root - linear) / quadratic)
    large = np.where(linear >= 0, -(linear + root) / quadratic, 2 * need / (linear - root))
    peak = (quadratic < 0) & (linear > 0) & (linear < -quadratic) & (linear * linear >= -2 * quadratic * need)
    # Up to a peak and down again: both roots. From a start where it holds, down: the first root where it fails.
    down = np.where(quadratic < 0, large, np.where(linear < 0, large, 1.0))
    last = np.where(
        at_end, 1.0, np.where(at_start, np.clip(down, 0.0, 1.0), np.where(peak, np.clip(large, 0.0, 1.0), -1.0))
    )
    first = np.where(at_start, 0.0, np.where(at_end | peak, np.clip(small, 0.0, 1.0), 2.0))
    return first, last
