"""Statics and actuator rates: platform motion for a unit rate of one actuator, and forces by virtual work.

With ``J chi = D qdot``, the platform motion for a unit rate of actuator k only is the solution of ``J x_k = d_k``. A
load W does the work ``W . x_k`` in it, and constraint wrenches do none, so the actuator balances the load with the
force or torque

    tau_k = -(W . x_k),        W . x = force . v + moment . omega            (virtual work)

with moments about the platform's origin and v its velocity. The motions ``x_k`` span all platform motions. The rates of
all actuators in a motion ``chi = X qdot`` are ``(X' S X)^-1 X' S chi`` for any weights S.

``J x_k = d_k`` has a solution if the robot has as many actuators as degrees of freedom, for any number of rows of J.
The solution uses the normal equations with one step of refinement, without a choice of rows.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import casadi as ca
from casadi import SX

from .actuation import rates_expression
from .instance import RobotInstance
from .model import Model
from .parts import Dimension
from .wrench import WrenchKind


class DrivenJoint(NamedTuple):
    """Actuator: name, limb, and dimension (length or angle)."""

    name: str
    limb: str
    dimension: Dimension


def driven_joints(model: Model) -> tuple[DrivenJoint, ...]:
    """Return the actuators of a robot: its actuated joints, or its straight legs along their lines."""
    if model.actuators:
        return tuple(DrivenJoint(each.name, each.limb, each.dimension) for each in model.actuators)
    return tuple(DrivenJoint(each.name, each.name, Dimension.LENGTH) for each in model.legs)


def degrees_of_freedom(model: Model) -> int:
    """Return the degrees of freedom of the platform with unlocked actuators, at almost all dimensions and poses."""
    if model.generic is not None:
        return 6 - model.generic.constraints
    return 6 - sum(row.kind is not WrenchKind.FORCE for row in model.wrenches)


def statics_hindrance(model: Model) -> str:
    """Return the reason why loads do not determine the actuator forces, as a clause; empty if they do."""
    count, freedoms = len(driven_joints(model)), degrees_of_freedom(model)
    if not count:
        return "its actuators are not known"
    if not freedoms:
        return "its platform cannot move"
    if count > freedoms:
        surplus = f"it has {_counted(count, 'actuator')} for {_counted(freedoms, 'degree')} of freedom"
        apart = "which can move while the platform stands still: actuator forces of such robots are not computed"
        against = "so internal forces between actuators are not determined by the load"
        return f"{surplus}, {apart if model.generic is not None and model.generic.idle else against}"
    if count < freedoms:
        held = f"{_counted(freedoms, 'degree')} of freedom of its platform"
        return f"its {_counted(count, 'actuator')} {'do' if count > 1 else 'does'} not control the {held}"
    if model.rank < 6:
        return "its platform can move with locked actuators"
    return ""


def _counted(count: int, word: str) -> str:
    return f"{count} {word}{'s' if count > 1 else ''}"


class Statics(NamedTuple):
    """Platform motions for unit actuator rates at one pose, with the actuator forces and rates by virtual work.

    Attributes:
        numerators: (6, a) platform motion for a unit rate of each actuator, times the divisor: angular velocity, then
            velocity of the platform's origin, in the world frame.
        divisor: (1, 1) divisor, 0 where the rows are dependent; 1 for motions that are not quotients.
        rows: (m, 6) rows of J about the platform's origin: moment, then force.
        driven: (m, a) work rates of the rows for a unit rate of each actuator.
        factors: factors of ``J'J`` of these rows.
    """

    numerators: SX
    divisor: SX
    rows: SX
    driven: SX
    factors: tuple[SX, SX]

    @property
    def motions(self) -> SX:
        """Platform motion (6, a) for a unit rate of each actuator."""
        return self.numerators / self.divisor

    def rates(self, length: SX) -> SX:
        """Return the matrix (a, 6) from a possible platform motion to the rates of all actuators.

        For a platform with fewer than six degrees of freedom the matrix is not unique: it is the one of least norm,
        with angular velocities times a length.

        Args:
            length: (1, 1) factor of angular velocities, length.
        """
        weights = ca.vertcat(SX.ones(3) * length**2, SX.ones(3))
        motions = self.motions
        weighted = motions * ca.repmat(weights, 1, motions.shape[1])
        return _solved(_factors(motions.T @ weighted), weighted.T)

    def compliance(self, stiffness: SX) -> SX:
        """Return the compliance (6, 6): platform displacement for unit components of a load, moment, then force.

        Links and joints are rigid; only the actuators are elastic.

        Args:
            stiffness: (a, 1) stiffness of each actuator: force or torque per displacement.
        """
        motions = self.motions
        return motions @ (motions / ca.repmat(stiffness.T, 6, 1)).T

    def row_forces(self, load: SX) -> SX:
        """Return the row forces (m, 1) that balance a load (6, 1), force and moment about the platform's origin.

        For dependent rows, they are the forces with the least sum of squares.
        """
        return -self.rows @ _solved(self.factors, ca.vertcat(load[3:], load[:3]))


def statics_of(model: Model, jacobian: SX, driven: SX, position: SX) -> Statics:
    """Return the platform motions for unit actuator rates at a pose.

    Args:
        model: robot for which :func:`statics_hindrance` returns an empty text.
        jacobian: (m, 6) Jacobian of a :class:`~.instance.RobotInstance` at the pose: expressions or numbers.
        driven: (m, a) work rates of its rows for unit actuator rates: expressions or numbers.
        position: (3, 1) origin of the platform frame in the world frame, length.
    """
    rows = rows_about(jacobian, position)
    driven = driven if model.actuators else _of_legs(model)
    factors = _factors(rows.T @ rows)
    motions = _solved(factors, rows.T @ driven)
    motions += _solved(factors, rows.T @ (driven - rows @ motions))
    return Statics(motions, SX(1), rows, driven, factors)


def rows_about(jacobian: SX, position: SX) -> SX:
    """Return rows (m, 6) about the platform's origin (3, 1): moment, then force."""
    force, moment = jacobian[:, :3], jacobian[:, 3:]
    return ca.horzcat(moment - ca.horzcat(*[ca.cross(position, each.T) for each in ca.vertsplit(force)]).T, force)


