"""Matrices whose null space has the motions of a platform that nothing resists, as expressions of the pose.

They are built for the check from the model and the case alone. A motion is the velocity v of the platform's origin and
its angular velocity, here ``x = (v, length omega)``, with rates of joints. Each row is a condition that it keeps:

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

A rotation is a polynomial matrix over a positive number. Rows of limbs that are linear in the rotation are multiplied
by that number, so that they are polynomials.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Actuator, FloatArray, Member, Model, Substitution, Wrench, WrenchKind, rate_relations
from .....models.member import scaled_twists
from .....models.rows import independent_rows
from ....case.case import Case
from ....case.pose import Free
from ....case.workspace import TurnKind
from ...statement.machine import has_straight_legs
from ..proof_file import ProofError
from .pose_boxes import PoseRoot

#: Singular values below this part of the largest are zero at the middle of the workspace.
_ZERO = 1e-9


@dataclass(frozen=True, eq=False)
class PosedRobot:
    """A robot with its dimensions over a workspace.

    Attributes:
        z: (n, 1) symbols: those of the six coordinates of the pose that vary, then the unknowns, then errors.
        errors: number of components of errors of joint centres, which are the last coordinates.
        free: indices of the varying coordinates among the six.
        centre: (n,) the middle of the workspace, with unknowns and errors of 0.
        size: (n,) by which coordinates are comparable: half ranges, and sizes of the unknowns.
        length: by which rotations are multiplied, length: any positive number.
        position: (3, 1) the platform's origin, length.
        scale: (1, 1) by which rows are multiplied that are linear in the rotation; at least 1.
        rows: rows of limbs, one wrench each, with moments about the platform's origin.
        members: members of limbs.
        actuators: actuated joints.
        legs: base joint (3, 1) of each straight leg, and its platform joint a in the world, ``scale R a``.
        nested: (m, k) each, the conditions of nested loops on rates of a member's passive joints.
        equations: (k, 1) that are 0 where the loops are closed, of order 1.
        loops: (l, 1) further equations of the same loops, which other assemblies of the joints do not fulfil.
        signs: (s, 1) numbers that are positive in home's working mode.
    """

    z: SX
    errors: int
    free: list[int]
    centre: FloatArray
    size: FloatArray
    length: float
    position: SX
    scale: SX
    rows: tuple[Wrench, ...]
    members: tuple[Member, ...]
    actuators: tuple[Actuator, ...]
    legs: tuple[tuple[SX, SX], ...]
    nested: tuple[SX, ...]
    equations: SX
    loops: SX
    signs: SX

    def at(self, expression: SX, z: FloatArray) -> FloatArray:
        """Return the values of a matrix of expressions at a point (n,)."""
        return np.asarray(ca.Function("values", [self.z], [ca.densify(expression)])(z).full())


def posed_robot(case: Case, model: Model, root: PoseRoot) -> PosedRobot:
    """Return a robot over a workspace.

    Args:
        case: with fixed dimensions.
        model: its robot, some of whose unknowns may have been replaced by expressions; further parameters than the
            case's are components of errors of joint centres, and come last.
        root: the box of coordinates.
    """
    middle, symbols = 0.5 * root.lower + 0.5 * root.upper, Substitution.identity(model).all
    free = np.flatnonzero(root.upper > root.lower).tolist()
    y = [SX.sym(f"y{k}") if k in free else SX(float(middle[k])) for k in range(6)]
    unknowns, position = ca.vertcat(SX(0, 1), *[SX.sym(item.name) for item in model.unknowns]), ca.vertcat(*y[:3])
    values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
    errors = SX.sym("errors", symbols[0].numel() - len(values))
    (turned, scale), inverse = turned_rotation(root, y[3:]), SX.sym("inverse")

    def put(expressions: Iterable[SX], rotation: SX = turned / scale) -> list[SX]:
        """Return expressions of the model with those of the coordinates in the place of its symbols."""
        numbers = [ca.vertcat(SX(0, 1), *values, errors), unknowns, rotation, position]
        return list(ca.Function("robot", symbols, list(expressions)).call(numbers))

    def scaled(vectors: Iterable[SX]) -> list[SX]:
        """Return vectors, those that are linear in the rotation as multiples without the inverse of the scale."""
        found = put(map(ca.densify, vectors), inverse * turned)
        for k, vector in enumerate(found):
            slope = ca.jacobian(vector, inverse)
            if ca.depends_on(slope, inverse) or not ca.depends_on(vector, inverse):
                found[k] = ca.substitute(vector, inverse, 1 / scale)
            else:
                found[k] = scale * ca.substitute(vector, inverse, 0) + slope
        return found

    def stacked(expressions: Iterable[SX]) -> SX:
        """Return numbers of the robot as a column."""
        return ca.vertcat(SX(0, 1), *put(expressions))

    arms = scaled(model.pose.rotation @ leg.platform for leg in model.legs)
    legs = tuple(zip(put(leg.base for leg in model.legs), arms, strict=True))
    if has_straight_legs(model):
        # The line of a leg passes its platform joint: u x (s (p - b) + u) / s is its moment about the origin.
        spans = [(position - foot, arm) for foot, arm in legs]
        rows = [ca.vertcat(scale * d + u, ca.cross(u, d)) for d, u in spans]
    else:
        about = [row.moment - ca.cross(model.pose.position, row.force) for row in model.wrenches]
        rows = scaled(ca.vertcat(row.force, moment) for row, moment in zip(model.wrenches, about, strict=True))
    parts = iter(put(part for each in model.members for part in (each.centre, each.screws)))
    moving = iter(put(part for each in model.actuators for part in (each.screws, each.relations)))
    sizes = np.array(ca.evalf(stacked(each.size for each in model.unknowns))).ravel()
    ends = np.full(errors.numel(), case.joint_centre_tolerance or 0.0)
    return PosedRobot(
        z=ca.vertcat(SX(0, 1), *[y[k] for k in free], unknowns, errors),
        errors=errors.numel(),
        free=free,
        centre=np.concatenate([middle[free], np.zeros(len(sizes) + len(ends))]),
        size=np.concatenate([(0.5 * (root.upper - root.lower))[free], sizes, ends]),
        length=case.characteristic_length,
        position=position,
        scale=scale,
        rows=tuple(replace(old, force=row[:3], moment=row[3:]) for old, row in zip(model.wrenches, rows, strict=True)),
        members=tuple(replace(each, centre=next(parts), screws=next(parts), slide=None) for each in model.members),
        actuators=tuple(replace(each, screws=next(moving), relations=next(moving)) for each in model.actuators),
        legs=legs,
        nested=tuple(put(each.loops[:, each.passive] for each in model.nested)),
        equations=stacked(each.scaled for each in model.closure),
        loops=stacked(each.scaled for each in model.loops),
        signs=stacked(each.value for each in model.signs),
    )


def turned_rotation(root: PoseRoot, turn: list[SX]) -> tuple[SX, SX]:
    """Return the rotation (3, 3) with three coordinates times a positive number, and this number: polynomials."""

    def of_quaternion(r: SX) -> tuple[SX, SX]:
        """Return the rotation of the quaternion (1, r), times its squared size."""
        square = ca.sumsqr(r)
        return (1 - square) * SX.eye(3) + 2 * r @ r.T + 2 * ca.skew(r), 1 + square

    if root.kind is TurnKind.ROLL_PITCH_YAW:
        single = [of_quaternion(t * SX.eye(3)[:, k]) for k, t in enumerate(turn)]
        return reduce(lambda done, each: (each[0] @ done[0], each[1] * done[1]), single)
    return of_quaternion(ca.vertcat(*turn) if root.kind is TurnKind.ANY_AXIS else turn[0] * SX(root.axis.tolist()))


def motion_matrix(model: Model, robot: PosedRobot, start: FloatArray, *, is_locked: bool) -> tuple[SX, int]:
    """Return the matrix (m, c), and the dimensions of its null space claimed to be all: freedoms and idle rates.

    With free actuators the matrix of a robot given by its rows is that of its couples, which are constraints.

    Args:
        model: the robot's model.
        robot: the robot.
        start: (n,) closed loops, at which those screws of each member are chosen that are independent.
        is_locked: whether the actuators are locked, and there are no freedoms.

    Raises:
        ProofError: the screws or loops of a member are singular at the start, or all freedoms of a platform are left.
    """
    if is_locked:
        return _whole_matrix(model, robot, start, ()), 0
    if robot.actuators:
        matrix = _whole_matrix(model, robot, start, robot.actuators)
    else:
        couples = [_work(robot, row) for row in robot.rows if row.kind is WrenchKind.COUPLE]
        matrix = ca.vertcat(SX(0, 6), *couples)
    if model.generic is not None:
        freedoms, idle = 6 - model.generic.constraints, model.generic.idle
    else:
        values = np.linalg.svd(robot.at(matrix, start), compute_uv=False)
        freedoms, idle = matrix.shape[1] - int(np.count_nonzero(values > _ZERO * values[0])), 0
    if not 0 < freedoms < 6:
        raise ProofError("the robot has no constraint wrenches of which the rank could be claimed")
    return matrix, freedoms + idle


def _work(robot: PosedRobot, row: Wrench) -> SX:
    """Return the work (1, 6) of a limb's row in motions."""
    return ca.horzcat(row.force.T, row.moment.T / robot.length)


