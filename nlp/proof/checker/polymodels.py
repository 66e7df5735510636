"""Quadratic models over boxes for the check of a proof: weighted sums of polynomials, their weights, and tilts.

The coordinates of a box are e in [-1, 1]^n, the same as those of its polynomials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..statement.standard_form import StandardForm
from .polynomials import Polynomial, middles, places, settled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Relative error of a sum of a few hundred rounded terms.
_SUMS = 1e-13
#: Upper bound of the effect of underflow on a sum.
_TINY = 1e-290
#: Weight of slopes relative to curvatures in the choice of the variable to bisect.
_SLOPE = 0.3
#: Number of sweeps over all expressions in the search for weights.
_SWEEPS = 3


class Forms(NamedTuple):
    """Polynomials of R expressions over N boxes, in all n variables of the boxes.

    Attributes:
        values: the R polynomials.
        low, high: (R, N) bounds of the expressions.
        share: (n, N) widths of the boxes relative to the whole box, scaled so that the largest of each box is 1.
    """

    values: tuple[Polynomial, ...]
    low: FloatArray
    high: FloatArray
    share: FloatArray

    def select(self, which: NDArray[np.intp]) -> Forms:
        """Return the forms over some boxes."""
        values = tuple(each.select(which) for each in self.values)
        return Forms(values, self.low[:, which], self.high[:, which], self.share[:, which])

    def only(self, r: int) -> Forms:
        """Return the form of one expression."""
        return Forms(self.values[r : r + 1], self.low[r : r + 1], self.high[r : r + 1], self.share)

    def centres(self) -> FloatArray:
        """Return the constant coefficients (R, N) of the polynomials, their values at the centres."""
        return np.array([np.broadcast_to(each.P[0], self.low[0].shape) for each in self.values])

    def gradients(self) -> FloatArray:
        """Return the linear coefficients (R, n, N) of the polynomials."""
        G = np.zeros((len(self.values), *self.share.shape))
        for row, each in zip(G, self.values, strict=True):
            row[list(each.on)] = each.P[places(len(each.on)).linear]
        return G


def forms_of(polynomials: Sequence[Polynomial], lower: FloatArray, upper: FloatArray, form: StandardForm) -> Forms:
    """Return polynomials over boxes with ends (n, N), with their ranges as arrays."""
    N = lower.shape[1]
    low, high = (np.array([np.broadcast_to(each.V[side], N) for each in polynomials]) for side in (0, 1))
    width = (upper - lower) / (form.upper - form.lower)[:, None]
    largest = width.max(axis=0)
    return Forms(tuple(polynomials), low, high, width / np.where(largest > 0, largest, 1.0))


@dataclass(frozen=True, eq=False)
class SumModel:
    """An upper model ``fixed + b e + 1/2 e'He`` of a weighted sum over N boxes.

    Attributes:
        fixed: (N,) constants, including the error balls of the polynomials, and rounding.
        b: (n, N) linear coefficients.
        H: (n, n, N) symmetric matrices of the quadratic part.
        balls: (n, N) weighted radii of the error balls of the polynomials that depend on each variable, times the
            variable's share of the width of the box.
    """

    fixed: FloatArray
    b: FloatArray
    H: FloatArray
    balls: FloatArray

    def select(self, which: NDArray[np.intp]) -> SumModel:
        """Return the model over some boxes."""
        return SumModel(*(getattr(self, each.name)[..., which] for each in fields(self)))

    @property
    def reach(self) -> FloatArray:
        """Largest change (n, N) of each derivative from its value at the centre."""
        return np.asarray(np.abs(self.H).sum(axis=1))

    def bound(self) -> FloatArray:
        """Return an upper bound (N,) over the boxes."""
        # Where the sum rises along a variable on the whole box, its maximum lies on that face.
        reach = self.reach
        side = np.where(np.abs(self.b) > reach + _SUMS * (np.abs(self.b) + reach), np.sign(self.b), 0.0)
        return np.asarray(self.fixed + _largest(self.b, self.H, side) + _TINY)

    def change(self) -> FloatArray:
        """Return the estimated gain (n, N) of the bound when each variable is halved. Error balls are cubic."""
        return np.asarray(self.reach + _SLOPE * np.abs(self.b) + 2 * self.balls)


def polynomial_sum(forms: Forms, weights: FloatArray) -> SumModel:
    """Return the upper model of a sum with weights (R, N)."""
    n, N = forms.share.shape
    b, H, balls = np.zeros((n, N)), np.zeros((n, n, N)), np.zeros((n, N))
    fixed, ball, sizes = np.zeros(N), np.zeros(N), np.zeros(N)
    for weight, value in zip(weights, forms.values, strict=True):
        used = weight != 0
        if not used.any():
            continue
        at, on = places(len(value.on)), np.array(value.on, dtype=np.intp)
        # The coefficients of an unused value may be NaN, and 0 times NaN is NaN.
        P = weight * (value.P if used.all() else np.where(used, value.P, 0.0))
        fixed += P[0]
        b[on] += P[at.linear]
        H[on, on] += 2 * P[at.squares]
        first, second = on[at.first], on[at.second]
        H[first, second] += P[at.products]
        H[second, first] += P[at.products]
        own = np.where(used, np.abs(weight) * value.s, 0.0)
        ball += own
        balls[on] += own
        sizes += np.where(used, np.abs(weight) * value.size, 0.0)
    fixed = fixed + ball * (1 + _SUMS) + _SUMS * sizes
    return SumModel(fixed, b, H, balls * forms.share)


def _largest(b: FloatArray, H: FloatArray, s: FloatArray) -> FloatArray:
    """Return an upper bound (N,) of ``b e + 1/2 e'He`` for e in [-1, 1]^n, with ``e_i = s_i`` where ``s_i`` is not 0.

    The bound comes from a tangent plane to a concave part, which Gershgorin's circles give.
    """
    Hs = np.einsum("ijb,jb->ib", H, s)
    base = (b * s).sum(axis=0) + 0.5 * (s * Hs).sum(axis=0)
    free = s == 0
    b, C = np.where(free, b + Hs, 0.0), np.where(free[:, None] & free[None], H, 0.0)
    diagonal = np.einsum("iib->ib", C)
    shift = np.maximum(diagonal + np.abs(C).sum(axis=1) - np.abs(diagonal), 0.0)
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
    return np.asarray(base + plane)


def reaching_part(
    model: SumModel, level: FloatArray | float, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return bounds (n, N) of the parts of boxes in which a model may reach a level.

    Lower bounds are above upper bounds if no point can reach the level.
    """
    with np.errstate(all="ignore"):
        missing = level - model.fixed - _SUMS * (np.abs(level) + np.abs(model.fixed))
        half = 0.5 * model.reach
        steepest = np.abs(model.b) + half
        total = steepest.sum(axis=0)
        sizes = np.abs(missing) + total
        # Along e_i alone the model gains at most ``(b_i + half_i) e_i``, or ``(half_i - b_i) |e_i|`` on the other side;
        # the other variables give no more than the rest of the total.
        rest = (missing - (total - steepest)) - (_SUMS * sizes + _TINY)
        right, left = (np.where(up > 0, rest / up, np.inf) * (1 - _SUMS) for up in (half + model.b, half - model.b))
        known = (rest > 0) & np.isfinite(sizes)
        no_right, no_left = known & (right > 1), known & (left > 1)
        centre, radius = middles(lower, upper)
        margin = _SUMS * (np.abs(centre) + radius)
        # Only an end that moves is converted to the coordinates of the box.
        low = np.where(no_left, centre + radius * (right - _SUMS) - margin, lower)
        high = np.where(no_right, centre - radius * (left - _SUMS) + margin, upper)
        none = no_left & no_right
        return np.where(none, np.inf, np.fmax(lower, low)), np.where(none, -np.inf, np.fmin(upper, high))


