"""Tasks of a case, and methods that combine several tasks."""

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


#: Quantities of the actuators that can be minimised; for each, whether it needs loads, and whether it needs motions.
MEASURES = {"actuator_force": (True, False), "actuator_speed": (False, True), "actuator_power": (True, True)}
#: Name of the longest leg along a path as objective, which needs neither loads nor motions.
LEG_LENGTH = "leg_length"
#: Name of the smallest singular value of the homogenised J along a path as objective, likewise.
SMALLEST = "smallest_singular_value"
#: Objectives that exist along a path only.
ALONG = (LEG_LENGTH, SMALLEST)
#: Motions that move with a tool path.
FOLLOWS = ("feed", "tool", "thrust")


class Sense(enum.Enum):
    """Sense of optimisation: maximise or minimise F."""

    MAX = "max"
    MIN = "min"

    @property
    def sign(self) -> float:
        """1 for a maximum, -1 for a minimum: ``sign * F`` is maximised."""
        return 1.0 if self is Sense.MAX else -1.0


@dataclass(frozen=True, eq=False)
class Task:
    """Task: instantaneous twist deformation (ITD) that the platform must make (equation 12).

    Attributes:
        twist: (6,) ``(omega, v)`` in the world frame; ``v`` is the velocity of the platform point at the world origin.
        sense: sense of optimisation of F: maximum or minimum.
        name: name of the task.
        weight: positive weight of the task in a combination of several tasks.
        point: (3,) point of the screw axis as stated, length; None for a translation, or for a task given as a twist.
        measure: quantity that is optimised instead of F, such as ``actuator_force``; empty for F.
        is_stated: If true, the case states the motion; if false, the twist is a placeholder of an objective without F.
        follows: motion that moves with the tool path of the case: ``"feed"``, ``"tool"`` or ``"thrust"``; the twist is
            then a placeholder. Empty for a fixed motion.
        length: length by which moments are divided, if the measure is the smallest singular value; otherwise None.
    """

    twist: ArrayLike
    sense: Sense = Sense.MAX
    name: str = "task"
    weight: float = 1.0
    point: ArrayLike | None = None
    measure: str = ""
    is_stated: bool = True
    follows: str = ""
    length: float | None = None

    @classmethod
    def minimise(cls, measure: str) -> Task:
        """Return an objective that minimises the largest force, speed or power of the actuators.

        Args:
            measure: ``"actuator_force"``, ``"actuator_speed"`` or ``"actuator_power"``; its largest magnitude over
                loads, actuators and poses is minimised.
        """
        return cls((0.0, 0.0, 0.0, 0.0, 0.0, 1.0), Sense.MIN, measure, measure=measure, is_stated=False)

    @classmethod
    def maximise(cls, measure: str, *, length: float | None) -> Task:
        """Return an objective along a path that maximises the smallest singular value of the homogenised J.

        Args:
            measure: ``"smallest_singular_value"``.
            length: length by which moments about the platform origin are divided.
        """
        twist = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        return cls(twist, Sense.MAX, measure, measure=measure, is_stated=False, length=length)

    @property
    def objective_key(self) -> str:
        """Dotted key of the measure in a case file."""
        return f"objective.{'maximise' if self.measure == SMALLEST else 'minimise'}"

    @classmethod
    def following(cls, motion: str, *, sense: Sense | str = "max", name: str = "task", weight: float = 1.0) -> Task:
        """Return the task of a unit motion that moves with the tool path of the case.

        Args:
            motion: ``"feed"``, a translation in the direction of the feed; ``"tool"``, a rotation about the tool's
                axis; or ``"thrust"``, a translation along the tool's axis.
            sense: sense of optimisation of F, ``"max"`` or ``"min"``.
            name: name of the task.
            weight: positive weight of the task in a combination of several tasks.
        """
        # The kind of the placeholder, a rotation or a translation, determines the unit of F.
        twist = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0) if motion == "tool" else (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        return cls(twist, Sense(sense), name, weight, follows=motion)

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
        """Return the task of a unit screw motion.

        Args:
            sense: sense of optimisation of F, ``"max"`` or ``"min"``.
            axis: (3,) direction of the screw axis, of any length but zero.
            pitch: translation per radian, length; ``math.inf`` for a pure translation along the axis.
            point: (3,) any point on the axis, length; not needed for an infinite pitch.
            name: name of the task.
            weight: positive weight of the task in a combination of several tasks.

        Raises:
            CaseError: the sense is not allowed, the axis is zero, the point is missing, or a number is not finite.
        """
        if sense not in ("max", "min", Sense.MAX, Sense.MIN):
            raise CaseError("task.sense", "must be 'max' or 'min'", sense)
        twist = unit_twist(axis, point, pitch, "task")
        return cls(twist, Sense(sense), name, weight, None if pitch == math.inf else point)

    @classmethod
    def rotation(
        cls, axis: ArrayLike, through: ArrayLike, *, sense: Sense | str = "max", name: str = "task", weight: float = 1.0
    ) -> Task:
        """Return the task of a pure rotation about an axis.

        Args:
            axis: (3,) direction of the axis, of any length but zero; the right-hand rule gives the sense of rotation.
            through: (3,) any point on the axis, length.
            sense: sense of optimisation of F, ``"max"`` or ``"min"``.
            name: name of the task.
            weight: positive weight of the task in a combination of several tasks.

        Raises:
            CaseError: the sense is not allowed, the axis is zero, or a number is not finite.
        """
        point = check_vector(through, "task.through")
        return cls.screw(sense, axis=axis, pitch=0.0, point=point, name=name, weight=weight)

    @classmethod
    def translation(
        cls, direction: ArrayLike, *, sense: Sense | str = "max", name: str = "task", weight: float = 1.0
    ) -> Task:
        """Return the task of a pure translation along a direction.

        Args:
            direction: (3,) direction of the velocity, of any length but zero.
            sense: sense of optimisation of F, ``"max"`` or ``"min"``.
            name: name of the task.
            weight: positive weight of the task in a combination of several tasks.

        Raises:
            CaseError: the sense is not allowed, the direction is zero, or a number is not finite.
        """
        along = check_direction(direction, "task.direction")
        return cls.screw(sense, axis=along, pitch=math.inf, name=name, weight=weight)


def unit_twist(axis: ArrayLike | None, point: ArrayLike | None, pitch: float | None, key: str) -> FloatArray:
    """Return the twist (6,) of a unit screw motion.

    Args:
        axis: (3,) direction of the screw axis, of any length but zero.
        point: (3,) any point on the axis, length; not needed for an infinite pitch.
        pitch: translation per radian, length; ``math.inf`` for a pure translation along the axis.
        key: dotted key of the task, for messages.

    Raises:
        CaseError: axis, point or pitch is missing or not allowed.
    """
    if axis is None:
        raise CaseError(f"{key}.axis", "is missing: give axis, point and pitch, or twist")
    direction = check_direction(axis, f"{key}.axis")
    if pitch is None:
        raise CaseError(f"{key}.pitch", "is missing: give a number, 0 for a rotation, inf for a translation")
    pitch = check_real(pitch, f"{key}.pitch")
    if pitch == math.inf:
        return screw_from_axis(direction, (0.0, 0.0, 0.0), pitch)
    if not math.isfinite(pitch):
        raise CaseError(f"{key}.pitch", "must be a number, or inf for a translation", pitch)
    if point is None:
        raise CaseError(f"{key}.point", "is missing: give any point on the axis")
    check_size(pitch, f"{key}.pitch")
    on_axis = check_vector(point, f"{key}.point")
    for index, coordinate in enumerate(on_axis.tolist()):
        check_size(coordinate, f"{key}.point[{index}]")
    return screw_from_axis(direction, on_axis, pitch)


class Method(enum.Enum):
    """Methods that combine several tasks."""

    AVERAGE = "average"
    WEIGHTED_SUM = "weighted-sum"
    WORST_CASE = "worst-case"
