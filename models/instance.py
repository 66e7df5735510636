"""Model with expressions or numbers in place of its symbols: rows, work rates and F at one pose.

F is defined only here. For rows ``L_i = (f_i, m_i) / sqrt(square_i)`` and a twist ``chi = (omega, v)``

    F = sum_i (L_i ^ chi)^2,        L_i ^ chi = m_i . omega + f_i . v            (equations 5 and 14)

with moments about the world origin. The row of a couple is multiplied by the characteristic length, so that its work
rate has the unit of the other rows. A :class:`~.member.Member` adds ``|P x(chi)|^2``: the sum of squared work rates of
any orthonormal basis of its wrenches. Its rows here are all rows of ``P``, which are dependent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from .arrays import FloatArray
from .limbjoints import LimbJoint, LimbLink
from .member import Member, resistance
from .model import Model, joint_parameter
from .parts import Actuator, Closure, Dimension, Unknown, rate_relations
from .values import dataclass
from .whole import expressions_of, with_expressions
from .wrench import Wrench, WrenchKind

#: Matrix or vector of symbols or numbers.
Matrix = TypeVar("Matrix", SX, FloatArray)


@dataclass(frozen=True, eq=False)
class Substitution:
    """Expressions that replace a model's symbols.

    Attributes:
        parameters: (n, 1) components of all parameters, in the model's order.
        unknowns: (u, 1) unknowns of the closure equations, in the model's order.
        rotation: (3, 3) ``R``, platform to world coordinates.
        position: (3, 1) ``p``, origin of the platform frame in the world frame, length.
        reference: (n,) parameter values from which the scales of loop equations are computed; None for the values of
            ``parameters``.
    """

    parameters: SX
    unknowns: SX
    rotation: SX
    position: SX
    reference: tuple[float, ...] | None = None

    @classmethod
    def identity(cls, model: Model) -> Substitution:
        """Return the symbols of the model, so that nothing is replaced."""
        return cls(
            model.symbols,
            ca.vertcat(SX(0, 1), *[item.symbol for item in model.unknowns]),
            model.pose.rotation,
            model.pose.position,
        )

    @property
    def all(self) -> list[SX]:
        """The four expressions, in the order of the first four fields."""
        return [self.parameters, self.unknowns, self.rotation, self.position]


@dataclass(frozen=True, eq=False)
class LegInstance:
    """A leg at one pose.

    Attributes:
        name: the limb's name.
        base: (3, 1) centre of the leg's base joint in the world frame, length.
        platform: (3, 1) centre of the leg's platform joint in the platform frame, length.
        span: (3, 1) vector from base joint to platform joint in the world frame, length.
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
        rotation: (3, 3) ``R``, platform to world coordinates.
        position: (3, 1) ``p``, origin of the platform frame in the world frame, length.
        jacobian: (m, 6) unit wrenches ``J``, force, then moment about the world origin; rows of couples times the
            characteristic length. Rows of single wrenches come first, then all rows of the members' projectors.
        rates: (m, tasks) work rates ``L_i ^ chi_j``.
        F: (tasks, 1) objective of each task (equation 14).
        squares: (w, 1) squared norm of the direction of each single wrench; 0 for a limb of zero length.
        magnitude: (tasks, 1) upper bound on F without cancellation; see :func:`magnitude`.
        quantities: (n, 1) values of each quantity of the model.
        legs: the model's legs.
        closure: (c, 1) left sides of the closure equations; zero where the loops are closed.
        rows: rows before normalisation.
        inputs: (k, 1) all arguments: parameters, unknowns, rotation column by column, position, characteristic length,
            twists.
        loops: (k, 1) left sides of all loop equations, including the equations that ``closure`` omits.
        driven: (m, a) work rate of each row for a unit rate of each actuator.
        relations: (r, a) coefficients of the equations that loops impose on the actuator rates alone.
        signs: (s, 1) expressions that are positive in the home assembly mode.
        distances: (d, 1) left sides of equations that follow from the loop equations.
        joints: joints of the model's limbs.
        links: links of the model's limbs.
        size: (1, 1) characteristic size of the robot, length.
        reference: parameter values from which the scales of the loop equations are computed; None for ``parameters``.
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
    rows: tuple[Wrench, ...]
    inputs: SX
    loops: SX
    driven: SX
    relations: SX
    signs: SX
    distances: SX
    joints: tuple[LimbJoint, ...]
    links: tuple[LimbLink, ...]
    size: SX
    reference: tuple[float, ...] | None = None


