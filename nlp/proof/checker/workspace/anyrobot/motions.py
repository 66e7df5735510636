"""Matrices whose null space has the motions of a platform that nothing resists.

A motion is the velocity v of the platform's origin and its angular velocity, here ``x = (v, length omega)``, with rates
of joints. Each row of the matrix is a condition that it keeps:

* the force f and moment m of a limb's row, about the platform's origin, do no work: ``f.v + m.omega = 0``;
* the motion is one of the passive joints of each member, ``x - sum_j w_j S_j = 0`` with rates w; of a pinned member the
  velocity of its centre alone.

With the actuators free, x minus the motion ``sum_k u_k A_k`` of the actuators that move a member stands for x in its
conditions, and relations ``B u = 0`` that loops demand of the actuators alone are conditions too. With locked actuators
the matrix has full column rank where J has full rank, and the passive screws of each member are independent. With free
ones its null space has as many dimensions as the robot has freedoms and rates ``u`` without a motion, and more only
where the constraint wrenches lose their rank, or passive screws theirs.

Screws of members with nested loops have these solved, with the rank that they have at almost all poses. That each loop
keeps its rank is claimed beside: as many of its conditions as its rank are columns of a block of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ......models import Actuator, FloatArray, Member, Model, Wrench, WrenchKind, rate_relations
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
        freedoms: dimensions of its null space that are claimed to be all: the robot's freedoms and idle rates.
    """

    matrix: SX
    freedoms: int


def locked_motions(model: Model, robot: PosedRobot, start: FloatArray) -> Motions:
    """Return the matrix with locked actuators.

    Args:
        model: the robot's model.
        robot: the robot.
        start: (n,) closed loops, at which those screws of each member are chosen that are independent.

    Raises:
        ProofError: the screws or loops of a member are singular there.
    """
    matrix = _matrix(robot, robot.rows, _with_chosen_screws(robot, start), ())
    return Motions(ca.diagcat(matrix, *_loop_blocks(model, robot, start)), 0)


def free_motions(model: Model, robot: PosedRobot, start: FloatArray) -> Motions:
    """Return the matrix with free actuators; of a robot given by its rows that of its couples, which are constraints.

    Args:
        model: the robot's model.
        robot: the robot.
        start: as for :func:`locked_motions`.

    Raises:
        ProofError: screws or loops of a member are singular at the start, or all freedoms of a platform are left.
    """
    if robot.actuators:
        matrix = _matrix(robot, robot.rows, _with_chosen_screws(robot, start), robot.actuators)
        matrix = ca.diagcat(matrix, *_loop_blocks(model, robot, start))
    else:
        couples = [row for row in robot.rows if row.kind is WrenchKind.COUPLE]
        matrix = _matrix(robot, couples, (), ())
    if model.generic is not None:
        freedoms, idle = 6 - model.generic.constraints, model.generic.idle
    else:
        values = np.linalg.svd(ca.Function("free", [robot.z], [ca.densify(matrix)])(start).full(), compute_uv=False)
        freedoms, idle = matrix.shape[1] - int(np.count_nonzero(values > _ZERO * values[0])), 0
    if not 0 < freedoms < 6:
        raise ProofError("the robot has no constraint wrenches of which the rank could be claimed")
    return Motions(matrix, freedoms + idle)


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
        # Screws that nested loops hold still are rounding errors.
        chosen = independent_rows([values.T]) if each.rank else ()
        if len(chosen) != each.rank:
            raise ProofError(f"the passive joints of limb {each.label} are singular in the middle of the workspace")
        members.append(replace(each, screws=each.screws[:, sorted(chosen)], groups=()))
    return members


def _loop_blocks(model: Model, robot: PosedRobot, start: FloatArray) -> list[SX]:
    """Return the conditions (k, r) of nested loops, one in each column, as many as the loops of a member have ranks.

    Raises:
        ProofError: the loops of a member have another rank at the start.
    """
    blocks = []
    for path, conditions in zip(model.nested, robot.nested, strict=True):
        values = ca.Function("nested", [robot.z], [ca.densify(conditions)])(start).full()
        chosen = sorted(independent_rows([values])) if path.loop_rank else []
        if len(chosen) != path.loop_rank:
            raise ProofError(f"the nested loops of limb {path.member} are singular in the middle of the workspace")
        blocks += [conditions[chosen, :].T] if chosen else []
    return blocks


def _matrix(robot: PosedRobot, rows: Sequence[Wrench], members: Sequence[Member], actuators: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), with columns of the platform, of passive joints and of actuators."""
    passive = sum(each.screws.shape[1] for each in members)
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
    relations = rate_relations(actuators)
    blocks.append(ca.horzcat(SX(relations.shape[0], 6 + passive), relations))
    return ca.sparsify(ca.vertcat(SX(0, 6 + passive + len(actuators)), *blocks))


def _motion(robot: PosedRobot, screw: SX) -> SX:
    """Return the motion (6, 1) of a screw: a twist with the world's origin as reference."""
    omega, v = screw[:3], screw[3:]
    return ca.vertcat(v + ca.cross(omega, robot.position), robot.length * omega)
