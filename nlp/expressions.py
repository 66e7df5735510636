"""What a program is made of: named scalars, named constraints with their readings, and the robot's expressions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from casadi import SX

from screwsynth.models import Dimension, Wrench, WrenchKind


@dataclass(frozen=True)
class Scalar:
    """A named scalar of a program: a free variable or an argument that a case fixes."""

    name: str
    dimension: Dimension


@dataclass(frozen=True)
class Reading:
    """How a constraint's limit reads in the words of a case.

    A limit on an angle may be a limit on a smoother function of it in the program.

    Attributes:
        dimension: what the limit measures for people.
        from_value: the number for people (radians for angles) from the program's limit.
        slope: derivative of the program's limit with respect to the number for people, at the program's limit.
        to_value: the program's limit from the number for people, as an expression; it never falls where that grows.
    """

    dimension: Dimension
    from_value: Callable[[float], float] = lambda value: value
    slope: Callable[[float], float] = lambda _: 1.0
    to_value: Callable[[SX], SX] = lambda number: number


@dataclass(frozen=True, eq=False)
class Constraint:
    """A named smooth constraint ``lower <= expression <= upper``; its bounds are numbers of the :class:`Nlp`.

    Attributes:
        name: in the words of a case.
        expression: (1, 1).
        reading: how its limits read.
        keys: dotted keys below ``limits`` of the case's numbers that are its lower and its upper bound; empty for a
            bound that is none of the case's limits.
        pose: index of the pose that it is at.
        exact: (1, 1) the measured number itself, where the expression tells it near the limit only.
    """

    name: str
    expression: SX
    reading: Reading
    keys: tuple[str, str] = ("", "")
    pose: int = 0
    exact: SX | None = None


@dataclass(frozen=True, eq=False)
class Bounded:
    """A constraint with its bounds."""

    constraint: Constraint
    lower: float
    upper: float


def vanished(row: Wrench) -> str:
    """Why a row whose direction is zero is none, for messages."""
    if row.kind is WrenchKind.COUPLE:
        return f"the couple of limb {row.limb!r} has no direction: the axes that it is normal to coincide"
    return f"limb {row.limb!r} has zero length: its two joints coincide"


@dataclass(frozen=True, eq=False)
class LegExpressions:
    """A leg at the program's point.

    Attributes:
        name: the limb's name.
        base: (3, 1) centre of its base joint in the world frame, length.
        platform: (3, 1) centre of its platform joint in the platform frame, length.
        span: (3, 1) from base joint to platform joint in the world frame, length.
    """

    name: str
    base: SX
    platform: SX
    span: SX


@dataclass(frozen=True, eq=False)
class RobotExpressions:
    """The robot at the program's point: every expression in the program's variables and arguments.

    Attributes:
        parameters: (n, 1) components of all parameters, in the model's order.
        rotation: (3, 3) ``R``.
        position: (3, 1) ``p``, length.
        jacobian: (m, 6) unit wrenches ``J``, couple rows scaled by the characteristic length.
        rates: (m, tasks) ``L_i ^ chi_j``.
        F: (tasks, 1) objective of each task (equation 14).
        squares: (m, 1) squared length of each row's direction: a limb of zero length has 0.
        magnitude: (tasks, 1) what F would be without cancellation, ``sum (|m_i| |omega| + |f_i| |v|)^2`` with moments
            and velocity taken at the platform's origin, so that it does not depend on where the world's origin is.
        quantities: each of the model's quantities.
        legs: the model's legs.
    """

    parameters: SX
    rotation: SX
    position: SX
    jacobian: SX
    rates: SX
    F: SX
    squares: SX
    magnitude: SX
    quantities: tuple[SX, ...]
    legs: tuple[LegExpressions, ...] = ()
