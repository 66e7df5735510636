"""Dependence of F on two conventions: the characteristic length, and centres that the joints do not determine.

For almost every robot F does not depend on them if the platform can make the motion with unlocked actuators. For other
motions constraint wrenches count too: the characteristic length weighs their couples, and a couple depends on the point
about which it is taken. In a limb without ball joint and without two intersecting hinges, this point is the centre of
the last passive joint, and its position along the joint axis is arbitrary.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray, Model, Substitution, objective
from ...models.values import dataclass
from ..program.nlp import Nlp

#: Relative dependence below this is rounding: F is a sum of squares of rates that are known to 1e-9.
_NEGLIGIBLE = 1e-7


@dataclass(frozen=True)
class Dependence:
    """Dependence of F on conventions, relative to F.

    Attributes:
        length: relative derivative ``(l / F) dF/dl`` with respect to the characteristic length; 0 if F does not depend
            on the length.
        centre: largest relative change of F if all arbitrary centres move along their joint axes by the characteristic
            length, to either side; None if all centres are determined.
    """

    length: float
    centre: float | None


def dependence_of(nlp: Nlp, x: FloatArray) -> Dependence | None:
    """Return the dependence of F, summed over the poses, on conventions; None for a robot without couples, or F = 0.

    Args:
        nlp: nonlinear program; for several tasks, the first task counts.
        x: (n,) the point.
    """
    model, program = nlp.program.model, nlp.program
    if not model.has_couples:
        return None
    function = _objective_function(model)
    length = nlp.case.characteristic_length
    twist = nlp.arguments[list(program.places.twists[0])]
    totals = np.zeros(4)
    size = 0.0
    for pose, kernel in enumerate(program.kernels.robot_states):
        numbers = kernel(x, nlp.arguments)
        at = [numbers.parameters, x[list(program.places.unknowns[pose])], numbers.rotation, numbers.position]
        here = [np.array(each).item() for each in function.call([*at, length, 0.0, twist])]
        moved = [function.call([*at, length, side * length, twist])[0] for side in (1.0, -1.0)]
        totals += [*here, *(np.array(each).item() for each in moved)]
        size += float(numbers.magnitude[0, 0])
    F, slope, *others = totals.tolist()
    if not np.isfinite(totals).all() or size * _NEGLIGIBLE**2 >= F:
        return None
    may_slide = any(member.slide is not None for member in model.members)
    largest = max((abs(each - F) / F for each in others), default=0.0)
    return Dependence(_settled(length * slope / F), _settled(largest) if may_slide else None)


def _settled(value: float) -> float:
    """Return a relative change of F, or 0 for a change within rounding error."""
    return 0.0 if abs(value) <= _NEGLIGIBLE else value


def _objective_function(model: Model) -> ca.Function:
    """Return the function for F and its derivative with respect to the characteristic length.

    Its arguments are parameters, unknowns, rotation and position, the characteristic length, the shift of the centres
    along their joint axes, and the twist.
    """
    length, way, twist = SX.sym("length"), SX.sym("way"), SX.sym("twist", 6)
    members = [
        each if each.slide is None else replace(each, centre=each.centre + way * each.slide) for each in model.members
    ]
    F = objective(model.wrenches, twist, length, members)
    outputs = [ca.densify(F), ca.densify(ca.jacobian(F, length))]
    return ca.Function("conventions", [*Substitution.identity(model).all, length, way, twist], outputs)
