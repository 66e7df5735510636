"""The best point that a search of the whole box knows."""

from __future__ import annotations

import math

import numpy as np

from ...models import FloatArray
from ..errors import InputError
from ..evidence.kkt import FEASIBLE, close_equations, correct_point, linearise
from ..program.sampling import starting_points
from .standardform import StandardForm

#: A value that is claimed for a point may differ from what the program computes there by this part of its scale.
_SAME_VALUE = 1e-9
#: Points that are tried when none is given.
_TRIED = 8
#: A new point must be better by this part of the objective's scale to count as having beaten the one that was given.
_BETTER = 1e-9


class IncumbentError(InputError):
    """The incumbent that was given is not what it is said to be."""


class Incumbent:
    """The best feasible point known, and its value in the standard form.

    Args:
        form: what is searched.
    """

    def __init__(self, form: StandardForm) -> None:
        self._form = form
        self.x: FloatArray | None = None
        self.value = -math.inf
        self._given = math.nan

    @property
    def was_beaten(self) -> bool:
        """Whether a better point than the given one was met."""
        return self.value > self._given + _BETTER * self._form.nlp.objective_scale

    def full(self) -> FloatArray:
        """(n,) the point in the program's variables."""
        return self._whole(np.zeros(self._form.n) if self.x is None else self.x, self.value)

    def start(self, x: FloatArray | None, claimed: float | None) -> None:
        """Begin with a point that was given, or with the best of a few.

        Args:
            x: (n,) in the program's variables, or None.
            claimed: the objective that is claimed there.

        Raises:
            IncumbentError: it lies outside of a limit, or has another value.
        """
        form, nlp = self._form, self._form.nlp
        if x is None:
            for point in starting_points(nlp, _TRIED, seed=0):
                self.look_near(point[: form.n])
            return
        point = np.asarray(x, dtype=np.float64)[: form.n]
        value = form.level_of(point)
        violation = self._violation(point, value)
        if not violation <= FEASIBLE:
            raise IncumbentError(f"the incumbent lies outside of the limits by {violation:.3g} half ranges")
        if claimed is not None and form.sign * claimed > value + _SAME_VALUE * nlp.objective_scale:
            raise IncumbentError(f"the incumbent is said to have F = {claimed:.10g}, but has {form.sign * value:.10g}")
        self.x, self.value, self._given = point, value, value

    def take(self, point: FloatArray) -> None:
        """Take a feasible point (n,) that was met, and what Newton's method makes of it."""
        self._offer(point)
        self.look_near(point)

    def look_near(self, point: FloatArray) -> None:
        """Correct a point onto the limits and towards an optimum; keep what is better."""
        nlp = self._form.nlp
        value = self._form.level_of(point)
        if not math.isfinite(value):
            return
        whole = close_equations(nlp, self._whole(point, value))
        at = linearise(nlp, whole)
        if not math.isfinite(at.violation):
            return
        self._offer(whole[: self._form.n])
        corrected = correct_point(nlp, whole, at.active())
        self._offer(np.clip(corrected.x, nlp.lower, nlp.upper)[: self._form.n])

    def _whole(self, point: FloatArray, value: float) -> FloatArray:
        """The point with the level of a worst case, where the program has one."""
        if not self._form.has_level:
            return np.array(point)
        nlp = self._form.nlp
        return np.append(point, np.clip(self._form.sign * value, nlp.lower[-1], nlp.upper[-1]))

    def _violation(self, point: FloatArray, value: float) -> float:
        return linearise(self._form.nlp, self._whole(point, value)).violation

    def _offer(self, point: FloatArray) -> None:
        value = self._form.level_of(point)
        if value > self.value and self._violation(point, value) <= FEASIBLE:
            self.x, self.value = np.array(point), value
