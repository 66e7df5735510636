"""Named smooth constraints of the nonlinear program, and readings that convert their bounds to quantities of the case.

A form is a function that is called for every leg, pair of legs, joint, task or pose. Generated C contains the function
once and calls it in a loop.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Hashable, Sequence
from functools import cached_property, partial
from operator import mul
from typing import NamedTuple, TypeAlias, TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray
from ....models.values import dataclass


@dataclass(frozen=True)
class Form:
    """Function of a vector, with constant parameters; forms with equal function and parameters are equal.

    Attributes:
        build: function at the top of a module, from a vector (k, 1) and the parameters to a value (r, 1).
        numbers: constant parameters of the function.
    """

    build: Callable[..., SX]
    numbers: tuple[Hashable, ...] = ()

    def __call__(self, inputs: SX) -> SX:
        """Return the value (r, 1) at a vector (k, 1)."""
        return self.build(inputs, *self.numbers)


@dataclass(frozen=True, eq=False)
class Call:
    """Call of a :class:`Form` with its arguments.

    Attributes:
        form: called function.
        inputs: (k, 1) arguments.
    """

    form: Form
    inputs: SX

    @cached_property
    def value(self) -> SX:
        """Value (r, 1) of the function."""
        return self.form(self.inputs)


_T = TypeVar("_T")

#: Function of the Jacobian (m, 6) and the platform position (3,) at a pose, with a measured quantity as value.
JacobianMeasure: TypeAlias = Callable[[FloatArray, FloatArray], float]


def _unchanged(value: _T) -> _T:
    return value


def _one(value: float) -> float:  # noqa: ARG001 - a slope is a function of the bound
    return 1.0


@dataclass(frozen=True)
class Reading:
    """Conversion between the bound of a constraint and the limit in the case.

    The program may bound a smoother function of the limited quantity, such as the cosine of an angle. The three
    functions are module-level functions or ``partial`` of these, because solutions with a ``lambda`` cannot be pickled.

    Attributes:
        dimension: physical dimension of the limited quantity.
        from_value: function from the program's bound to the limit, radians for angles.
        slope: derivative of the program's bound with respect to the limit, as a function of the program's bound.
        to_value: function from the limit to the program's bound, as an expression; monotonically increasing.
        above: exclusive lower end of the allowed limits.
        most: upper end of the allowed limits.
    """

    dimension: Dimension
    from_value: Callable[[float], float] = _unchanged
    slope: Callable[[float], float] = _one
    to_value: Callable[[SX], SX] = _unchanged
    above: float = -math.inf
    most: float = math.inf

    @property
    def power(self) -> int:
        """Power of the limit's unit in the program's bound; 0 for a plain number, such as a cosine."""
        return {_unchanged: 1, _square: 2}.get(self.to_value, 0)

    def size(self, bound: float, length: float) -> float:
        """Return the size to which a distance from the program's bound is relative.

        Args:
            bound: bound of the program.
            length: characteristic length of the robot, for a length with the bound 0.
        """
        if bound:
            return abs(bound)
        return length**self.power if self.dimension is Dimension.LENGTH else 1.0


def squared(dimension: Dimension) -> Reading:
    """Return the reading of a square as its positive root."""
    return Reading(dimension, from_value=_root, slope=_slope_of_square, to_value=_square, above=0.0)


def _root(value: float) -> float:
    return math.sqrt(max(value, 0.0))


def _slope_of_square(value: float) -> float:
    return 2 * math.sqrt(max(value, 0.0))


def _square(number: SX) -> SX:
    return number * number


def in_parts(part: float) -> Reading:
    """Return the conversion for a limited plain number of which the program bounds ``part`` times the number."""
    return Reading(
        Dimension.NUMBER, from_value=partial(mul, 1 / part), slope=partial(_slope, part), to_value=partial(mul, part)
    )


def _slope(part: float, value: float) -> float:  # noqa: ARG001 - a slope is a function of the bound
    return part


def _at_least_zero(value: float) -> float:
    return max(value, 0.0) + 0.0  # no minus zero


LENGTH, NUMBER = Reading(Dimension.LENGTH), Reading(Dimension.NUMBER)
#: Reading of a sum of squares: a proved bound below 0 is shown as 0.
NOT_NEGATIVE = Reading(Dimension.NUMBER, from_value=_at_least_zero)
POSITIVE_LENGTH = Reading(Dimension.LENGTH, above=0.0)
SQUARED_LENGTH, SQUARED_NUMBER = squared(Dimension.LENGTH), squared(Dimension.NUMBER)


class End(enum.Enum):
    """Kinds of estimates of eigenvalues of ``A = J'J``: smallest eigenvalue, or minus ratio of smallest to largest."""

    SMALLEST = 0
    MINUS_RATIO = 1


