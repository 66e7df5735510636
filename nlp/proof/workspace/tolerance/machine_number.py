"""Smallest value of a number over all machines within a tolerance, at every pose of a workspace: bisection.

Over a box of poses, and for all machines, an expression has a form ``g + a e_I + b e_D + d e_E + [-r, r]``. With the
dependent coordinates replaced by their relation, no machine at a pose of the box has a smaller value than

    (g + b off) - sum |a - b T| - sum_j |(d - b E)_j| - (r + |b| rho),

where the errors of joint centre j count as one vector. Boxes of poses are bisected, those with the smallest bounds
first; errors never are. Values are those of machines whose errors are along the gradient, at the corner of a box.
"""

from __future__ import annotations

import numpy as np
from casadi import SX

from ....interruption import one_search
from ...enclosure.forms import Forms
from ..numbers.bound_search import Bounds, FollowedRule, Goal, Minimum
from ..ranks.krawczyk import ROUNDING, by_centres
from ..robot.tolerance_model import Family
from .machine_points import MachinePoints


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
    family: Family,
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
        points = MachinePoints(family, expression)
        return FollowedRule(family.problem, family, _Expression(expression), points.smallest_in, goal).minimum()
