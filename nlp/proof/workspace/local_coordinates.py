"""Independent and dependent coordinates of a robot's pose, near a given pose."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.joints.model.closedform import closed_form
from ...case.case import Case
from ...case.pose import Free, Value
from ...case.workspace import TurnKind, Turns, Workspace
from ...evidence.dependent import dependent_of, independent_coordinates
from .robot.pose_box import pose_box, rotation_of
from .robot.posed_robot import NotJudgedError, Problem, build_problem

#: The six coordinates of a pose, in order: the position, and ``Rz(yaw) Ry(pitch) Rx(roll)``.
AXES = ("x", "y", "z", "roll", "pitch", "yaw")
#: Displacement of coordinates in the test for independence, relative to the robot's size or as an angle; and relative
#: work of a constraint wrench that counts as 0.
_NEAR, _ZERO = 1e-3, 1e-9


class LocalCoordinates(NamedTuple):
    """Indices of the independent and of the dependent coordinates of a pose, in the order of ``AXES``.

    Attributes:
        independent: indices of the coordinates that the robot controls independently.
        dependent: indices of the coordinates that follow from the independent ones.
    """

    independent: list[int]
    dependent: list[int]


def box_about(start: FloatArray, ends: dict[int, tuple[float, float]]) -> Workspace:
    """Return a box of poses about a pose: some coordinates have ranges, the other coordinates are fixed.

    Args:
        start: (6,) the pose: position, length, and roll, pitch and yaw, radians.
        ends: both ends of the range of a coordinate, by its index; the other coordinates are fixed.
    """
    values: list[Value] = start.tolist()
    for k, (low, high) in ends.items():
        values[k] = Free(low, high)
    return Workspace(values[:3], Turns(TurnKind.ROLL_PITCH_YAW, tuple(values[3:])))


def local_coordinates(case: Case, start: FloatArray, length: float) -> LocalCoordinates:
    """Return the independent and the dependent coordinates of the pose, near a given pose.

    Args:
        case: the robot with fixed dimensions.
        start: (6,) the pose: position, length, and roll, pitch and yaw, radians.
        length: characteristic size of the robot, length.
    """
    half = _NEAR * np.array([length] * 3 + [1.0] * 3)
    about = box_about(start, {k: (start[k] - half[k], start[k] + half[k]) for k in range(6)})
    chosen = independent_coordinates(case, about) or list(range(6))
    if len(chosen) < len(AXES):
        moved = dependent_of(case, box_about(start, {k: (start[k] - half[k], start[k] + half[k]) for k in chosen}))
        return LocalCoordinates(chosen, [each.index for each in moved.dependent])
    try:
        problem = build_problem(case, closed_form(case.model).model, pose_box(about))
    except NotJudgedError:
        return LocalCoordinates(list(range(len(AXES))), [])
    # A robot that is given by its rows has no loop equations: independent motions do no work on constraint wrenches.
    work = np.zeros(6) if problem.unactuated is None else _work(problem, problem.unactuated.matrix, start)
    return LocalCoordinates(np.flatnonzero(work <= _ZERO).tolist(), [])


def _work(problem: Problem, matrix: ca.SX, start: FloatArray) -> FloatArray:
    """Return the largest work (6,) of unit constraint wrenches of a robot without loops, by coordinate of the pose."""
    turn = ca.SX.sym("turn", 3)
    rotation = rotation_of(problem.box, turn)
    slopes = ca.Function("slopes", [turn], [ca.jacobian(ca.vec(rotation), turn), rotation])
    changes, R = (np.array(each) for each in slopes(np.tan(0.5 * start[3:])))
    twists = np.eye(6)
    for k in range(3):
        omega = changes[:, k].reshape(3, 3, order="F") @ R.T
        twists[3:, 3 + k] = omega[2, 1], omega[0, 2], omega[1, 0]
    rows = problem.posed.values(matrix, problem.start)[:, :6]
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(np.abs(rows / np.where(sizes > 0, sizes, 1.0) @ twists).max(axis=0))
