"""Points of a program from those of a form without some of its variables, which follow from the others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray

#: Difference of a variable from what replaces it, in radians and in parts of a slide's range, above which the point is
#: another solution of the loops. Where the two solutions meet, a point that keeps the loops to 1e-9 is so far off one.
_SAME = 1e-4


@dataclass(frozen=True, eq=False)
class Lift:
    """What replaces variables of a program in a form without them.

    Attributes:
        x: (n,) symbols of all variables.
        kept: places of the form's variables, in order.
        places: places of the variables that are replaced.
        values: (k, 1) expressions of the form's variables that replace them.
        is_angle: for each of them, whether whole turns make no difference.
        ranges: (k,) half range of each, in which differences of slides are measured.
        signs: (s, 1) expressions of all variables that are at most 0 where the joints hold together.
    """

    x: SX
    kept: tuple[int, ...]
    places: tuple[int, ...]
    values: SX
    is_angle: tuple[bool, ...]
    ranges: FloatArray
    signs: SX

    def variables(self, point: FloatArray) -> FloatArray:
        """Return all variables (n,) at a point (m,) of the form."""
        x = np.zeros(self.x.numel())
        x[list(self.kept)] = point
        x[list(self.places)] = np.array(self._values_at(point)).ravel()
        return x

    def point(self, x: FloatArray) -> FloatArray:
        """Return the form's variables (m,) of all variables (n,)."""
        return np.asarray(x, dtype=np.float64)[list(self.kept)]

    def holds(self, x: FloatArray) -> bool:
        """Return whether variables (n,) have the values that replace them, and joints that hold together."""
        index = list(self.places)
        apart = np.asarray(x, dtype=np.float64)[index] - self.variables(self.point(x))[index]
        turned = np.where(self.is_angle, np.abs(np.sin(apart / 2)), np.abs(apart / self.ranges))
        return bool(np.all(turned <= _SAME)) and bool(np.all(np.array(self._signs_at(x)) <= 0))

    @cached_property
    def _values_at(self) -> ca.Function:
        return ca.Function("values", [self.x[list(self.kept)]], [ca.densify(self.values)])

    @cached_property
    def _signs_at(self) -> ca.Function:
        return ca.Function("signs", [self.x], [ca.densify(self.signs)])
