"""Lower bounds of expressions over poses, for the nominal robot or for all robots within the tolerance.

Over a box of poses, an expression has a form ``g + a e_I + b e_D + d e_E + [-r, r]`` with errors ``e_E`` of joint
centres. If the relation replaces the dependent coordinates, the values of the expression are at least

    (g + b off) - sum |a - b T| - sum_j |(d - b E)_j| - (r + |b| rho),

where the errors of joint centre j count as one vector. Only poses are bisected, never errors. Values are computed at a
corner of the box, with joint-centre errors along the gradient. Loops are followed in the home assembly mode.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from .....models.arrays import FloatArray, values_at
from ....evidence.closed_loops import inverses
from ...enclosure.forms import Forms
from ..ranks.krawczyk import ROUNDING, by_centres
from ..ranks.loop_boxes import LoopBoxes
from ..robot.posed_robot import Problem
from .bound_search import Bounds, Number

#: Slope, relative to the largest one at a point, that counts as rounding error.
_FLAT = 1e-9


def ranges(forms: Forms, errors: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper bounds (B, R) of expressions; infinite where no bound is known.

    Args:
        forms: forms of the expressions over boxes.
        errors: number of joint-centre errors, which are the last terms.
    """
    c, a, r = forms
    t = a.shape[2] - errors
    with np.errstate(all="ignore"):
        whole = np.abs(a[:, :, :t]).sum(axis=2) + by_centres(a[:, :, t:]) + r
        half = whole + 2 * ROUNDING * (np.abs(c) + whole)
        known = np.isfinite(c - half) & np.isfinite(c + half)
        return np.where(known, c - half, -np.inf), np.where(known, c + half, np.inf)


class Expressions(Number):
    """Bounds, over boxes, of expressions of the coordinates.

    Args:
        problem: the nominal robot, or all robots within the tolerance, over the workspace.
        expressions: (K, 1) expressions of the problem's coordinates.
    """

    def __init__(self, problem: Problem, expressions: SX) -> None:
        super().__init__(problem, expressions, expressions.numel())
        slopes = ca.densify(ca.jacobian(expressions, problem.z))
        self._values = ca.Function("values", [problem.z], [ca.densify(expressions)])
        self._slopes = ca.Function("slopes", [problem.z], [slopes])

    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over boxes; see :meth:`.bound_search.Number.over`."""
        # Each coordinate gets a share of the remainder, so that coordinates with small slopes are bisected once the
        # others are narrow.
        shares = np.abs(forms.a[:, :, :count]) + forms.r[:, :, None] / max(count, 1)
        return Bounds(ranges(forms, len(self.problem.of_errors))[0], shares)

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (P, K) at points (P, n) with closed loops."""
        return values_at(self._values, z)[0][:, :, 0]

    def slopes(self, z: FloatArray, which: NDArray[np.intp]) -> FloatArray:
        """Return the derivatives (P, n) of one expression at each point; 0 with respect to dependent coordinates."""
        found: FloatArray = values_at(self._slopes, z)[0][np.arange(len(z)), which]
        D, size = list(self.problem.dependent), self.problem.size
        if D:
            whole = self.problem.loops.slopes(z.T) * size
            found = found * size
            found -= (found[:, None, D] @ inverses(whole[:, :, D]) @ whole)[:, 0]
            found = found / size
            found[:, D] = 0.0
        return found

    def near(self, boxes: LoopBoxes, which: NDArray[np.intp]) -> FloatArray:
        """Return two points (2, P, n) for each box, both with the worst joint-centre errors.

        The first point is the middle of the box, the second the corner with the smallest value to first order.
        """
        z = self.closed(boxes.centre)
        slopes = self.slopes(z, which)
        z = self.worst(z, slopes)
        moved = self._at_corner(z, slopes, boxes)
        return np.stack([self.closed(each) for each in (z, moved)])

    def worst(self, z: FloatArray, slopes: FloatArray) -> FloatArray:
        """Return points (P, n) with the joint-centre errors that minimise the values to first order."""
        parts = slopes[:, self.problem.of_errors].reshape(len(z), -1, 3)
        sizes = np.linalg.norm(parts, axis=2, keepdims=True)
        return self.problem.with_errors(z, np.where(sizes > _FLAT * _sizes(sizes), -parts, 0.0))

    def _at_corner(self, z: FloatArray, slopes: FloatArray, boxes: LoopBoxes) -> FloatArray:
        """Return the points moved to the corner of their box with the smallest value to first order."""
        own, free = list(self.problem.independent), list(self.problem.free)
        z = z.copy()
        change = slopes[:, own] * (boxes.upper - boxes.lower)[:, own]
        # A slope that counts as rounding error selects the upper end.
        z[:, own] = np.where(change > _FLAT * _sizes(change), boxes.lower[:, own], boxes.upper[:, own])
        of_pose = [j for j in own if j < len(free)]
        z[:, of_pose] = self.problem.box.clipped(self.problem.pose_of(z))[:, free][:, of_pose]
        return z


def _sizes(values: FloatArray) -> FloatArray:
    """Return the largest absolute value at each of P points, with the shape (P, 1, ...)."""
    return np.asarray(np.nan_to_num(np.abs(values)).max(axis=tuple(range(1, values.ndim)), keepdims=True, initial=0.0))
