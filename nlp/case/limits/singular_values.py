"""Limits on singular values of the homogenised J: moments about the platform origin, divided by a length.

The constraints are on smooth estimates of eigenvalues of ``J'J``: the smallest from below and the largest from above,
so that a design that satisfies the constraints satisfies the limits. Eigenvalues themselves have a kink where two of
them coincide, and optima often lie there. The measured values are computed by a singular value decomposition of J.

For a positive definite matrix A,

    mu(A) = (tr A^-m)^(-1/m) <= lambda_min(A),

too small by the factor ``r^(-1/m)`` if r eigenvalues are equal to the smallest one. Shifting A by almost this estimate,
and estimating again, multiplies the error by ``1 - r^(-1/m)`` each time:

    theta <- theta + mu(A - theta I),        theta < lambda_min(A) throughout.

The largest eigenvalue is ``c - lambda_min(c I - A)`` for any larger c, and is estimated from above.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import ClassVar, TypeAlias

import casadi as ca
import numpy as np
from casadi import SX
from pydantic import Field, FiniteFloat

from ....models import Dimension, FloatArray, homogenised
from ..table import Table
from .constraint import SQUARED_NUMBER, BoundedConstraint, End, Reading, Spectral, between
from .interval import AtLeast, AtMost
from .limit import Limit, NumberRange, PosedRobot, Ranges


def _condition_from(value: float) -> float:
    """Return the condition number c from ``-1 / c^2``."""
    return 1 / math.sqrt(-value) if value < 0 else math.inf


def _condition_slope(value: float) -> float:
    """Return the derivative of ``-1 / c^2`` with respect to c, at a value of ``-1 / c^2``."""
    return float(2 * max(-value, 0.0) ** 1.5)


def _condition_bound(number: SX) -> SX:
    """Return ``-1 / c^2`` from the condition number c."""
    return -1 / (number * number)


#: Reading of ``-1 / c^2`` as the condition number c.
_CONDITION = Reading(
    Dimension.NUMBER, from_value=_condition_from, slope=_condition_slope, to_value=_condition_bound, above=1.0
)


class SmallestTable(AtLeast):
    """Smallest singular value of the homogenised J."""

    length: FiniteFloat = Field(description="length by which moments about the platform origin are divided")


@dataclass(frozen=True)
class SmallestSingularValue(Limit[SmallestTable]):
    """Lower limit on the smallest singular value of the homogenised J, at every pose.

    Attributes:
        min: smallest allowed singular value, above 0.
        length: length by which moments about the platform origin are divided.
    """

    min: float
    length: float

    key: ClassVar[str] = "smallest_singular_value"
    table: ClassVar[type[Table]] = SmallestTable
    description: ClassVar[str] = (
        "lower limit on the smallest singular value of J, with moments divided by a length; distance from a singularity"
    )
    numbers: ClassVar[Ranges] = {"min": NumberRange(Dimension.NUMBER), "length": NumberRange()}

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on the smallest eigenvalue of ``J'J``."""
        J = _homogenised(pose, self.length)
        yield between(
            f"smallest_singular_value{pose.where}",
            smallest_eigenvalue(J.T @ J),
            SQUARED_NUMBER,
            "smallest_singular_value",
            lower=self.min,
            measure=partial(_smallest, self.length),
            spectral=Spectral(End.SMALLEST, _homogenised(pose, 1.0), self.length),
        )


class ConditionTable(AtMost):
    """Condition number of the homogenised J."""

    length: FiniteFloat = Field(description="length by which moments about the platform origin are divided")


@dataclass(frozen=True)
class ConditionNumber(Limit[ConditionTable]):
    """Upper limit on the condition number of the homogenised J, at every pose: largest over smallest singular value.

    Attributes:
        max: largest allowed condition number, above 1.
        length: length by which moments about the platform origin are divided.
    """

    max: float
    length: float

    key: ClassVar[str] = "condition_number"
    table: ClassVar[type[Table]] = ConditionTable
    description: ClassVar[str] = (
        "largest condition number of J (largest over smallest singular value), with moments divided by a length"
    )
    numbers: ClassVar[Ranges] = {
        "max": NumberRange(Dimension.NUMBER, above=1.0),
        "length": NumberRange(),
    }
    order: ClassVar[int] = 1

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on minus the ratio of smallest to largest eigenvalue of ``J'J``."""
        J = _homogenised(pose, self.length)
        gram = J.T @ J
        yield between(
            f"condition_number{pose.where}",
            -smallest_eigenvalue(gram) / largest_eigenvalue(gram),
            _CONDITION,
            "condition_number",
            upper=self.max,
            measure=partial(_condition, self.length),
            spectral=Spectral(End.MINUS_RATIO, _homogenised(pose, 1.0), self.length),
        )


def _homogenised(pose: PosedRobot, length: float) -> SX:
    """Return the homogenised J (m, 6)."""
    return ca.horzcat(*homogenised(pose.robot.jacobian, pose.robot.position, length))


def _smallest(length: float, jacobian: FloatArray, position: FloatArray) -> float:
    return float(_singular_values(length, jacobian, position)[-1])


def _condition(length: float, jacobian: FloatArray, position: FloatArray) -> float:
    values = _singular_values(length, jacobian, position)
    return float(values[0] / values[-1]) if values[-1] > 0 else math.inf


