"""Newton's method with least-norm steps, for vectors and for points of any other set.

All equations of single points are solved here: closed loops, stationarity conditions, aligned joints.
``Loops.all_closed`` of :mod:`screwsynth.nlp` closes the loops of many poses at once, in the home assembly mode.
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
    """Linearised equations at a point.

    Attributes:
        residual: (m,) left sides, zero at a solution.
        slopes: (m, n) derivatives of the left sides with respect to the coordinates of a step.
        damping: term added to the squared singular values; 0 for a full step.
    """

    residual: FloatArray
    slopes: FloatArray
    damping: float = 0.0


class Equations(Protocol[P]):
    """Equations, and the set in which the point moves, not necessarily a vector space."""

    def linear(self, at: P) -> Linear | None:
        """Return the linearised equations at a point; None to end the iteration, as at a solution."""

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
    """Return the last point of Newton's method with least-norm steps.

    The iteration ends where ``linear`` returns None, where every trial of a step is refused, or after ``steps`` steps.

    Args:
        equations: equations of the point.
        at: first point.
        steps: largest number of steps.
        zeros: relative sizes below which singular values count as zero, one for each trial; None for rounding.
        parts: fractions of the step to try in turn, with the same zero singular values.
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
    """Vector with the values of equations.

    Attributes:
        z: (n,) vector.
        residual: (m,) left sides of the equations.
        slopes: (m, n or more) derivatives of the left sides.
    """

    z: FloatArray
    residual: FloatArray
    slopes: FloatArray

    @property
    def error(self) -> float:
        """Largest absolute left side; infinite if it or a derivative is not finite."""
        is_defined = np.isfinite(self.residual).all() and np.isfinite(self.slopes).all()
        return float(np.abs(self.residual).max(initial=0.0)) if is_defined else float("inf")


class VectorEquations:
    """Equations in a vector with some fixed components, solved by full steps that are shortest in scaled components.

    Args:
        values: function of a vector (n,), which returns left sides (m,) or (m, 1), and derivatives (m, n or more).
        closed: largest left side at a solution.
        moving: indices of the variable components; all by default.
        size: scale of each variable component, for shortest steps; 1 by default.
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
        """Return a vector (n,) with the values of the equations."""
        residual, slopes = self._values(z)
        return Point(z, residual.ravel(), slopes)

    def linear(self, at: Point) -> Linear | None:
        """Return the linearised equations; None at a solution, or where they are not defined."""
        if not self._closed < at.error < np.inf:
            return None
        return Linear(at.residual, at.slopes[:, : len(at.z)][:, self._moving] * self._size)

    def moved(self, at: Point, step: FloatArray) -> Point:
        """Return the vector after a step."""
        z = at.z.copy()
        z[self._moving] += self._size * step
        return self.at(z)
