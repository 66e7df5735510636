"""A program's equations alone, linearised: Newton's method on them needs nothing else of the program."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...models import FloatArray
from ..program.nlp import Nlp

if TYPE_CHECKING:
    from numpy.typing import NDArray


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


def linearise_equations(nlp: Nlp, rows: NDArray[np.intp], x: FloatArray, no_gradient: float) -> Equations:
    """Return some of a program's equations linearised at a point.

    Args:
        nlp: the program.
        rows: (k,) indices of the equations' sides.
        x: (n,) the point.
        no_gradient: gradient of a constraint, as a part of its typical size, that counts as zero.
    """
    F, _, g, jacobian = nlp.program.kernels.derivatives(x, nlp.arguments)
    sides, place = nlp.sides, nlp.sides.place[rows] - nlp.n
    gradients = jacobian[place] * nlp.scale
    per_unit = 1 / gradient_sizes(gradients, nlp.row_sizes[place], no_gradient)
    residual = sides.sign[rows] * (g.ravel()[place] - sides.limit[rows]) * per_unit
    normals = (sides.sign[rows] * per_unit)[:, None] * gradients
    is_defined = bool(np.isfinite(F).all() and np.isfinite(g).all())
    return Equations(np.asarray(x, dtype=np.float64), residual, normals, is_defined)


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
