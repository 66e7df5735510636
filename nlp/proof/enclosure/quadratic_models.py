"""Quadratic upper models of expressions over boxes, from the Taylor forms of their gradients; sums and contraction.

With ``h = r e``, ``|e_i| <= 1``, the forms of a gradient, ``grad L in G + A t e + t^2 [p, q]``, integrated along the
ray from the centre, give

    L(c + h) in L(c) + sum_i b_i e_i + 1/2 sum_ij H_ij e_i e_j +- sum_i w_i |e_i|,
    b_i = r_i (G_i + (p_i + q_i) / 6),   H = sym(r_i A_ij),   w_i = r_i (q_i - p_i) / 6,

a quadratic model with a remainder of third order, without second derivatives. With ``mu`` on the simplex and
``lambda_k >= 0`` on inequalities, ``L = sum_j mu_j phi_j - sum_k lambda_k h_k`` is at least ``min phi`` wherever the
conditions hold: its bound holds there for any multipliers. The multipliers used make its gradient at the centre small.
``docs/certificate.md`` has the derivation; the kernel bounds the models.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .engine import kernel
from .forms import TINY, ULP, Enclosures

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Rounds of the coordinate-wise search for multipliers: any result of it gives a bound.
_MULTIPLIER_ROUNDS = 8
#: Largest weight of a condition: what underflow takes from its model, times the weight, is still less than ``TINY``.
_LARGEST_WEIGHT = 1e20


class Ends(NamedTuple):
    """Least and largest ``e_i``, (n, B) each, of the points that can reach a level; low > high where none can."""

    low: FloatArray
    high: FloatArray


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

    def expression_model(self, r: int, sign: float) -> QuadraticModel:
        """Return the upper model of ``sign`` times one expression."""
        weights = np.zeros(self.value.c.shape)
        weights[r] = sign
        return self.sum_model(weights)

    def sum_model(self, weights: FloatArray) -> QuadraticModel:
        """Return the upper model of a sum of all expressions with weights (R, B)."""
        return self.total(weights).integral()

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


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """An upper model ``middle + b e + 1/2 e'He + w |e|`` of a function on the box, e in [-1, 1]^n.

    Attributes:
        middle: (B,) upper bound of the function at the centre.
        b: (n, B).
        H: (n, n, B) symmetric.
        w: (n, B).
        slope_lo, slope_hi: (n, B) interval gradient times ``r_i``.
        rounding: (B,) bound of the rounding errors of all sums.
    """

    middle: FloatArray
    b: FloatArray
    H: FloatArray
    w: FloatArray
    slope_lo: FloatArray
    slope_hi: FloatArray
    rounding: FloatArray

    def bound(self) -> FloatArray:
        """Return an upper bound (B,) over the box."""
        bound = np.empty(self.middle.size)
        kernel().models(len(self.b), self._arrays(), bound.size, bound)
        return bound

    def ends_reaching(self, level: float | FloatArray) -> Ends:
        """Return the ends of the ``e_i`` for which the model can reach a level, one or (B,), for any other ``e_j``."""
        low, high, levels = np.empty(self.b.shape), np.empty(self.b.shape), np.empty(self.middle.size)
        levels[:] = level
        kernel().models(len(self.b), self._arrays(), levels.size, levels, low, high)
        return Ends(low, high)

    def _arrays(self) -> tuple[FloatArray, ...]:
        """Return the model as the kernel reads it."""
        arrays = (self.middle, self.b, self.H, self.w, self.slope_lo, self.slope_hi, self.rounding)
        return tuple(np.ascontiguousarray(each) for each in arrays)


def affine_ends_reaching(value: Enclosures, r: int, sign: float, level: float) -> Ends:
    """Return the ends of the ``e_i`` for which ``sign`` times an expression can reach a level, from its affine form.

    In ``c + sum a_i e_i + q + s >= level``, the other terms bound each ``a_i e_i``.
    """
    a = sign * value.a[r]
    rad = np.abs(a).sum(axis=0)
    most = value.q[r] if sign > 0 else -value.p[r]
    slack = most + value.s[r] + (np.abs(value.c[r]) + rad + most + abs(level)) * (64 * ULP) + TINY
    needed = (level - sign * value.c[r] - slack - (rad - np.abs(a))) / a
    margin = np.abs(needed) * (8 * ULP)
    low = np.where((a > 0) & (needed > -1), needed - margin, -1.0)
    high = np.where((a < 0) & (needed < 1), needed + margin, 1.0)
    return Ends(low, high)


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


def ranges(model: GradientModel) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper ends (R, B) of the expressions: of their forms, and by the mean value theorem."""
    steep = np.maximum(np.abs(model.slope_lo), np.abs(model.slope_hi)).sum(axis=1) * (1 + 64 * ULP)
    middle, error = model.value.c, model.value.s
    spread = (error + (steep + TINY)) * (1 + ULP) + ULP * np.abs(middle)
    high = np.fmin(model.value.hi, middle + spread * (1 + ULP) + ULP * np.abs(middle))
    low = np.fmax(model.value.lo, middle - spread * (1 + ULP) - ULP * np.abs(middle))
    return low, high
