"""Parts of a model: parameters, unknowns, closure equations, pose, quantities and legs."""

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
    """Physical dimension of a quantity, which determines its unit in a case."""

    LENGTH = "length"
    ANGLE = "angle"
    NUMBER = "number"
    FORCE = "force"
    TORQUE = "torque"
    SPEED = "length per second"
    TURN_SPEED = "angle per second"
    POWER = "power"


def component_names(name: str, size: int) -> tuple[str, ...]:
    """Return the names of a quantity's components: ``name`` for a scalar, ``name_x, name_y, name_z`` for a vector.

    Args:
        name: name of the quantity.
        size: number of components, 1 to 3.
    """
    return (name,) if size == 1 else tuple(f"{name}_{axis}" for axis in _AXES[:size])


@dataclass(frozen=True, eq=False)
class Parameter:
    """Dimension of the robot that a case fixes or frees.

    Attributes:
        name: name of the parameter in case files.
        symbol: (1, 1) or (3, 1) CasADi symbol.
        dimension: length, angle (radians) or dimensionless number.
        description: a few words for people.
        typical: value of each component in a starter case, in some length unit and radians.
        lower: smallest value for which the robot exists.
        upper: largest value for which the robot exists.
        is_direction: True for a unit vector. A fixed unit vector is normalised; for a free one, unit length is an
            equation of the program.
        starter: value of each component in a starter case, if the robot is singular at its typical values; None for
            ``typical``.
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
        """Name of each component of the parameter."""
        return component_names(self.name, self.symbol.numel())


@dataclass(frozen=True)
class PoseSetting:
    """Component of a parameter that is an affine function of the platform's position.

    Attributes:
        name: name of the component.
        lower: smallest value of the setting's range; radians for an angle.
        upper: largest value of this range.
        centre: (3,) position at which the setting has the value of the parameter, length.
    """

    name: str
    lower: float
    upper: float
    centre: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Unknown:
    """Unknown that the closure equations determine, such as a passive joint coordinate.

    A robot with more actuators than degrees of freedom has free actuator coordinates, which the pose does not
    determine. The closure equations determine the other unknowns from the parameters, the pose and a set of independent
    free coordinates.

    Attributes:
        name: unique name within the model.
        symbol: (1, 1) CasADi symbol.
        dimension: length, angle (radians) or dimensionless number.
        description: a few words for people.
        lower: finite lower bound in the search for assembly modes, relative to ``size``.
        upper: finite upper bound in the search for assembly modes, relative to ``size``.
        size: (1, 1) order of magnitude of the unknown as an expression of the parameters: 1, or a length of the robot.
        joint: for a free actuator coordinate, label of the actuated joint, such as ``2:3``; empty for a determined
            unknown.
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
        """True for a free actuator coordinate."""
        return bool(self.joint)


@dataclass(frozen=True, eq=False)
class Closure:
    """Loop equation ``expression == 0``.

    A program divides the equation by the value of ``size`` at one point of the case: dividing by the expression would
    lengthen the equation and its derivatives.

    Attributes:
        name: unique name within the model.
        expression: (1, 1) left side of the equation.
        size: (1, 1) positive expression of the parameters by which the equation is divided, so that its values are
            about 1.
    """

    name: str
    expression: SX
    size: SX = field(default_factory=lambda: SX(1))

    @property
    def scaled(self) -> SX:
        """Left side of the equation (1, 1), divided by its scale."""
        return self.expression / self.size


@dataclass(frozen=True, eq=False)
class AssemblySign:
    """Expression that, for closed loops, is positive in the home assembly mode.

    Attributes:
        name: unique name within the model.
        limb: name of the limb.
        value: (1, 1) expression; only its sign has a meaning.
        is_mode: True if a negative value means another working mode; False if it means that joints do not fit together.
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
    """Named quantity of the robot, one value for each limb or joint, that a case may limit.

    Attributes:
        name: name in results and limits, such as ``leg_length``.
        owners: name of the limb or joint of each value, in order.
        values: (n, 1) expressions.
        dimension: length, angle (radians) or dimensionless number.
        description: a few words for people.
    """

    name: str
    owners: tuple[str, ...]
    values: SX
    dimension: Dimension
    description: str


@dataclass(frozen=True, eq=False)
class Leg:
    """Straight leg between two passive joints, actuated along its line.

    Attributes:
        name: name of the limb.
        base: (3, 1) centre of the leg's base joint in the world frame, length.
        platform: (3, 1) centre of the leg's platform joint in the platform frame, length.
        base_error: (3, 1) symbols of the joint-centre error on the base, in the frame of that centre, length.
        platform_error: (3, 1) symbols of the joint-centre error on the platform, in the frame of that centre, length.
        centres: names of both joint centres in a :class:`~.displaced.DisplacedRobot`. For a limb given joint by joint,
            these are labels of joints. Empty names stand for the name of the leg and its plate.
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
        """Leg with joint-centre errors."""
        return Leg(self.name, self.base + self.base_error, self.platform + self.platform_error)


