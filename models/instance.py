"""A model with other symbols, or numbers, in place of its own: rows, rates and F at one pose."""

from __future__ import annotations

from dataclasses import dataclass

from casadi import SX

from .wrench import Wrench, WrenchKind


def vanished(row: Wrench) -> str:
    """Why a row whose direction is zero is none, for messages."""
    if row.kind is WrenchKind.COUPLE:
        return f"the couple of limb {row.limb!r} has no direction: the axes that it is normal to coincide"
    return f"limb {row.limb!r} has zero length: its two joints coincide"


@dataclass(frozen=True, eq=False)
class LegInstance:
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
class RobotInstance:
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
    legs: tuple[LegInstance, ...] = ()
