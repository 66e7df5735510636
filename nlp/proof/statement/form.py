"""A program in standard form: functions, the least of which is maximised over a box, and conditions.

A form may lack variables of the program that follow from the others; its lift returns them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ...program.kernel import Kernel, single_output
from ...program.nlp import Nlp
from .piecewise_derivatives import without_ties

#: Difference of a variable from what replaces it, in radians and in parts of a slide's range, above which the point is
#: another solution of the loops. Where the two solutions meet, a point that keeps the loops to 1e-9 is so far off one.
_SAME = 1e-4


@dataclass(frozen=True, eq=False)
class Condition:
    """A condition ``expression <= 0``, or ``expression = 0``.

    Attributes:
        name: in the words of a case.
        expression: (1, 1).
        is_equation: whether it must be 0.
        follows: whether it follows from another one. It excludes boxes, and has no multiplier of its own.
    """

    name: str
    expression: SX
    is_equation: bool
    follows: bool = False


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
        x[list(self.places)] = self._values_at(point).ravel()
        return x

    def point(self, x: FloatArray) -> FloatArray:
        """Return the form's variables (m,) of all variables (n,)."""
        return np.asarray(x, dtype=np.float64)[list(self.kept)]

    def holds(self, x: FloatArray) -> bool:
        """Return whether variables (n,) have the values that replace them, and joints that hold together."""
        index = list(self.places)
        apart = np.asarray(x, dtype=np.float64)[index] - self.variables(self.point(x))[index]
        turned = np.where(self.is_angle, np.abs(np.sin(apart / 2)), np.abs(apart / self.ranges))
        return bool(np.all(turned <= _SAME)) and bool(np.all(self._signs_at(x) <= 0))

    @cached_property
    def _values_at(self) -> Kernel[FloatArray]:
        return _kernel(self.x[list(self.kept)], [self.values])

    @cached_property
    def _signs_at(self) -> Kernel[FloatArray]:
        return _kernel(self.x, [self.signs])


@dataclass(frozen=True, eq=False)
class StandardForm:
    """A maximisation over a box.

    Attributes:
        nlp: the program that it states.
        x: (n,) symbols.
        lower, upper: (n,) ends of the box.
        functions: ``phi_j``, the least of which is maximised.
        conditions: ``h_k``, with ``signs`` at the end; numbered after the functions where both are counted.
        sign: factor from the program's objective to the value that is maximised: -1 for a minimum.
        signs: conditions of a robot's assembly, which are no constraints of the program.
        has_epigraph: whether the program's last variable is an epigraph variable, which this form does not have.
        places: places of its variables in the program, where they are not the first ones.
        lift: what replaces variables of the program that this form does not have; None where it has them all.
    """

    nlp: Nlp
    x: SX
    lower: FloatArray
    upper: FloatArray
    functions: tuple[SX, ...]
    conditions: tuple[Condition, ...]
    signs: tuple[Condition, ...]
    sign: float
    has_epigraph: bool
    places: tuple[int, ...] | None = None
    lift: Lift | None = None

    @property
    def n(self) -> int:
        """Number of variables."""
        return int(self.x.numel())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        variables = self.nlp.program.variables
        return tuple(variables[i].name for i in (range(self.n) if self.places is None else self.places))

    @property
    def is_equation(self) -> tuple[bool, ...]:
        """Whether each of the R expressions must be 0; false for functions."""
        return (*(False for _ in self.functions), *(condition.is_equation for condition in self.conditions))

    @property
    def follows(self) -> tuple[bool, ...]:
        """Whether each of the R expressions is a condition that follows from others."""
        return (*(False for _ in self.functions), *(condition.follows for condition in self.conditions))

    @cached_property
    def expressions(self) -> SX:
        """(R, 1) functions, then conditions."""
        return ca.densify(ca.vertcat(*self.functions, *[condition.expression for condition in self.conditions]))

    @cached_property
    def jacobian(self) -> SX:
        """(R, n) derivatives, dense: structural zeros are written out."""
        return ca.densify(without_ties(ca.jacobian(self.expressions, self.x), self.x))

    @cached_property
    def dependence(self) -> list[list[bool]]:
        """(R, n) whether an expression depends on a variable."""
        pattern = ca.jacobian(self.expressions, self.x).sparsity()
        return [[bool(pattern.has_nz(r, i)) for i in range(self.n)] for r in range(self.expressions.numel())]

    def value_at(self, x: FloatArray) -> float:
        """Return the value that is maximised at a point (n,), as computed in doubles."""
        return float(np.min(self._functions_at(x)))

    def point_of(self, x: FloatArray) -> FloatArray:
        """Return the form's variables (n,) of those of the program (m,)."""
        point = np.asarray(x, dtype=np.float64)
        return point[: self.n] if self.lift is None else self.lift.point(point)

    def program_variables(self, point: FloatArray) -> FloatArray:
        """Return the program's variables (m,), an epigraph variable left out, at a point (n,) of the form."""
        return np.array(point, dtype=np.float64) if self.lift is None else self.lift.variables(point)

    def keeps_signs(self, x: FloatArray) -> bool:
        """Return whether the conditions of the assembly hold at a point (m,) of the program, as computed in doubles."""
        if self.lift is not None:
            return self.lift.holds(np.asarray(x)[: self.lift.x.numel()])
        return not self.signs or bool(np.all(self._signs_at(x[: self.n]) <= 0))

    @cached_property
    def _signs_at(self) -> Kernel[FloatArray]:
        return _kernel(self.x, [each.expression for each in self.signs])

    @cached_property
    def _functions_at(self) -> Kernel[FloatArray]:
        return _kernel(self.x, self.functions)


def _kernel(x: SX, expressions: Sequence[SX]) -> Kernel[FloatArray]:
    """Return expressions of x as a function of NumPy arrays."""
    return Kernel(ca.Function("values", [x], [ca.densify(ca.vertcat(*expressions))]), single_output)