def weights_of(functions: int, is_equation: Sequence[bool], forms: Forms) -> FloatArray:
    """Return weights (R, N): for functions, not negative with sum 1; for inequalities, not positive.

    Any weights give a bound; these make it small. The bound of ``L = sum_r w_r v_r`` over a box is about
    ``L(c) + sum_i r_i |dL/dx_i (c)|``, which also counts the violation of a condition at the centre. Coordinate descent
    finds the weights: those of functions on the squares of the gradient, those of conditions on this bound.

    Args:
        functions: number of functions; conditions follow.
        is_equation: whether each of the R expressions must be 0.
        forms: forms of the expressions over the boxes.
    """
    values, G = forms.centres(), forms.gradients()
    usable = np.isfinite(G).all(axis=1) & np.isfinite(values) & np.isfinite(forms.high)
    for r in range(functions, len(G)):
        if not is_equation[r]:
            # A condition that cannot be active gets no weight.
            usable[r] &= ~(forms.high[r] < 0)
    G, values = np.where(usable[:, None], G, 0.0), np.where(usable, values, 0.0)
    weights, left = np.zeros_like(values), G[0].copy()
    weights[0] = 1.0
    bind = [r for r in range(functions, len(G)) if usable[r].any()]
    for _ in range(_SWEEPS):
        for r in range(1, functions):
            _move_towards(r, functions, weights, G, left)
        for r in bind:
            _minimise_bound(weights[r], G[r], values[r], left, is_equation[r])
    return weights


