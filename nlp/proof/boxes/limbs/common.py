"""The part of a form in the variables that its limbs share: enclosures, conditions, and multipliers for any tilt."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...enclosure.forms import enclose, midpoints
from ...enclosure.quadratic_models import GradientModel, gradient_model, multipliers
from ..tapes import search_tape

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray
    from ...statement.standard_form import StandardForm


class CommonPart:
    """The common part of limbs.

    Args:
        form: its function, the first row, and the common conditions.
    """

    def __init__(self, form: StandardForm) -> None:
        self._tape, self._functions = search_tape(form), len(form.functions)
        self._equation, self._follows = np.array(form.is_equation), np.array(form.follows)

    def model(self, lower: FloatArray, upper: FloatArray) -> GradientModel:
        """Return the enclosures of the expressions and of their gradients over boxes, (n, B) each."""
        return gradient_model(enclose(self._tape, lower, upper), midpoints(lower, upper).radius)

    def multipliers(self, gradients: FloatArray, rounding: FloatArray, high: FloatArray) -> FloatArray:
        """Return weights (R, B) of the Lagrangian for gradients (R, n, B) with these rounding errors."""
        weighed = np.where(self._follows[:, None], -np.inf, high)
        return multipliers(gradients, rounding, weighed, self._equation, self._functions)

    def states(self, low: FloatArray, high: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return whether expressions (R, B) are conditions that cannot hold, and whether they may bind."""
        impossible = (low > 0) | (self._equation[:, None] & (high < 0))
        impossible[: self._functions] = False
        binding = (~(high < 0)) & ~impossible
        binding[: self._functions] = False
        return impossible, binding
