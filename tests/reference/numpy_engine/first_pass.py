"""First pass over boxes, by forms of second order of the expressions alone, without their gradients.

It closes a box by its bound or by a condition that cannot hold, and contracts the others. Only these go on to the forms
of the gradients in :mod:`.bounding`, which cost as much again and find variables along which a box is monotone. For any
weights the forms add up to a quadratic model of the Lagrangian with a constant remainder, the terms of third order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from screwsynth.models import FloatArray
from screwsynth.nlp.proof.boxes.engine import UNMOVED, BoxState
from screwsynth.nlp.proof.enclosure.forms import Ends
from screwsynth.nlp.proof.enclosure.tape import Tape

from .intervals import TINY, ULP
from .quadratic_models import QuadraticModel, multipliers
from .second_order import Forms, enclose_second, monomials
from .tangent_bounds import tangent_forms

#: Weight of the Lagrangian's linear part beside its curved part in the choice of the variable to bisect.
LINEAR = 0.3


class Cuts(NamedTuple):
    """Ends of boxes in parts of their radii, and numbers of the expressions that moved them, (n, B) each."""

    low: FloatArray
    high: FloatArray
    why_low: NDArray[np.int32]
    why_high: NDArray[np.int32]

    @classmethod
    def none(cls, shape: tuple[int, ...]) -> Cuts:
        """Return whole boxes."""
        why = np.full(shape, UNMOVED, dtype=np.int32)
        return cls(np.full(shape, -1.0), np.full(shape, 1.0), why, why.copy())

    def keep(self, part: Ends, r: int) -> None:
        """Move ends to tighter ones for the reason r, in place."""
        raised, lowered = part.low > self.low, part.high < self.high
        self.low[raised], self.high[lowered] = part.low[raised], part.high[lowered]
        self.why_low[raised], self.why_high[lowered] = r, r

    def put(self, which: NDArray[np.intp], other: Cuts) -> None:
        """Set those of some boxes, in place."""
        self.low[:, which], self.high[:, which] = other.low, other.high
        self.why_low[:, which], self.why_high[:, which] = other.why_low, other.why_high

    def select(self, which: NDArray[np.intp]) -> Cuts:
        """Return those of some boxes."""
        return Cuts(self.low[:, which], self.high[:, which], self.why_low[:, which], self.why_high[:, which])


class FirstPass(NamedTuple):
    """Results of the first pass over B boxes; the names are those of :class:`.examination.Examination`.

    ``scores`` (n, B) are changes of the Lagrangian along each variable.
    """

    verdict: NDArray[np.int32]
    reason: NDArray[np.int32]
    bound: FloatArray
    value: FloatArray
    cuts: Cuts
    scores: FloatArray


def first_pass(
    tape: Tape,
    kinds: tuple[NDArray[np.bool_], NDArray[np.bool_]],
    functions: int,
    lower: FloatArray,
    upper: FloatArray,
    threshold: float,
    squared: tuple[int, ...] = (),
) -> FirstPass:
    """Return the first pass over boxes.

    Args:
        tape: of the R expressions.
        kinds: (R,) whether each must be 0, and whether it follows from others and has no weight.
        functions: number J of the first expressions, which are functions.
        lower: (n, B) lower ends.
        upper: (n, B) upper ends.
        threshold: boxes whose bound is at most this are closed.
        squared: functions of the squares that tangents may replace, whose rows the tape has behind the expressions.
    """
    R, every = len(kinds[0]), enclose_second(tape, lower, upper)
    found = _pass(_some(every, slice(0, R)), kinds, functions, threshold, Cuts.none(lower.shape))
    if not squared:
        return found.result
    tangents = tangent_forms(_some(every, slice(R, None)), squared, functions)
    rest = np.flatnonzero((found.result.verdict == BoxState.OPEN) & tangents.usable)
    expressions, steep = _some(every, slice(functions, R)), tangents.forms
    forms = Forms(
        *(np.concatenate([getattr(part, name)[..., rest] for part in (steep, expressions)]) for name in vars(every))
    )
    first = found.result
    again = _pass(forms, kinds, functions, threshold, first.cuts.select(rest)).result
    first.bound[rest] = np.fmin(first.bound[rest], again.bound)
    first.verdict[rest], first.reason[rest] = again.verdict, again.reason
    first.cuts.put(rest, again.cuts)
    unknown = ~found.defined[rest]
    first.scores[:, rest[unknown]] = again.scores[:, unknown]
    return first


class _Passed(NamedTuple):
    """Results of a pass over B boxes, and whether every function is defined in each (B,)."""

    result: FirstPass
    defined: NDArray[np.bool_]


def _some(forms: Forms, rows: slice) -> Forms:
    """Return the forms of some rows."""
    return Forms(*(values[rows] for values in vars(forms).values()))


def _pass(
    forms: Forms, kinds: tuple[NDArray[np.bool_], NDArray[np.bool_]], functions: int, threshold: float, cuts: Cuts
) -> _Passed:
    """Return a pass over boxes with the forms of all expressions, and cuts that move further, in place."""
    J, n, (equation, follows) = functions, forms.a.shape[1], kinds
    matrices = _matrices(forms, n)
    size = np.abs(forms.c) + (forms.q - forms.p) + forms.s
    size = size + np.abs(forms.a).sum(axis=1) + np.abs(matrices).sum(axis=(1, 2))
    defined = np.asarray((forms.s[:J] < np.inf).all(axis=0))
    weighed = np.where(follows[:, None], -np.inf, forms.hi)
    L = _sum_model(forms, matrices, size, multipliers(forms.a, forms.s[:, None], weighed, equation, J))
    bound = np.where(defined, np.fmin(forms.hi[:J].min(axis=0), L.bound()), np.inf)
    impossible = (forms.lo > 0) | (equation[:, None] & (forms.hi < 0))
    impossible[:J] = False
    verdict = np.where(impossible.any(axis=0), BoxState.INFEASIBLE, BoxState.OPEN)
    is_bounded = bound <= threshold
    verdict = np.where(is_bounded, BoxState.BOUNDED, verdict).astype(np.int32)
    reason = np.where(is_bounded, 0, impossible.argmax(axis=0)).astype(np.int32)
    for r in range(len(equation)):
        for sign in (1.0, -1.0):
            if (r < J and sign > 0) or (r >= J and (sign < 0 or equation[r])):
                model = _expression_model(forms, matrices, size, r, sign)
                cuts.keep(_where(defined, model.ends_reaching(threshold if r < J else 0.0)), r)
    if len(equation) > 1:
        cuts.keep(_where(defined, L.ends_reaching(threshold)), 0)
    holds = (forms.c[J:] + forms.s[J:] <= 0).all(axis=0)
    value = np.where(holds, (forms.c[:J] - forms.s[:J]).min(axis=0), -np.inf)
    scores = LINEAR * np.abs(L.b) + np.abs(L.H).sum(axis=0)
    return _Passed(FirstPass(verdict, reason, bound, value, cuts, scores), defined)


def _where(usable: NDArray[np.bool_], ends: Ends) -> Ends:
    """Return ends where they may be used, whole boxes elsewhere."""
    return Ends(np.where(usable, ends.low, -1.0), np.where(usable, ends.high, 1.0))


def _matrices(forms: Forms, n: int) -> FloatArray:
    """Return the second derivatives (R, n, n, B) of the quadratic parts."""
    at = monomials(n)
    H = np.zeros((len(forms.c), n, n, forms.c.shape[1]))
    H[:, at.first, at.second] = forms.Q
    H[:, at.second, at.first] = np.where(at.is_square[:, None], 2 * forms.Q, forms.Q)
    return H


def _expression_model(forms: Forms, matrices: FloatArray, size: FloatArray, r: int, sign: float) -> QuadraticModel:
    """Return the upper model of ``sign`` times one expression."""
    middle = sign * forms.c[r] + forms.s[r] + (forms.q[r] if sign > 0 else -forms.p[r])
    return _model(middle, sign * forms.a[r], sign * matrices[r], size[r])


def _sum_model(forms: Forms, matrices: FloatArray, size: FloatArray, weights: FloatArray) -> QuadraticModel:
    """Return the upper model of a sum of all expressions with weights (R, B)."""
    used = weights != 0
    rest = np.where(weights > 0, forms.q, forms.p) * weights
    middle = np.where(used, forms.c * weights + (forms.s * np.abs(weights) + rest), 0.0).sum(axis=0)
    total = np.where(used, size * np.abs(weights), 0.0).sum(axis=0)
    b = np.where(used[:, None], forms.a * weights[:, None], 0.0).sum(axis=0)
    H = np.where(used[:, None, None], matrices * weights[:, None, None], 0.0).sum(axis=0)
    return _model(middle, b, H, total)


def _model(middle: FloatArray, b: FloatArray, H: FloatArray, size: FloatArray) -> QuadraticModel:
    """Return a model whose slope is that of the model itself, from its parts and the sizes (B,) of all its terms."""
    rounding = 64 * ULP * size + TINY
    across = np.abs(H).sum(axis=1)
    return QuadraticModel(middle, b, H, np.zeros_like(b), b - across - rounding, b + across + rounding, rounding)