def _move_towards(r: int, functions: int, weights: FloatArray, G: FloatArray, left: FloatArray) -> None:
    """Move the weights of the functions towards function r as long as the gradient ``left`` decreases."""
    direction = G[r] - np.einsum("jn,jin->in", weights[:functions], G[:functions])
    size = np.einsum("in,in->n", direction, direction)
    part = -np.einsum("in,in->n", direction, left) / np.where(size > 0, size, np.inf)
    part = np.clip(part, 0.0, 1.0)
    left += part * direction
    weights[:functions] *= 1 - part
    weights[r] += part
    # The sum remains 1 in spite of rounding.
    weights[:functions] /= weights[:functions].sum(axis=0)


def _minimise_bound(
    weight: FloatArray, gradient: FloatArray, value: FloatArray, left: FloatArray, is_equation: bool
) -> None:
    """Change one weight (N,) in place so that ``weight value + sum |left|`` is least; ``left`` (n, N) is updated too.

    The function is convex and piecewise linear in the weight: its minimum lies where a component of ``left`` is 0, or
    at 0.
    """
    without = left - weight * gradient
    with np.errstate(all="ignore"):
        breaks = np.where(np.abs(gradient) > 0, -without / gradient, 0.0)
    breaks = np.where(np.isfinite(breaks), breaks, 0.0)
    tried = np.concatenate([breaks, np.zeros((1, weight.size)), weight[None]])
    if not is_equation:
        tried = np.minimum(tried, 0.0)
    bounds = tried * value + np.abs(without[None] + tried[:, None] * gradient[None]).sum(axis=1)
    best = tried[bounds.argmin(axis=0), np.arange(weight.size)]
    left += (best - weight) * gradient
    weight[:] = best


@dataclass(frozen=True, eq=False)
class Tilts:
    """Quadratic functions of m shared variables, one for each of L boxes of these variables.

        t(s) = g.e + 1/2 e'Q e,    e_i = (s_i - c_i) / r_i

    with the centre c and half widths r of the box, as computed in doubles; a half width of 0 is replaced by 1, as e is
    then 0. Any tilts give a bound, so they need not be trusted.

    Attributes:
        centre, radius: (m, L) centres and half widths of the boxes.
        g: (m, L) linear coefficients.
        Q: (m, m, L) symmetric matrices.
    """

    centre: FloatArray
    radius: FloatArray
    g: FloatArray
    Q: FloatArray

    @classmethod
    def over(cls, lower: FloatArray, upper: FloatArray, g: FloatArray, Q: FloatArray) -> Tilts:
        """Return tilts over boxes with ends (m, L)."""
        radius = 0.5 * (upper - lower)
        return cls(0.5 * (lower + upper), np.where(radius > 0, radius, 1.0), g, Q)

    def select(self, which: NDArray[np.intp]) -> Tilts:
        """Return the tilts of some boxes, which may repeat."""
        return Tilts(self.centre[:, which], self.radius[:, which], self.g[:, which], self.Q[:, :, which])

    def sizes(self, e: FloatArray | float = 1.0) -> FloatArray:
        """Return sums (L,) of the absolute values of all terms, for absolute coordinates of at most ``e``, (m, L)."""
        far = np.broadcast_to(e, self.g.shape)
        return np.asarray(
            (np.abs(self.g) * far).sum(axis=0) + 0.5 * np.einsum("ib,ijb,jb->b", far, np.abs(self.Q), far)
        )

    def at(self, s: FloatArray) -> FloatArray:
        """Return values (L,) at one point (m, L) for each box, as computed in doubles."""
        e = (s - self.centre) / self.radius
        return np.asarray((self.g * e).sum(axis=0) + 0.5 * np.einsum("ib,ijb,jb->b", e, self.Q, e))

    def polynomial(self, lower: FloatArray, upper: FloatArray) -> Polynomial:
        """Return the tilts over pieces of the boxes with ends (n, N); the first m variables are the shared ones."""
        m, at = len(self.g), places(len(self.g))
        centre, radius = middles(lower[:m], upper[:m])
        e, r = (centre - self.centre) / self.radius, radius / self.radius
        P = np.zeros((at.total, e.shape[1]))
        P[0] = self.at(centre)
        P[at.linear] = (self.g + np.einsum("ijb,jb->ib", self.Q, e)) * r
        P[at.squares] = 0.5 * np.einsum("iib->ib", self.Q) * r * r
        P[at.products] = self.Q[at.first, at.second] * r[at.first] * r[at.second]
        s = _SUMS * self.sizes(np.abs(e) + r) + _TINY
        anything = np.full_like(s, np.inf)
        return settled(tuple(range(m)), P, s, np.array([-anything, anything]))
