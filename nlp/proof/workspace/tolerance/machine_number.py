"""Number of all machines within a tolerance: bounds over boxes of poses, and values of single machines.

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
from ..numbers.bound_search import Bounds, FollowedRule, Goal, Minimum, Value
from ..ranks.krawczyk import ROUNDING, by_centres, inverses
from ..ranks.loop_boxes import LoopBoxes, are_between
from ..robot.tolerance_model import ToleranceModel, steepest

#: Slope, as a part of the largest at a point, that is rounding error.
_FLAT = 1e-9


class MachineNumber:
    """A number of all machines, whose smallest value is meant.

    Args:
        family: the machines.
        expression: (1, 1) in their coordinates.

    Attributes:
        entries: the expression.
    """

    def __init__(self, family: ToleranceModel, expression: SX) -> None:
        self.entries: SX = expression
        self._family, self._problem, self._loops = family, family.problem, family.loops
        gradient = ca.densify(ca.gradient(expression, family.coordinates))
        self._function = ca.Function("number", [family.coordinates], [ca.densify(expression), gradient])
        self._dependent, self._count = list(family.problem.dependent), len(family.problem.start)

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

    def minimum(
        self, *, gap: float, limit: float | None = None, slack: float = 0.0, time_limit: float | None = None
    ) -> Minimum:
        """Prove the smallest value over all machines and poses.

        Args:
            gap: allowed distance of the bound from the smallest value known, as a part of it.
            limit: the search ends once the bound is at least this, or a smaller value is known.
            slack: how far a value may be below the limit and still count as on it.
            time_limit: seconds after which the search stops with the bound reached.

        Raises:
            UncoveredError: the expression holds an operation without a rule.
        """
        goal = Goal(gap, limit, slack, is_relative=True)
        with one_search(time_limit):
            return FollowedRule(self._problem, self._family, self, self.smallest_in, goal).minimum()

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

    def change(self, z: FloatArray) -> FloatArray:
        """Return the largest changes (K,) by errors to first order, of derivatives that are defined."""
        parts = self.slopes(z)[:, self._count :].reshape(len(z), -1, 3)
        return np.asarray(self._family.tolerance * np.nan_to_num(np.linalg.norm(parts, axis=2)).sum(axis=1))

    def worst(self, z: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return the machines (K, n + 3 m) with the smallest values to first order, from derivatives of the design."""
        parts = slopes[:, self._count :].reshape(len(z), -1, 3)
        sizes = np.linalg.norm(parts, axis=2, keepdims=True)
        errors = steepest(np.where(sizes > _FLAT * _largest(sizes), -parts, 0.0), self._family.tolerance)
        return np.hstack([z[:, : self._count], errors.reshape(len(z), -1)])

    def smallest_in(self, boxes: LoopBoxes) -> Value | None:
        """Return the smallest value at few points of boxes; None where no loops close in them.

        The errors are along the gradient at the middle of a box, with the pose there or in the corner that the gradient
        points to.
        """
        best: Value | None = None
        design = np.hstack([boxes.centre, np.zeros((len(boxes.centre), self._family.errors.numel()))])
        with np.errstate(all="ignore"):
            design = self._closed(design)
            slopes = self.slopes(design)
            worst = self.worst(design, slopes)
            for tried in (worst, self._at_corner(worst, slopes, boxes)):
                z = self._closed(tried)
                inside = are_between(z, boxes, self._dependent)
                inside &= np.array([self._problem.box.holds(each) for each in self._problem.pose_of(z)])
                values = np.where(inside, self.values(z), np.nan)
                if np.isfinite(values).any():
                    k = int(np.nanargmin(values))
                    if best is None or values[k] < best.value:
                        best = Value(float(values[k]), z[k])
        return best

    def _closed(self, z: FloatArray) -> FloatArray:
        """Return points (K, n + 3 m) with closed loops near points; one that does not close is NaN."""
        return self._loops.all_closed(z.T, self._dependent).T if self._dependent else z

    def _at_corner(self, z: FloatArray, slopes: FloatArray, boxes: LoopBoxes) -> FloatArray:
        """Return points with the pose in the corner of a box that the derivatives point to."""
        problem, own, free = self._problem, list(self._problem.independent), list(self._problem.free)
        z = z.copy()
        change = slopes[:, own] * (boxes.upper - boxes.lower)[:, own]
        # A slope that is rounding error points to the upper end.
        z[:, own] = np.where(change > _FLAT * _largest(change), boxes.lower[:, own], boxes.upper[:, own])
        of_pose = [j for j in own if j < len(free)]
        z[:, of_pose] = problem.box.clipped(problem.pose_of(z))[:, free][:, of_pose]
        return z


def _largest(values: FloatArray) -> FloatArray:
    """Return the largest size of the values at each of K points, with the shape (K, 1, ...)."""
    return np.asarray(np.nan_to_num(np.abs(values)).max(axis=tuple(range(1, values.ndim)), keepdims=True, initial=0.0))