def _whole_matrix(model: Model, robot: PosedRobot, start: FloatArray, actuators: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), with columns of the platform, of passive joints, of actuators and of nested loops.

    Of each member as many screws are taken as have its rank: where these are independent, they span all.

    Raises:
        ProofError: the screws or the loops of a member have another rank at the start.
    """
    members, loops = [], []
    for each in robot.members:
        if each.rank < each.screws.shape[1]:
            columns = scaled_twists(each.screws, each.centre, SX(robot.length), each.size)
            whose = f"the passive joints of limb {each.label}"
            chosen = _independent(robot.at(columns, start).T, each.rank, whose)
            members.append(replace(each, screws=each.screws[:, chosen], groups=()))
        else:
            members.append(each)
    for path, conditions in zip(model.nested, robot.nested, strict=True):
        whose = f"the nested loops of limb {path.member}"
        kept = _independent(robot.at(conditions, start), path.loop_rank, whose)
        loops += [conditions[kept, :].T] if kept else []
    return ca.diagcat(_matrix(robot, members, actuators), *loops)


def _independent(rows: FloatArray, rank: int, whose: str) -> list[int]:
    """Return as many independent rows as their rank; rows that loops hold still are rounding errors.

    Raises:
        ProofError: they have another rank.
    """
    chosen = sorted(independent_rows([rows])) if rank else []
    if len(chosen) != rank:
        raise ProofError(f"{whose} are singular in the middle of the workspace")
    return chosen


def _matrix(robot: PosedRobot, members: Sequence[Member], actuators: Sequence[Actuator]) -> SX:
    """Return the matrix (m, c), with columns of the platform, of passive joints and of actuators."""
    passive = sum(each.screws.shape[1] for each in members)
    blocks, at = [], 6

    def driven(member: str, seen: SX) -> list[SX]:
        """Return the columns of all actuators: those that do not move a member are 0."""
        screws = [each.screw_in(member) for each in actuators]
        return [SX(seen.shape[0], 1) if screw is None else -seen @ _motion(robot, screw) for screw in screws]

    for row in robot.rows:
        seen = _work(robot, row)
        blocks.append(ca.horzcat(seen, SX(1, passive), *driven(row.label.member, seen)))
    for each in members:
        # The velocity of a pinned member's centre is v + omega x arm.
        arm = (each.centre - robot.position) / robot.length
        seen = ca.horzcat(SX.eye(3), -ca.skew(arm)) if each.is_pinned else SX.eye(6)
        count = each.screws.shape[1]
        columns = [-seen @ _motion(robot, each.screws[:, j]) for j in range(count)]
        before, after = SX(each.size, at - 6), SX(each.size, 6 + passive - at - count)
        blocks.append(ca.horzcat(seen, before, *columns, after, *driven(each.label, seen)))
        at += count
    relations = rate_relations(actuators)
    blocks.append(ca.horzcat(SX(relations.shape[0], 6 + passive), relations))
    return ca.sparsify(ca.vertcat(SX(0, 6 + passive + len(actuators)), *blocks))


def _motion(robot: PosedRobot, screw: SX) -> SX:
    """Return the motion (6, 1) of a screw: a twist with the world's origin as reference."""
    omega, v = screw[:3], screw[3:]
    return ca.vertcat(v + ca.cross(omega, robot.position), robot.length * omega)
