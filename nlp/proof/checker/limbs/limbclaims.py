"""Check of bounds of one limb minus its tilt, over boxes of shared variables and all of its own ones.

A box is bisected until one of these holds on each piece:

- a condition of the limb cannot hold;
- the limb minus its tilt is at most the bound by the ranges of its parts;
- the limb minus its tilt, and minus a weighted sum of its conditions, is at most the bound;
- what is left of the piece, where neither of these is shown point by point, is empty.

A piece in which the limb rises strictly along an own variable, which no condition stops, collapses on its face there:
a feasible point above the bound could be moved to that face, where it would be feasible and above the bound too. Shared
variables must not collapse, since the other limbs depend on them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...statement.standard_form import StandardForm
from ..bisection import Shown, show
from ..slopecut import cut_off
from .tilted import TiltedForm, TiltedSlopes
from .tilts import Tilts

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from .....models import FloatArray

#: Number of boxes that are evaluated at once.
_BLOCK = 512
#: Largest number of pieces of a claim's box.
_MOST_PIECES = 2_000
#: Error of a difference of two rounded numbers, in parts of their sizes.
_SUMS = 1e-13
#: Part of the sizes of its terms by which a value in doubles must exceed a bound to show that this is wrong.
_WRONG = 1e-9


@dataclass(frozen=True, eq=False)
class LimbClaims:
    """Claims about L boxes of m shared variables.

    Attributes:
        lower, upper: (m, L) ends.
        tilts: of the limb over each.
        bounds: (L,) of the limb minus its tilt; -inf where it has no feasible point.
    """

    lower: FloatArray
    upper: FloatArray
    tilts: Tilts
    bounds: FloatArray


class LimbChecker:
    """A check of claims about one limb, or about the part with shared variables alone.

    Args:
        form: the limb, over the shared variables and then its own ones.
        shared: number m of shared variables.
    """

    def __init__(self, form: StandardForm, shared: int) -> None:
        self._form, self._m = form, shared
        self._lower, self._upper = np.array(form.lower), np.array(form.upper)
        self.width, self.block, self.most_pieces = self._upper - self._lower, _BLOCK, _MOST_PIECES
        self._tilted = TiltedForm(form)
        self._equation = [each.is_equation for each in form.conditions]
        self._depends = np.array(form.dependence, dtype=bool)[1:]

    def show(self, claims: LimbClaims, done: Callable[[int], None] | None = None) -> int:
        """Show claims, bisecting boxes until each holds, and return the number of boxes evaluated.

        Args:
            claims: the claims.
            done: called with the number of claims that have been shown since the last call.

        Raises:
            ProofError: a claim could not be shown.
        """
        own = [np.repeat(ends[self._m :, None], claims.bounds.size, axis=1) for ends in (self._lower, self._upper)]
        self._claims = claims
        return show(self, np.concatenate([claims.lower, own[0]]), np.concatenate([claims.upper, own[1]]), done)

    def examine(self, lower: FloatArray, upper: FloatArray, of: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (n, N) of the claims with these numbers (N,)."""
        slopes, bound = self._tilted.slopes(lower, upper), self._claims.bounds[of]
        tilts = self._claims.tilts.select(of)
        holds, low, high = self._feasible_part(slopes)
        holds |= slopes.is_below(bound - tilts.total() * (1 + _SUMS))
        change = np.zeros_like(low)
        for model in [] if holds.all() else self._tilted.sums(slopes, tilts):
            holds |= slopes.defined & (model.bound() <= bound)
            change = np.fmax(change, model.change())
            above = bound - model.total - _SUMS * (np.abs(bound) + np.abs(model.total))
            usable = slopes.defined & np.isfinite(above)
            ends = cut_off(above, -model.slope_high, -model.slope_low, lower, upper)
            low = np.where(usable, np.fmax(low, ends[0]), low)
            high = np.where(usable, np.fmin(high, ends[1]), high)
        is_wrong = self._is_wrong(slopes, tilts, bound)
        holds |= (low > high).any(axis=0)
        low, high = self._collapsed(slopes, low, high)
        return Shown(holds, change, low, high, is_wrong)

    def _feasible_part(self, slopes: TiltedSlopes) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
        """Return whether a condition cannot hold (N,), and ends (n, N) of the part that no single one excludes."""
        low, high = slopes.lower, slopes.upper
        excluded = np.zeros(low.shape[1], dtype=bool)
        for each, is_equation in zip(slopes.conditions, self._equation, strict=True):
            excluded |= each.V[0] > 0
            ends = [cut_off(each.C[0], *each.S, slopes.lower, slopes.upper)]
            if is_equation:
                excluded |= each.V[1] < 0
                ends.append(cut_off(-each.C[1], -each.S[1], -each.S[0], slopes.lower, slopes.upper))
            for below, above in ends:
                low, high = np.fmax(low, below), np.fmin(high, above)
        return excluded, low, high

    def _collapsed(self, slopes: TiltedSlopes, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return boxes with ends (n, N) collapsed on faces of own variables along which the limb rises."""
        low, high = low.copy(), high.copy()
        for i in range(self._m, len(low)):
            up, down = slopes.rises_low[i] > 0, slopes.rises_high[i] < 0
            for r, (each, gradient) in enumerate(zip(slopes.conditions, slopes.d_conditions, strict=True)):
                if self._depends[r, i]:
                    free, falls = each.V[1] < 0, gradient[i].V
                    up &= free | ((falls[1] < 0) & (not self._equation[r]))
                    down &= free | ((falls[0] > 0) & (not self._equation[r]))
            low[i], high[i] = np.where(up, high[i], low[i]), np.where(down & ~up, low[i], high[i])
        return low, high

    def _is_wrong(self, slopes: TiltedSlopes, tilts: Tilts, bound: FloatArray) -> NDArray[np.bool_]:
        """Return whether the centre (N,) of a piece is a counterexample to its claim, by more than rounding."""
        m = self._m
        value, tilt = slopes.value_at_centre(), tilts.at(0.5 * (slopes.lower[:m] + slopes.upper[:m]))
        is_feasible = np.ones(value.size, dtype=bool)
        for each in slopes.conditions:
            is_feasible &= each.C[1] <= 0
        size = np.abs(value) + tilts.total() + np.where(np.isfinite(bound), np.abs(bound), 0.0)
        return is_feasible & (not any(self._equation)) & (value - tilt > bound + _WRONG * size)

    def sentence(self, claim: int) -> str:
        """Return the sentence that a claim could not be shown."""
        names, claims = self._form.names, self._claims
        ends = ", ".join(
            f"{name} in [{low:.6g}, {high:.6g}]"
            for name, low, high in zip(names, claims.lower[:, claim], claims.upper[:, claim], strict=False)
        )
        own = names[self._m :]
        of = f"the limb with {own[0]}" if own else "the sum of the limbs"
        return f"the bound of {of} could not be shown for the box {ends}"
