"""Limits on the singular values of J, made homogeneous: moments about the platform's origin, divided by a length.

The constraints are on eigenvalues of ``J'J`` (:mod:`screwsynth.nlp.case.limits.spectrum`). The smallest one is
estimated from below and the largest from above, so that a design that keeps the constraints keeps the limits. The
measured numbers are computed from the singular value decomposition of J at a point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import casadi as ca
import numpy as np
from casadi import SX
from pydantic import Field, FiniteFloat

from ....models import Dimension, FloatArray, homogenised
from ..table import Table
from .constraint import SQUARED_NUMBER, BoundedConstraint, End, Reading, Spectral, between
from .limit import Limit, NumberRange, PosedRobot, Ranges
from .spectrum import largest_eigenvalue, smallest_eigenvalue


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


class SmallestTable(Table):
    """The smallest singular value of J, homogenised."""

    min: FiniteFloat = Field(description="smallest value")
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


class ConditionTable(Table):
    """The ratio of the singular values of J, homogenised."""

    max: FiniteFloat = Field(description="largest value")
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
