"""A program in the form that a search of the whole box reads: maximise the least of some functions, under rows.

    maximise  min_j phi_j(x)   over  lower <= x <= upper,   h_k(x) <= 0 or h_k(x) = 0

A minimum becomes a maximum of ``-F``. The worst case of several tasks, which the program states by a variable ``level``
and one constraint for each task, is taken back to what it means: the least of the tasks' own functions. The program's
arguments are put in as the doubles that they are, so what is proved is about this graph.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, frozen_array
from ..program.nlp import Nlp


@dataclass(frozen=True, eq=False)
class Condition:
    """A condition ``expression <= 0``, or ``expression = 0``."""

    name: str
    expression: SX
    is_equation: bool


@dataclass(frozen=True, eq=False)
class StandardForm:
    """A maximisation over a box.

    Attributes:
        nlp: where it comes from.
        x: (n,) symbols.
        lower, upper: (n,) the box.
        functions: the least of them is maximised.
        rows: conditions.
        sign: what takes a value of the program's objective to the one that is maximised: -1 for a minimum.
        has_level: whether the program's last variable is the level of a worst case, which is no variable here.
    """

    nlp: Nlp
    x: SX
    lower: FloatArray
    upper: FloatArray
    functions: tuple[SX, ...]
    rows: tuple[Condition, ...]
    sign: float
    has_level: bool

    @property
    def n(self) -> int:
        """Number of variables."""
        return int(self.x.numel())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(variable.name for variable in self.nlp.program.variables[: self.n])

    @cached_property
    def expressions(self) -> SX:
        """(R, 1) functions, then rows."""
        return ca.densify(ca.vertcat(*self.functions, *[row.expression for row in self.rows]))

    @cached_property
    def jacobian(self) -> SX:
        """(R, n) derivatives, dense, with structural zeros filled in."""
        return ca.densify(ca.jacobian(self.expressions, self.x))

    @cached_property
    def dependence(self) -> list[list[bool]]:
        """(R, n) whether an expression depends on a variable."""
        pattern = ca.jacobian(self.expressions, self.x).sparsity()
        return [[bool(pattern.has_nz(r, i)) for i in range(self.n)] for r in range(self.expressions.numel())]

    def level_of(self, x: FloatArray) -> float:
        """The value that is maximised at a point (n,), as computed."""
        values = np.array(self._compiled(x)).ravel()
        return float(np.min(values[: len(self.functions)]))

    def violation_of(self, x: FloatArray) -> float:
        """Largest violation of a row at a point (n,), as computed; ``inf`` where one has no value."""
        rows = np.array(self._compiled(x)).ravel()[len(self.functions) :]
        sizes = [abs(v) if row.is_equation else v for v, row in zip(rows, self.rows, strict=True)]
        worst = max(sizes, default=0.0)
        return float(worst) if np.isfinite(worst) else float("inf")

    @cached_property
    def _compiled(self) -> ca.Function:
        return ca.Function("point", [self.x], [self.expressions])


def standard_form(nlp: Nlp) -> StandardForm:
    """The standard form of a program with at least one variable."""
    program = nlp.program
    x = SX.sym("x", nlp.n)
    F, g = program.values.call([x, SX(ca.DM(nlp.arguments))])
    epigraph = program.places.epigraph
    count = nlp.n if epigraph is None else epigraph.level
    functions: list[SX] = [-nlp.sign * F]
    lower, upper = nlp.g_lower.tolist(), nlp.g_upper.tolist()
    constraints = [(constraint.name, g[k], lower[k], upper[k]) for k, constraint in enumerate(program.constraints)]
    if epigraph is not None:
        pairs = list(zip(constraints, program.constraints, strict=True))
        level = x[epigraph.level]
        functions = [
            _own_function(expression, level, nlp.sign)
            for (_, expression, _, _), constraint in pairs
            if constraint in epigraph.constraints
        ]
        constraints = [each for each, constraint in pairs if constraint not in epigraph.constraints]
    return StandardForm(
        nlp=nlp,
        x=x[:count],
        lower=frozen_array(nlp.lower[:count], (count,)),
        upper=frozen_array(nlp.upper[:count], (count,)),
        functions=tuple(functions),
        rows=tuple(_rows(constraints)),
        sign=-nlp.sign,
        has_level=epigraph is not None,
    )


def _own_function(expression: SX, level: SX, sign: float) -> SX:
    """The function whose bound a level is, from a constraint ``expression >= 0`` that is linear in the level."""
    slope = ca.jacobian(expression, level)
    without = ca.substitute(expression, level, 0)
    # Maximum: level <= -without / slope, slope < 0. Minimum: level >= -without / slope, slope > 0; negated.
    return -without / slope if sign < 0 else without / slope


def _rows(constraints: Sequence[tuple[str, SX, float, float]]) -> list[Condition]:
    rows = []
    for name, expression, low, high in constraints:
        if low == high:
            rows.append(Condition(name, expression - low, is_equation=True))
            continue
        if np.isfinite(high):
            rows.append(Condition(name, expression - high, is_equation=False))
        if np.isfinite(low):
            rows.append(Condition(name, low - expression, is_equation=False))
    return rows
