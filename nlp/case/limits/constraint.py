"""Named smooth constraints, readings of their numbers in the words of a case, and forms of expressions that repeat.

A form is one function of a few numbers, called for every leg, pair of legs, joint, task or pose. A program needs the
expressions alone. Generated C also uses that they are calls of one function: it has the function once, and calls it in
a loop.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Hashable, Sequence
from functools import cached_property, partial
from operator import mul
from typing import TypeAlias, TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray
from ....models.values import dataclass


@dataclass(frozen=True)
class Form:
    """A function of a vector; two forms are equal where they are the same function with the same numbers.

    Attributes:
        build: function at the top of a module, from a vector (k, 1) and the numbers to the value (r, 1).
        numbers: further arguments of the function, the same in each of its calls.
    """

    build: Callable[..., SX]
    numbers: tuple[Hashable, ...] = ()

    def __call__(self, inputs: SX) -> SX:
        """Return the value (r, 1) at a vector (k, 1)."""
        return self.build(inputs, *self.numbers)


@dataclass(frozen=True, eq=False)
class Call:
    """A call of a form.

    Attributes:
        form: the function.
        inputs: (k, 1) expressions.
    """

    form: Form
    inputs: SX

    @cached_property
    def value(self) -> SX:
        """(r, 1) value."""
        return self.form(self.inputs)


_T = TypeVar("_T")

#: A measured number from the Jacobian (m, 6) and the position (3,) of the platform at a pose.
JacobianMeasure: TypeAlias = Callable[[FloatArray, FloatArray], float]


def _unchanged(value: _T) -> _T:
    return value


def _one(value: float) -> float:  # noqa: ARG001 - a slope is a function of the bound
    return 1.0


@dataclass(frozen=True)
class Reading:
    """Conversion between a constraint's bound and the number that a case states for it.

    A limit on an angle may be a bound on a smoother function of it in the program. The three functions have names, or
    are a ``partial`` of functions that have: a solution that holds a ``lambda`` cannot be pickled.

    Attributes:
        dimension: of the number that a case states.
        from_value: the number for people (radians for angles) from the program's bound.
        slope: derivative of the program's bound with respect to the number for people, at the program's bound.
        to_value: the program's bound from the number for people, as an expression; it never falls where that grows.
        above: the number for people must be larger than this.
        most: the number for people may be at most this.
    """

    dimension: Dimension
    from_value: Callable[[float], float] = _unchanged
    slope: Callable[[float], float] = _one
    to_value: Callable[[SX], SX] = _unchanged
    above: float = -math.inf
    most: float = math.inf

    @property
    def power(self) -> int:
        """Power of the number's unit that the bound has: 0 where it is a plain number, as a cosine is."""
        return {_unchanged: 1, _square: 2}.get(self.to_value, 0)


def squared(dimension: Dimension) -> Reading:
    """Return the reading of a square as the number itself, which is positive."""
    return Reading(dimension, from_value=_root, slope=_slope_of_square, to_value=_square, above=0.0)


def _root(value: float) -> float:
    return math.sqrt(max(value, 0.0))


def _slope_of_square(value: float) -> float:
    return 2 * math.sqrt(max(value, 0.0))


def _square(number: SX) -> SX:
    return number * number


def in_parts(part: float) -> Reading:
    """Return the reading of a part of a plain number as the number itself."""
    return Reading(
        Dimension.NUMBER, from_value=partial(mul, 1 / part), slope=partial(_slope, part), to_value=partial(mul, part)
    )


def _slope(part: float, value: float) -> float:  # noqa: ARG001 - a slope is a function of the bound
    return part


def _at_least_zero(value: float) -> float:
    return max(value, 0.0) + 0.0  # no minus zero


LENGTH, NUMBER = Reading(Dimension.LENGTH), Reading(Dimension.NUMBER)
#: A sum of squares: a bound below 0 that a search of boxes has says no more than 0 does.
NOT_NEGATIVE = Reading(Dimension.NUMBER, from_value=_at_least_zero)
POSITIVE_LENGTH = Reading(Dimension.LENGTH, above=0.0)
SQUARED_LENGTH, SQUARED_NUMBER = squared(Dimension.LENGTH), squared(Dimension.NUMBER)


class End(enum.Enum):
    """Estimate of eigenvalues of ``A = J'J`` that a constraint is on."""

    SMALLEST = 0
    MINUS_RATIO = 1


