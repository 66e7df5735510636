"""Nonlinear program in standard form: the smallest of some functions is maximised over a box under conditions.

A form may omit variables of the program that follow from other variables; its lift returns the omitted variables.

CasADi writes the derivative of ``fmax(a, b)`` with respect to a as ``(b <= a) / ((a <= b) + (b <= a))``, which is 1,
0, or 1/2 where both are equal. An enclosure of the divisor may contain 0. So the sum of the two comparisons is written
as 1 here. The derivative is then 1 where both are equal, and unchanged elsewhere. Bounds use integrals of derivatives
along lines, and any value from 0 to 1 is a generalised derivative there. Expressions with jumps have no such
derivative.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from ...errors import UncoveredError
from ...program.nlp import Nlp
from ...program.program import Kernel, single_output
from .signs import is_nowhere_positive

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Difference of a variable from its closed form above which the point is another solution of the loops, in radians or
#: relative to a slide's range. Near a double solution, loops closed to 1e-9 allow differences of this size.
_SAME = 1e-4
#: Operations with jumps. Their derivative is written as 0, so its integral along a line is not the change.
_JUMPS = {ca.OP_LE: "the comparison 'le'", ca.OP_SIGN: "the operation 'sign'"}


class Kind(enum.Enum):
    """Origin of a condition."""

    LIMIT = "a constraint of the program"
    LOOP = "a loop equation of the robot, or a bound that follows from it"
    ASSEMBLY = "a condition on the sign or reach of the assembly mode, which is not a constraint of the program"
    FOLLOWS = "a redundant condition that follows from others: it excludes boxes, and has no multiplier"


@dataclass(frozen=True, eq=False)
class Condition:
    """A condition ``expression <= 0``, or ``expression = 0``.

    Attributes:
        name: name of the condition, in the terms of case files.
        expression: (1, 1) expression.
        is_equation: If true, the expression must be 0; otherwise at most 0.
        kind: origin of the condition.
    """

    name: str
    expression: SX
    is_equation: bool
    kind: Kind = Kind.LIMIT

    @property
    def is_of_joints(self) -> bool:
        """Whether the condition concerns closed loops or the assembly mode."""
        return self.kind in (Kind.LOOP, Kind.ASSEMBLY)


class Lift(NamedTuple):
    """Closed forms of the program variables that a form omits.

    Attributes:
        x: (n,) symbols of all variables of the program.
        places: indices of the replaced variables.
        values: (k, 1) closed forms of the replaced variables, in the form's variables.
        is_angle: whether each replaced variable is an angle; angles may differ by full turns.
        ranges: (k,) half range of each replaced variable; differences of slides are relative to it.
        signs: (s, 1) expressions of all variables; they are at most 0 in the assembly mode of the form.
    """

    x: SX
    places: tuple[int, ...]
    values: SX
    is_angle: tuple[bool, ...]
    ranges: FloatArray
    signs: SX


@dataclass(frozen=True, eq=False)
class StandardForm:
    """Standard form of a nonlinear program: a maximisation over a box under conditions.

    Attributes:
        nlp: the nonlinear program; the form does not have its epigraph variable.
        x: (n,) symbols of the variables.
        lower, upper: (n,) ends of the box.
        functions: functions ``phi_j``; the smallest function value is maximised.
        conditions: conditions ``h_k``; in a common numbering they follow the functions.
        places: indices of the form's variables in the program; None if the form has the first variables of the program.
        lift: closed forms of the program variables that this form omits; None if no variable is omitted.
    """

    nlp: Nlp
    x: SX
    lower: FloatArray
    upper: FloatArray
    functions: tuple[SX, ...]
    conditions: tuple[Condition, ...]
    places: tuple[int, ...] | None = None
    lift: Lift | None = None

    @property
    def n(self) -> int:
        """Number of variables."""
        return int(self.x.numel())

    @property
    def sign(self) -> float:
        """Factor from the program's objective to the maximised value: -1 for a minimum."""
        return -self.nlp.sign

    @property
    def power(self) -> int:
        """Power of the program's objective to which the maximised value is proportional."""
        return power_of(self.nlp)

    @property
    def size(self) -> float:
        """Typical magnitude of the maximised value."""
        return float(self.nlp.objective_size**self.power)

    def objective_of(self, value: float) -> float:
        """Return the program's objective that belongs to a value of the maximised expression.

        Inverse of :meth:`value_of`; a square root is rounded down.
        """
        found = self.sign * value + 0.0  # no negative zero
        if self.power == 1 or not math.isfinite(found):
            return found
        return math.nextafter(math.sqrt(max(found, 0.0)), 0.0)

    def value_of(self, objective: float) -> float:
        """Return the value of the maximised expression that belongs to a value of the program's objective."""
        return self.sign * objective**self.power

    @cached_property
    def ceiling(self) -> float:
        """Bound of the maximised value without a search: 0 for minus a sum of squares, infinite for other functions."""
        return 0.0 if any(is_nowhere_positive(each, self.x) for each in self.functions) else math.inf

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(self.nlp.program.variables[i].name for i in self._index)

    @property
    def is_equation(self) -> tuple[bool, ...]:
        """Whether each of the R expressions must be 0; false for functions."""
        return (*(False for _ in self.functions), *(condition.is_equation for condition in self.conditions))

    @property
    def follows(self) -> tuple[bool, ...]:
        """Whether each of the R expressions is a redundant condition that follows from other conditions."""
        return (*(False for _ in self.functions), *(each.kind is Kind.FOLLOWS for each in self.conditions))

    @cached_property
    def expressions(self) -> SX:
        """The R expressions (R, 1): functions, then conditions."""
        return ca.densify(ca.vertcat(*self.functions, *[condition.expression for condition in self.conditions]))

    @cached_property
    def jacobian(self) -> SX:
        """Derivatives (R, n) of the R expressions with respect to the variables; a dense matrix."""
        return ca.densify(without_ties(ca.jacobian(self.expressions, self.x), self.x))

    @cached_property
    def dependence(self) -> NDArray[np.bool_]:
        """Whether each expression depends on each variable, (R, n)."""
        return dependence_of(self.expressions, self.x)

    def value_at(self, x: FloatArray) -> float:
        """Return the maximised value at a point (n,), in double precision."""
        return float(np.min(self._functions_at(x)))

    def point_of(self, x: FloatArray) -> FloatArray:
        """Return the form's variables (n,) at a point (m,) of the program."""
        return np.asarray(x, dtype=np.float64)[self._index]

    def program_variables(self, point: FloatArray) -> FloatArray:
        """Return the program's variables (m,), without an epigraph variable, at a point (n,) of the form."""
        if self.lift is None:
            return np.array(point, dtype=np.float64)
        x = np.zeros(self.lift.x.numel())
        x[self._index], x[list(self.lift.places)] = point, self._replaced_at(point).ravel()
        return x

    def keeps_signs(self, x: FloatArray) -> bool:
        """Return whether a point (m,) of the program is in the form's assembly mode, in double precision."""
        lift = self.lift
        if lift is not None:
            index = list(lift.places)
            apart = x[index] - self.program_variables(self.point_of(x))[index]
            turned = np.where(lift.is_angle, np.abs(np.sin(apart / 2)), np.abs(apart / lift.ranges))
            if not np.all(turned <= _SAME):
                return False
        return bool(np.all(self._signs_at(x[: (self.x if lift is None else lift.x).numel()]) <= 0))

    @property
    def _index(self) -> list[int]:
        """Indices of the variables in the program."""
        return list(range(self.n) if self.places is None else self.places)

    @cached_property
    def _functions_at(self) -> Kernel[FloatArray]:
        return _kernel(self.x, self.functions)

    @cached_property
    def _replaced_at(self) -> Kernel[FloatArray]:
        return _kernel(self.x, [] if self.lift is None else [self.lift.values])

    @cached_property
    def _signs_at(self) -> Kernel[FloatArray]:
        if self.lift is not None:
            return _kernel(self.lift.x, [self.lift.signs])
        return _kernel(self.x, [each.expression for each in self.conditions if each.kind is Kind.ASSEMBLY])


