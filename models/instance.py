"""A model with symbols or numbers in place of its own: its rows, their rates and F at one pose.

F is written here and nowhere else. For rows ``L_i = (f_i, m_i) / sqrt(square_i)`` and a twist ``chi = (omega, v)``

    F = sum_i (L_i ^ chi)^2,        L_i ^ chi = m_i . omega + f_i . v            (equations 5 and 14)

with moments about the world origin. A row that is a couple is multiplied by the characteristic length, so that its work
rate has the unit of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
from casadi import SX

from .model import Model
from .wrench import Wrench, WrenchKind


@dataclass(frozen=True, eq=False)
class Substitution:
    """Expressions that take the place of a model's symbols.

    Attributes:
        parameters: (n, 1) components of all parameters, in the model's order.
        unknowns: (u, 1) internal unknowns, in the model's order.
        rotation: (3, 3) ``R``.
        position: (3, 1) ``p``, length.
    """

    parameters: SX
    unknowns: SX
    rotation: SX
    position: SX

    @classmethod
    def identity(cls, model: Model) -> Substitution:
        """Return the model's own symbols."""
        return cls(
            ca.vertcat(SX(0, 1), *[item.symbol for item in model.parameters]),
            ca.vertcat(SX(0, 1), *[item.symbol for item in model.unknowns]),
            model.pose.rotation,
            model.pose.position,
        )

    @property
    def all(self) -> list[SX]:
        """The four expressions, in the order of the fields."""
        return [self.parameters, self.unknowns, self.rotation, self.position]


@dataclass(frozen=True, eq=False)
class LegInstance:
    """A leg at one pose.

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
    """A robot at one pose, for given twists.

    Attributes:
        parameters: (n, 1) components of all parameters, in the model's order.
        rotation: (3, 3) ``R``.
        position: (3, 1) ``p``, length.
        jacobian: (m, 6) unit wrenches ``J``, couple rows multiplied by the characteristic length.
        rates: (m, tasks) ``L_i ^ chi_j``.
        F: (tasks, 1) objective of each task (equation 14).
        squares: (m, 1) squared length of each row's direction: a limb of zero length has 0.
        magnitude: (tasks, 1) upper bound of F, see :func:`magnitude`.
        quantities: each of the model's quantities.
        legs: the model's legs.
        closure: (c, 1) closure equations, zero where the loops are closed.
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
    legs: tuple[LegInstance, ...]
    closure: SX


def instantiate(model: Model, put: Substitution, length: SX, twists: Sequence[SX]) -> RobotInstance:
    """Return a model's expressions with its symbols replaced.

    Args:
        model: the model.
        put: what takes the place of its symbols.
        length: (1, 1) characteristic length, by which couple rows are multiplied.
        twists: (6, 1) each, angular velocity, then velocity at the world origin.
    """
    outputs = [
        ca.horzcat(*[row.force for row in model.wrenches]),
        ca.horzcat(*[row.moment for row in model.wrenches]),
        ca.vertcat(*[row.square for row in model.wrenches]),
        ca.vertcat(SX(0, 1), *[equation.expression for equation in model.closure]),
        *[quantity.values for quantity in model.quantities],
        *[joint for leg in model.legs for joint in (leg.base, leg.platform)],
    ]
    inlined = ca.Function("model", Substitution.identity(model).all, outputs)
    force, moment, square, closure, *others = inlined.call(put.all)
    quantities, joints = others[: len(model.quantities)], others[len(model.quantities) :]
    rows = [Wrench(row.limb, row.kind, force[:, i], moment[:, i], square[i]) for i, row in enumerate(model.wrenches)]
    return RobotInstance(
        parameters=put.parameters,
        rotation=put.rotation,
        position=put.position,
        jacobian=jacobian(rows, length),
        rates=ca.horzcat(*[rates(rows, twist, length) for twist in twists]),
        F=ca.vertcat(*[objective(rows, twist, length) for twist in twists]),
        squares=square,
        magnitude=ca.vertcat(*[magnitude(rows, twist, put.position, length) for twist in twists]),
        quantities=tuple(quantities),
        legs=tuple(
            LegInstance(leg.name, base, platform, put.position + put.rotation @ platform - base)
            for leg, base, platform in zip(model.legs, joints[::2], joints[1::2], strict=True)
        ),
        closure=closure,
    )


def jacobian(rows: Sequence[Wrench], length: SX) -> SX:
    """Return (m, 6) unit wrenches, force, then moment about the world origin; couples times the length."""
    return ca.vertcat(
        *[_scale(row, length) * ca.vertcat(row.force, row.moment).T / ca.sqrt(row.square) for row in rows]
    )


def rates(rows: Sequence[Wrench], twist: SX, length: SX) -> SX:
    """Return (m, 1) work rates ``L_i ^ chi`` in a twist (6, 1); couples times the length."""
    return ca.vertcat(*[_product(row, twist, length) / ca.sqrt(row.square) for row in rows])


def objective(rows: Sequence[Wrench], twist: SX, length: SX) -> SX:
    """Return F, (1, 1), in a twist (6, 1).

    It is written as a sum of ``(m . omega + f . v)^2 / square`` and not of squared unit products: smoother, and with
    tighter interval enclosures.
    """
    return sum((_product(row, twist, length) ** 2 / row.square for row in rows), SX(0))


def magnitude(rows: Sequence[Wrench], twist: SX, position: SX, length: SX) -> SX:
    """Return F without cancellation, (1, 1): ``sum (|m_i| |omega| + |f_i| |v|)^2``, never below F.

    Moments and velocity are taken at the platform's origin, so that the number does not depend on where the world's
    origin is.
    """
    omega, v = twist[:3], twist[3:]
    at_origin = ca.norm_2(v + ca.cross(omega, position))
    return sum(
        (
            _scale(row, length) ** 2
            * (
                ca.norm_2(row.moment - ca.cross(position, row.force)) * ca.norm_2(omega)
                + ca.norm_2(row.force) * at_origin
            )
            ** 2
            / row.square
            for row in rows
        ),
        SX(0),
    )


def homogenised(jacobian: Any, centre: Any, length: Any) -> tuple[Any, ...]:  # noqa: ANN401 - SX or NumPy alike
    """Return the columns of a Jacobian made homogeneous: moments about a point, divided by a length.

    Args:
        jacobian: (m, 6) rows force, then moment about the world origin; symbols or numbers.
        centre: (3,) the point, length.
        length: what moments are divided by.

    Returns:
        Six columns of m entries each: forces, then moments.
    """
    fx, fy, fz, mx, my, mz = (jacobian[:, k] for k in range(6))
    x, y, z = (centre[k] for k in range(3))
    moments = (mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx))
    return (fx, fy, fz, *(moment / length for moment in moments))


def vanished(row: Wrench) -> str:
    """Return why a row whose direction is zero is none, for messages."""
    if row.kind is WrenchKind.COUPLE:
        return f"the couple of limb {row.limb!r} has no direction: the axes that it is normal to coincide"
    return f"limb {row.limb!r} has zero length: its two joints coincide"


def _scale(row: Wrench, length: SX) -> SX:
    return length if row.kind is WrenchKind.COUPLE else SX(1)


def _product(row: Wrench, twist: SX, length: SX) -> SX:
    return _scale(row, length) * row.rate(twist)
