"""Limits on the singular values of J, made homogeneous: moments about the platform's origin, divided by a length.

The constraints are on eigenvalues of ``J'J``. The smallest one is estimated from below and the largest from above, so
that a design that keeps the constraints keeps the limits. The measured numbers are computed from the singular value
decomposition of J at a point.

No closed form of an eigenvalue exists, and an eigenvalue itself has a kink where two of them coincide, where optima
often lie. The estimates of this module are smooth everywhere, made of ``+ - * /`` and square roots alone, and never on
the unsafe side. For a positive definite matrix A,

    mu(A) = (tr A^-m)^(-1/m) <= lambda_min(A),

short of it by the factor ``r^(-1/m)`` where r eigenvalues are smallest and by little where one is. Shifting A by almost
this estimate, and estimating again, multiplies the error by ``1 - r^(-1/m)`` once more:

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
    """Return the derivative of ``-1 / c^2`` with respect to c, at a value of it."""
    return float(2 * max(-value, 0.0) ** 1.5)


def _condition_bound(number: SX) -> SX:
    """Return ``-1 / c^2`` from the condition number c."""
    return -1 / (number * number)


#: ``-1 / c^2`` read as the condition number c.
_CONDITION = Reading(
    Dimension.NUMBER, from_value=_condition_from, slope=_condition_slope, to_value=_condition_bound, above=1.0
)


class SmallestTable(AtLeast):
    """The smallest singular value of J, homogenised."""

    length: FiniteFloat = Field(description="by which moments about the platform's origin are divided")


@dataclass(frozen=True)
class SmallestSingularValue(Limit[SmallestTable]):
    """Smallest singular value of the homogenised J.

    Attributes:
        min: smallest value.
        length: length by which moments are divided.
    """

    min: float
    length: float

    key: ClassVar[str] = "smallest_singular_value"
    table: ClassVar[type[Table]] = SmallestTable
    description: ClassVar[str] = "of the same J"
    numbers: ClassVar[Ranges] = {"min": NumberRange(Dimension.NUMBER), "length": NumberRange()}

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the smallest eigenvalue of ``J'J``."""
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
    """The ratio of the singular values of J, homogenised."""

    length: FiniteFloat = Field(description="by which moments about the platform's origin are divided")


@dataclass(frozen=True)
class ConditionNumber(Limit[ConditionTable]):
    """Largest ratio of the singular values of the homogenised J.

    Attributes:
        max: largest value.
        length: length by which moments are divided.
    """

    max: float
    length: float

    key: ClassVar[str] = "condition_number"
    table: ClassVar[type[Table]] = ConditionTable
    description: ClassVar[str] = "of J, made homogeneous by a length"
    numbers: ClassVar[Ranges] = {
        "max": NumberRange(Dimension.NUMBER, above=1.0),
        "length": NumberRange(),
    }
    order: ClassVar[int] = 1

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return minus the ratio of the smallest to the largest eigenvalue of ``J'J``."""
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
#: Rounds of shifting. Two leave an error of 0.083^2 = 0.7 % of a double eigenvalue (0.35 % of the singular value), and
#: next to none of one whose neighbour is half as large again. More would be closer, and the rounded corner so sharp
#: that Newton steps across it fail: with four rounds two thirds of the searches did.
_ROUNDS = 2
#: The next shift goes this part of the way, so that the matrix to be inverted stays well away from singular.
_CLOSE = 0.999
#: A first shift below zero, in parts of the mean eigenvalue, so that a singular matrix can be inverted.
_FLOOR = 1e-10


#: The upper triangle of a symmetric matrix, row by row: ``rows[i][j - i]`` for ``i <= j``.
Rows: TypeAlias = list[list[SX]]


def smallest_eigenvalue(A: SX) -> SX:
    """Return an estimate (1, 1) from below of the smallest eigenvalue of a symmetric positive semidefinite (n, n)."""
    return _estimate(_estimate_smallest, A.shape[0])(A)


def largest_eigenvalue(A: SX) -> SX:
    """Return an estimate (1, 1) from above of the largest eigenvalue of a symmetric positive semidefinite (n, n)."""
    return _estimate(_estimate_largest, A.shape[0])(A)


@cache
def _estimate(formula: Callable[[SX], SX], n: int) -> ca.Function:
    """Return an estimate as a function of a matrix (n, n): a call copies thousands of operations at once."""
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
    # (tr A^m)^(1/m) is above, by no more than n^(1/m).
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
    """Return ``(tr A^-m)^(-1/m)`` of a positive definite matrix."""
    inverse = _inverse(rows)
    size = sum((row[0] for row in inverse), SX(0))
    return 1 / (size * _root_of_trace([[each / size for each in row] for row in inverse]))


def _root_of_trace(rows: Rows) -> SX:
    """Return ``(tr A^m)^(1/m)``; the last square's trace is the sum of all squared entries."""
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
