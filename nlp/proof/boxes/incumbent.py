"""Incumbent of a search: the best known feasible point of the whole form, or of one limb."""

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

#: Largest difference between a claimed and a computed value, relative to the objective's scale.
_SAME_VALUE = 1e-9
#: Number of points that are tried if none is given.
_POINTS = 8
#: Improvement, relative to the objective's scale, from which a new point counts as better than the given point.
_BETTER = 1e-9
#: The same improvement between two points of a search. Smaller differences are rounding errors, and the first point is
#: kept.
_TIE = 1e-13


class IncumbentError(InputError):
    """Error of a given point that is infeasible or does not have the claimed value."""


class _Point(NamedTuple):
    """A point (n,) and its value; None and -inf without a point."""

    x: FloatArray | None
    value: float


class Incumbent:
    """Best known feasible point, and its value in the standard form.

    Args:
        form: form of the search.
    """

    def __init__(self, form: StandardForm) -> None:
        self._form, self._best, self._given = form, _Point(None, -math.inf), math.nan
        # Last known part (d,) of each limb by the indices of its variables, as long as there is no incumbent.
        self._parts: dict[tuple[int, ...], FloatArray] = {}

    @property
    def x(self) -> FloatArray | None:
        """Point (n,) in the form's variables; None without a point."""
        return self._best.x

    @property
    def value(self) -> float:
        """Maximised value at the point; -inf without a point."""
        return self._best.value

    @property
    def was_beaten(self) -> bool:
        """Whether the search found a better point than the given point."""
        return self.value > self._given + _BETTER * self._form.size

    def program_point(self) -> FloatArray | None:
        """Return the point (n,) in the program's variables; None without a point."""
        return None if self.x is None else self._with_level(self.x, self.value)

    def start(self, x: FloatArray | None, claimed: float | None) -> None:
        """Set the first incumbent: a given point, or the best of a few points.

        Args:
            x: (n,) point in the program's variables; None if no point is given.
            claimed: claimed objective at the given point; None without a claim.

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
            raise IncumbentError(
                f"the given point violates the limits by up to {violation:.3g}, "
                "with each variable scaled to half its range"
            )
        if claimed is not None and form.value_of(claimed) > value + _SAME_VALUE * form.size:
            raise IncumbentError(
                f"the given point has F = {form.objective_of(value):.10g}, but {claimed:.10g} was claimed"
            )
        self._best, self._given = _Point(point, value), value

    def consider(self, point: FloatArray) -> None:
        """Keep a point (n,) if it is feasible and better than the incumbent.

        Newton's method from this point gives further candidates.
        """
        if self._form.nlp.sides.equal.any():  # without equations, only the corrected point is tested
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
        """Return the point with the program's epigraph variable, if the program has one."""
        variables = self._form.program_variables(point)
        if self._form.nlp.program.places.epigraph is None:
            return variables
        nlp = self._form.nlp
        return np.append(variables, np.clip(self._form.objective_of(value), nlp.lower[-1], nlp.upper[-1]))

    def _violation(self, point: FloatArray, value: float, known: Linearisation | None = None) -> float:
        """Return the largest violation of the program's limits, in half ranges; infinite with open loops.

        The program has only independent loop equations. Joints in another assembly mode may satisfy these too.
        """
        nlp, whole = self._form.nlp, self._with_level(point, value)
        if not self._form.keeps_signs(whole):
            return math.inf
        at = known if known is not None and np.array_equal(known.x, whole) else linearise(nlp, whole)
        violation = at.violation
        return violation if violation > FEASIBLE or loops_are_closed(nlp, whole) else math.inf

    def _keep_if_better(self, point: FloatArray, known: Linearisation | None = None) -> None:
        """Keep a point if it is feasible and better; ``known`` is the linearised program at the point, if available."""
        value = self._form.value_at(point)
        # Rounding errors must not select among points with the same value.
        better = value > self.value + _TIE * self._form.size
        if better and self._violation(point, value, known) <= FEASIBLE:
            self._best = _Point(np.array(point), value)

    def with_part(self, limbs: Sequence[Limb], part: FloatArray) -> FloatArray | None:
        """Return the incumbent with new values (d,) of the variables of a limb and of its copies.

        Without an incumbent, combine the points of all limbs once these are known.
        """
        given, whole = {each.own: part for each in limbs}, self.x
        if whole is None:
            self._parts |= given
            given, whole = self._parts, np.full(self._form.n, np.nan)
        whole = whole.copy()
        for places, own in given.items():
            whole[list(places)] = own
        return whole if np.isfinite(whole).all() else None


class LimbPoint:
    """Variables of one limb and its copies in the incumbent.

    Args:
        limbs: the limb and its copies.
        whole: incumbent of the whole form, which a better point of the limb improves.
    """

    def __init__(self, limbs: Sequence[Limb], whole: Incumbent) -> None:
        self._limbs, self._whole = limbs, whole
        self._at: FloatArray | None = None
        self._value = -math.inf

    @property
    def value(self) -> float:
        """Value of the limb at the incumbent (the mean over its copies); -inf without an incumbent."""
        at = self._whole.x
        if at is not self._at and at is not None:
            values = [each.form.value_at(at[list(each.own)]) for each in self._limbs]
            # The point is set last: after an interrupt before it, the value is computed again.
            self._value = math.fsum(values) / len(values)
            self._at = at
        return self._value

    def consider(self, point: FloatArray) -> None:
        """Improve the incumbent by a point (d,) of the limb if the result is feasible and better."""
        whole = self._whole.with_part(self._limbs, point)
        if whole is not None:
            self._whole.consider(whole)

    def improve_near(self, point: FloatArray) -> None:
        """Improve the incumbent from a point (d,) of the limb that need not be feasible."""
        whole = self._whole.with_part(self._limbs, point)
        if whole is not None:
            self._whole.improve_near(whole)
