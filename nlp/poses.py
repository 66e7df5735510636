"""Several poses from one: displacements of the platform along a screw motion, or over a grid."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from screwsynth.models import FloatArray, axis_from_screw, frozen_array

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Step:
    """A displacement of the platform in the world frame: a pose ``(R, p)`` goes to ``(Q R, Q p + t)``.

    Attributes:
        rotation: (3, 3) ``Q``.
        translation: (3,) ``t``, length.
    """

    rotation: FloatArray
    translation: FloatArray

    @property
    def is_identity(self) -> bool:
        """Whether it leaves every pose where it is."""
        return bool(np.array_equal(self.rotation, np.eye(3)) and not self.translation.any())


def _step(rotation: FloatArray, translation: FloatArray) -> Step:
    return Step(frozen_array(rotation, (3, 3)), frozen_array(translation, (3,)))


#: No displacement.
HERE = _step(np.eye(3), np.zeros(3))


def along_screw(twist: ArrayLike, amounts: Sequence[float]) -> tuple[Step, ...]:
    """Displacements along the finite screw motion ``exp(t [chi])`` of a twist.

    Args:
        twist: (6,) ``chi``, of any size but zero: only its axis and pitch count.
        amounts: how far each goes: radians about the axis, or a length for a pure translation.
    """
    screw = axis_from_screw(twist)
    s = np.asarray(screw.axis)
    if math.isinf(screw.pitch):
        return tuple(_step(np.eye(3), amount * s) for amount in amounts)
    point, cross = np.asarray(screw.point), np.cross(np.eye(3), s)
    steps = []
    for amount in amounts:
        # Rodrigues' formula.
        Q = np.eye(3) + math.sin(amount) * cross + (1 - math.cos(amount)) * (cross @ cross)
        steps.append(_step(Q, point - Q @ point + screw.pitch * amount * s) if amount else HERE)
    return tuple(steps)


def over_grid(offsets: Sequence[Sequence[float]]) -> tuple[Step, ...]:
    """Displacements without rotation to every combination of offsets along x, y and z."""
    return tuple(_step(np.eye(3), np.array(offset, dtype=np.float64)) for offset in itertools.product(*offsets))
