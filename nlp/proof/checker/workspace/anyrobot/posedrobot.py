"""A robot with its dimensions as expressions of the pose, built for the check from the model and the case alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import SX

from ......models import Actuator, FloatArray, Member, Model, Substitution, Wrench
from .....case.case import Case
from .....case.pose import Free
from .....case.workspace import TurnKind
from ..poseroot import PoseRoot


@dataclass(frozen=True, eq=False)
class PosedRobot:
    """A robot over a workspace.

    Attributes:
        z: (n, 1) symbols: those of the six coordinates of the pose that vary, then the unknowns.
        free: indices of these coordinates among the six.
        middle: (6,) the middle of the workspace: the values of the others.
        size: (n,) by which coordinates are comparable: half ranges, and sizes of the unknowns.
        equations: (k, 1) that are 0 where the loops are closed, of order 1.
        loops: (l, 1) further equations of the same loops, which other assemblies of the joints do not fulfil.
        signs: (s, 1) numbers that are positive in home's working mode.
        rows: rows of limbs, one wrench each.
        members: members of limbs.
        actuators: actuated joints.
        nested: (m, k) each, the conditions of nested loops on rates of a member's passive joints.
        position: (3, 1) the platform's origin, length.
        length: by which rotations are multiplied, length: any positive number.
    """

    z: SX
    free: tuple[int, ...]
    middle: FloatArray
    size: FloatArray
    equations: SX
    loops: SX
    signs: SX
    rows: tuple[Wrench, ...]
    members: tuple[Member, ...]
    actuators: tuple[Actuator, ...]
    nested: tuple[SX, ...]
    position: SX
    length: float

    @property
    def centre(self) -> FloatArray:
        """(n,) the middle of the workspace, with unknowns of 0 as at home."""
        return np.concatenate([self.middle[list(self.free)], np.zeros(self.z.numel() - len(self.free))])


def posed_robot(case: Case, model: Model, root: PoseRoot) -> PosedRobot:
    """Return a robot over a workspace.

    Args:
        case: with fixed dimensions.
        model: its robot, some of whose unknowns may have been replaced by expressions.
        root: the box of coordinates.
    """
    middle = 0.5 * root.lower + 0.5 * root.upper
    free = tuple(np.flatnonzero(root.upper > root.lower).tolist())
    y = [SX.sym(f"y{k}") if k in free else SX(float(middle[k])) for k in range(6)]
    unknowns = [SX.sym(item.name) for item in model.unknowns]
    position = ca.vertcat(*y[:3])
    values = [float(v) for name in case.parameters for v in case.components(name) if not isinstance(v, Free)]
    given = Substitution(
        ca.vertcat(SX(0, 1), *values),
        ca.vertcat(SX(0, 1), *unknowns),
        rotation_matrix(root, y[3:]),
        position,
    )
    outputs = [
        *[part for row in model.wrenches for part in (row.force, row.moment)],
        *[part for member in model.members for part in (member.centre, member.screws)],
        *[part for each in model.actuators for part in (each.screws, each.relations)],
        *[each.loops[:, each.passive] for each in model.nested],
        *[each.scaled for each in (*model.closure, *model.loops)],
        *[each.value for each in model.signs],
        *[each.size for each in model.unknowns],
    ]
    following = iter(ca.Function("robot", Substitution.identity(model).all, outputs).call(given.all))
    robot = PosedRobot(
        z=ca.vertcat(SX(0, 1), *[y[k] for k in free], *unknowns),
        free=free,
        middle=middle,
        size=(0.5 * (root.upper - root.lower))[list(free)],
        rows=tuple(replace(row, force=next(following), moment=next(following)) for row in model.wrenches),
        members=tuple(
            replace(each, centre=next(following), screws=next(following), slide=None) for each in model.members
        ),
        actuators=tuple(replace(each, screws=next(following), relations=next(following)) for each in model.actuators),
        nested=tuple(next(following) for _ in model.nested),
        equations=ca.vertcat(SX(0, 1), *[next(following) for _ in model.closure]),
        loops=ca.vertcat(SX(0, 1), *[next(following) for _ in model.loops]),
        signs=ca.vertcat(SX(0, 1), *[next(following) for _ in model.signs]),
        position=position,
        length=case.characteristic_length,
    )
    sizes = [float(next(following)) for _ in model.unknowns]
    return replace(robot, size=np.concatenate([robot.size, np.array(sizes)]))


def rotation_matrix(root: PoseRoot, turn: Sequence[SX]) -> SX:
    """Return the rotation (3, 3) with three coordinates: the matrix of a quaternion, divided by its squared size."""
    if root.kind is TurnKind.ROLL_PITCH_YAW:
        roll, pitch, yaw = (_of_quaternion(t * SX.eye(3)[:, k]) for k, t in enumerate(turn))
        return yaw @ pitch @ roll
    return _of_quaternion(ca.vertcat(*turn) if root.kind is TurnKind.ANY_AXIS else turn[0] * SX(root.axis.tolist()))


def _of_quaternion(r: SX) -> SX:
    """Return the rotation of the quaternion (1, r)."""
    square = ca.sumsqr(r)
    return ((1 - square) * SX.eye(3) + 2 * r @ r.T + 2 * ca.skew(r)) / (1 + square)
