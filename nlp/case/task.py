"""Tasks of a case, and how several are combined."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...models import screw_from_axis
from ..errors import CaseError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Sense(enum.Enum):
    """Whether F is to be as large or as small as possible."""

    MAX = "max"
    MIN = "min"


@dataclass(frozen=True, eq=False)
class Task:
    """An instantaneous twist deformation (ITD) that the platform must make (equation 12).

    Attributes:
        twist: (6,) ``(omega, v)`` in the world frame; ``v`` is the velocity of the platform point at the world origin.
        sense: whether the robot should put much or little work rate into it.
        name: a few words.
        weight: positive; what the task counts for beside others.
    """

    twist: ArrayLike
    sense: Sense = Sense.MAX
    name: str = "task"
    weight: float = 1.0

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
        """A unit screw motion from its axis.

        Args:
            sense: ``"max"`` or ``"min"``.
            axis: (3,) direction, any length but zero.
            pitch: translation per radian, length; ``math.inf`` is the pure translation along the axis.
            point: (3,) any point of the axis, length; needed unless the pitch is infinite.
            name: a few words.
            weight: positive.

        Raises:
            CaseError: the sense is another word, or the point is missing.
            ValueError: the axis is zero, or a number is not finite.
        """
        if sense not in ("max", "min", Sense.MAX, Sense.MIN):
            raise CaseError("task.sense", "must be 'max' or 'min'", sense)
        if point is None and pitch != math.inf:
            raise CaseError("task.point", "is missing: any point on the axis")
        return cls(
            screw_from_axis(axis, (0.0, 0.0, 0.0) if point is None else point, pitch), Sense(sense), name, weight
        )


class Method(enum.Enum):
    """How several tasks are brought together."""

    AVERAGE = "average"
    WEIGHTED_SUM = "weighted-sum"
    WORST_CASE = "worst-case"
