"""The parts of a model: parameters, unknowns, closure equations, the pose, quantities and legs."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from casadi import SX

_AXES = ("x", "y", "z")


class Dimension(enum.Enum):
    """What a number measures, and so which unit of a case it is in."""

    LENGTH = "length"
    ANGLE = "angle"
    NUMBER = "number"


def component_names(name: str, size: int) -> tuple[str, ...]:
    """Names of the scalars of a quantity: itself when it is one, ``name_x, name_y, name_z`` for a vector."""
    return (name,) if size == 1 else tuple(f"{name}_{axis}" for axis in _AXES[:size])


@dataclass(frozen=True, eq=False)
class Parameter:
    """A dimension of the robot that a case fixes or frees.

    Attributes:
        name: the name in case files.
        symbol: (1, 1) or (3, 1) CasADi symbol.
        dimension: what it measures; angles are radians inside.
        description: a few words for people.
        typical: a sensible value for each component, in some length unit and radians: what a starter case begins with.
        lower, upper: the values for which the robot exists, ends included.
        is_direction: whether it is a unit vector: a fixed one is brought to unit length, a free one held there.
    """

    name: str
    symbol: SX
    dimension: Dimension
    description: str
    typical: tuple[float, ...]
    lower: float = -float("inf")
    upper: float = float("inf")
    is_direction: bool = False

    @property
    def components(self) -> tuple[str, ...]:
        """Name of each scalar."""
        return component_names(self.name, self.symbol.numel())


@dataclass(frozen=True, eq=False)
class Unknown:
    """An internal unknown, such as a passive joint's position, that the closure equations determine.

    Attributes:
        name: unique within the model.
        symbol: (1, 1) CasADi symbol.
        dimension: what it measures; angles are radians.
        description: a few words for people.
        lower, upper: finite range in which the assembly is looked for.
    """

    name: str
    symbol: SX
    dimension: Dimension
    description: str
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class Closure:
    """An equation that the robot's loops impose: ``expression == 0``."""

    name: str
    expression: SX


@dataclass(frozen=True, eq=False)
class PoseSymbols:
    """Pose of the platform in the world frame (equation 8).

    Attributes:
        rotation: (3, 3) matrix of symbols ``R``: platform to world coordinates.
        position: (3, 1) symbols ``p``: origin of the platform frame, length.
    """

    rotation: SX = field(default_factory=lambda: SX.sym("R", 3, 3))
    position: SX = field(default_factory=lambda: SX.sym("p", 3))


@dataclass(frozen=True, eq=False)
class Quantity:
    """A named measure of the robot, one number for each limb or joint, that limits may bound.

    Attributes:
        name: the name in results and limits, such as ``leg_length``.
        owners: what each number belongs to, in order.
        values: (n, 1) expressions.
        dimension: what they measure.
        description: a few words for people.
    """

    name: str
    owners: tuple[str, ...]
    values: SX
    dimension: Dimension
    description: str


@dataclass(frozen=True, eq=False)
class Leg:
    """A straight leg between two passive joints, driven along its own axis.

    Attributes:
        name: the limb's name.
        base: (3, 1) centre of its base joint in the world frame, length.
        platform: (3, 1) centre of its platform joint in the platform frame, length.
        base_error, platform_error: (3, 1) symbols for how far off these a machine's joint centres are built.
    """

    name: str
    base: SX
    platform: SX
    base_error: SX = field(default_factory=lambda: SX.sym("base_error", 3))
    platform_error: SX = field(default_factory=lambda: SX.sym("platform_error", 3))

    @property
    def built(self) -> Leg:
        """The leg between the joint centres as they are built."""
        return Leg(self.name, self.base + self.base_error, self.platform + self.platform_error)
