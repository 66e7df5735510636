"""Smallest value of a number over all machines within a tolerance, at every pose of a workspace: bisection.

Over a box of poses, and for all machines, an expression has a form ``g + a e_I + b e_D + d e_E + [-r, r]``. With the
dependent coordinates replaced by their relation, no machine at a pose of the box has a smaller value than

    (g + b off) - sum |a - b T| - sum_j |(d - b E)_j| - (r + |b| rho),

where the errors of joint centre j count as one vector. Boxes of poses are bisected, those with the smallest bounds
first; errors never are. Values are those of machines whose errors are along the gradient, at the corner of a box.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from ....interruption import one_search
from ...enclosure.forms import Forms
from ...statement.machine import INSIDE
from ..numbers.bound_search import Bounds, FollowedRule, Goal, Minimum, Value
from ..ranks.krawczyk import ROUNDING, by_centres, inverses
from ..ranks.loop_boxes import LoopBoxes, are_between
from ..robot.tolerance_model import ToleranceModel

#: Part of themselves by which rotations stay inside of their ends: more than the rounding of these.
_INSIDE = 1e-13
#: Slope, as a part of the largest at a point, that is rounding error.
_FLAT = 1e-9


class _Expression:
    """Bounds of an expression (1, 1) in the coordinates of a family."""

    def __init__(self, expression: SX) -> None:
        self.entries: SX = expression

    def over(self, forms: Forms, count: int, errors: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`~..numbers.bound_search.Number.over`."""
        c, a, r = (each[:, 0] for each in forms)
        by_pose = a[:, :count]
        with np.errstate(all="ignore"):
            whole = np.abs(by_pose).sum(axis=1) + by_centres(a[:, a.shape[1] - errors :]) + r
            lower = c - whole - 2 * ROUNDING * (np.abs(c) + whole)
        # Each coordinate has a part of the rest, so that one with little slope is divided once the others are narrow.
        shares = np.abs(by_pose) + r[:, None] / max(count, 1)
        return Bounds(np.where(np.isfinite(lower), lower, -np.inf), shares)


def smallest_of_machines(
    family: ToleranceModel,
    expression: SX,
    *,
    gap: float,
    limit: float | None = None,
    slack: float = 0.0,
    time_limit: float | None = None,
) -> Minimum:
    """Prove the smallest value of an expression over all machines and poses.

    Args:
        family: the machines.
        expression: (1, 1) in their coordinates.
        gap: allowed distance of the bound from the smallest value known, as a part of it.
        limit: the search ends once the bound is at least this, or a smaller value is known.
        slack: how far a value may be below the limit and still count as on it.
        time_limit: seconds after which the search stops with the bound reached.

    Raises:
        UncoveredError: the expression holds an operation without a rule.
    """
    goal = Goal(gap, limit, slack, is_relative=True)
    with one_search(time_limit):
        points = _MachinePoints(family, expression)
        return FollowedRule(family.problem, family, _Expression(expression), points.smallest_in, goal).minimum()


class _MachinePoints:
    """An expression at single points of a family.

    Args:
        family: the machines.
        expression: (1, 1) in their coordinates.
    """

    def __init__(self, family: ToleranceModel, expression: SX) -> None:
        self._family, problem = family, family.problem
        gradient = ca.densify(ca.gradient(expression, family.z))
        self._function = ca.Function("number", [family.z], [ca.densify(expression), gradient])
        self._loops = family.loops
        self._independent, self._dependent = list(problem.independent), list(problem.dependent)
        self._count, self._free = len(problem.start), list(problem.free)

    def closed(self, z: FloatArray) -> FloatArray:
        """Return points (K, n + 3 m) with closed loops near points; one that does not close is NaN."""
        return self._loops.all_closed(z.T, self._dependent).T if self._dependent else z

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (K,) at closed points (K, n + 3 m)."""
        return np.asarray(self._function(z.T)[0].full()[0])

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return the derivatives (K, n + 3 m) by independent coordinates and errors; the others follow, and have 0."""
        found = np.array(self._function(z.T)[1].full().T)
        D = self._dependent
        if D:
            size = self._loops.size
            whole = self._loops.slopes(z.T) * size
            found = found * size
            found -= (found[:, None, D] @ inverses(whole[:, :, D]) @ whole)[:, 0]
            found = found / size
            found[:, D] = 0.0
        return found

    def smallest_in(self, boxes: LoopBoxes) -> Value | None:
        """Return the smallest value at few points of boxes; None where no loops close in them.

        The errors are along the gradient at the middle of a box, with the pose there or in the corner that the gradient
        points to.
        """
        best: Value | None = None
        centre = boxes.centre
        with np.errstate(all="ignore"):
            z = self.closed(centre)
            slopes = self.slopes(z)
            errors = self._steepest(slopes[:, self._count :])
            for moves_pose in (False, True):
                moved = z.copy()
                moved[:, self._count :] = errors
                if moves_pose:
                    moved = self._at_corner(moved, slopes, boxes)
                moved = self.closed(moved)
                values = np.where(self._are_inside(moved, boxes), self.values(moved), np.nan)
                if np.isfinite(values).any():
                    k = int(np.nanargmin(values))
                    if best is None or values[k] < best.value:
                        best = Value(float(values[k]), moved[k])
        return best

    def _steepest(self, slopes: FloatArray) -> FloatArray:
        """Return errors (K, 3 m) as large as the tolerance, against the derivatives by them."""
        parts = slopes.reshape(len(slopes), -1, 3)
        sizes = np.linalg.norm(parts, axis=2, keepdims=True)
        unit = np.divide(parts, sizes, out=np.zeros_like(parts), where=sizes > _FLAT * _sizes(sizes))
        return np.asarray((-INSIDE * self._family.tolerance * unit).reshape(slopes.shape))

    def _at_corner(self, z: FloatArray, slopes: FloatArray, boxes: LoopBoxes) -> FloatArray:
        """Return points with the pose in the corner of a box that the derivatives point to."""
        own, count, problem = self._independent, len(self._free), self._family.problem
        z = z.copy()
        change = slopes[:, own] * (boxes.upper - boxes.lower)[:, own]
        # A slope that is rounding error points to the upper end.
        z[:, own] = np.where(change > _FLAT * _sizes(change), boxes.lower[:, own], boxes.upper[:, own])
        # Ends of rotations are rounded outwards, and are no poses of the workspace.
        box = problem.box
        room = np.where(box.upper > box.lower, _INSIDE * np.maximum(np.abs(box.lower), np.abs(box.upper)), 0.0)
        room[:3] = 0.0
        clipped = np.clip(box.clipped(problem.pose_of(z)), box.lower + room, box.upper - room)[:, self._free]
        of_pose = [j for j in own if j < count]
        z[:, of_pose] = clipped[:, of_pose]
        return z

    def _are_inside(self, z: FloatArray, boxes: LoopBoxes) -> FloatArray:
        """Return whether points are in the workspace, with closed loops in the assembly of their boxes."""
        D, problem = self._dependent, self._family.problem
        own = are_between(z, boxes, D)
        return np.array(
            [bool(good) and problem.box.holds(problem.pose_of(each)) for good, each in zip(own, z, strict=True)]
        )


def _sizes(values: FloatArray) -> FloatArray:
    """Return the largest size of the values at each of K points, with the shape (K, 1, ...)."""
    return np.asarray(np.nan_to_num(np.abs(values)).max(axis=tuple(range(1, values.ndim)), keepdims=True, initial=0.0))
