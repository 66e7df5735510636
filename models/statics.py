"""Statics and rates of actuators: the platform's motion by one actuator alone, and forces by virtual work.

With ``J chi = D qdot`` for the rows of J and the actuators' rates, the motion ``x_k`` of the platform by a unit rate of
actuator k alone is the solution of ``J x_k = d_k``. A load W does the work ``W . x_k`` in it, and the constraint
wrenches do none, so that the actuator holds the load with the force, or the torque,

    tau_k = -(W . x_k),        W . x = force . v + moment . omega            (virtual work)

with moments about the platform's origin and v its velocity. The motions span those that the platform can make. The
rates of all actuators in such a motion ``chi = X qdot`` are ``(X' S X)^-1 X' S chi`` for any weights S.

``J x_k = d_k`` has a solution wherever the robot has as many actuators as freedoms, however many rows J has. It is
found from the normal equations, with one step of refinement, in which no row is chosen.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
from casadi import SX

from .model import Model
from .parts import Dimension
from .wrench import WrenchKind


class DrivenJoint(NamedTuple):
    """An actuator: its name, its limb, and its dimension, a length or an angle."""

    name: str
    limb: str
    dimension: Dimension


def driven_joints(model: Model) -> tuple[DrivenJoint, ...]:
    """Return the actuators of a robot: its actuated joints, or its straight legs along their lines."""
    if model.actuators:
        return tuple(DrivenJoint(each.name, each.limb, each.dimension) for each in model.actuators)
    return tuple(DrivenJoint(each.name, each.name, Dimension.LENGTH) for each in model.legs)


def freedoms_of(model: Model) -> int:
    """Return the freedoms of a robot's platform with free actuators, for almost all dimensions and poses."""
    if model.generic is not None:
        return 6 - model.generic.constraints
    return 6 - sum(row.kind is not WrenchKind.FORCE for row in model.wrenches)


def statics_hindrance(model: Model) -> str:
    """Return why loads do not determine the forces of a robot's actuators, as a clause; empty where they do."""
    count, freedoms = len(driven_joints(model)), freedoms_of(model)
    if not count:
        return "its actuators are not known"
    if count > freedoms:
        return (
            f"it has {count} actuators for {freedoms} freedoms, so that they can load each other with forces that no "
            "load determines"
        )
    if count < freedoms:
        return f"its {count} actuators do not hold the {freedoms} freedoms of its platform"
    if model.generic is not None and model.generic.jacobian < 6:
        return "its platform can move with locked actuators"
    return ""


class Statics(NamedTuple):
    """Motions of a robot's platform by its actuators at one pose, and what follows from them by virtual work.

    Attributes:
        motions: (6, a) motion of the platform by a unit rate of each actuator alone: angular velocity, then velocity of
            the platform's origin, in the world frame.
        rows: (m, 6) the rows of J for such motions.
        driven: (m, a) work rates of the rows for a unit rate of each actuator.
        factors: of ``J'J`` for them.
    """

    motions: SX
    rows: SX
    driven: SX
    factors: tuple[SX, SX]

    def rates(self, length: SX) -> SX:
        """Return the rates (a, 6) of all actuators in a motion that the platform can make.

        Of a platform with fewer than six freedoms other factors say the same of these motions. They are those with the
        least size, with angular velocities times a length.

        Args:
            length: (1, 1) the length.
        """
        weights = ca.vertcat(SX.ones(3) * length**2, SX.ones(3))
        weighted = self.motions * ca.repmat(weights, 1, self.motions.shape[1])
        return _solved(_factors(self.motions.T @ weighted), weighted.T)

    def row_forces(self, load: SX) -> SX:
        """Return forces (m, 1) of the rows that hold a load (6, 1), force and moment about the platform's origin.

        Where the rows are not independent, they are those with the least sum of squares.
        """
        return -self.rows @ _solved(self.factors, ca.vertcat(load[3:], load[:3]))


def statics_of(model: Model, jacobian: SX, driven: SX, position: SX) -> Statics:
    """Return the motions of a robot's platform by its actuators at a pose.

    Args:
        model: the robot, of which :func:`statics_hindrance` says nothing.
        jacobian: (m, 6) that of a :class:`~.instance.RobotInstance` at the pose: expressions or numbers.
        driven: (m, a) that of the instance, or numbers.
        position: (3, 1) origin of the platform frame in the world frame, length.
    """
    force, moment = jacobian[:, :3], jacobian[:, 3:]
    about_origin = moment - ca.horzcat(*[ca.cross(position, each.T) for each in ca.vertsplit(force)]).T
    rows = ca.horzcat(about_origin, force)
    driven = driven if model.actuators else _of_legs(model)
    factors = _factors(rows.T @ rows)
    motions = _solved(factors, rows.T @ driven)
    motions += _solved(factors, rows.T @ (driven - rows @ motions))
    return Statics(motions, rows, driven, factors)


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
