"""Upper models of expressions over boxes from the forms of their gradients and squared quotients, and their bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.enclosure import forms
from screwsynth.nlp.proof.enclosure.forms import Ends

from .first_order import Enclosures
from .intervals import TINY, ULP

#: Rounds of the coordinate-wise search for a tangent point: any result of it gives a bound.
_TANGENT_ROUNDS = 3
#: Part of its terms by which a quadratic's level is lowered before its roots: far more than their rounding.
_ROOT_SLACK = 1e-12
#: Least size of the terms of a quadratic whose roots are taken; its inverse is the largest.
_LEAST_SIZE = 1e-140
#: Rounds of the coordinate-wise search for multipliers: any result of it gives a bound.
_MULTIPLIER_ROUNDS = 8
#: Largest weight of a condition: what underflow takes from its model, times the weight, is still less than ``TINY``.
_LARGEST_WEIGHT = 1e20


class Total(NamedTuple):
    """The form of the gradient of a function over B boxes, times their radii ``r_i``.

    Attributes:
        middle: (B,) upper bound of the value at the centre.
        b: (n, B) gradient at the centre.
        A: (n, n, B) linear part of the gradient.
        p, q: (n, B) least and largest terms of second order of the gradient.
        s: (n, B) rounding errors of the gradient.
        low, high: (n, B) ends of the gradient from another enclosure, for an intersection.
        largest: (B,) size of the terms of the value at the centre.
    """

    middle: FloatArray
    b: FloatArray
    A: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    low: FloatArray
    high: FloatArray
    largest: FloatArray

    def integral(self) -> QuadraticModel:
        """Return the upper model of the function, by the integral of its gradient along rays from the centre.

        The terms of second order grow along a ray with ``t^2``, whose integral is 1/3.
        """
        middle, b, A, p, q, s, low, high, largest = self
        across = np.abs(A).sum(axis=1)
        rounding = 64 * ULP * (largest + (np.abs(b) + 2 * across + q - p + s).sum(axis=0)) + TINY
        margin = 64 * ULP * (np.abs(b) + across + q - p + s) + TINY
        symmetric, remainder = 0.5 * (A + np.swapaxes(A, 0, 1)), (q - p) / 6 + s
        low, high = np.fmax(low, b - across + p - s), np.fmin(high, b + across + q + s)
        return QuadraticModel(middle, b + (p + q) / 6, symmetric, remainder, low - margin, high + margin, rounding)


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
class GradientModel:
    """Enclosures of R expressions over B boxes, and of their gradients scaled by the boxes' radii ``r_i``.

    The first J expressions are functions, the others conditions.

    Attributes:
        value: enclosures of the expressions.
        b: (R, n, B) gradients at the centres times ``r_i``.
        A: (R, n, n, B) linear parts of the gradients times ``r_i``.
        p, q: (R, n, B) least and largest terms of second order of the gradients times ``r_i``.
        s: (R, n, B) rounding errors of the gradients times ``r_i``.
        slope_lo, slope_hi: (R, n, B) interval gradients times ``r_i``.
        gradient_lo, gradient_hi: (R, n, B) interval gradients.
        squares: upper models of the functions' quotients, whose ``b`` is in that of the functions; None without them.
    """

    value: Enclosures
    b: FloatArray
    A: FloatArray
    p: FloatArray
    q: FloatArray
    s: FloatArray
    slope_lo: FloatArray
    slope_hi: FloatArray
    gradient_lo: FloatArray
    gradient_hi: FloatArray
    squares: SquareSums | None = None

    def expression_model(self, r: int, sign: float) -> QuadraticModel:
        """Return the upper model of ``sign`` times one expression."""
        weights = np.zeros(self.value.c.shape)
        weights[r] = sign
        return self.sum_model(weights)

    def sum_model(self, weights: FloatArray) -> QuadraticModel:
        """Return the upper model of a sum of all expressions with weights (R, B)."""
        total = self.total(weights)
        if self.squares is None:
            return total.integral()
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

    def total(self, weights: FloatArray) -> Total:
        """Return the form of the gradient of a sum of all expressions with weights (R, B)."""
        size = np.abs(weights)
        used = size > 0
        keep = used[:, None]

        def total(values: FloatArray, by: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("rb,r...b->...b", by, values))

        middle = total(np.where(used, self.value.c, 0.0), weights) + total(np.where(used, self.value.s, 0.0), size)
        b = total(np.where(keep, self.b, 0.0), weights)
        A = total(np.where(keep[:, None], self.A, 0.0), weights)
        s = total(np.where(keep, self.s, 0.0), size)
        positive = (weights > 0)[:, None]

        def ends(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
            least, most = np.where(positive, low, high), np.where(positive, high, low)
            return total(np.where(keep, least, 0.0), weights), total(np.where(keep, most, 0.0), weights)

        largest = total(np.where(used, np.abs(self.value.c), 0.0), size)
        p, q = ends(self.p, self.q)
        return Total(middle, b, A, p, q, s, *ends(self.slope_lo, self.slope_hi), largest)


class QuadraticModel(forms.QuadraticModel):
    """An upper model that NumPy bounds."""

    def bound(self) -> FloatArray:
        """Return an upper bound (B,) over the box."""
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
        return np.asarray(np.fmin(np.inf, np.fmin(separate, tangent)) + self.rounding)

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


def gradient_model(box: Enclosures, radius: FloatArray) -> GradientModel:
    """Return the enclosures of E rows and of their gradients, from those of the rows and then their derivatives.

    Args:
        box: of E (1 + n) values over B boxes; the derivatives are row by row.
        radius: (n, B) half widths of the boxes.
    """
    n, count = radius.shape
    E = len(box.c) // (n + 1)
    shape, r = (E, n, count), radius[None]

    def scaled(values: FloatArray) -> FloatArray:
        return np.where(r > 0, values[E:].reshape(shape) * r, 0.0)

    return GradientModel(
        value=replace(box, **{name: values[:E] for name, values in vars(box).items()}),
        b=scaled(box.c),
        A=box.a[E:].reshape(E, n, n, count) * radius[None, :, None],
        p=scaled(box.p),
        q=scaled(box.q),
        s=scaled(box.s),
        slope_lo=scaled(box.lo),
        slope_hi=scaled(box.hi),
        gradient_lo=box.lo[E:].reshape(shape),
        gradient_hi=box.hi[E:].reshape(shape),
    )


def multipliers(
    gradients: FloatArray,
    rounding: FloatArray,
    high: FloatArray,
    equation: NDArray[np.bool_],
    functions: int,
    first: int = 0,
) -> FloatArray:
    """Return weights (R, B) of the Lagrangian, ``mu`` of functions and ``-lambda`` of conditions.

    They make its gradient small in the variables from number ``first`` on, by coordinate descent on the sum of squares.
    A condition whose gradient is within its rounding has none: that would add more to a bound than it can take away.

    Args:
        gradients: (R, n, B) of the expressions at the centres, scaled.
        rounding: (R, m, B) rounding errors of the gradients from variable ``first`` on, or of the values, m = 1.
        high: (R, B) upper ends of the expressions.
        equation: (R,) whether each must be 0.
        functions: number J of the first expressions, which are functions.
        first: the first variable.
    """
    J, R = functions, len(equation)
    weights = np.zeros_like(high)
    weights[0] = 1.0
    left = gradients[0, first:].copy()
    directions = gradients[:, first:].copy()
    directions[:J] -= gradients[0, first:]
    sizes = np.einsum("rib,rib->rb", directions, directions)
    lost = np.einsum("rib,rib->rb", rounding, rounding)
    usable = (sizes > lost) & (sizes < np.inf) & (high >= 0)
    usable[:J] = (sizes[:J] > 0) & (sizes[:J] < np.inf)
    for _ in range(_MULTIPLIER_ROUNDS if R > 1 else 0):
        for r in range(1, R):
            step = -np.einsum("ib,ib->b", directions[r], left) / sizes[r]
            new = weights[r] + step
            if r < J:
                new = np.clip(new, 0.0, weights[r] + weights[0])
            elif not equation[r]:
                new = np.minimum(new, 0.0)
            new = np.where(usable[r] & (np.abs(new) < _LARGEST_WEIGHT), new, weights[r])
            change = new - weights[r]
            left += change * np.where(usable[r], directions[r], 0.0)
            weights[r] = new
            if r < J:
                weights[0] = np.maximum(weights[0] - change, 0.0)
    # The weights of the functions must sum to 1 in spite of rounding.
    weights[0] += 1.0 - weights[:J].sum(axis=0)
    bad = weights[0] < 0
    weights[:J, bad], weights[0, bad] = 0.0, 1.0
    return weights