@dataclass(frozen=True, eq=False)
class Actuator:
    """Actuated joint of a limb given joint by joint.

    Attributes:
        name: unique name within the model.
        limb: name of the limb with the joint.
        members: labels of the members that the actuator moves.
        screws: (6, k) platform twist about the world origin for a unit rate of this actuator while the other actuators
            stand still. There is one column for each member, determined up to the twists that the member allows.
        dimension: length for a prismatic joint or a parallelogram, angle for a revolute joint.
        relations: (r, 1) coefficients of the actuator in the r equations that loops impose on the actuator rates alone.
            All actuators of a robot have the same r; it is 0 unless nested loops have more actuators than degrees of
            freedom.
        joint: label of the joint, such as ``2:3``.
    """

    name: str
    limb: str
    members: tuple[str, ...]
    screws: SX
    dimension: Dimension
    relations: SX = field(default_factory=lambda: SX(0, 1))
    joint: str = ""

    def screw_in(self, member: str) -> SX | None:
        """Return the actuator's screw (6, 1) for a member, by its label; None if the member does not move."""
        return self.screws[:, self.members.index(member)] if member in self.members else None


def rate_relations(actuators: Sequence[Actuator]) -> SX:
    """Return the coefficients (r, a) of the equations that loops impose on the actuator rates alone."""
    return ca.horzcat(*[each.relations for each in actuators]) if actuators else SX(0, 0)


@dataclass(frozen=True, eq=False)
class JointScrews:
    """Current screws of a limb's joints, whose ranks show singularities of the limb.

    With nested loops, the columns are platform motions for unit joint rates along a spanning tree of links; the loops
    allow the rates with ``L q = 0``.

    Attributes:
        limb: name of the limb.
        joints: label of the joint of each column, such as ``2:3``.
        all: (6, k) screws of all joints from base to platform, as twists about the world origin.
        driven: indices of the columns of actuated joints.
        passive_rank: rank of the platform motions by passive joints, at almost all dimensions and poses.
        all_rank: rank of the platform motions by all joints, at almost all dimensions and poses.
        member: name of the member of nested loops; empty for a chain of joints.
        loops: (m, k) matrix ``L`` of nested loops, dimensionless for scaled rates.
        loop_rank: rank of the passive columns of ``L``, at almost all dimensions and poses.
        centre: (3, 1) centre of the member, length.
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
        """True if the columns are motions along a spanning tree of links with nested loops."""
        return bool(self.member)

    @property
    def passive(self) -> list[int]:
        """Indices of the columns of passive joints."""
        return [k for k in range(self.all.shape[1]) if k not in self.driven]


class PlatformMotions(NamedTuple):
    """Motions of the platform at a configuration.

    Attributes:
        rotation: (3, 3) rotation from platform to world coordinates.
        twists: (6, f) basis of the motions: angular velocity, then velocity of the platform's origin, in the world
            frame.
    """

    rotation: FloatArray
    twists: FloatArray


@dataclass(frozen=True)
class GenericRanks:
    """Ranks of a robot given joint by joint, at almost all dimensions and closed configurations.

    Attributes:
        jacobian: rank of all rows.
        constraints: rank of the constraint wrenches; the platform has six minus this rank degrees of freedom.
        idle: dimension of the space of actuator rates with which the platform does not move.
        undetermined: names of the actuators with undetermined rates.
        motions: motions of the platform at some of these configurations; empty for six degrees of freedom.
        is_shared: True if limbs share all constraints, so that statics determines the constraint wrenches of no limb.
    """

    jacobian: int
    constraints: int
    idle: int = 0
    undetermined: tuple[str, ...] = ()
    motions: tuple[PlatformMotions, ...] = field(default=(), compare=False, repr=False)
    is_shared: bool = field(default=False, compare=False)


@dataclass(frozen=True)
class PathStructure:
    """Structure of a chain of joints from base to platform, at almost all dimensions and poses.

    Attributes:
        limb: name of the limb.
        name: name of the chain: that of the limb, with the number of the branch if there are several.
        joints: letters of the joints from base to platform, with a star for an actuated joint.
        opened: place at which the loop is opened, in words.
        wrenches: dimension of the space ``W`` of the chain's wrenches on the platform with locked actuators.
        constraints: dimension of the space ``C`` of constraint wrenches, which do no work in actuated joints.
        unknowns: number of joint coordinates that are unknowns and belong to no earlier chain.
        equations: number of loop equations of the chain.
        kept: number of loop equations that do not follow from other loop equations.
        nested: names of the joints, for nested loops, coupled joints or a passive joint before branches; empty for a
            chain of a limb.
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
