"""A program's equations alone, linearised: Newton's method on them needs nothing else of the program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ...models.newton import Linear
from ..program.nlp import Nlp


class Equations(NamedTuple):
    """The equations of a program at a point, in scaled variables, as :class:`.kkt.Linearisation` has them.

    Attributes:
        x: (n,) the point, unscaled.
        residual: (k,) signed residuals.
        normals: (k, n) directions of their gradients.
        is_defined: whether the program has a finite value there.
    """

    x: FloatArray
    residual: FloatArray
    normals: FloatArray
    is_defined: bool


class ProgramEquations:
    """The equations of a program for Newton's method, with steps inside the bounds of the variables.

    Args:
        nlp: the program.
        movable: indices of the variables that move.
        closed: largest residual where the equations hold.
        no_gradient: gradient of a constraint, as a part of its typical size, that counts as zero.
    """

    def __init__(self, nlp: Nlp, movable: Sequence[int], closed: float, no_gradient: float) -> None:
        self._nlp, self._movable, self._closed, self._no_gradient = nlp, list(movable), closed, no_gradient
        self._rows = np.flatnonzero(nlp.sides.equal)

    def at(self, x: FloatArray) -> Equations:
        """Return the equations at a point (n,)."""
        nlp, sides, rows = self._nlp, self._nlp.sides, self._rows
        F, _, g, jacobian = nlp.program.kernels.derivatives(x, nlp.arguments)
        place = sides.place[rows] - nlp.n
        gradients = jacobian[place] * nlp.scale
        per_unit = 1 / gradient_sizes(gradients, nlp.row_sizes[place], self._no_gradient)
        residual = sides.sign[rows] * (g.ravel()[place] - sides.limit[rows]) * per_unit
        normals = (sides.sign[rows] * per_unit)[:, None] * gradients
        is_defined = bool(np.isfinite(F).all() and np.isfinite(g).all())
        return Equations(np.asarray(x, dtype=np.float64), residual, normals, is_defined)

    def linear(self, at: Equations) -> Linear | None:
        """Return the equations to first order; None where they hold or are not defined."""
        if np.max(np.abs(at.residual)) <= self._closed or not at.is_defined:
            return None
        return Linear(at.residual, at.normals[:, self._movable])

    def moved(self, at: Equations, step: FloatArray) -> Equations:
        """Return the equations after a step of the variables that move."""
        x = at.x.copy()
        x[self._movable] += self._nlp.scale[self._movable] * step
        return self.at(np.clip(x, self._nlp.lower, self._nlp.upper))


def gradient_sizes(gradients: FloatArray, longest: FloatArray, no_gradient: float) -> FloatArray:
    """Return (k,) sizes by which constraints are divided: the lengths of their gradients.

    Where the gradient of a constraint is zero there is no distance to it; the residual itself replaces the distance.

    Args:
        gradients: (k, n) gradients in scaled variables.
        longest: (k,) longest gradient of each constraint at a few points; 0 where there is none.
        no_gradient: gradient, as a part of the typical size, that counts as zero.
    """
    sizes = np.sqrt(np.einsum("ij,ij->i", gradients, gradients))
    typical = np.where(longest > 0, np.minimum(longest, 1.0), 1.0)
    return np.where(sizes > no_gradient * typical, sizes, typical)