def inverse_rates(model: Model, robot: RobotInstance) -> SX:
    """Return the inverse Jacobian (a, 6): actuator rates for angular velocity and velocity of the platform's origin.

    Least-squares solution of ``D qdot = J chi`` for each limb, exact in every possible platform motion. Unlike
    :meth:`Statics.rates` it also exists where J is singular, and for any number of actuators.

    Args:
        model: the robot.
        robot: robot at a pose.
    """
    rows, joints = rows_about(robot.jacobian, robot.position), driven_joints(model)
    driven, relations = (robot.driven, robot.relations) if model.actuators else (_of_legs(model), SX(0, len(joints)))
    found = SX(len(joints), 6)
    for limb in dict.fromkeys(each.limb for each in joints):
        own = [k for k, each in enumerate(joints) if each.limb == limb]
        at = [k for k, row in enumerate(model.frame_rows) if row.limb == limb]
        found[own, :] = rates_expression(driven[at, own], _without_zeros(relations[:, own]), rows[at, :])
    return found


def _without_zeros(relations: SX) -> SX:
    """Return the rows of relations (r, a) with a nonzero coefficient."""
    return relations[[k for k in range(relations.shape[0]) if not relations[k, :].is_zero()], :]


def posed_statics(model: Model, robot: RobotInstance) -> Statics:
    """Return the platform motions for unit actuator rates at a pose.

    If J has six rows, only of straight legs and couples, the motions are quotients of minors of J.

    Args:
        model: robot for which :func:`statics_hindrance` returns an empty text.
        robot: the robot at the pose.
    """
    found = statics_of(model, robot.jacobian, robot.driven, robot.position)
    # Rows of a robot given joint by joint may be constraint forces.
    quotient = None if model.actuators else _quotient_of_minors(robot)
    return found if quotient is None else found._replace(numerators=quotient[0], divisor=quotient[1])


