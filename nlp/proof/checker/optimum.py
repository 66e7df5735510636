"""Rules for claims about boxes of a form, by polynomials of second order: proofs of claims, and contraction of boxes.

A bound that is clearly wrong at the centre of a contracted box is refused at once, without many bisections. Centres are
evaluated in doubles, and count only where they exceed the bound by far more than rounding; no accepted claim depends on
them.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import casadi as ca
import numpy as np

from ..statement.standard_form import StandardForm
from .arithmetic import PolynomialArithmetic
from .bisection import Shown
from .polymodels import Forms, Tilts, forms_of, polynomial_sum, reaching_part, weights_of
from .polynomials import Polynomial, places
from .tree import FACES, Node

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Least and largest number of boxes that are evaluated at once, and largest number of coefficients of their values in
#: between: one NumPy call costs as much as a hundred boxes, and more coefficients do not fit into a cache.
_FEWEST, _MOST, _COEFFICIENTS = 128, 1024, 2**16
#: Distance from a claim that is more than rounding; relative for values above 1, otherwise absolute.
_CLEARLY = 1e-9


@dataclass(frozen=True, eq=False)
class Claims:
    """Claims of one kind about L boxes of a form.

    Attributes:
        form: the form.
        kind: ``BOUNDED``, ``INFEASIBLE``, ``MONOTONE`` or the kind of a face.
        index: index of the condition or variable that the kind names; 0 for a kind without condition or variable.
        lower, upper: (n, L) ends of the boxes.
        bounds: (L,) bounds of the value of the form minus its tilt; -inf for boxes without a feasible point.
        tilts: tilts of the claims about a limb, over the shared variables, which come first; None without tilts.
    """

    form: StandardForm
    kind: Node
    index: int
    lower: FloatArray
    upper: FloatArray
    bounds: FloatArray
    tilts: Tilts | None = None


class FormRule:
    """Base class of the rules that prove claims about boxes of a form, in the loop of the checker.

    Args:
        claims: the claims.
        form: form with the relevant functions and conditions.
    """

    most_pieces = 20_000

    def __init__(self, claims: Claims, form: StandardForm) -> None:
        self._claims, self._form, self._J, self._equation = claims, form, len(form.functions), form.is_equation
        self.width = form.upper - form.lower
        self.block = min(max(_COEFFICIENTS // places(form.n).total, _FEWEST), _MOST)

    def about(self, claims: Claims) -> Self:
        """Return the rule for further claims of the same kind about boxes of the same form."""
        other = copy.copy(self)
        other._claims = claims
        return other

    def sentence(self, claim: int) -> str:
        """Return the message for a claim that could not be proved."""
        claims, names = self._claims, self._form.names
        what = f"the objective is monotone in {names[claims.index]}"
        if claims.kind in (Node.BOUNDED, Node.INFEASIBLE):
            what = "the bound" if claims.kind == Node.BOUNDED else f"condition {claims.index} excludes every point"
        if claims.tilts is not None:
            names, own = names[: len(claims.tilts.g)], names[len(claims.tilts.g) :]
            what = f"the bound of {f'the limb with {own[0]}' if own else 'the sum of the limbs'}"
        ends = zip(names, claims.lower[:, claim], claims.upper[:, claim], strict=False)
        box = ", ".join(f"{name} in [{low:.6g}, {high:.6g}]" for name, low, high in ends)
        return f"could not be proved for the box {box}: {what}"

    def _use_conditions(
        self, shown: Shown, which: NDArray[np.intp], forms: Forms, lower: FloatArray, upper: FloatArray
    ) -> None:
        """Reduce some pieces to the parts that single conditions do not exclude; return their ends and forms.

        Without functions, a piece is proved where a condition excludes all of it.
        """
        for r in range(self._J, len(self._equation)):
            for sign in (-1.0, 1.0) if self._equation[r] else (-1.0,):
                if sign < 0 and not (forms.high[r] >= 0).any():
                    continue
                model = polynomial_sum(forms.only(r), np.full((1, which.size), sign))
                if not self._J:
                    shown.keep(which, model.bound() < 0, model.change())
                shown.cut(which, reaching_part(model, 0.0, lower[:, which], upper[:, which]))


class BoundRule(FormRule):
    """Rule for claims that no feasible point of a box has a value above a bound.

    The proof is one of three: a function is at most the bound, a condition is violated everywhere, or a weighted sum
    of both is at most the bound. The claim that a condition holds nowhere in a box uses the same rule with that
    condition only.

    The rest of a limb's box collapses on a face if the limb's part of the objective increases along a variable that
    only this limb has, and no condition stops a motion along this variable. Any feasible point above the bound could
    then move to that face, and remain feasible and above the bound. Tilts do not change this gradient, as they depend
    only on the shared variables. A tree over all variables states its faces.
    """

    def __init__(self, claims: Claims) -> None:
        form = claims.form
        if claims.kind == Node.INFEASIBLE:
            form = replace(form, functions=(), conditions=(form.conditions[claims.index - len(form.functions)],))
        super().__init__(claims, form)
        function = ca.Function("values", [form.x], [ca.cse(form.expressions)])
        self._arithmetic, self._at_centres = PolynomialArithmetic(function), function
        own = range(0) if claims.tilts is None else range(len(claims.tilts.g), form.n)
        self._slopes = _Slopes(form, own)
        self._gradient = PolynomialArithmetic(ca.Function("slopes", [form.x], [ca.cse(self._slopes.expressions)]))

    def examine(self, lower: FloatArray, upper: FloatArray, of: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (n, N); ``of`` (N,) has the index of the claim to which each piece belongs."""
        J, bound, values = self._J, self._claims.bounds[of], self._arithmetic(lower, upper)
        if self._claims.tilts is not None:
            values[0] = values[0] - self._claims.tilts.select(of).polynomial(lower, upper)
        forms = forms_of(values, lower, upper, self._form)
        defined = np.isfinite(forms.high[:J]).all(axis=0)
        holds = defined & (forms.high[:J].min(axis=0, initial=np.inf) <= bound)
        for low, high, is_equation in zip(forms.low[J:], forms.high[J:], self._equation[J:], strict=True):
            holds |= (low > 0) | (is_equation & (high < 0))
        shown = Shown(holds, np.zeros_like(lower), lower.copy(), upper.copy())
        left = np.flatnonzero(~holds & defined)
        forms = forms.select(left)
        if J:
            model = polynomial_sum(forms, weights_of(J, self._equation, forms))
            shown.keep(left, model.bound() <= bound[left], model.change())
            rest = np.flatnonzero(~shown.holds[left])
            left, forms = left[rest], forms.select(rest)
            shown.cut(left, reaching_part(model.select(rest), bound[left], lower[:, left], upper[:, left]))
        self._use_conditions(shown, left, forms, lower, upper)
        if self._slopes.stops:
            self._collapse(shown, left, forms)
        rest = np.flatnonzero(~shown.holds)
        shown.is_wrong = np.zeros(of.size, dtype=bool)
        shown.is_wrong[rest] = self._are_wrong(0.5 * shown.lower[:, rest] + 0.5 * shown.upper[:, rest], of[rest])
        return shown

    def _collapse(self, shown: Shown, which: NDArray[np.intp], forms: Forms) -> None:
        """Shrink pieces of boxes, in place, to the face where the limb's part of the objective is largest.

        Pieces shrink along each variable that only this limb has, if that part of the objective provably rises or
        falls.
        """
        left = np.flatnonzero((shown.lower[:, which] <= shown.upper[:, which]).all(axis=0))
        which, forms = which[left], forms.select(left)
        low, high = shown.lower[:, which], shown.upper[:, which]
        slopes = self._gradient(low, high)
        for i in self._slopes.stops:
            up, down = (self._slopes.rise(i, side, slopes, forms.high) for side in (1, -1))
            shown.lower[i, which] = np.where(up, high[i], low[i])
            shown.upper[i, which] = np.where(down & ~up, low[i], high[i])

    def _are_wrong(self, points: FloatArray, of: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return which points (n, K) are counterexamples of claims (K,), beyond rounding."""
        values, bound = self._at_centres(points).full(), self._claims.bounds[of]
        best = values[: self._J].min(axis=0, initial=np.inf)
        sizes = sum(np.where(np.isfinite(each), np.abs(each), 0.0) for each in (best, bound))
        if self._claims.tilts is not None:
            tilts = self._claims.tilts.select(of)
            best, sizes = best - tilts.at(points[: len(tilts.g)]), sizes + tilts.sizes()
        feasible = (values[self._J :] < -_CLEARLY).all(axis=0)
        return np.asarray(feasible & (best - bound > _CLEARLY * sizes) & (not any(self._equation)))


class _Slopes:
    """Derivatives along some variables: of a form's functions, and of the conditions that depend on the variable.

    Args:
        form: the form.
        variables: indices of the variables.

    Attributes:
        stops: indices of these conditions, for each variable.
        expressions: (E, 1) derivatives: for each variable, of the J functions and then of its conditions.
    """

    def __init__(self, form: StandardForm, variables: Sequence[int]) -> None:
        self._J, self._equation = len(form.functions), form.is_equation
        conditions = range(self._J, len(self._equation))
        self.stops = {i: [r for r in conditions if form.dependence[r][i]] for i in variables}
        entries = [(r, i) for i, stops in self.stops.items() for r in [*range(self._J), *stops]]
        self._at = {entry: k for k, entry in enumerate(entries)}
        self.expressions = ca.densify(ca.vertcat(*(form.jacobian[r, i] for r, i in entries)))

    def rise(self, i: int, side: int, slopes: Sequence[Polynomial], high: FloatArray) -> NDArray[np.bool_]:
        """Return where (N,) all functions increase towards a side, and no condition stops a point on its way.

        Args:
            i: index of the variable.
            side: 1 for the upper end of the variable, -1 for the lower one.
            slopes: derivatives over the boxes.
            high: (R, N) upper bounds of functions and conditions.
        """

        def grows(r: int, way: int) -> NDArray[np.bool_]:
            V = slopes[self._at[r, i]].V
            return np.asarray(V[0] > 0 if way > 0 else V[1] < 0)

        found = np.ones(high.shape[1], dtype=bool)
        for r in range(self._J):
            found &= grows(r, side)
        for r in self.stops[i]:
            found &= (high[r] < 0) | (grows(r, -side) & (not self._equation[r]))
        return found


class MonotoneRule(FormRule):
    """Rule for claims that no maximum lies in a box.

    Every function rises along a variable, and no condition stops a point that moves along this variable. ``MONOTONE``
    requires this in both directions, and room beyond the box; a face requires one direction.
    """

    def __init__(self, claims: Claims) -> None:
        form = claims.form
        super().__init__(claims, form)
        self._i, self._slopes = claims.index, _Slopes(form, [claims.index])
        self._sides = {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(claims.kind, (1, -1))
        both = ca.cse([form.expressions, self._slopes.expressions])
        self._arithmetic = PolynomialArithmetic(ca.Function("both", [form.x], both))

    def examine(self, lower: FloatArray, upper: FloatArray, _: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (n, N)."""
        form, i, R = self._form, self._i, len(self._equation)
        both = self._arithmetic(lower, upper)
        values, holds = forms_of(both[:R], lower, upper, form), np.zeros(lower.shape[1], dtype=bool)
        for side in self._sides:
            rises = self._slopes.rise(i, side, both[R:], values.high)
            if self._claims.kind not in FACES:
                rises &= (upper[i] < form.upper[i]) if side > 0 else (lower[i] > form.lower[i])
            holds |= rises
        shown, left = Shown(holds, np.zeros_like(lower), lower.copy(), upper.copy()), np.flatnonzero(~holds)
        self._use_conditions(shown, left, values.select(left), lower, upper)
        return shown


def rule_of(claims: Claims) -> BoundRule | MonotoneRule:
    """Return the rule that proves claims of their kind."""
    return BoundRule(claims) if claims.kind in (Node.BOUNDED, Node.INFEASIBLE) else MonotoneRule(claims)
