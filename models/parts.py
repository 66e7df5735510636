"""The parts of a model: parameters, unknowns, closure equations, the pose, quantities and legs."""

from __future__ import annotations

import enum
from collections.abc import Sequence
from dataclasses import field
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .arrays import FloatArray
from .values import dataclass

_AXES = ("x", "y", "z")


class Dimension(enum.Enum):
    """Physical dimension of a number, which decides its unit in a case."""

    LENGTH = "length"
    ANGLE = "angle"
    NUMBER = "number"
    FORCE = "force"
    TORQUE = "torque"
    SPEED = "length per second"
    TURN_SPEED = "angle per second"
    POWER = "power"


def component_names(name: str, size: int) -> tuple[str, ...]:
    """Return the names of a quantity's scalars: its own name for one scalar, ``name_x, name_y, name_z`` for a vector.

    Args:
        name: name of the quantity.
        size: number of its scalars, 1 to 3.
    """
    return (name,) if size == 1 else tuple(f"{name}_{axis}" for axis in _AXES[:size])


@dataclass(frozen=True, eq=False)
class Parameter:
    """A dimension of the robot that a case fixes or frees.

    Attributes:
        name: the name in case files.
        symbol: (1, 1) or (3, 1) CasADi symbol.
        dimension: length, angle (radians) or plain number.
        description: a few words for people.
        typical: a sensible value of each component for a starter case, in some length unit and radians.
        lower: least value with which the robot exists.
        upper: largest such value.
        is_direction: whether the parameter is a unit vector. A fixed one is normalised; a free one has its unit length
            as an equation of the program.
        starter: value of each component in a starter case, where the robot is singular at its typical values; None for
            the typical value.
    """

    name: str
    symbol: SX
    dimension: Dimension
    description: str
    typical: tuple[float, ...]
    lower: float = -float("inf")
    upper: float = float("inf")
    is_direction: bool = False
    starter: tuple[float, ...] | None = None

    @property
    def components(self) -> tuple[str, ...]:
        """Name of each scalar."""
        return component_names(self.name, self.symbol.numel())


@dataclass(frozen=True, eq=False)
class Unknown:
    """An internal unknown, such as a passive joint's position, that the closure equations determine.

    A robot with more actuators than its platform has degrees of freedom has driven joints that the pose does not
    determine. As many of their positions as are independent are *free*: the closure equations determine the other
    unknowns from the parameters, the pose and these positions.

    Attributes:
        name: unique within the model.
        symbol: (1, 1) CasADi symbol.
        dimension: length, angle (radians) or plain number.
        description: a few words for people.
        lower: finite bound from which on the program searches the assembly, in parts of ``size``.
        upper: finite bound up to which it does.
        size: (1, 1) expression of the parameters of the order of the unknown: 1, or a length of the robot's.
        joint: label, such as ``2:3``, of the driven joint whose free position it is; empty for a determined unknown.
    """

    name: str
    symbol: SX
    dimension: Dimension
    description: str
    lower: float
    upper: float
    size: SX = field(default_factory=lambda: SX(1))
    joint: str = ""

    @property
    def is_free(self) -> bool:
        """Whether the pose and the closure equations leave it free."""
        return bool(self.joint)


@dataclass(frozen=True, eq=False)
class Closure:
    """An equation of the robot's closed loops: ``expression == 0``.

    A program divides the equation by its size at one point of the case: divided by the expression itself, the equation
    and its derivatives would be longer.

    Attributes:
        name: unique within the model.
        expression: (1, 1) left side of the equation.
        size: (1, 1) positive expression of the parameters, by which the equation becomes a number of order 1.
    """

    name: str
    expression: SX
    size: SX = field(default_factory=lambda: SX(1))

    @property
    def scaled(self) -> SX:
        """Left side of the equation (1, 1), of order 1."""
        return self.expression / self.size


@dataclass(frozen=True, eq=False)
class AssemblySign:
    """A number that is positive in home's assembly of a robot's joints, where the loops are closed.

    Attributes:
        name: unique within the model.
        limb: name of the limb.
        value: (1, 1) expression; its size has no meaning.
        is_mode: whether the joints hold together where it is negative too, in another working mode than home's.
    """

    name: str
    limb: str
    value: SX
    is_mode: bool


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
    """A named quantity of the robot, one number for each limb or joint, that a case may limit.

    Attributes:
        name: the name in results and limits, such as ``leg_length``.
        owners: name of the limb or joint to which each number belongs, in order.
        values: (n, 1) expressions.
        dimension: length, angle (radians) or plain number.
        description: a few words for people.
    """

    name: str
    owners: tuple[str, ...]
    values: SX
    dimension: Dimension
    description: str


@dataclass(frozen=True, eq=False)
class Leg:
    """A straight leg between two passive joints, driven along its own axis; a limb is any chain to the platform.

    Attributes:
        name: name of the limb that the leg is.
        base: (3, 1) centre of its base joint in the world frame, length.
        platform: (3, 1) centre of its platform joint in the platform frame, length.
        base_error: (3, 1) symbols of the error of the joint centre on the base in the machine as it is built, in the
            frame of that centre, length.
        platform_error: (3, 1) those of the centre on the platform.
        centres: names of both centres in a :class:`~.displaced.DisplacedRobot`: labels of joints of a limb given joint
            by joint; empty for the name of the leg and its plate.
    """

    name: str
    base: SX
    platform: SX
    base_error: SX = field(default_factory=lambda: SX.sym("base_error", 3))
    platform_error: SX = field(default_factory=lambda: SX.sym("platform_error", 3))
    centres: tuple[str, str] = ("", "")

    def __post_init__(self) -> None:
        named = tuple(
            own or f"{self.name} {plate}" for own, plate in zip(self.centres, ("base", "platform"), strict=True)
        )
        object.__setattr__(self, "centres", named)

    @property
    def built(self) -> Leg:
        """The leg between joint centres with their errors."""
        return Leg(self.name, self.base + self.base_error, self.platform + self.platform_error)


