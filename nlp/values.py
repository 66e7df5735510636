"""What a case is made of: numbers that are fixed or free, poses, motions, and how to search and what to expect.

Angles are radians. These values hold what they are given; :class:`screwsynth.nlp.case.Case` checks them together.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeAlias

from screwsynth.models import screw_from_axis
from screwsynth.nlp.errors import CaseError
from screwsynth.nlp.poses import HERE, Step

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: With the axis free the rotation is written by a quaternion's vector part, which is smooth below half a turn only.
MAX_FREE_ROTATION = math.radians(179)
#: No number of a case may be larger, and no twist smaller than its inverse: squares and fourth powers stay finite.
LARGEST = 1e30


class Sense(enum.Enum):
    """Whether F is to be as large or as small as possible."""

    MAX = "max"
    MIN = "min"


@dataclass(frozen=True)
class Free:
    """A number that the solver chooses between two bounds.

    Attributes:
        lower, upper: finite bounds, ``lower < upper``.
        start: where the first search begins; the middle when left out.
    """

    lower: float
    upper: float
    start: float | None = None

    @property
    def first(self) -> float:
        """Where the first search begins."""
        return (self.lower + self.upper) / 2 if self.start is None else self.start


Value: TypeAlias = float | Free


def sizes_of_turn(angle: Value) -> tuple[float, float]:
    """Smallest and largest size, radians, of a rotation whose axis is free, where an angle's sign means nothing."""
    if not isinstance(angle, Free):
        return abs(angle), abs(angle)
    sizes = sorted((abs(angle.lower), abs(angle.upper)))
    return (0.0 if angle.lower <= 0 <= angle.upper else sizes[0]), sizes[1]


@dataclass(frozen=True, eq=False)
class Rotation:
    """Orientation of the platform, ``exp(angle [axis]x)`` in the world frame (equation 9).

    Attributes:
        axis: (3,) held axis, any length but zero; None leaves the axis free.
        angle: radians. With the axis free the sign of an angle means nothing: ``Free(-0.5, 0.5)`` allows every rotation
            by at most 0.5, about any axis; its start is about z.
    """

    axis: ArrayLike | None = (0.0, 0.0, 1.0)
    angle: Value = 0.0


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose of the platform, and the poses that follow from it.

    Attributes:
        position: origin of the platform frame in the world frame, length.
        rotation: orientation of the platform.
        steps: displacements of this pose, one for each pose that the robot takes.
    """

    position: Sequence[Value]
    rotation: Rotation = field(default_factory=Rotation)
    steps: tuple[Step, ...] = (HERE,)


class OverPoses(enum.Enum):
    """What F is over several poses."""

    SUM = "sum"
    MEAN = "mean"
    WORST = "worst"


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


@dataclass(frozen=True)
class Search:
    """How the solver searches.

    Attributes:
        starts: number of starting points.
        seed: seed of the random ones.
        max_iterations: Ipopt's limit for each start.
        compiled: whether Ipopt calls the objective as compiled C instead of through CasADi's interpreter. It needs a C
            compiler, and a second or two the first time.
    """

    starts: int = 32
    seed: int = 0
    max_iterations: int = 500
    compiled: bool = False

    def __post_init__(self) -> None:
        for key, value, least in (
            ("starts", self.starts, 1),
            ("seed", self.seed, 0),
            ("max_iterations", self.max_iterations, 1),
        ):
            if value < least:
                raise CaseError(f"solve.{key}", f"must be at least {least}", value)

    def but(self, starts: int | None, seed: int | None, *, compiled: bool = False) -> Search:
        """The same search with another number of starts or seed where they are given, and compiled if asked."""
        return Search(
            self.starts if starts is None else starts,
            self.seed if seed is None else seed,
            self.max_iterations,
            self.compiled or compiled,
        )


@dataclass(frozen=True)
class ExpectedValue:
    """A number of the result, by its dotted path there, and how far it may be off."""

    quantity: str
    value: float
    within: float


@dataclass(frozen=True)
class Expectation:
    """What a regression holds the case to; ``tolerance`` is relative, and absolute where F is 0."""

    F: float | None = None
    tolerance: float = 1e-6
    singular: bool | None = None
    values: tuple[ExpectedValue, ...] = ()


@dataclass(frozen=True)
class Published:
    """A number that the literature prints, and whether this program reproduces it.

    Attributes:
        quantity: dotted path in the result, such as ``pose.angle``, or ``gain``: by how many percent F exceeds that of
            the case ``over``.
        value: as printed.
        source: where.
        reproduced: whether this program reproduces it.
        because: the reason, where it does not.
        decimals: digits printed behind the point, where the value alone does not show them.
        over: name of the case that a gain is over.
    """

    quantity: str
    value: tuple[float, ...]
    source: str
    reproduced: bool
    because: str = ""
    decimals: int | None = None
    over: str | None = None