def _singular_values(length: float, jacobian: FloatArray, position: FloatArray) -> FloatArray:
    """Return the singular values (6,) of the homogenised J, largest first; 0 for missing rows."""
    values = np.linalg.svd(np.array(homogenised(jacobian, position, length)), compute_uv=False)
    return np.concatenate([values, np.zeros(6 - len(values))])


#: Squarings of the inverse: ``m = 2 ** _SQUARINGS``.
_SQUARINGS = 3
#: Number of shifts. Two leave an error of 0.083^2 = 0.7 % for a double eigenvalue (0.35 % of the singular value), and
#: almost none if the next eigenvalue is 1.5 times as large. More shifts make the estimate's curvature so large that
#: Newton steps across it fail: with four shifts, two thirds of the searches failed.
_ROUNDS = 2
#: Part of the distance to the estimate by which the matrix is shifted, so that it stays well away from singular.
_CLOSE = 0.999
#: Initial shift below zero, relative to the mean eigenvalue, so that a singular matrix can be inverted.
_FLOOR = 1e-10


#: Upper triangle of a symmetric matrix by rows: ``rows[i][j - i]`` for ``i <= j``.
Rows: TypeAlias = list[list[SX]]


def smallest_eigenvalue(A: SX) -> SX:
    """Return an estimate (1, 1) from below of the smallest eigenvalue of a positive semidefinite matrix (n, n)."""
    return _estimate(_estimate_smallest, A.shape[0])(A)


def largest_eigenvalue(A: SX) -> SX:
    """Return an estimate (1, 1) from above of the largest eigenvalue of a positive semidefinite matrix (n, n)."""
    return _estimate(_estimate_largest, A.shape[0])(A)


@cache
def _estimate(formula: Callable[[SX], SX], n: int) -> ca.Function:
    """Return an estimate as a CasADi function of a matrix (n, n), so that its many operations are built only once."""
    A = SX.sym("A", n, n)
    return ca.Function("estimate", [A], [formula(A)])


def _estimate_smallest(A: SX) -> SX:
    n = A.shape[0]
    scale = ca.trace(A) / n
    rows = _upper(A / scale)
    theta = found = SX(-_FLOOR)
    for _ in range(_ROUNDS):
        found = theta + _root_of_inverse(_shifted(rows, -theta))
        theta = theta + _CLOSE * (found - theta)
    return found * scale


def _estimate_largest(A: SX) -> SX:
    scale = ca.trace(A)
    rows = _upper(A / scale)
    # (tr A^m)^(1/m) is an upper bound, too large by at most the factor n^(1/m).
    above = _root_of_trace(rows) * (2 - _CLOSE)
    found = above
    negative = [[-each for each in row] for row in rows]
    for _ in range(_ROUNDS):
        gap = _root_of_inverse(_shifted(negative, above))
        found = above - gap
        above = above - _CLOSE * gap
    return found * scale


def _upper(A: SX) -> Rows:
    return [[A[i, j] for j in range(i, A.shape[0])] for i in range(A.shape[0])]


def _shifted(rows: Rows, by: SX) -> Rows:
    return [[row[0] + by, *row[1:]] for row in rows]


def _root_of_inverse(rows: Rows) -> SX:
    """Return ``(tr A^-m)^(-1/m)`` of a positive definite matrix A; ``m = 2^_SQUARINGS``."""
    inverse = _inverse(rows)
    size = sum((row[0] for row in inverse), SX(0))
    return 1 / (size * _root_of_trace([[each / size for each in row] for row in inverse]))


def _root_of_trace(rows: Rows) -> SX:
    """Return ``(tr A^m)^(1/m)`` of a symmetric matrix A by squaring; ``m = 2^_SQUARINGS``.

    The trace of the last square is the sum of the squared entries of the matrix before it.
    """
    for _ in range(_SQUARINGS - 1):
        rows = _square(rows)
    value = sum((row[0] ** 2 + 2 * sum((each**2 for each in row[1:]), SX(0)) for row in rows), SX(0))
    for _ in range(_SQUARINGS):
        value = ca.sqrt(value)
    return value


def _square(rows: Rows) -> Rows:
    full = _full(rows)
    return [
        [sum((a * b for a, b in zip(full[i], full[j], strict=True)), SX(0)) for j in range(i, len(rows))]
        for i in range(len(rows))
    ]


def _full(rows: Rows) -> Rows:
    return [[rows[min(i, j)][abs(i - j)] for j in range(len(rows))] for i in range(len(rows))]


def _inverse(rows: Rows) -> Rows:
    """Return the inverse of a positive definite matrix, by sweeping one row after the other without pivoting.

    Sweeping k turns ``a_kk`` into ``-1/a_kk``, the rest of row k into ``a_kj/a_kk`` and every other entry into ``a_ij -
    a_ik a_kj / a_kk``, and keeps the matrix symmetric; after all rows it is minus the inverse.
    """
    n = len(rows)
    rows = [list(row) for row in rows]
    for k in range(n):
        pivot = 1 / rows[k][0]
        column = [rows[min(i, k)][abs(i - k)] for i in range(n)]
        scaled = [each * pivot for each in column]
        for i in range(n):
            for j in range(i, n):
                if k not in (i, j):
                    rows[i][j - i] = rows[i][j - i] - column[i] * scaled[j]
        for i in range(n):
            rows[min(i, k)][abs(i - k)] = scaled[i] if i != k else -pivot
    return [[-each for each in row] for row in rows]
