"""Levenberg-Marquardt iteration on joint coordinates until equations are satisfied or the residual stops falling.

The damping is the squared residual, with quadratic convergence [1].

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

#: Largest scaled residual of closed loops; rounding errors of 60 joints in series leave 1e-14.
CLOSED = 1e-11


class Reached(NamedTuple):
    """Iterate: joint coordinates of a mechanism, with the values of the equations at these coordinates.

    Attributes:
        at: joint coordinates.
        placed: mechanism at these coordinates.
        residual: (m,) left sides of the equations.
        slopes: (m, n) derivatives of the left sides.
        is_stuck: True if the step to this point hardly reduced the residual.
    """

    at: Coordinates
    placed: Placed
    residual: FloatArray
    slopes: FloatArray
    is_stuck: bool

    @property
    def error(self) -> float:
        """Largest absolute left side."""
        return float(np.abs(self.residual).max(initial=0.0))

    @property
    def length(self) -> float:
        """Length of the vector of left sides."""
        return float(np.linalg.norm(self.residual))


class Descent:
    """Equations of a mechanism for Newton's method, with steps accepted only if they reduce the residual.

    Args:
        motions: kinematics of the mechanism.
        equations: function of coordinates and of the mechanism at these coordinates; it returns the equations.
        free: indices of the variable coordinates.
        closed: largest left side at a solution.
        size: (f,) scale of each variable coordinate, for least-norm steps.
        stuck: ratio of residuals above which a step is stuck; 1 to disable the test.
        is_damped: If true, steps are damped. Dependent equations have singular values of the order of the residual,
            which would cause large undamped steps.
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
        """Return coordinates with the values of the equations."""
        placed = self._motions.placed(at)
        return Reached(at, placed, *self._equations(at, placed), is_stuck=False)

    def linear(self, at: Reached) -> Linear | None:
        """Return the linearised equations; None at a solution, or if the iteration is stuck."""
        if at.is_stuck or at.error <= self._closed:
            return None
        return Linear(at.residual, at.slopes[:, self._free] * self._size, at.length**2 if self._is_damped else 0.0)

    def moved(self, at: Reached, step: FloatArray) -> Reached | None:
        """Return the coordinates after a step; None if the residual does not fall."""
        every = np.zeros(self._motions.count)
        every[self._free] = self._size * step
        found = self.at(self._motions.stepped(at.at, every, at.placed))
        if not found.length < at.length:
            return None
        return found._replace(is_stuck=found.length > self._stuck * at.length > CLOSED)
