"""What the optimal F owes to the numbers that a case fixes.

By the envelope theorem the derivative of the optimal F by an argument is that of the Lagrangian, at the optimum and
with its multipliers held: nothing needs to be solved again (A. V. Fiacco, *Introduction to Sensitivity and Stability
Analysis in Nonlinear Programming*, 1983, chapter 3). It stands where the active limits' normals are independent and the
second-order conditions hold strictly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...models import Dimension, FloatArray
from ..program.nlp import Nlp
from .kkt import linearise, multipliers


@dataclass(frozen=True)
class Sensitivity:
    """Derivative of the optimal F by a fixed number.

    Attributes:
        name: the number.
        value: what it is, radians for angles.
        derivative: of the optimal F, per radian for angles.
        dimension: what the number measures.
    """

    name: str
    value: float
    derivative: float
    dimension: Dimension


def sensitivities(nlp: Nlp, x: FloatArray) -> list[Sensitivity]:
    """Return the derivatives at an optimum (n,) by the robot's and the pose's fixed numbers, in the case's order."""
    places = [place.index for place in nlp.program.places.numbers if place.vector == "p"]
    if not places:
        return []
    at = linearise(nlp, x)
    mu, _ = multipliers(at, at.active())
    gradient, rows = nlp.program.kernels.argument_derivatives(x, nlp.arguments)
    table = nlp.sides
    carried = np.bincount(table.place, table.sign * mu * at.per_unit, nlp.n + len(nlp.program.constraints))
    whole = gradient.ravel() + nlp.sign * nlp.objective_scale * (carried[nlp.n :] @ rows)
    arguments = nlp.program.arguments
    return [
        Sensitivity(arguments[k].name, float(nlp.arguments[k]), float(whole[k]), arguments[k].dimension) for k in places
    ]
