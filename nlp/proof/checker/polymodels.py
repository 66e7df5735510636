"""Upper models of weighted sums of polynomials with balls, and parts of boxes where they reach a level."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..statement.standard_form import StandardForm
from .polynomials import Polynomial, middles, places
from .slopebounds import SumModel
from .slopecut import cut_off

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Error of a sum of a few hundred rounded terms, in parts of their sizes.
_SUMS = 1e-13
#: Weight, in the choice of the variable to bisect, of those at their ends on a whole box: it decides if no other does.
_AT_END = 0.05


class Forms(NamedTuple):
    """Polynomials of R expressions over N boxes, in all n variables of the boxes.

    Attributes:
        values: the R polynomials.
        low, high: (R, N) ends of their ranges.
        share: (n, N) widths of the boxes in parts of the whole box's, the largest of each box being 1.
    """

    values: tuple[Polynomial, ...]
    low: FloatArray
    high: FloatArray
    share: FloatArray

    def select(self, which: NDArray[np.intp]) -> Forms:
        """Return those of some boxes."""
        values = tuple(each.select(which) for each in self.values)
        return Forms(values, self.low[:, which], self.high[:, which], self.share[:, which])

    def only(self, r: int) -> Forms:
        """Return that of one expression."""
        return Forms(self.values[r : r + 1], self.low[r : r + 1], self.high[r : r + 1], self.share)

    def centres(self) -> FloatArray:
        """Return the constants (R, N)."""
        return np.array([np.broadcast_to(each.P[0], self.low[0].shape) for each in self.values])

    def gradients(self) -> FloatArray:
        """Return the linear parts (R, n, N)."""
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
class PolynomialModel(SumModel):
    """An upper model of a sum of polynomials.

    Attributes:
        balls: (n, N) radii of the balls of the polynomials that depend on each variable, times their weights and the
            variable's share of the width of the box.
    """

    balls: FloatArray

    def change(self) -> FloatArray:
        """Return how much (n, N) the bound can gain from halving each variable; the balls are of third order.

        Where the sum rises or falls along a variable on the whole box, the bound is taken at its end already.
        """
        free = (self.slope_low <= 0) & (self.slope_high >= 0)
        coupled = np.where(free[:, None] & free[None], np.abs(self.H), 0.0).sum(axis=0)
        own = np.where(free, coupled + 0.3 * np.abs(self.b), 0.0)
        return np.asarray(own + _AT_END * super().change() + 2 * self.balls)

    def select(self, which: NDArray[np.intp]) -> PolynomialModel:
        """Return the model over some boxes."""
        return PolynomialModel(*(getattr(self, each.name)[..., which] for each in fields(self)))


def polynomial_sum(forms: Forms, weights: FloatArray) -> PolynomialModel:
    """Return the upper model of a sum with weights (R, N), in coordinates from -1 to 1 of each box."""
    n, N = forms.share.shape
    b, H, balls = np.zeros((n, N)), np.zeros((n, n, N)), np.zeros((n, N))
    fixed, ball, sizes = np.zeros(N), np.zeros(N), np.zeros(N)
    for weight, value in zip(weights, forms.values, strict=True):
        used = weight != 0
        if not used.any():
            continue
        at, on = places(len(value.on)), np.array(value.on, dtype=np.intp)
        # An unused value may be undefined, and then 0 times it is no number.
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
    reach = np.abs(H).sum(axis=1)
    loose = np.zeros_like(b)
    return PolynomialModel(fixed, fixed, b, H, loose, b - reach, b + reach, np.ones_like(b), balls * forms.share)


def reaching_part(
    model: SumModel, level: FloatArray | float, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return ends (n, N) of the parts of boxes that hold every point where a model reaches a level; crossed if none."""
    half = 0.5 * np.abs(model.H).sum(axis=1)
    one = np.ones_like(model.b)
    missing = level - model.fixed - _SUMS * (np.abs(level) + np.abs(model.fixed))
    low, high = cut_off(missing, -model.b - half, half - model.b, -one, one)
    centre, radius = middles(lower, upper)
    margin = _SUMS * (np.abs(centre) + radius)
    with np.errstate(all="ignore"):
        # Only an end that was moved is written in the box's own numbers.
        first = np.where(low > -1, centre + radius * low - margin, lower)
        last = np.where(high < 1, centre + radius * high + margin, upper)
    return np.fmax(lower, first), np.fmin(upper, last)
