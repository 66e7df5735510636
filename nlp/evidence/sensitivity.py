"""Sensitivity of the optimal F to the numbers that a case fixes.

By the envelope theorem the derivative of the optimal F with respect to an argument is that of the Lagrangian, at the
optimum and with its multipliers held fixed, without a further solution (A. V. Fiacco, *Introduction to Sensitivity and
Stability Analysis in Nonlinear Programming*, 1983, chapter 3). The theorem requires that the normals of the active
sides are independent and that the second-order conditions hold strictly.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...models import Dimension, FloatArray
from ..program.nlp import Nlp
from .kkt import constraint_weights, linearise, multipliers


@dataclass(frozen=True)
class Sensitivity:
    """Derivative of the optimal F with respect to a fixed number.

    Attributes:
        name: name of the number.
        value: the number, radians for angles.
        derivative: derivative of the optimal F, per radian for angles.
        dimension: length, angle or plain number.
    """

    name: str
    value: float
    derivative: float
    dimension: Dimension


def sensitivities(nlp: Nlp, x: FloatArray) -> list[Sensitivity]:
    """Return the sensitivities of the optimal F to the fixed numbers of the robot and the poses, in the case's order.

    Args:
        nlp: the program.
        x: (n,) an optimum.
    """
    places = [place.index for place in nlp.program.places.numbers if place.vector == "p"]
    if not places:
        return []
    at = linearise(nlp, x)
    mu, _ = multipliers(at, at.active())
    gradient, rows = nlp.program.kernels.argument_derivatives(x, nlp.arguments)
    whole = gradient.ravel() + nlp.sign * nlp.objective_scale * (constraint_weights(nlp, at, mu) @ rows)
    arguments = nlp.program.arguments
    return [
        Sensitivity(arguments[k].name, float(nlp.arguments[k]), float(whole[k]), arguments[k].dimension) for k in places
    ]
