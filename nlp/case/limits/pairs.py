"""Constraints of one form on all pairs of many values, such as the lengths of a leg at every pair of poses.

There are as many pairs as the square of the number of values, and few of them can bind. A program starts with none of
many pairs, and gets a pair where a point would violate it: :mod:`screwsynth.nlp.program.pairs`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from casadi import SX

from .constraint import BoundedConstraint


@dataclass(frozen=True, eq=False)
class PairFamily:
    """Constraints on every ordered pair of N values.

    Attributes:
        values: (N, 1) the values, N >= 2.
        pair: the constraints on two values, by their indices. They are the tightest where the first value is the
            smallest and the second the largest of all.
        slack: least distance to a limit, as a number, of a first and a second value; negative where it is violated.
    """

    values: SX
    pair: Callable[[int, int], tuple[BoundedConstraint, ...]]
    slack: Callable[[float, float], float]