def power_of(nlp: Nlp) -> int:
    """Return the power of a program's objective to which the maximised value of its standard form is proportional."""
    epigraph = nlp.program.places.epigraph
    return 1 if epigraph is None else epigraph.power


def dependence_of(expressions: SX, x: SX) -> NDArray[np.bool_]:
    """Return whether each expression (R, 1) depends on each variable, (R, n)."""
    return np.asarray(ca.DM(ca.jacobian_sparsity(expressions, x), 1).full() > 0)


def _kernel(x: SX, expressions: Sequence[SX]) -> Kernel[FloatArray]:
    """Return expressions of x as a function of NumPy arrays."""
    values = ca.densify(ca.vertcat(SX(0, 1), *expressions))
    return Kernel(ca.Function("values", [x], [values]), single_output)


def refuse_jumps(expressions: SX, x: SX) -> None:
    """Check that expressions of x (n, 1) have no jumps. Jumps in derivatives are allowed.

    Raises:
        UncoveredError: an expression has a jump.
    """
    function = ca.Function("values", [x], [expressions])
    for k in range(function.n_instructions()):
        if function.instruction_id(k) in _JUMPS:
            raise UncoveredError(_JUMPS[function.instruction_id(k)])


def without_ties(expressions: SX, x: SX) -> SX:
    """Return expressions (r, c) of x (n, 1) with the sum of a comparison and its converse written as 1."""
    function = ca.Function("ties", [x], [expressions])
    count = function.n_instructions()
    if not any(function.instruction_id(k) == ca.OP_LE for k in range(count)):
        return expressions
    work: list[SX] = [SX(0)] * function.sz_w()
    # Operands of comparisons, by the hashes of the nodes.
    compared: dict[int, tuple[int, int]] = {}
    # A hash is the address of a node; the nodes are kept alive, so that no other node gets the same address.
    held: list[SX] = []
    results = [SX(0)] * expressions.nnz()
    for k in range(count):
        op, source, target = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_OUTPUT:
            results[target[1]] = work[source[0]]
        elif op == ca.OP_INPUT:
            work[target[0]] = x[source[1]]
        elif op == ca.OP_CONST:
            work[target[0]] = SX(function.instruction_constant(k))
        elif len(source) == 1:
            work[target[0]] = SX.unary(op, work[source[0]])
        else:
            a, b = work[source[0]], work[source[1]]
            one, other = (compared.get(each.element_hash()) for each in (a, b))
            is_tie = op == ca.OP_ADD and one is not None and other == one[::-1]
            work[target[0]] = SX(1) if is_tie else SX.binary(op, a, b)
            if op == ca.OP_LE:
                compared[work[target[0]].element_hash()] = (a.element_hash(), b.element_hash())
                held.append(work[target[0]])
    return SX(expressions.sparsity(), ca.vertcat(*results))
