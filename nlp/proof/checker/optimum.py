"""Claims about boxes shown by polynomials of second order: what holds, and what part of each box is left."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ..statement.standard_form import StandardForm
from .bisection import Shown
from .polymodels import Forms, forms_of, polynomial_sum, reaching_part
from .polynomialrules import PolynomialArithmetic
from .polynomials import places
from .slopeweights import weights_of
from .tree import Node

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Least and largest number of boxes that are evaluated at once, and largest number of coefficients of a value over them
#: in between: a call of NumPy costs as much as a hundred boxes, and more coefficients do not fit in a cache.
_FEWEST, _MOST, _COEFFICIENTS = 128, 1024, 2**16


def boxes_at_once(n: int) -> int:
    """Return the number of boxes of n variables that are best evaluated at once."""
    return min(max(_COEFFICIENTS // places(n).total, _FEWEST), _MOST)


class BoundClaim:
    """Claims that no feasible point of a box has a value above a bound.

    Args:
        form: the form.
        bound: the bound.
    """

    def __init__(self, form: StandardForm, bound: float) -> None:
        self._form, self._bound, self._functions = form, bound, len(form.functions)
        self._arithmetic = PolynomialArithmetic(ca.Function("values", [form.x], [ca.cse(form.expressions)]))

    def show(self, lower: FloatArray, upper: FloatArray) -> Shown:
        """Show the claim on boxes with ends (n, N).

        A function is at most the bound, or a condition cannot hold, or a weighted sum of all is at most the bound.
        """
        J, equation = self._functions, self._form.is_equation
        forms = forms_of(self._arithmetic(lower, upper), lower, upper, self._form)
        defined = np.isfinite(forms.high[:J]).all(axis=0)
        holds = defined & (forms.high[:J].min(axis=0) <= self._bound)
        for low, high, is_equation in zip(forms.low[J:], forms.high[J:], equation[J:], strict=True):
            holds |= (low > 0) | (is_equation & (high < 0))
        shown = Shown(holds, np.zeros_like(lower), lower.copy(), upper.copy())
        left = np.flatnonzero(~holds & defined)
        if not left.size:
            return shown
        forms = forms.select(left)
        models = []
        for weights in weights_of(J, equation, forms.centres(), forms.high, forms.gradients()):
            model = polynomial_sum(forms, weights)
            shown.keep(left, model.bound() <= self._bound, model.change())
            models.append(model)
        rest = np.flatnonzero(~shown.holds[left])
        if rest.size:
            which = left[rest]
            for model in models:
                few = model.select(rest)
                shown.cut(which, reaching_part(few, self._bound, lower[:, which], upper[:, which]))
            _cut_by_conditions(shown, which, forms.select(rest), J, equation, lower, upper)
        return shown


def _cut_by_conditions(
    shown: Shown,
    which: NDArray[np.intp],
    forms: Forms,
    first: int,
    equation: tuple[bool, ...],
    lower: FloatArray,
    upper: FloatArray,
) -> None:
    """Leave only parts of boxes where no single condition excludes a point."""
    for r in range(first, len(equation)):
        for sign in (-1.0, 1.0) if equation[r] else (-1.0,):
            if sign < 0 and not (forms.high[r] >= 0).any():
                continue
            model = polynomial_sum(forms.only(r), np.full((1, which.size), sign))
            shown.cut(which, reaching_part(model, 0.0, lower[:, which], upper[:, which]))


class InfeasibleClaim:
    """Claims that a condition is positive on a box; for an equation, positive or negative.

    Args:
        form: the form.
        r: number of the condition, counted after the functions.
    """

    def __init__(self, form: StandardForm, r: int) -> None:
        self._form, self._is_equation = form, form.is_equation[r]
        self._arithmetic = PolynomialArithmetic(ca.Function("values", [form.x], [ca.cse(form.expressions[r])]))

    def show(self, lower: FloatArray, upper: FloatArray) -> Shown:
        """Show the claim on boxes with ends (n, N)."""
        forms = forms_of(self._arithmetic(lower, upper), lower, upper, self._form)
        holds = forms.low[0] > 0
        if self._is_equation:
            holds |= forms.high[0] < 0
        shown = Shown(holds, np.zeros_like(lower), lower.copy(), upper.copy())
        left = np.flatnonzero(~holds)
        if left.size:
            forms = forms.select(left)
            for sign in (-1.0, 1.0) if self._is_equation else (-1.0,):
                model = polynomial_sum(forms, np.full((1, left.size), sign))
                shown.keep(left, model.bound() < 0, model.change())
                shown.cut(left, reaching_part(model, 0.0, lower[:, left], upper[:, left]))
        return shown


class MonotoneClaim:
    """Claims that no maximum lies in a box, since every function rises along a variable and no condition stops a point.

    Args:
        form: the form.
        kind: ``MONOTONE``, for either direction, or a face's kind for one.
        i: the variable.
    """

    def __init__(self, form: StandardForm, kind: Node, i: int) -> None:
        self._form, self._kind, self._i = form, kind, i
        J, R = len(form.functions), form.expressions.numel()
        self._stops = [r for r in range(J, R) if form.dependence[r][i]]
        slopes = ca.vertcat(*(form.jacobian[r, i] for r in [*range(J), *self._stops]))
        self._arithmetic = PolynomialArithmetic(
            ca.Function("slopes", [form.x], ca.cse([form.expressions, ca.densify(slopes)]))
        )

    def show(self, lower: FloatArray, upper: FloatArray) -> Shown:
        """Show the claim on boxes with ends (n, N)."""
        form, i = self._form, self._i
        J, R, boxes = len(form.functions), form.expressions.numel(), lower.shape[1]
        both = self._arithmetic(lower, upper)
        values, slopes = (forms_of(some, lower, upper, form) for some in (both[:R], both[R:]))
        holds = np.zeros(boxes, dtype=bool)
        change = _steepness(slopes, range(J))
        for side in {Node.FACE_UPPER: (1,), Node.FACE_LOWER: (-1,)}.get(self._kind, (1, -1)):
            ends = slopes.low if side > 0 else -slopes.high
            rises = (ends[:J] > 0).all(axis=0)
            for k, r in enumerate(self._stops, start=J):
                free = values.high[r] < 0
                if not form.is_equation[r]:
                    falls = slopes.high[k] < 0 if side > 0 else slopes.low[k] > 0
                    free |= falls
                # The functions rise, and this condition may stop a point: it decides where to cut.
                change = np.where(rises & ~free, _steepness(values, [r]), change)
                rises &= free
            if self._kind == Node.MONOTONE:
                rises &= (upper[i] < form.upper[i]) if side > 0 else (lower[i] > form.lower[i])
            holds |= rises
        shown = Shown(holds, change, lower.copy(), upper.copy())
        left = np.flatnonzero(~holds)
        if left.size:
            _cut_by_conditions(shown, left, values.select(left), J, form.is_equation, lower, upper)
        return shown


def _steepness(forms: Forms, which: range | list[int]) -> FloatArray:
    """Return the largest sizes (n, N) of the slopes of some forms along each variable, times the radius."""
    steep = np.zeros_like(forms.share)
    for r in which:
        model = polynomial_sum(forms.only(r), np.ones((1, steep.shape[1])))
        steep = np.fmax(steep, np.fmax(np.abs(model.slope_low), np.abs(model.slope_high)))
    return steep
