"""A program in standard form: functions, the least of which is maximised over a box, and conditions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ...program.nlp import Nlp
from .lift import Lift
from .piecewise_derivatives import without_ties


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
        return float(np.min(np.array(self._functions_at(x))))

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
        return not self.signs or bool(np.all(np.array(self._signs_at(x[: self.n])) <= 0))

    @cached_property
    def _signs_at(self) -> ca.Function:
        return ca.Function("signs", [self.x], [ca.densify(ca.vertcat(*[each.expression for each in self.signs]))])

    @cached_property
    def _functions_at(self) -> ca.Function:
        return ca.Function("functions", [self.x], [ca.densify(ca.vertcat(*self.functions))])