@dataclass(frozen=True, eq=False)
class Actuator:
    """An actuated joint of a limb given joint by joint.

    Attributes:
        name: unique within the model.
        limb: name of the limb that it is part of.
        members: labels of the members that it moves.
        screws: (6, k) the platform's twist for its unit rate, as each of these members demands it while the other
            actuators stand still, up to the twists that the member allows; the world's origin is the reference.
        dimension: length for a slide or a parallelogram, angle for a rotation.
        relations: (r, 1) its factors in the equations that loops demand of the actuators' rates alone: all actuators of
            a robot have as many. There are none but where more actuators drive nested loops than these have freedoms.
        joint: label of its joint, such as ``2:3``.
    """

    name: str
    limb: str
    members: tuple[str, ...]
    screws: SX
    dimension: Dimension
    relations: SX = field(default_factory=lambda: SX(0, 1))
    joint: str = ""

    def screw_in(self, member: str) -> SX | None:
        """Return its screw (6, 1) as a member demands it, by the member's label; None where it does not move it."""
        return self.screws[:, self.members.index(member)] if member in self.members else None


def rate_relations(actuators: Sequence[Actuator]) -> SX:
    """Return the factors (r, a) of the actuators' rates in the equations that loops demand of these alone."""
    return ca.horzcat(*[each.relations for each in actuators]) if actuators else SX(0, 0)


@dataclass(frozen=True, eq=False)
class JointScrews:
    """Current screws of a limb's joints, whose ranks tell a limb's singularities.

    Nested loops leave no joint a screw of its own. The columns of one of their members are motions of the platform by
    rates of joints along a tree of links, of which its loops allow those with ``L q = 0``.

    Attributes:
        limb: name of the limb.
        joints: label of the joint of each column, such as ``2:3``.
        all: (6, k) screws of all its joints from base to platform as twists, the world's origin as reference.
        driven: indices of the columns of actuated joints.
        passive_rank: rank of the motions by passive joints, at almost all dimensions and poses.
        all_rank: rank of the motions by all joints there.
        member: name of the member of nested loops; empty for a path of joints.
        loops: (m, k) ``L`` of nested loops, without a unit for rates of order 1.
        loop_rank: of the columns of passive joints in ``L``, at almost all dimensions and poses.
        centre: (3, 1) of the member, length.
    """

    limb: str
    joints: tuple[str, ...]
    all: SX
    driven: tuple[int, ...]
    passive_rank: int
    all_rank: int
    member: str = ""
    loops: SX = field(default_factory=lambda: SX(0, 0))
    loop_rank: int = 0
    centre: SX = field(default_factory=lambda: SX.zeros(3))

    @property
    def is_nested(self) -> bool:
        """Whether the columns are motions along a tree of links with nested loops."""
        return bool(self.member)

    @property
    def passive(self) -> list[int]:
        """Indices of the columns of passive joints."""
        return [k for k in range(self.all.shape[1]) if k not in self.driven]


class PlatformMotions(NamedTuple):
    """Motions that a platform can make at a configuration.

    Attributes:
        rotation: (3, 3) platform to world coordinates.
        twists: (6, f) basis of them: angular velocity, then velocity of the platform's origin, in the world frame.
    """

    rotation: FloatArray
    twists: FloatArray


@dataclass(frozen=True)
class GenericRanks:
    """Ranks of a robot given joint by joint, at almost all dimensions and closed configurations.

    Attributes:
        jacobian: rank of all rows.
        constraints: rank of the wrenches that do no work in the actuated joints: the platform has six freedoms less
            this rank.
        idle: dimension of the actuators' rates with which the platform does not move.
        undetermined: names of the actuators that have such a rate.
        motions: of the platform at some of these configurations; empty where it has six freedoms.
        is_shared: whether limbs share all constraints, so that statics does not determine those of any limb.
    """

    jacobian: int
    constraints: int
    idle: int = 0
    undetermined: tuple[str, ...] = ()
    motions: tuple[PlatformMotions, ...] = field(default=(), compare=False, repr=False)
    is_shared: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class PathStructure:
    """Structure of a path of joints from base to platform, for almost all dimensions and poses.

    Attributes:
        limb: name of the limb.
        name: of the path: that of the limb, with the number of the branch where there are several.
        joints: letters of its joints from base to platform, an actuated one with a star.
        opened: the place at which its loop is opened, in words.
        wrenches: dimension of the wrenches with which it resists the platform, actuators locked: of ``W``.
        constraints: dimension of those that do no work in its actuated joints: of ``C``.
        unknowns: number of its joint variables that are unknowns and that no path before it has.
        equations: number of its loop equations.
        kept: number of those that do not follow from others.
        nested: names of its joints where it is no path of a limb, but has nested loops, coupled joints, or a passive
            joint before branches; else empty.
    """

    limb: str
    name: str
    joints: str
    opened: str
    wrenches: int
    constraints: int
    unknowns: int
    equations: int
    kept: int
    nested: tuple[str, ...] = ()
