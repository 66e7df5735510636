"""Tasks of a case, and the methods that combine several."""

from __future__ import annotations

import enum
import math
from typing import TYPE_CHECKING

from ...models import FloatArray, screw_from_axis
from ...models.values import dataclass
from ..errors import CaseError
from .checks import check_direction, check_real, check_size, check_vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


#: Numbers of the actuators that can be minimised, and whether they need loads and motions.
MEASURES = {"actuator_force": (True, False), "actuator_speed": (False, True), "actuator_power": (True, True)}


class Sense(enum.Enum):
    """Sense of the optimisation of F."""

    MAX = "max"
    MIN = "min"

    @property
    def sign(self) -> float:
        """1 of a maximum and -1 of a minimum: this times the number is maximised."""
        return 1.0 if self is Sense.MAX else -1.0


@dataclass(frozen=True, eq=False)
class Task:
    """An instantaneous twist deformation (ITD) that the platform must make (equation 12).

    Attributes:
        twist: (6,) ``(omega, v)`` in the world frame; ``v`` is the velocity of the platform point at the world origin.
        sense: whether F is maximised or minimised.
        name: a few words.
        weight: positive weight among several tasks.
        point: (3,) point of the axis as it was stated, length; None for a translation, and for a task given as a twist.
        measure: number of the actuators that is minimised instead of F, such as ``actuator_force``; empty for F.
        is_stated: whether the motion is a case's own; else it stands for none, and says nothing.
    """

    twist: ArrayLike
    sense: Sense = Sense.MAX
    name: str = "task"
    weight: float = 1.0
    point: ArrayLike | None = None
    measure: str = ""
    is_stated: bool = True

    @classmethod
    def minimise(cls, measure: str) -> Task:
        """Return the objective that a number of the actuators is as small as possible.

        Args:
            measure: ``"actuator_force"``, ``"actuator_speed"`` or ``"actuator_power"``: the largest size over loads,
                actuators and poses.
        """
        return cls((0.0, 0.0, 0.0, 0.0, 0.0, 1.0), Sense.MIN, measure, measure=measure, is_stated=False)

    @classmethod
    def screw(
        cls,
        sense: Sense | str,
        *,
        axis: ArrayLike,
        pitch: float,
        point: ArrayLike | None = None,
        name: str = "task",
        weight: float = 1.0,
    ) -> Task:
        """Return a unit screw motion about an axis.

        Args:
            sense: ``"max"`` or ``"min"``.
            axis: (3,) direction, any length but zero.
            pitch: translation per radian, length; ``math.inf`` is the pure translation along the axis.
            point: (3,) any point of the axis, length; needed unless the pitch is infinite.
            name: a few words.
            weight: positive.

        Raises:
            CaseError: the sense is another word, the axis is zero, the point is missing, or a number is not finite.
        """
        if sense not in ("max", "min", Sense.MAX, Sense.MIN):
            raise CaseError("task.sense", "must be 'max' or 'min'", sense)
        twist = unit_twist(axis, point, pitch, "task")
        return cls(twist, Sense(sense), name, weight, None if pitch == math.inf else point)

    @classmethod
    def rotation(
        cls, axis: ArrayLike, through: ArrayLike, *, sense: Sense | str = "max", name: str = "task", weight: float = 1.0
    ) -> Task:
        """Return a pure rotation about an axis.

        Args:
            axis: (3,) direction of the axis, any length but zero; the right-hand rule gives the sense of rotation.
            through: (3,) any point of the axis, length.
            sense: ``"max"`` or ``"min"``.
            name: a few words.
            weight: positive weight among several tasks.

        Raises:
            CaseError: the sense is another word, the axis is zero, or a number is not finite.
        """
        point = check_vector(through, "task.through")
        return cls.screw(sense, axis=axis, pitch=0.0, point=point, name=name, weight=weight)

    @classmethod
    def translation(
        cls, direction: ArrayLike, *, sense: Sense | str = "max", name: str = "task", weight: float = 1.0
    ) -> Task:
        """Return a pure translation along a direction.

        Args:
            direction: (3,) direction of the velocity, any length but zero.
            sense: ``"max"`` or ``"min"``.
            name: a few words.
            weight: positive weight among several tasks.

        Raises:
            CaseError: the sense is another word, the direction is zero, or a number is not finite.
        """
        along = check_direction(direction, "task.direction")
        return cls.screw(sense, axis=along, pitch=math.inf, name=name, weight=weight)


def unit_twist(axis: ArrayLike | None, point: ArrayLike | None, pitch: float | None, key: str) -> FloatArray:
    """Return the twist (6,) of a unit screw motion.

    Args:
        axis: (3,) direction, any length but zero.
        point: (3,) any point of the axis, length; needed unless the pitch is infinite.
        pitch: translation per radian, length; ``math.inf`` is the pure translation along the axis.
        key: dotted key of the task, for messages.

    Raises:
        CaseError: a part is missing or not allowed.
    """
    if axis is None:
        raise CaseError(f"{key}.axis", "is missing: give axis, point and pitch, or twist")
    direction = check_direction(axis, f"{key}.axis")
    if pitch is None:
        raise CaseError(f"{key}.pitch", "is missing: a number, 0 for a rotation, inf for a translation")
    pitch = check_real(pitch, f"{key}.pitch")
    if pitch == math.inf:
        return screw_from_axis(direction, (0.0, 0.0, 0.0), pitch)
    if not math.isfinite(pitch):
        raise CaseError(f"{key}.pitch", "must be a number or inf", pitch)
    if point is None:
        raise CaseError(f"{key}.point", "is missing: any point on the axis")
    check_size(pitch, f"{key}.pitch")
    on_axis = check_vector(point, f"{key}.point")
    for index, coordinate in enumerate(on_axis.tolist()):
        check_size(coordinate, f"{key}.point[{index}]")
    return screw_from_axis(direction, on_axis, pitch)


class Method(enum.Enum):
    """Method that combines several tasks."""

    AVERAGE = "average"
    WEIGHTED_SUM = "weighted-sum"
    WORST_CASE = "worst-case"
