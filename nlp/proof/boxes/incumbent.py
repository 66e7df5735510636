"""The incumbent of a search: the best feasible point known, of the whole box or of limbs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ....models import FloatArray
from ...errors import InputError
from ...evidence.kkt import FEASIBLE, Linearisation, close_equations, correct_point, linearise
from ...evidence.state import loops_are_closed
from ...interruption import is_requested
from ...program.sampling import starting_points
from ..statement.limb_separation import Limb
from ..statement.standard_form import StandardForm

#: Difference allowed between a claimed value and the one computed there, in parts of the objective's scale.
_SAME_VALUE = 1e-9
#: Points that are tried when none is given.
_POINTS = 8
#: Improvement, in parts of the objective's scale, from which on a new point counts as better than the one given.
_BETTER = 1e-9
#: The same for points that a search finds by itself, of which the first one is kept: rounding of the objective.
_TIE = 1e-13


class IncumbentError(InputError):
    """The point that was given is not feasible, or does not have the value claimed."""


class _Point(NamedTuple):
    """A point (n,) and its value; None and -inf without one."""

    x: FloatArray | None
    value: float


class Incumbent:
    """The best feasible point known, and its value in the standard form.

    Args:
        form: the form whose box is searched.
    """

    def __init__(self, form: StandardForm) -> None:
        self._form, self._best, self._given = form, _Point(None, -math.inf), math.nan
        # The last known part (d,) of each limb while there is no point, by the places of its variables.
        self._parts: dict[tuple[int, ...], FloatArray] = {}

    @property
    def x(self) -> FloatArray | None:
        """(n,) the point in the form's variables; None without one."""
        return self._best.x

    @property
    def value(self) -> float:
        """Value of the form there; -inf without a point."""
        return self._best.value

    @property
    def was_beaten(self) -> bool:
        """Whether the search has found a better point than the one given."""
        return self.value > self._given + _BETTER * self._form.size

    def program_point(self) -> FloatArray | None:
        """Return the point (n,) in the program's variables; None without one."""
        return None if self.x is None else self._with_level(self.x, self.value)

    def start(self, x: FloatArray | None, claimed: float | None) -> None:
        """Begin with a given point, or with the best of a few.

        Args:
            x: (n,) in the program's variables, or None.
            claimed: the objective claimed there.

        Raises:
            IncumbentError: the point violates a limit, or has a worse value.
        """
        form, nlp = self._form, self._form.nlp
        if x is None:
            for point in starting_points(nlp, _POINTS, seed=0):
                if is_requested():
                    return
                self.improve_near(form.point_of(point))
            return
        point = form.point_of(x)
        value = form.value_at(point)
        violation = self._violation(point, value)
        if not violation <= FEASIBLE:
            raise IncumbentError(f"the incumbent lies outside of the limits by {violation:.3g} half ranges")
        if claimed is not None and form.value_of(claimed) > value + _SAME_VALUE * form.size:
            raise IncumbentError(
                f"the incumbent is said to have F = {claimed:.10g}, but has {form.objective_of(value):.10g}"
            )
        self._best, self._given = _Point(point, value), value

    def consider(self, point: FloatArray) -> None:
        """Keep a point (n,) if it is feasible and better; likewise the points that Newton's method reaches from it."""
        if self._form.nlp.sides.equal.any():  # else the point is that at which equations hold
            self._keep_if_better(point)
        self.improve_near(point)

    def improve_near(self, point: FloatArray) -> None:
        """Correct a point (n,) onto the limits and towards an optimum, and keep the result if it is better."""
        nlp = self._form.nlp
        value = self._form.value_at(point)
        if not math.isfinite(value):
            return
        whole = close_equations(nlp, self._with_level(point, value))
        at = linearise(nlp, whole)
        if not math.isfinite(at.violation):
            return
        self._keep_if_better(self._form.point_of(whole), at)
        corrected = correct_point(nlp, whole, at.active())
        self._keep_if_better(self._form.point_of(np.clip(corrected.x, nlp.lower, nlp.upper)), corrected)

    def _with_level(self, point: FloatArray, value: float) -> FloatArray:
        """Return the point with the program's epigraph variable, where it has one."""
        variables = self._form.program_variables(point)
        if self._form.nlp.program.places.epigraph is None:
            return variables
        nlp = self._form.nlp
        return np.append(variables, np.clip(self._form.objective_of(value), nlp.lower[-1], nlp.upper[-1]))

    def _violation(self, point: FloatArray, value: float, known: Linearisation | None = None) -> float:
        """Return the largest violation of the program's limits, in half ranges; infinite where loops are open.

        The program has independent loop equations only, which other ways to assemble the joints fulfil too.
        """
        nlp, whole = self._form.nlp, self._with_level(point, value)
        if not self._form.keeps_signs(whole):
            return math.inf
        at = known if known is not None and np.array_equal(known.x, whole) else linearise(nlp, whole)
        violation = at.violation
        return violation if violation > FEASIBLE or loops_are_closed(nlp, whole) else math.inf

    def _keep_if_better(self, point: FloatArray, known: Linearisation | None = None) -> None:
        """Keep a point if it is feasible and better; the program linearised there may be known."""
        value = self._form.value_at(point)
        # Rounding chooses none of several points with the same value.
        better = value > self.value + _TIE * self._form.size
        if better and self._violation(point, value, known) <= FEASIBLE:
            self._best = _Point(np.array(point), value)

    def with_part(self, limbs: Sequence[Limb], part: FloatArray) -> FloatArray | None:
        """Return the point with another part (d,) of limbs; without one the limbs' parts, once there is one of each."""
        given, whole = {each.own: part for each in limbs}, self.x
        if whole is None:
            self._parts |= given
            given, whole = self._parts, np.full(self._form.n, np.nan)
        whole = whole.copy()
        for places, own in given.items():
            whole[list(places)] = own
        return whole if np.isfinite(whole).all() else None


class LimbPoint:
    """The part of the incumbent that belongs to one limb, or to its copies too.

    Args:
        limbs: the limb and its copies.
        whole: the incumbent, which a better part improves.
    """

    def __init__(self, limbs: Sequence[Limb], whole: Incumbent) -> None:
        self._limbs, self._whole = limbs, whole
        self._at: FloatArray | None = None
        self._value = -math.inf

    @property
    def value(self) -> float:
        """Value of the limb at the incumbent, the mean where it has copies; -inf without one."""
        at = self._whole.x
        if at is not self._at and at is not None:
            values = [each.form.value_at(at[list(each.own)]) for each in self._limbs]
            # The point last: an interrupt before it leaves the value to be computed again.
            self._value = math.fsum(values) / len(values)
            self._at = at
        return self._value

    def consider(self, point: FloatArray) -> None:
        """Improve the incumbent by a part (d,) of it, if that is feasible and better."""
        whole = self._whole.with_part(self._limbs, point)
        if whole is not None:
            self._whole.consider(whole)

    def improve_near(self, point: FloatArray) -> None:
        """Improve the incumbent from a part (d,) of it that is not feasible yet."""
        whole = self._whole.with_part(self._limbs, point)
        if whole is not None:
            self._whole.improve_near(whole)
