"""Sensitivity of the optimal F to the parameters that a case fixes.

By the envelope theorem the derivative of the optimal F with respect to an argument is that of the Lagrangian at the
optimum, with constant multipliers (A. V. Fiacco, *Introduction to Sensitivity and Stability Analysis in Nonlinear
Programming*, 1983, chapter 3). It needs independent active normals and strict second-order conditions. With dependent
normals the derivative exists only if it is the same for all multipliers, that is, if the variables can follow the
argument to first order with all active sides active. It does not exist where the loops close at one value only.
"""

import enum
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray
from ..program.nlp import Nlp
from ..system.jsonvalues import Absent, Hidden, JsonObject, Shown, Slope
from .kkt import constraint_weights, linearise, multipliers

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Relative rounding of derivatives, below which distances of vectors from a space, and singular values, count as zero;
#: and relative size below which vectors count as zero.
_OUTSIDE, _ZERO = 1e-7, 1e-12


class Hindrance(enum.Enum):
    """Reason why the optimal F has no derivative with respect to a fixed parameter."""

    LOOPS = "loops close at no other value"
    CORNER = "F has a kink at this value"


class Sensitivity(JsonObject):
    """Sensitivity of the optimal F to a fixed parameter.

    Attributes:
        name: name of the parameter.
        value: value of the parameter.
        unit: unit of the value.
        derivative: derivative of the optimal F with respect to the parameter; absent if it does not exist.
        hindrance: reason why the derivative does not exist, in words.
        dimension: dimension of the parameter; angles are in radians.
    """

    name: str
    value: Shown
    unit: str
    derivative: Slope[Absent[float]]
    hindrance: Absent[Hindrance]
    dimension: Hidden[Dimension] = Dimension.NUMBER


def sensitivities(nlp: Nlp, x: FloatArray) -> list[Sensitivity]:
    """Return the sensitivities of the optimal F to the fixed parameters of robot and poses, in the case's order.

    Args:
        nlp: the nonlinear program.
        x: (n,) an optimum.
    """
    places = [place.index for place in nlp.program.places.numbers if place.vector == "p"]
    if not places:
        return []
    at = linearise(nlp, x)
    active = at.active()
    mu, _ = multipliers(at, active)
    gradient, rows = nlp.program.kernels.argument_derivatives(x, nlp.arguments)
    whole = gradient.ravel() + nlp.sign * nlp.objective_scale * (constraint_weights(nlp, at, mu) @ rows)
    sides = [j for j in active if nlp.sides.sides[j].constraint is not None]
    bounds = [j for j in active if j not in sides]
    by_argument = (nlp.sides.sign * at.per_unit)[sides, None] * rows[nlp.sides.place[sides] - nlp.n]
    moved = np.vstack([by_argument, np.zeros((len(bounds), rows.shape[1]))])
    cornered = ~_can_follow(at.normals[[*sides, *bounds]], moved)
    without_choice = ~_can_follow(*_loop_derivatives(nlp, x))
    arguments, found = nlp.program.arguments, []
    for k in places:
        hindrance = Hindrance.LOOPS if without_choice[k] else Hindrance.CORNER if cornered[k] else None
        found.append(
            Sensitivity(
                name=arguments[k].name,
                value=float(nlp.arguments[k]),
                unit=nlp.case.units.label(arguments[k].dimension),
                derivative=float(whole[k]) if hindrance is None else None,
                hindrance=hindrance,
                dimension=arguments[k].dimension,
            )
        )
    return found


def _can_follow(by_variable: FloatArray, by_argument: FloatArray) -> "NDArray[np.bool_]":
    """Return for each argument (k,) whether variables can follow its change so that functions keep their values.

    Args:
        by_variable: (m, n) derivatives of the functions with respect to the variables.
        by_argument: (m, k) derivatives of the functions with respect to the arguments.
    """
    if not by_variable.size:
        return np.asarray(~by_argument.any(axis=0), dtype=np.bool_)
    steps = np.linalg.lstsq(by_variable, by_argument, rcond=_OUTSIDE)[0]
    left, whole = (np.linalg.norm(each, axis=0) for each in (by_argument - by_variable @ steps, by_argument))
    return np.asarray(left <= np.maximum(_OUTSIDE * whole, _ZERO * whole.max(initial=0.0)), dtype=np.bool_)


def _loop_derivatives(nlp: Nlp, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of all loop equations with respect to variables, scaled (m, n), and arguments (m, k).

    The program itself has only the equations that are independent at the fixed parameters.
    """
    program = nlp.program
    loops = ca.vertcat(SX(0, 1), *[robot.loops for robot in program.robots])
    outputs = [ca.densify(ca.jacobian(loops, each)) for each in (program.x, program.p)]
    by_variable, by_argument = ca.Function("loops", [program.x, program.p], outputs)(x, nlp.arguments)
    return by_variable.full() * nlp.scale, by_argument.full()