@dataclass(frozen=True, eq=False)
class Spectral:
    """A constraint's expression as an estimate of eigenvalues, for those who compute the estimate themselves.

    Attributes:
        end: the smallest eigenvalue, or minus the ratio of the smallest to the largest.
        matrix: (m, 6) rows force, then moment about the platform's origin.
        length: by which moments are divided.
    """

    end: End
    matrix: SX
    length: float


@dataclass(frozen=True, eq=False)
class Constraint:
    """A named smooth constraint ``lower <= expression <= upper``.

    Its bounds are numbers of the :class:`~screwsynth.nlp.program.nlp.Nlp`.

    Attributes:
        name: in the words of a case.
        expression: (1, 1).
        reading: how its bounds read.
        keys: dotted keys below ``limits`` of the case's numbers that are its lower and its upper bound; empty for a
            bound that is none of the case's limits.
        pose: index of the pose that it is at.
        exact: (1, 1) the measured number itself, where the expression gives it near the limit only.
        measure: the measured number itself, where the expression only estimates it.
        spectral: the matrix that the expression is made from, where it estimates eigenvalues.
        call: the call whose value the expression is, where it repeats for several legs, joints, tasks or poses.
        stated: lower and upper bound as the case states them, where those of the program are tighter; else None.
    """

    name: str
    expression: SX
    reading: Reading
    keys: tuple[str, str] = ("", "")
    pose: int = 0
    exact: SX | None = None
    measure: JacobianMeasure | None = None
    spectral: Spectral | None = None
    call: Call | None = None
    stated: tuple[float, float] | None = None

    def measured_at(self, symbols: Sequence[SX], point: Sequence[FloatArray | Sequence[float] | float]) -> float:
        """Return the measured number of a constraint with ``measure`` and ``spectral``; NaN for another constraint.

        Args:
            symbols: variables and arguments of the program.
            point: their values.
        """
        if self.measure is None or self.spectral is None:
            return math.nan
        matrix = ca.Function("matrix", list(symbols), [ca.densify(self.spectral.matrix)])
        return self.measure(matrix(*point).full(), np.zeros(3))


@dataclass(frozen=True, eq=False)
class BoundedConstraint:
    """A constraint with its bounds."""

    constraint: Constraint
    lower: float
    upper: float


def between(
    name: str,
    expression: SX | Call,
    reading: Reading,
    key: str | tuple[str, str],
    *,
    lower: float | None = None,
    upper: float | None = None,
    exact: SX | None = None,
    measure: JacobianMeasure | None = None,
    spectral: Spectral | None = None,
) -> BoundedConstraint:
    """Return a constraint from the numbers of its limit as people write them.

    Args:
        name: in the words of a case.
        expression: (1, 1), or the call whose value it is; it grows with the measured number.
        reading: how its bounds read.
        key: dotted key below ``limits`` of the table whose ``min`` and ``max`` the numbers are; or the dotted keys of
            the lower and of the upper number, empty where there is none.
        lower: the lower number, radians for an angle; None where there is none.
        upper: likewise.
        exact: (1, 1) the measured number itself, where the expression gives it near the limit only.
        measure: the measured number itself, where the expression only estimates it.
        spectral: the matrix that the expression is made from, where it estimates eigenvalues.
    """
    if isinstance(key, str):
        key = ("" if lower is None else f"{key}.min", "" if upper is None else f"{key}.max")
    value, call = (expression.value, expression) if isinstance(expression, Call) else (expression, None)
    return BoundedConstraint(
        Constraint(name, value, reading, key, exact=exact, measure=measure, spectral=spectral, call=call),
        -math.inf if lower is None else float(reading.to_value(SX(lower))),
        math.inf if upper is None else float(reading.to_value(SX(upper))),
    )


@dataclass(frozen=True, eq=False)
class PairFamily:
    """Constraints of one form on every ordered pair of N values, such as the lengths of a leg at several poses.

    There are as many pairs as the square of N, and few of them can bind. A program starts with none of many pairs, and
    gets a pair where a point would violate it: :mod:`screwsynth.nlp.program.pairs`.

    Attributes:
        values: (N, 1) the values, N >= 2.
        pair: the constraints on two values, by their indices. They are the tightest where the first value is the
            smallest and the second the largest of all.
        slack: least distance to a limit, as a number, of a first and a second value; negative where it is violated.
    """

    values: SX
    pair: Callable[[int, int], tuple[BoundedConstraint, ...]]
    slack: Callable[[float, float], float]
