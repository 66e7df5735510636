"""The worst machine for limits on the joint centres of the plates, which no pose changes.

With t the tolerance two joint centres are nearer by at most 2 t, and one is farther out by at most t. A plate's radius
is the root of a sum of squares, each of which grows by itself.
"""

from __future__ import annotations

import math

import numpy as np
from casadi import SX

from ......models import FloatArray
from ....statement.machine import INSIDE, LEGS, JointErrors, Legs
from ....statement.tolerance_bound import Worst
from ...robot.pose_box import PoseNumbers
from .worst import of_leg, unit

#: Part of itself by which a bound moves outwards: its own rounding.
_OUTWARDS = 1 + 1e-12


def worst_spacing(legs: Legs, plate: str, one: int, other: int) -> Worst:
    """Return the smallest distance of two joint centres of a plate, ``base`` or ``platform``."""

    def value(machine: Legs, pose: PoseNumbers) -> float:  # noqa: ARG001 - no pose changes it
        centres = getattr(machine, plate)
        return float(np.linalg.norm(centres[other] - centres[one]))

    def errors(pose: PoseNumbers) -> JointErrors:  # noqa: ARG001 - no pose changes it
        centres = getattr(legs, plate)
        apart = centres[other] - centres[one]
        return _of_plate(legs, plate, of_leg(one, apart) - of_leg(other, apart))

    return Worst(errors, value, allowance=2 * legs.tolerance, least=0.0)


def worst_radius(legs: Legs, plate: str, i: int) -> Worst:
    """Return the largest distance of a joint centre from its plate's axis."""

    def value(machine: Legs, pose: PoseNumbers) -> float:  # noqa: ARG001 - no pose changes it
        return float(np.linalg.norm(getattr(machine, plate)[i, :2]))

    def errors(pose: PoseNumbers) -> JointErrors:  # noqa: ARG001 - no pose changes it
        return _of_plate(legs, plate, of_leg(i, getattr(legs, plate)[i] * (1.0, 1.0, 0.0)))

    return Worst(errors, value, allowance=legs.tolerance)


def worst_ratio(legs: Legs, sign: float) -> Worst:
    """Return the largest (sign 1) or smallest (sign -1) ratio of the platform's radius to the base's."""
    radii = [np.linalg.norm(centres[:, :2], axis=1) for centres in (legs.platform, legs.base)]
    t = sign * legs.tolerance * _OUTWARDS
    squares = [float((np.maximum(r + e, 0.0) ** 2).sum()) for r, e in zip(radii, (t, -t), strict=True)]

    def value(machine: Legs, pose: PoseNumbers) -> float:  # noqa: ARG001 - no pose changes it
        return float(np.linalg.norm(machine.platform[:, :2]) / np.linalg.norm(machine.base[:, :2]))

    def errors(pose: PoseNumbers) -> JointErrors:  # noqa: ARG001 - no pose changes it
        flat = np.array([1.0, 1.0, 0.0])
        return JointErrors(
            _of_plate(legs, "base", -sign * legs.base * flat).base,
            _of_plate(legs, "platform", sign * legs.platform * flat).platform,
        )

    return Worst(errors, value, SX(squares[0] / squares[1] if squares[1] > 0 else math.inf), least=0.0)


def _of_plate(legs: Legs, plate: str, vectors: FloatArray) -> JointErrors:
    """Return errors as large as the tolerance along vectors (6, 3) in the frame of one plate."""
    errors, none = legs.tolerance * INSIDE * unit(vectors), np.zeros((LEGS, 3))
    return JointErrors(errors, none) if plate == "base" else JointErrors(none, errors)
