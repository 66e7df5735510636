"""Limits at sampled poses on the edges of a box, for a first guess of the largest box that can be proved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.joints.model.closedform import closed_form
from ...case.case import Case
from .numbers.expressions import Expressions
from .numbers.extremes import goal_of
from .numbers.within_tolerance import RobotsWithinTolerance
from .ranks.singular_pose import DeterminantSigns
from .robot.posed_robot import Problem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of points on each side of a box, and of scale factors of the box that are evaluated together.
_EDGE, _PARTS = 9, 65


class EdgeSamples:
    """Limits and the sign of the determinant at sampled poses: a guess of where a box of poses fails, not a proof.

    Args:
        case: the robot with fixed dimensions.
        start: (6,) pose at the centre: position, length, and roll, pitch and yaw, radians.
        problem: the robot over a box of poses, without dependent coordinates.
    """

    def __init__(self, case: Case, start: FloatArray, problem: Problem) -> None:
        robots = RobotsWithinTolerance(case, closed_form(case.model), problem)
        reaches, claims = robots.symbols.claims([], with_objective=False)
        limited = [each for each in (*reaches, *claims) if each.limit is not None]
        numbers = ca.vertcat(*map(robots.number, limited)) if limited else ca.SX(0, 1)
        self._problem, self._start, self._values = robots.family, start, Expressions(robots.family, numbers)
        goals = [goal_of(each) for each in limited]
        self._least = np.array([(goal.limit or 0.0) - goal.slack for goal in goals])
        matrix = problem.locked
        is_square = matrix.matrix.shape == (6, 6) and not matrix.nullity
        self._signs = DeterminantSigns(problem, matrix) if is_square else None
        self._sign = 1.0
        if self._signs is not None:
            self._sign = float(np.sign(self._signs.computed(coordinates_of(start[None])[:, list(problem.free)])[0]))

    def first(self, moves: FloatArray) -> float:
        """Return the smallest factor of a box of two coordinates at which a pose on its edge fails; at most 1.

        Args:
            moves: (2, 2, 6) changes of the pose to both ends of each coordinate.
        """
        (a, b), (c, d) = moves
        along = np.linspace(0.0, 1.0, _EDGE)[:, None]
        edges = [a + c + along * (b - a), a + d + along * (b - a), a + c + along * (d - c), b + c + along * (d - c)]
        edge, low, high = np.concatenate(edges), 0.0, 1.0
        for _ in range(2):
            parts = np.linspace(low, high, _PARTS)
            poses = self._start + parts[:, None, None] * edge
            fails = self._fails(coordinates_of(poses.reshape(-1, 6))).reshape(len(parts), -1).any(axis=1)
            if not fails.any():
                return high
            k = int(np.argmax(fails))
            low, high = float(parts[max(k - 1, 0)]), float(parts[k])
        return high

    def _fails(self, y: FloatArray) -> NDArray[np.bool_]:
        """Return whether poses (P, 6) violate a limit, or have a determinant of another sign than the start pose."""
        z = y[:, list(self._problem.free)]
        with np.errstate(all="ignore"):
            fails = ~(self._values.values(self._problem.exact(z)) >= self._least).all(axis=1)
        if self._signs is not None:
            fails |= np.sign(self._signs.computed(z)) != self._sign
        return np.asarray(fails)


def coordinates_of(poses: FloatArray) -> FloatArray:
    """Convert poses (P, 6) to coordinates of a search: angles become tangents of half angles."""
    return np.hstack([poses[:, :3], np.tan(0.5 * poses[:, 3:])])
