"""Upper models of a form's function minus tilts over boxes, for the check of a proof by limbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ...statement.piecewise_derivatives import refuse_jumps, without_ties
from ...statement.standard_form import StandardForm
from ..slopebounds import SumModel, sum_model
from ..slopes import Slope, SlopeArithmetic
from ..slopeweights import lagrangian_weights
from .squares import SquareSlopes, add_square, slopes_of_square, squares_of
from .tilts import Tilts, without_tilts

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray

#: Error of a sum of a few rounded terms, in parts of their sizes.
_SUMS = 1e-13


@dataclass(frozen=True, eq=False)
class TiltedSlopes:
    """A form's function and conditions over N boxes.

    Attributes:
        lower, upper: (n, N) ends of the boxes.
        rest: the function without its squared quotients.
        d_rest: its n derivatives.
        squares: its squared quotients.
        conditions: slopes of the conditions.
        d_conditions: n derivatives of each.
        rises_low, rises_high: (n, N) gradient of the function, without tilts.
        defined: (N,) whether the function has a value in the whole box.
    """

    lower: FloatArray
    upper: FloatArray
    rest: Slope
    d_rest: list[Slope]
    squares: list[SquareSlopes]
    conditions: list[Slope]
    d_conditions: list[list[Slope]]
    rises_low: FloatArray
    rises_high: FloatArray
    defined: NDArray[np.bool_]

    def is_below(self, bound: FloatArray) -> NDArray[np.bool_]:
        """Return whether the function is at most a bound (N,) by the ranges of its parts alone."""
        parts = [self.rest.V[1], *(each.high for each in self.squares)]
        size = np.sum([np.abs(each) for each in parts], axis=0)
        return np.asarray(self.defined & (np.sum(parts, axis=0) + _SUMS * size <= bound), dtype=bool)

    def value_at_centre(self) -> FloatArray:
        """Return the function (N,) at the centres, as computed in doubles."""
        return np.asarray(0.5 * (self.rest.C[0] + self.rest.C[1]) + sum(each.middle for each in self.squares))


class TiltedForm:
    """A form with one function, as its checker encloses it.

    Args:
        form: the form.
    """

    def __init__(self, form: StandardForm) -> None:
        (function,) = form.functions
        self._n, self._equation = form.n, [each.is_equation for each in form.conditions]
        rest, self._squares = squares_of(function)
        parts = [part for each in self._squares for part in (each.N, each.D)]
        rows = ca.densify(ca.vertcat(rest, *[each.expression for each in form.conditions], *parts))
        refuse_jumps(form.expressions, form.x)
        jacobian = ca.densify(without_ties(ca.jacobian(rows, form.x), form.x))
        self._count = int(rows.numel())
        self._arithmetic = SlopeArithmetic(ca.Function("limb", [form.x], ca.cse([rows, jacobian.T])))

    def slopes(self, lower: FloatArray, upper: FloatArray) -> TiltedSlopes:
        """Return the slopes over boxes with ends (n, N)."""
        n, C = self._n, len(self._equation)
        values = self._arithmetic(lower, upper)
        rows = values[: self._count]
        gradients = [values[self._count + r * n : self._count + (r + 1) * n] for r in range(self._count)]
        squares = [
            SquareSlopes(rows[r], rows[r + 1], gradients[r], gradients[r + 1], each.factor)
            for r, each in zip(range(1 + C, self._count, 2), self._squares, strict=True)
        ]
        low, high = (np.array([each.V[side] for each in gradients[0]]) for side in (0, 1))
        defined = np.isfinite(rows[0].V[0] + rows[0].V[1])
        with np.errstate(all="ignore"):
            for each in squares:
                ends = slopes_of_square(each)
                low, high = np.nextafter(low + ends[0], -np.inf), np.nextafter(high + ends[1], np.inf)
                defined &= each.is_defined
        return TiltedSlopes(
            lower,
            upper,
            rows[0],
            gradients[0],
            squares,
            rows[1 : 1 + C],
            gradients[1 : 1 + C],
            np.where(defined, low, -np.inf),
            np.where(defined, high, np.inf),
            defined,
        )

    def sums(self, given: TiltedSlopes, tilts: Tilts) -> list[SumModel]:
        """Return upper models of the function minus tilts and weighted conditions, for some choices of weights.

        Args:
            given: slopes over N boxes.
            tilts: of each box, over the shared box that it is a piece of.
        """
        lower, upper = given.lower, given.upper
        rows, gradients = [given.rest, *given.conditions], [given.d_rest, *given.d_conditions]
        found = []
        for weights in self._weights(given, tilts):
            model = sum_model(weights, rows, gradients, lower, upper)
            for each in given.squares:
                model = add_square(model, each, lower, upper)
            found.append(without_tilts(model, tilts, lower, upper))
        return found

    def _weights(self, given: TiltedSlopes, tilts: Tilts) -> list[FloatArray]:
        """Return choices of weights (1 + C, N) of function and conditions; the first is 1 each time."""
        N, m = given.lower.shape[1], len(tilts.g)
        if not self._equation:
            return [np.ones((1, N))]
        gradient = np.array([0.5 * (each.C[0] + each.C[1]) for each in given.d_rest])
        for square in given.squares:
            gradient = gradient + square.gradient
        centre = 0.5 * (given.lower[:m] + given.upper[:m])
        e = (centre - tilts.centre) / tilts.radius
        gradient[:m] -= (tilts.g + np.einsum("ijb,jb->ib", tilts.Q, e)) / tilts.radius
        # Values and gradients at the centres are all that a choice of weights takes of the function.
        value = given.value_at_centre() - tilts.at(centre)
        ends = [(row, row) for row in gradient]
        function = Slope((value, value), (value, value), (gradient, gradient))
        derivatives = [Slope(each, each, (gradient, gradient)) for each in ends]
        radius = 0.5 * (given.upper - given.lower)
        every = [function, *given.conditions], [derivatives, *given.d_conditions]
        return lagrangian_weights(1, [False, *self._equation], *every, radius)