def instantiate(model: Model, substitution: Substitution, length: SX, twists: Sequence[SX]) -> RobotInstance:
    """Return a model's expressions with its symbols replaced.

    Args:
        model: the model.
        substitution: expressions that replace the symbols of the model.
        length: (1, 1) characteristic length, factor of the rows of couples.
        twists: (6, 1) each: angular velocity, then velocity of the platform point at the world origin.
    """
    given = (
        (model.wrenches, model.members, model.actuators, model.closure, model.loops, model.distances),
        (model.signs, model.quantities, model.joints, model.links),
        tuple((leg.base, leg.platform) for leg in model.legs),
        _size_of(model),
    )
    function = ca.Function("model", Substitution.identity(model).all, expressions_of(given))
    replaced = with_expressions(given, iter(function.call(substitution.all)))
    found, (signs, quantities, joints, links), ends, size = replaced
    rows, members, actuators, *equations = found

    def left_sides(parts: Sequence[Closure], replaced: Sequence[Closure]) -> SX:
        """Return the left sides (k, 1) of equations, scaled to values of about 1."""
        sizes = ca.vertcat(SX(0, 1), *[each.size for each in replaced])
        sides = ca.vertcat(SX(0, 1), *[each.expression for each in replaced])
        return sides / sizes_at(model, parts, substitution.reference, sizes)

    closure, loops, distances = map(left_sides, (model.closure, model.loops, model.distances), equations)
    return RobotInstance(
        parameters=substitution.parameters,
        rotation=substitution.rotation,
        position=substitution.position,
        jacobian=jacobian(rows, length, members),
        rates=ca.horzcat(*[rates(rows, twist, length, members) for twist in twists]),
        F=ca.vertcat(*[objective(rows, twist, length, members) for twist in twists]),
        squares=ca.vertcat(SX(0, 1), *[row.square for row in rows]),
        magnitude=ca.vertcat(*[magnitude(rows, twist, substitution.position, length, members) for twist in twists]),
        quantities=tuple(each.values for each in quantities),
        legs=tuple(
            LegInstance(leg.name, base, platform, substitution.position + substitution.rotation @ platform - base)
            for leg, (base, platform) in zip(model.legs, ends, strict=True)
        ),
        closure=closure,
        rows=rows,
        inputs=ca.veccat(*substitution.all, length, *twists),
        loops=loops,
        distances=distances,
        driven=driven(rows, actuators, length, members),
        relations=rate_relations(actuators),
        signs=ca.vertcat(SX(0, 1), *[each.value for each in signs]),
        joints=joints,
        links=links,
        size=size,
        reference=substitution.reference,
    )


def sizes_at(
    model: Model, parts: Sequence[Closure | Unknown], reference: tuple[float, ...] | None, otherwise: SX
) -> SX:
    """Return the scales (k, 1) of loop equations or unknowns for values of the parameters.

    Args:
        model: the model.
        parts: the k equations or unknowns.
        reference: (n,) values of the parameters, empty for a robot of literal numbers; None for no reference.
        otherwise: (k, 1) scales to use without a reference, or in place of a scale that is not positive at the
            reference.
    """
    if reference is None or not parts:
        return otherwise
    own = Substitution.identity(model).parameters
    function = ca.Function("sizes", [own], [ca.densify(ca.vertcat(*[each.size for each in parts]))])
    values = function(np.array(reference)).full().ravel()
    each = (SX(float(value)) if 0 < value < np.inf else otherwise[k] for k, value in enumerate(values))
    return ca.vertcat(*each)


def length_of(model: Model, values: Sequence[float]) -> float:
    """Return the characteristic size of a robot, length.

    Tolerances on lengths, areas and products of lengths are relative to this size, so that results do not depend on the
    unit.

    Args:
        model: robot.
        values: (n,) values of the robot's parameters.
    """
    function = ca.Function("size", [Substitution.identity(model).parameters], [ca.densify(_size_of(model))])
    found = float(function(list(values)))
    return found if 0 < found < np.inf else float(np.linalg.norm(model.home)) or 1.0


def joint_sizes(model: Model) -> FloatArray:
    """Return the sizes (d,) of the joint coordinates among a model's parameters; 0 for its dimensions.

    These coordinates are 0 at home, so a test of expressions at random values needs their sizes.
    """
    names, size = [joint_parameter(label) for label in model.locked], length_of(model, model.typical.tolist())
    return np.array(
        [
            (size if item.dimension is Dimension.LENGTH else 1.0) * (item.name in names)
            for item in model.parameters
            for _ in item.typical
        ],
        dtype=np.float64,
    )


def _size_of(model: Model) -> SX:
    if model.size is not None:
        return model.size
    lengths = [ca.vec(item.symbol) for item in model.parameters if item.dimension is Dimension.LENGTH]
    return ca.norm_2(ca.vertcat(*lengths)) if lengths else SX(float(np.linalg.norm(model.home)) or 1.0)


def jacobian(rows: Sequence[Wrench], length: SX, members: Sequence[Member] = ()) -> SX:
    """Return the Jacobian (m, 6): unit wrenches, force, then moment about the world origin; couples times the length.

    Args:
        rows: single wrenches.
        length: (1, 1) characteristic length.
        members: members; the 3 or 6 rows of each projector follow the single wrenches.
    """
    own = [_row_factor(row, length) * ca.vertcat(row.force, row.moment).T / ca.sqrt(row.square) for row in rows]
    unit_twists = ca.vertcat(ca.horzcat(SX(3, 3), SX.eye(3)), ca.horzcat(SX.eye(3), SX(3, 3)))
    return ca.vertcat(SX(0, 6), *own, *[resistance(member, unit_twists, length) for member in members])


