"""Linearised equations of a nonlinear program, for Newton's method on the equations only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...models import FloatArray
from ...models.newton import Linear
from ..program.nlp import Nlp


class Equations(NamedTuple):
    """Equations of a program at a point, in the scaled variables of :class:`.kkt.Linearisation`.

    Attributes:
        x: (n,) the point, unscaled.
        residual: (k,) signed residuals.
        normals: (k, n) unit vectors along the gradients of the residuals.
        is_defined: If true, the program has a finite value at the point.
    """

    x: FloatArray
    residual: FloatArray
    normals: FloatArray
    is_defined: bool


class ProgramEquations:
    """Equations of a program for Newton's method, with steps inside the bounds of the variables.

    Args:
        nlp: the nonlinear program.
        movable: indices of the variables that move.
        closed: largest residual at which the equations count as satisfied.
        no_gradient: relative size below which the gradient of a constraint counts as zero.
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
        """Return the equations to first order; None if the equations hold or are undefined."""
        if np.max(np.abs(at.residual)) <= self._closed or not at.is_defined:
            return None
        return Linear(at.residual, at.normals[:, self._movable])

    def moved(self, at: Equations, step: FloatArray) -> Equations:
        """Return the equations after a step of the movable variables."""
        x = at.x.copy()
        x[self._movable] += self._nlp.scale[self._movable] * step
        return self.at(np.clip(x, self._nlp.lower, self._nlp.upper))


def gradient_sizes(gradients: FloatArray, longest: FloatArray, no_gradient: float) -> FloatArray:
    """Return the lengths (k,) of the gradients of constraints, which turn residuals into distances.

    For a zero gradient, the typical length is returned, because there is no distance.

    Args:
        gradients: (k, n) gradients in scaled variables.
        longest: (k,) longest gradient of each constraint at a few points; 0 without a finite gradient.
        no_gradient: relative size below which a gradient counts as zero.
    """
    sizes = np.sqrt(np.einsum("ij,ij->i", gradients, gradients))
    typical = np.where(longest > 0, np.minimum(longest, 1.0), 1.0)
    return np.where(sizes > no_gradient * typical, sizes, typical)