@dataclass(frozen=True, eq=False)
class Spectral:
    """Matrix behind an estimate of eigenvalues, for modules that bound or measure the eigenvalues themselves.

    Attributes:
        end: estimated quantity: smallest eigenvalue, or minus the ratio of smallest to largest.
        matrix: (m, 6) Jacobian with rows of force, then moment about the platform origin.
        length: length by which moments are divided.
    """

    end: End
    matrix: SX
    length: float


@dataclass(frozen=True, eq=False)
class Constraint:
    """Named smooth constraint ``lower <= expression <= upper``.

    The bounds are in the :class:`~screwsynth.nlp.program.nlp.Nlp`.

    Attributes:
        name: name of the constraint, in the words of a case.
        expression: (1, 1) constrained function.
        reading: conversion between bounds and limits.
        keys: dotted keys below ``limits`` of the lower and the upper limit; empty for a bound that is not a limit of
            the case.
        pose: index of the pose.
        exact: (1, 1) limited quantity, if the expression follows it only near the limit; otherwise None.
        measure: function that computes the limited quantity, if the expression is an estimate of it; otherwise None.
        spectral: matrix whose eigenvalues the expression estimates; None for other expressions.
        call: call with the expression as value, if the function is called for several legs, joints, tasks or poses.
        stated: lower and upper bound of the case, if the program's bounds are tighter; otherwise None.
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
        """Return the limited quantity of a constraint with ``measure`` and ``spectral``; NaN for other constraints.

        Args:
            symbols: variables and arguments of the program.
            point: values of the symbols.
        """
        if self.measure is None or self.spectral is None:
            return math.nan
        matrix = ca.Function("matrix", list(symbols), [ca.densify(self.spectral.matrix)])
        return self.measure(matrix(*point).full(), np.zeros(3))


@dataclass(frozen=True, eq=False)
class BoundedConstraint:
    """Constraint with a lower and an upper bound."""

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
    """Return the constraint of a limit.

    Args:
        name: name of the constraint, in the words of a case.
        expression: (1, 1) constrained function, or a call with this value; it increases with the limited quantity.
        reading: conversion between bounds and limits.
        key: dotted key below ``limits`` of a table with ``min`` and ``max``; or the dotted keys of the lower and the
            upper limit, empty for a missing one.
        lower: lower limit, radians for an angle; None for no lower limit.
        upper: upper limit, radians for an angle; None for no upper limit.
        exact: (1, 1) limited quantity, if the expression follows it only near the limit.
        measure: function that computes the limited quantity, if the expression is an estimate of it.
        spectral: matrix whose eigenvalues the expression estimates; None for other expressions.
    """
    if isinstance(key, str):
        key = ("" if lower is None else f"{key}.min", "" if upper is None else f"{key}.max")
    value, call = (expression.value, expression) if isinstance(expression, Call) else (expression, None)
    return BoundedConstraint(
        Constraint(name, value, reading, key, exact=exact, measure=measure, spectral=spectral, call=call),
        -math.inf if lower is None else float(reading.to_value(SX(lower))),
        math.inf if upper is None else float(reading.to_value(SX(upper))),
    )


class Extent(NamedTuple):
    """Limit on the smallest and the largest of several values: ``largest - ratio * smallest <= most``.

    Attributes:
        name: name of the limit, in the words of a case.
        ratio: multiple of the smallest value.
        most: upper bound.
    """

    name: str
    ratio: float
    most: float


@dataclass(frozen=True, eq=False)
class PairFamily:
    """Constraints on all ordered pairs of N values, such as the lengths of a leg at several poses.

    Few of the N^2 pairs can be active. With many pairs, a program starts without them and adds a pair when a point
    violates it: :mod:`screwsynth.nlp.program.pairs`.

    Attributes:
        values: (N, 1) values, N >= 2.
        pair: function from two indices to the constraints on these values; they are tightest for the smallest value
            as the first one and the largest as the second one.
        extents: the same constraints on the smallest and the largest value.
    """

    values: SX
    pair: Callable[[int, int], tuple[BoundedConstraint, ...]]
    extents: tuple[Extent, ...]

    def slack(self, smallest: float, largest: float) -> float:
        """Return the smallest margin of two values; negative for a violated limit."""
        return min(each.most - largest + each.ratio * smallest for each in self.extents)
