"""Newton's method with least-norm steps, for equations in a vector of numbers or in a point of any other kind.

All equations of one point are solved here: closed loops, conditions of stationarity, joints in line with each other.
Loops of many poses at once are closed by ``Loops.all_closed`` of :mod:`screwsynth.nlp`, in the home assembly mode.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol, TypeVar

import numpy as np

from .arrays import FloatArray
from .linalg import least_squares

if TYPE_CHECKING:
    from numpy.typing import NDArray

P = TypeVar("P")


class Linear(NamedTuple):
    """Equations at a point, to first order.

    Attributes:
        residual: (m,) left sides, which are zero where the equations hold.
        slopes: (m, n) their derivatives by the coordinates of a step.
        damping: added to the squares of the singular values: 0 for a full step.
    """

    residual: FloatArray
    slopes: FloatArray
    damping: float = 0.0


class Equations(Protocol[P]):
    """Equations, and the set in which their point moves: it need not be a space of vectors."""

    def linear(self, at: P) -> Linear | None:
        """Return the equations at a point to first order; None where the search ends, as where they hold."""

    def moved(self, at: P, step: FloatArray) -> P | None:
        """Return the point after a step (n,); None to refuse the step."""


def newton(
    equations: Equations[P],
    at: P,
    *,
    steps: int,
    zeros: Sequence[float | None] = (None,),
    parts: Sequence[float] = (1.0,),
) -> P:
    """Return the point at which Newton's method with least-norm steps ends.

    That is where the equations end the search, where they refuse each trial of a step, or after a number of steps.

    Args:
        equations: equations of the point.
        at: first point.
        steps: largest number of steps.
        zeros: parts of the largest singular value below which others are zero, one for each trial; None for rounding.
        parts: parts of the step, one for each further trial with the same singular values.
    """
    for _ in range(steps):
        linear = equations.linear(at)
        if linear is None:
            break
        wholes = (least_squares(linear.slopes, -linear.residual, zero, linear.damping) for zero in zeros)
        trials = (equations.moved(at, part * whole) for whole in wholes for part in parts)
        following = next((trial for trial in trials if trial is not None), None)
        if following is None:
            break
        at = following
    return at


class Point(NamedTuple):
    """A vector of numbers, with equations there.

    Attributes:
        z: (n,) the numbers.
        residual: (m,) left sides of the equations.
        slopes: (m, n or more) their derivatives.
    """

    z: FloatArray
    residual: FloatArray
    slopes: FloatArray

    @property
    def error(self) -> float:
        """Size of the largest left side; infinite where one, or a derivative, is no finite number."""
        is_defined = np.isfinite(self.residual).all() and np.isfinite(self.slopes).all()
        return float(np.abs(self.residual).max(initial=0.0)) if is_defined else float("inf")


class VectorEquations:
    """Equations in a vector, of which some numbers move, by full steps that are shortest in parts of their sizes.

    Args:
        values: function of a vector (n,), which returns left sides (m,) or (m, 1), and derivatives (m, n or more).
        closed: largest left side where the equations hold.
        moving: indices of the numbers that move; all if left out.
        size: size of each number that moves; 1 if left out.
    """

    def __init__(
        self,
        values: Callable[[FloatArray], Sequence[FloatArray]],
        closed: float,
        moving: Sequence[int] | NDArray[np.intp] | slice = slice(None),
        size: FloatArray | float = 1.0,
    ) -> None:
        self._values, self._closed, self._moving, self._size = values, closed, moving, size

    def at(self, z: FloatArray) -> Point:
        """Return a vector (n,) with the equations there."""
        residual, slopes = self._values(z)
        return Point(z, residual.ravel(), slopes)

    def linear(self, at: Point) -> Linear | None:
        """Return the equations to first order; None where they hold or are not defined."""
        if not self._closed < at.error < np.inf:
            return None
        return Linear(at.residual, at.slopes[:, : len(at.z)][:, self._moving] * self._size)

    def moved(self, at: Point, step: FloatArray) -> Point:
        """Return the vector after a step."""
        z = at.z.copy()
        z[self._moving] += self._size * step
        return self.at(z)
