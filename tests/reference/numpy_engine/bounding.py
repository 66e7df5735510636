"""Examination of boxes with NumPy: bounds, impossible conditions, monotonicity, contraction, the next bisection.

Each box gets an upper bound of the maximised value over its feasible part, by the models of
:mod:`screwsynth.nlp.proof.enclosure.forms`. ``docs/certificate.md`` explains the formulas.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from screwsynth.models import FloatArray
from screwsynth.models.arrays import first_largest
from screwsynth.nlp.proof.boxes.engine import (
    COLLAPSED,
    UNMOVED,
    BoxState,
    Examination,
    objective_tape,
    search_tape,
    value_tape,
    without_conditions,
)
from screwsynth.nlp.proof.enclosure.squared_quotients import search_rows, tangent_rows
from screwsynth.nlp.proof.statement.standard_form import StandardForm

from .first_order import enclose
from .first_pass import LINEAR, Cuts, FirstPass, first_pass
from .intervals import ULP, Midpoints, midpoints
from .quadratic_models import GradientModel, QuadraticModel, gradient_model, multipliers
from .squared_quotients import with_quotients

#: Part of a side below which a contraction is not worth its leaf in a proof.
_WORTH = 0.1


@dataclass(eq=False)
class Remainder:
    """Parts of B boxes that are left, with the reasons for their ends and for closing a box; written to in place.

    The attributes are those of :class:`Examination`.
    """

    lower: FloatArray
    upper: FloatArray
    cut_lower: NDArray[np.int32]
    cut_upper: NDArray[np.int32]
    verdict: NDArray[np.int32]
    reason: NDArray[np.int32]

    @classmethod
    def whole(cls, lower: FloatArray, upper: FloatArray) -> Remainder:
        """Return whole boxes, all open."""
        cuts = np.full(lower.shape, UNMOVED, dtype=np.int32)
        open_boxes = np.zeros(lower.shape[1], dtype=np.int32)
        return cls(lower.copy(), upper.copy(), cuts, cuts.copy(), open_boxes, open_boxes.copy())

    def close(self, which: NDArray[np.bool_], verdict: BoxState, reason: int | NDArray[np.intp]) -> None:
        """Close some boxes for a reason."""
        self.verdict[which], self.reason[which] = verdict, reason


class NumpyEngine:
    """The reference engine: arithmetic on arrays with the boxes last.

    Args:
        form: the form whose box is searched.
        jobs: threads, which it has not.
        apart: whether N and D of the functions' squared quotients are enclosed, and not the quotients. The first pass
            over a box does without.
        tangents: whether the first pass has tangents to the squares of a minimum.
    """

    def __init__(
        self, form: StandardForm, jobs: int | None = None, *, apart: bool = False, tangents: bool = True
    ) -> None:
        del jobs
        self.form = form
        rows = search_rows(form, apart=apart)
        self._tape, self._quotients = search_tape(form, rows), rows.quotients
        squares = tangent_rows(form) if tangents else None
        self._values, self._squared = value_tape(form, squares), () if squares is None else squares.functions
        alone = self._values is not None and objective_tape(form, len(self._tape)) is not None
        self._objective = NumpyEngine(without_conditions(form)) if alone else None
        self.functions = len(form.functions)
        self.equation, self._follows = np.array(form.is_equation), np.array(form.follows)
        self.depends = np.array(form.dependence, dtype=bool)

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examination:
        """Examine boxes, and close those whose bounds do not exceed a threshold.

        Args:
            lower: (n, B) lower ends.
            upper: (n, B) upper ends.
            threshold: boxes whose bound is at most this are closed.
        """
        with np.errstate(all="ignore"):
            if self._values is None:
                return self._examine(lower, upper, threshold, Cuts.none(lower.shape))
            rows = self.equation, self._follows
            first = first_pass(self._values, rows, self.functions, lower, upper, threshold, self._squared)
            whole = Remainder.whole(lower, upper)
            result = Examination(
                verdict=first.verdict,
                reason=first.reason,
                bound=first.bound,
                lower=whole.lower,
                upper=whole.upper,
                cut_lower=whole.cut_lower,
                cut_upper=whole.cut_upper,
                split=np.zeros_like(first.reason),
                value=first.value,
                centre=midpoints(lower, upper).centre,
            )
            rest = np.flatnonzero(first.verdict == BoxState.OPEN)
            if self._objective is not None:
                rest = self._objective.examine_functions(first, result, rest, threshold)
            cuts, known = first.cuts.select(rest), first.bound[rest]
            _put(result, rest, self._examine(lower[:, rest], upper[:, rest], threshold, cuts, known))
        return result

    def examine_functions(
        self, first: FirstPass, result: Examination, rest: NDArray[np.intp], threshold: float
    ) -> NDArray[np.intp]:
        """Examine boxes by the functions alone, and return those whose conditions' gradients may decide.

        Those are the boxes in which every function rises, or falls, along a variable. This engine's form has no
        conditions.

        Args:
            first: the first pass over all boxes, conditions included.
            result: results of all boxes, written in place where these are examined; its ends are those of the boxes.
            rest: places of the boxes.
            threshold: as for :meth:`examine`.
        """
        lower, upper = result.lower[:, rest], result.upper[:, rest]
        model = self.model(lower, upper, midpoints(lower, upper).radius)
        rises, falls = (model.gradient_lo > 0).all(axis=0), (model.gradient_hi < 0).all(axis=0)
        defined = (model.value.s < np.inf).all(axis=0)
        more = defined & ((rises | falls) & (upper > lower)).any(axis=0)
        places = rest[~more]
        cuts, known, scores = first.cuts.select(places), first.bound[places], first.scores[:, places]
        ends = result.lower[:, places], result.upper[:, places]
        _put(result, places, self._examine(*ends, threshold, cuts, known, scores))
        return rest[more]

    def _examine(
        self,
        lower: FloatArray,
        upper: FloatArray,
        threshold: float,
        cuts: Cuts,
        known: FloatArray | float = np.inf,
        scores: FloatArray | None = None,
    ) -> Examination:
        """Examine boxes with cuts, bounds and scores (n, B) that are known; NumPy's warnings are off."""
        J = self.functions
        box = midpoints(lower, upper)
        model = self.model(lower, upper, box.radius)
        low, high = model.value.lo, model.value.hi
        middle, error = model.value.c, model.value.s
        defined = (error[:J] < np.inf).all(axis=0)
        bound = high[:J].min(axis=0)
        L = model.sum_model(self.multipliers(model, high))
        bound = np.fmin(np.where(defined, np.fmin(bound, L.bound()), np.inf), known)

        impossible, binding = self.states(low, high)
        left = self.collapse_monotone(model, binding, lower, upper)
        self.contract(model, L, left, box, threshold, cuts)
        some = np.asarray(impossible.any(axis=0))
        left.close(some, BoxState.INFEASIBLE, impossible.argmax(axis=0)[some])
        left.verdict[~defined & (left.verdict != BoxState.INFEASIBLE)] = BoxState.OPEN
        left.lower[:, ~defined], left.upper[:, ~defined] = lower[:, ~defined], upper[:, ~defined]
        left.cut_lower[:, ~defined] = left.cut_upper[:, ~defined] = UNMOVED
        left.close(bound <= threshold, BoxState.BOUNDED, 0)
        conditions_hold = (middle[J:] + error[J:] <= 0).all(axis=0)
        return Examination(
            verdict=left.verdict,
            reason=left.reason,
            bound=bound,
            lower=left.lower,
            upper=left.upper,
            cut_lower=left.cut_lower,
            cut_upper=left.cut_upper,
            split=self._split(L, lower, upper, left, scores),
            value=np.where(conditions_hold, (middle[:J] - error[:J]).min(axis=0), -np.inf),
            centre=box.centre,
        )

    def model(
        self, lower: FloatArray, upper: FloatArray, radius: FloatArray, least: FloatArray | None = None
    ) -> GradientModel:
        """Return the enclosures of the expressions and of their gradients over boxes, (n, B) each.

        The ends of gradients that are not scaled are for points whose values are at least ``least`` (B,).
        """
        rows = gradient_model(enclose(self._tape, lower, upper), radius)
        return with_quotients(rows, self._quotients, len(self.equation), radius, least)

    def multipliers(self, model: GradientModel, high: FloatArray, first: int = 0) -> FloatArray:
        """Return weights (R, B) of the Lagrangian: see :func:`.quadratic_models.multipliers`."""
        weighed = np.where(self._follows[:, None], -np.inf, high)
        return multipliers(model.b, model.s[:, first:], weighed, self.equation, self.functions, first)

    def states(self, low: FloatArray, high: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return whether expressions (R, B) are conditions that cannot hold, and whether they may bind."""
        impossible = (low > 0) | (self.equation[:, None] & (high < 0))
        impossible[: self.functions] = False
        binding = (~(high < 0)) & ~impossible
        binding[: self.functions] = False
        return impossible, binding

    def collapse_monotone(
        self, model: GradientModel, binding: NDArray[np.bool_], lower: FloatArray, upper: FloatArray, first: int = 0
    ) -> Remainder:
        """Close or collapse boxes in which every function rises along a variable and no condition stops a point.

        Such a point is no maximum, unless it lies on the face of the whole box. A condition stops it when it may bind
        and may grow in that direction; an equation always does, if it depends on the variable.
        """
        left = Remainder.whole(lower, upper)
        J = self.functions
        for i in range(first, self.form.n):
            width = upper[i] > lower[i]
            for side in (1, -1):
                g_lo, g_hi = model.gradient_lo[:, i], model.gradient_hi[:, i]
                if side > 0:
                    rises, falls = (g_lo[:J] > 0).all(axis=0), g_hi < 0
                else:
                    rises, falls = (g_hi[:J] < 0).all(axis=0), g_lo > 0
                stopped = binding & self.depends[:, i, None] & ~(falls & ~self.equation[:, None])
                applies = rises & ~stopped.any(axis=0) & width & (left.verdict == BoxState.OPEN)
                whole = self.form.upper[i] if side > 0 else self.form.lower[i]
                at_face = (upper[i] if side > 0 else lower[i]) == whole
                left.close(applies & ~at_face, BoxState.MONOTONE, i)
                collapsed = applies & at_face
                (left.lower if side > 0 else left.upper)[i, collapsed] = whole
                (left.cut_lower if side > 0 else left.cut_upper)[i, collapsed] = COLLAPSED
        return left

    def contract(
        self,
        model: GradientModel,
        L: QuadraticModel,
        left: Remainder,
        box: Midpoints,
        threshold: float,
        cuts: Cuts | None = None,
    ) -> None:
        """Move ends of boxes past points where a function is at most the threshold, or a condition cannot hold.

        Cuts that are known already are moved further, in place.
        """
        centre, radius = box
        J = self.functions
        cuts = Cuts.none(left.lower.shape) if cuts is None else cuts
        keep = cuts.keep
        for r in range(len(self.equation)):
            for sign in (1.0, -1.0):
                if (r < J and sign < 0) or (r >= J and sign > 0 and not self.equation[r]):
                    continue
                level = threshold if r < J else 0.0
                keep(model.expression_model(r, sign).ends_reaching(level), r)
        if len(self.equation) > 1:
            keep(L.ends_reaching(threshold), 0)
        e_lo, e_hi, why_lo, why_hi = cuts
        new_lo = centre + radius * e_lo
        new_lo -= (np.abs(centre) + radius) * (4 * ULP)
        new_hi = centre + radius * e_hi
        new_hi += (np.abs(centre) + radius) * (4 * ULP)
        worth = _WORTH * (left.upper - left.lower)
        unmoved = (left.cut_lower == UNMOVED) & (left.cut_upper == UNMOVED)
        moved = (why_lo >= 0) & unmoved & (new_lo - left.lower > worth)
        left.lower[moved], left.cut_lower[moved] = new_lo[moved], why_lo[moved]
        moved = (why_hi >= 0) & (left.cut_upper == UNMOVED) & (left.cut_lower != COLLAPSED)
        moved &= left.upper - new_hi > worth
        left.upper[moved], left.cut_upper[moved] = new_hi[moved], why_hi[moved]
        emptied = left.lower > left.upper
        which = np.asarray(emptied.any(axis=0))
        left.close(which, BoxState.EMPTIED, emptied.argmax(axis=0)[which])

    def _split(
        self,
        L: QuadraticModel,
        lower: FloatArray,
        upper: FloatArray,
        left: Remainder,
        scores: FloatArray | None,
    ) -> NDArray[np.int32]:
        """Return the variable (B,) along which the Lagrangian can change most on the part of the box that is left.

        With scores (n, B) these are the changes, apart from the model's remainder.
        """
        width = upper - lower
        part = (left.upper - left.lower) / np.where(width > 0, width, 1.0)
        score = LINEAR * np.abs(L.b) + np.abs(L.H).sum(axis=0) if scores is None else scores
        score = (score + L.w) * part
        relative = (left.upper - left.lower) / (self.form.upper - self.form.lower)[:, None]
        finite = np.isfinite(score).all(axis=0)
        score = np.where(finite, score, relative)
        # Where nothing changes, the longest side.
        score = np.where((score > 0).any(axis=0), score, relative)
        score[~(left.upper > left.lower)] = -1.0
        return first_largest(score.T).astype(np.int32)


def _put(result: Examination, places: NDArray[np.intp], found: Examination) -> None:
    """Write results of some boxes in place; values at centres are those of the first pass."""
    for name, values in vars(result).items():
        if name not in ("value", "centre"):
            values[..., places] = getattr(found, name)
