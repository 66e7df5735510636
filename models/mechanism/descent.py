"""Joints moved until equations hold, or as near to that as they come: each step makes the residual smaller.

Damped by the squared residual, the steps are those of Levenberg and Marquardt, and converge quadratically [1].

Source: 1. N. Yamashita, M. Fukushima, *On the rate of convergence of the Levenberg-Marquardt method*, Computing
Supplementa 15 (2001).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..arrays import FloatArray
from ..newton import Linear
from .motions import Coordinates, Equations, Motions, Placed

#: Loops are closed where no residual, of order 1, is above this: rounding of 60 joints in a row leaves 1e-14.
CLOSED = 1e-11


class Reached(NamedTuple):
    """Coordinates of a mechanism, with equations there.

    Attributes:
        at: the coordinates.
        placed: the mechanism at these.
        residual: (m,) left sides of the equations.
        slopes: (m, n) their derivatives.
        is_stuck: whether the step to this point hardly made the residual smaller.
    """

    at: Coordinates
    placed: Placed
    residual: FloatArray
    slopes: FloatArray
    is_stuck: bool

    @property
    def error(self) -> float:
        """Size of the largest left side."""
        return float(np.abs(self.residual).max(initial=0.0))

    @property
    def length(self) -> float:
        """Length of the vector of left sides."""
        return float(np.linalg.norm(self.residual))


class Descent:
    """Equations of a mechanism for Newton's method, which accepts only steps that make the residual smaller.

    Args:
        motions: kinematics of the mechanism.
        equations: functions of coordinates, and of the mechanism at these.
        free: indices of the coordinates that move.
        closed: largest left side where the equations hold.
        size: (f,) of each of these: least-norm steps are shortest in parts of it.
        stuck: part of the residual above which a step leads nowhere, where loops are open; 1 for none.
        is_damped: whether steps are damped. Equations that depend on each other have singular values of the order of
            the residual: damped, they ask for no large steps.
    """

    def __init__(
        self,
        motions: Motions,
        equations: Callable[[Coordinates, Placed], Equations],
        free: np.ndarray,
        closed: float,
        *,
        size: FloatArray | float = 1.0,
        stuck: float = 1.0,
        is_damped: bool = True,
    ) -> None:
        self._motions, self._equations, self._free, self._closed = motions, equations, free, closed
        self._size, self._stuck, self._is_damped = size, stuck, is_damped

    def at(self, at: Coordinates) -> Reached:
        """Return coordinates with the equations there."""
        placed = self._motions.placed(at)
        return Reached(at, placed, *self._equations(at, placed), is_stuck=False)

    def linear(self, at: Reached) -> Linear | None:
        """Return the equations to first order; None where they hold, and where steps lead nowhere."""
        if at.is_stuck or at.error <= self._closed:
            return None
        return Linear(at.residual, at.slopes[:, self._free] * self._size, at.length**2 if self._is_damped else 0.0)

    def moved(self, at: Reached, step: FloatArray) -> Reached | None:
        """Return the coordinates after a step; None where the residual is no smaller there."""
        every = np.zeros(self._motions.count)
        every[self._free] = self._size * step
        found = self.at(self._motions.stepped(at.at, every, at.placed))
        if not found.length < at.length:
            return None
        return found._replace(is_stuck=found.length > self._stuck * at.length > CLOSED)