def rates(rows: Sequence[Wrench], twist: SX, length: SX, members: Sequence[Member] = ()) -> SX:
    """Return the work rates ``L_i ^ chi``, (m, 1), in a twist (6, 1); work rates of couples are times the length."""
    own = [_scaled_rate(row, twist, length) / ca.sqrt(row.square) for row in rows]
    return ca.vertcat(SX(0, 1), *own, *[resistance(member, twist, length) for member in members])


def driven(rows: Sequence[Wrench], actuators: Sequence[Actuator], length: SX, members: Sequence[Member] = ()) -> SX:
    """Return the work rates (m, a) of the rows of :func:`jacobian` for a unit rate of each actuator.

    Args:
        rows: single wrenches.
        actuators: the actuators.
        length: (1, 1) characteristic length.
        members: members; the rows of their projectors follow the single wrenches.
    """
    found = SX(len(rows) + sum(member.size for member in members), len(actuators))
    for k, actuator in enumerate(actuators):
        for i, row in enumerate(rows):
            screw = actuator.screw_in(row.label.member)
            if screw is not None:
                found[i, k] = _scaled_rate(row, screw, length) / ca.sqrt(row.square)
        at = len(rows)
        for member in members:
            screw = actuator.screw_in(member.label)
            if screw is not None:
                found[at : at + member.size, k] = resistance(member, screw, length)
            at += member.size
    return found


def objective(rows: Sequence[Wrench], twist: SX, length: SX, members: Sequence[Member] = ()) -> SX:
    """Return F, (1, 1), in a twist (6, 1) (equation 14).

    F is written as a sum of ``(m . omega + f . v)^2 / square`` and not as a sum of squared products of unit vectors:
    the former is smoother and has tighter interval enclosures.

    Args:
        rows: single wrenches.
        twist: (6, 1) angular velocity, then velocity of the platform point at the world origin.
        length: (1, 1) characteristic length, factor of the rows of couples.
        members: members of limbs; each adds ``|P x|^2``.
    """
    own = sum((_scaled_rate(row, twist, length) ** 2 / row.square for row in rows), SX(0))
    return own + sum((ca.sumsqr(resistance(member, twist, length)) for member in members), SX(0))


def magnitude(rows: Sequence[Wrench], twist: SX, position: SX, length: SX, members: Sequence[Member] = ()) -> SX:
    """Return an upper bound on F without cancellation, (1, 1): ``sum (|m_i| |omega| + |f_i| |v|)^2``.

    Moments and velocity refer to the platform's origin, so that the bound does not depend on the world's origin. A
    member adds the bound of ``|x|^2`` about its centre.

    Args:
        rows: single wrenches.
        twist: (6, 1) angular velocity, then velocity of the platform point at the world origin.
        position: (3, 1) origin of the platform frame in the world frame, length.
        length: (1, 1) characteristic length, factor of the rows of couples.
        members: members of limbs.
    """
    omega, v = twist[:3], twist[3:]
    at_origin = ca.norm_2(v + ca.cross(omega, position))
    turning = ca.norm_2(omega)
    of_members = (
        (at_origin + ca.norm_2(member.centre - position) * turning) ** 2
        + (0 if member.is_pinned else length * turning) ** 2
        for member in members
    )
    return sum(of_members, SX(0)) + sum(
        (
            _row_factor(row, length) ** 2
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


def homogenised(jacobian: Matrix, centre: Matrix, length: float) -> tuple[Matrix, ...]:
    """Return the columns of a homogeneous Jacobian: moments about a point, divided by a length.

    Args:
        jacobian: (m, 6) rows, force, then moment about the world origin; symbols or numbers.
        centre: (3,) or, as symbols, (3, 1) reference point in the world frame, length.
        length: divisor of the moments, length.

    Returns:
        Six columns, each (m,) or, as symbols, (m, 1): forces, then moments.
    """
    columns: list[Matrix] = [jacobian[:, k] for k in range(6)]
    coordinates: list[Matrix] = [centre[k] for k in range(3)]
    fx, fy, fz, mx, my, mz = columns
    x, y, z = coordinates
    mx, my, mz = mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx)
    return fx, fy, fz, mx / length, my / length, mz / length


def _row_factor(row: Wrench, length: SX) -> SX:
    """Return the factor of a row: the characteristic length for a couple, 1 for a force."""
    return length if row.kind is WrenchKind.COUPLE else SX(1)


def _scaled_rate(row: Wrench, twist: SX, length: SX) -> SX:
    """Return the work rate of a row in a twist times the factor of the row, before division by ``sqrt(square)``."""
    return _row_factor(row, length) * row.rate(twist)