def _quotient_of_minors(robot: RobotInstance) -> tuple[SX, SX] | None:
    """Return the platform motions of a robot with six rows of straight legs and couples: numerators (6, a) and divisor.

    The motions of :func:`statics_of` without the pivots of a factorisation: polynomials of spans and joint centres over
    the determinant of the rows, which a search over a box can bound. None for other robots.

    Args:
        robot: robot at a pose.
    """
    legs = {leg.name: leg for leg in robot.legs}
    if len(robot.rows) != 6 or robot.jacobian.shape[0] != 6 or not legs:
        return None
    turning, sliding, lengths = [], [], []
    for row in robot.rows:
        if row.kind is WrenchKind.FORCE:
            leg = legs[row.limb]
            turning.append(ca.cross(robot.rotation @ leg.platform, leg.span))
            sliding.append(leg.span)
            lengths.append(ca.norm_2(leg.span))
        else:
            turning.append(row.moment)
            sliding.append(SX.zeros(3))
    driven = [k for k, row in enumerate(robot.rows) if row.kind is WrenchKind.FORCE]
    if len(driven) == 3:  # the couples prevent all rotations
        f = [sliding[k] for k in driven]
        crossed = [ca.cross(f[(k + 1) % 3], f[(k + 2) % 3]) for k in range(3)]
        volume = ca.dot(f[0], crossed[0])
        found = ca.horzcat(*[length * each for length, each in zip(lengths, crossed, strict=True)])
        return ca.vertcat(SX.zeros(3, 3), found), volume
    matrix = ca.horzcat(ca.horzcat(*turning).T, ca.horzcat(*sliding).T)
    cofactors = _cofactors(matrix)
    whole = sum((matrix[0, c] * cofactors[0, c] for c in range(6)), SX(0))
    return ca.horzcat(*[length * cofactors[k, :].T for k, length in zip(driven, lengths, strict=True)]), whole


def _cofactors(matrix: SX) -> SX:
    """Return the cofactors (6, 6) of a matrix (6, 6), by minors of its first and last three columns."""
    rows, found = range(6), SX(6, 6)
    blocks = (matrix[:, :3], matrix[:, 3:])
    thirds = [{s: ca.det(block[list(s), :]) for s in _subsets(rows, 3)} for block in blocks]
    for half, c in itertools.product(range(2), range(3)):
        a, b = (blocks[half][:, j] for j in range(3) if j != c)
        pairs = {s: a[s[0]] * b[s[1]] - b[s[0]] * a[s[1]] for s in _subsets(rows, 2)}
        for k in rows:
            others = [i for i in rows if i != k]
            value = SX(0)
            for s in _subsets(others, 2):
                rest = tuple(i for i in others if i not in s)
                # Laplace expansion: the two rows belong to the block without its column, in front or behind.
                sign = (-1) ** (others.index(s[0]) + others.index(s[1]) + (1 if half == 0 else 7))
                value += sign * pairs[s] * thirds[1 - half][rest]
            found[k, 3 * half + c] = (-1) ** (k + 3 * half + c) * value
    return found


def _of_legs(model: Model) -> SX:
    """Return the work rates (m, a) of the rows of straight legs for a unit rate of each leg."""
    rows, legs = model.frame_rows, [leg.name for leg in model.legs]
    found = SX(len(rows), len(legs))
    for i, row in enumerate(rows):
        if row.kind is WrenchKind.FORCE:
            found[i, legs.index(row.limb)] = 1.0
    return found


def _factors(matrix: SX) -> tuple[SX, SX]:
    """Return the factors L (n, n) and d (n, 1) of a symmetric positive definite matrix ``L diag(d) L'`` (n, n)."""
    n = matrix.shape[0]
    L, d = SX.eye(n), SX(n, 1)
    for j in range(n):
        d[j] = matrix[j, j] - sum((L[j, k] ** 2 * d[k] for k in range(j)), SX(0))
        for i in range(j + 1, n):
            L[i, j] = (matrix[i, j] - sum((L[i, k] * L[j, k] * d[k] for k in range(j)), SX(0))) / d[j]
    return L, d


def _solved(factors: tuple[SX, SX], right: SX) -> SX:
    """Return the solution (n, k) of a system with a factored matrix for right sides (n, k)."""
    (L, d), n = factors, right.shape[0]
    found = SX(right)
    for i in range(n):
        for j in range(i):
            found[i, :] -= L[i, j] * found[j, :]
    found /= ca.repmat(d, 1, right.shape[1])
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            found[i, :] -= L[j, i] * found[j, :]
    return found


def _subsets(numbers: Iterable[int], size: int) -> list[tuple[int, ...]]:
    return list(itertools.combinations(numbers, size))
