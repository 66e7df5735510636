"""A number over all machines within a tolerance on joint centres."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from casadi import SX

from .machine import CentreErrors, JointErrors


@dataclass(frozen=True, eq=False)
class Worst:
    """How far a number goes over all machines within the tolerance.

    Attributes:
        errors: returns those of the machine that is worst at a pose, to first order.
        value: returns the number, as people read it, of an exact machine at a pose.
        expression: (1, 1) bound of the number over the machines, in the terms of a program; None for the number of the
            exact machine.
        allowance: further change of the number as people read it, not negative.
        least, most: ends of what the number can be.
        machine: returns the errors and the number of the worst machine at a pose, in the place of the first two, which
            are None for a robot that is not six straight legs.
    """

    errors: Callable[..., JointErrors] | None = None
    value: Callable[..., float] | None = None
    expression: SX | None = None
    allowance: float = 0.0
    least: float = -math.inf
    most: float = math.inf
    machine: Callable[..., tuple[CentreErrors, float]] | None = None
