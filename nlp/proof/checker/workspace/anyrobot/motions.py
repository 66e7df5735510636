"""Matrices whose null space has the motions of a platform that nothing resists.

A motion is the velocity v of the platform's origin and its angular velocity, here ``x = (v, length omega)``, with rates
of joints. Each row of the matrix is a condition that it keeps:

* the force f and moment m of a limb's row, about the platform's origin, do no work: ``f.v + m.omega = 0``;
* the motion is one of the passive joints of each member, ``x - sum_j w_j S_j = 0`` with rates w; of a pinned member the
  velocity of its centre alone.

With the actuators free, x minus the motion ``sum_k u_k A_k`` of the actuators that move a member stands for x in its
conditions. With locked actuators the matrix has full column rank where J has full rank, and the passive screws of each
member are independent. With free ones its null space has as many dimensions as the robot has freedoms and rates ``u``
without a motion, and more only where the constraint wrenches lose their rank, or passive screws theirs.

Nested loops of a member are conditions as they are, ``sum_j w_j L_j + sum_k u_k L_k = 0``, beside ``x = sum_j w_j S_j +
sum_k u_k S_k`` with the motions S that joints give the platform along a tree of links. Screws with the loops solved
would not tell where a loop loses its rank. Both null spaces have the rates of passive joints in addition that close the
loops and do not move the platform.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ......models import Actuator, FloatArray, Member, Model, Wrench, WrenchKind
from ......models.member import scaled_twists
from ......models.rows import independent_rows
from ...proof_file import ProofError
from .posedrobot import PosedRobot

#: Singular values below this part of the largest are zero at the middle of the workspace.
_ZERO = 1e-9


@dataclass(frozen=True, eq=False)
class Motions:
    """A matrix of expressions.

    Attributes:
        matrix: (m, c) sparse, m not below c less the freedoms; its first six columns are those of the platform.
        freedoms: dimensions of its null space that are claimed to be all: of the robot's freedoms and idle rates.
    """

    matrix: SX
    freedoms: int


def locked_motions(robot: PosedRobot, start: FloatArray) -> Motions:
    """Return the matrix with locked actuators.

    Args:
        robot: the robot.
        start: (n,) closed loops, at which those screws of each member are chosen that are independent.

    Raises:
        ProofError: the screws of a member are singular there.
    """
    matrix = _matrix(robot, robot.rows, _with_chosen_screws(robot, start), ())
    idle = sum(each.idle for each in robot.nested)
    if idle and idle > _freedoms(robot, matrix, start):
        raise ProofError("passive joints have fewer motions without the platform than at almost all poses")
    return Motions(matrix, idle)


def free_motions(model: Model, robot: PosedRobot, start: FloatArray) -> Motions:
    """Return the matrix with free actuators; of a robot given by its rows that of its couples, which are constraints.

    Args:
        model: the robot's model.
        robot: the robot.
        start: as for :func:`locked_motions`.

    Raises:
        ProofError: the screws of a member are singular at the start, or as many freedoms as a platform has are left.
    """
    if robot.actuators:
        matrix = _matrix(robot, robot.rows, _with_chosen_screws(robot, start), robot.actuators)
    else:
        couples = [row for row in robot.rows if row.kind is WrenchKind.COUPLE]
        matrix = _matrix(robot, couples, (), ())
    at_start = _freedoms(robot, matrix, start)
    freedoms, idle = at_start, 0
    if model.generic is not None:
        freedoms = 6 - model.generic.constraints
        idle = model.generic.idle + sum(each.idle for each in robot.nested)
    if not 0 < freedoms < 6:
        raise ProofError("the robot has no constraint wrenches of which the rank could be claimed")
    if freedoms + idle > at_start:
        raise ProofError("the robot has fewer freedoms in the middle of the workspace than at almost all poses")
    return Motions(matrix, freedoms + idle)


def _freedoms(robot: PosedRobot, matrix: SX, start: FloatArray) -> int:
    """Return the dimensions of the null space at closed loops (n,)."""
    values = np.linalg.svd(ca.Function("at", [robot.z], [ca.densify(matrix)])(start).full(), compute_uv=False)
    return int(matrix.shape[1]) - int(np.count_nonzero(values > _ZERO * values[0]))


def _with_chosen_screws(robot: PosedRobot, start: FloatArray) -> list[Member]:
    """Return the members with as many of their screws as have their rank: where these are independent, they span all.

    Raises:
        ProofError: the screws of a member have another rank at the start.
    """
    members = []
    for each in robot.members:
        if each.rank == each.screws.shape[1]:
            members.append(each)
            continue
        columns = scaled_twists(each.screws, each.centre, SX(robot.length), each.size)
        values = ca.Function("screws", [robot.z], [ca.densify(columns)])(start).full()
        chosen = independent_rows([values.T])
        if len(chosen) != each.rank:
            raise ProofError(f"the passive joints of limb {each.label} are singular in the middle of the workspace")
        members.append(replace(each, screws=each.screws[:, sorted(chosen)], groups=()))
    return members


def _matrix(robot: PosedRobot, rows: Sequence[Wrench], members: Sequence[Member], actuators: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), with columns of the platform, of passive joints and of actuators."""
    passive = sum(each.screws.shape[1] for each in members) + sum(len(each.passive) for each in robot.nested)
    blocks, at = [], 6

    def driven(member: str, seen: SX) -> list[SX]:
        """Return the columns of all actuators: those that do not move a member are 0."""
        screws = [each.screw_in(member) for each in actuators]
        return [SX(seen.shape[0], 1) if screw is None else -seen @ _motion(robot, screw) for screw in screws]

    for row in rows:
        moment = row.moment - ca.cross(robot.position, row.force)
        work = ca.horzcat(row.force.T, moment.T / robot.length)
        blocks.append(ca.horzcat(work, SX(1, passive), *driven(row.label.member, work)))
    for each in members:
        # The velocity of a pinned member's centre is v + omega x arm.
        arm = (each.centre - robot.position) / robot.length
        seen = ca.horzcat(SX.eye(3), -ca.skew(arm)) if each.is_pinned else SX.eye(6)
        count = each.screws.shape[1]
        own = [-seen @ _motion(robot, each.screws[:, j]) for j in range(count)]
        before, after = SX(each.size, at - 6), SX(each.size, 6 + passive - at - count)
        blocks.append(ca.horzcat(seen, before, *own, after, *driven(each.label, seen)))
        at += count
    for path in robot.nested:
        motions = [-_motion(robot, path.all[:, j]) for j in range(path.all.shape[1])]
        conditions = ca.vertcat(ca.horzcat(SX(6, 0), *motions), path.loops)
        count, height = len(path.passive), conditions.shape[0]
        turned = {(path.limb, path.actuator(j)): conditions[:, j] for j in path.driven}
        before, after = SX(height, at - 6), SX(height, 6 + passive - at - count)
        platform = ca.vertcat(SX.eye(6), SX(height - 6, 6))
        turns = [turned.get((each.limb, each.name), SX(height, 1)) for each in actuators]
        whole = ca.sparsify(ca.horzcat(platform, before, conditions[:, path.passive], after, *turns))
        blocks += [row for row in ca.vertsplit(whole) if row.nnz()]
        at += count
    return ca.sparsify(ca.vertcat(SX(0, 6 + passive + len(actuators)), *blocks))


def _motion(robot: PosedRobot, screw: SX) -> SX:
    """Return the motion (6, 1) of a screw: a twist with the world's origin as reference."""
    omega, v = screw[:3], screw[3:]
    return ca.vertcat(v + ca.cross(omega, robot.position), robot.length * omega)
