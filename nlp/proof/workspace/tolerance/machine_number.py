"""Smallest value of a number over all machines within a tolerance, at every pose of a workspace: bisection.

Over a box of poses, and for all machines, an expression has a form ``g + a e_I + b e_D + d e_E + [-r, r]``. With the
dependent coordinates replaced by their relation, no machine at a pose of the box has a smaller value than

    (g + b off) - sum |a - b T| - sum_j |(d - b E)_j| - (r + |b| rho),

where the errors of joint centre j count as one vector. Boxes of poses are bisected, those with the smallest bounds
first; errors never are. Values are those of machines whose errors are along the gradient, at the corner of a box.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from casadi import SX

from .....models.arrays import first_largest
from ....interruption import one_search
from ...boxes.rows import Boxes, some
from ...boxes.search import Verdicts
from ...enclosure.forms import Forms
from ..numbers.bound_search import Goal, Minimum, SmallestValue, Value, searched
from ..ranks.covering import APART, Followed, LoopRule
from ..ranks.krawczyk import ROUNDING, by_centres
from ..ranks.loop_boxes import Examiner
from ..ranks.rank_rule import Tested
from ..robot.tolerance_model import Family
from .machine_points import MachinePoints

#: Number of boxes examined at once, and number of those with the smallest bounds at which values are computed.
_BLOCK, _TRIED = 256, 8
#: Widths of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTHS = 2.0**-24, 2.0**-24


class _Bound:
    """Lower bounds of one expression, as a test of boxes.

    Args:
        expression: (1, 1) in the coordinates of a family.
    """

    def __init__(self, expression: SX) -> None:
        self.entries: SX = expression

    def examine(self, forms: Forms, f: int) -> Tested:
        """Return the lower bounds of boxes as their smallest values; none is regular."""
        c, a, r = (each[:, 0] for each in forms)
        by_pose = a[:, :f]
        with np.errstate(all="ignore"):
            whole = np.abs(by_pose).sum(axis=1) + by_centres(a[:, f:]) + r
            lower = c - whole - 2 * ROUNDING * (np.abs(c) + whole)
        known = np.isfinite(lower)
        # Each coordinate has a part of the rest, so that one with little slope is divided once the others are narrow.
        shares = np.abs(by_pose) + r[:, None] / max(f, 1)
        none = np.zeros(len(c), dtype=np.int32)
        return Tested(none.astype(bool), np.nan_to_num(shares), np.where(known, lower, -np.inf), none)


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
    with one_search(time_limit):
        rule = _MachineRule(family, expression, Goal(gap, limit, slack, is_relative=True))
        found = searched(rule, rule.root, rule.whole, _LEAST_WIDTHS)
    if not math.isfinite(found.bound):
        return replace(found, bound=-math.inf)
    return found if rule.is_one_assembly() else replace(found, bound=-math.inf, reason=APART)


class _MachineRule(LoopRule, SmallestValue[Followed]):
    """Rule of an expression over all machines."""

    block = _BLOCK

    def __init__(self, family: Family, expression: SX, goal: Goal) -> None:
        LoopRule.__init__(self, family.problem, Examiner(family.problem, _Bound(expression), family))
        SmallestValue.__init__(self, goal, Value(math.inf, family.start))
        self._points = MachinePoints(family, expression)

    def examine(self, boxes: Boxes[Followed]) -> Verdicts[Followed]:
        """Return bounds of boxes, and take note of small values in them."""
        found = self.examined(boxes)
        known = np.flatnonzero(found.boxes.is_known & np.isfinite(found.smallest))
        if known.size:
            order = np.argsort(found.smallest[known])[:_TRIED]
            best = self._points.smallest_in(some(found.boxes, known[order]))
            if best is not None and best.value < self.best.value:
                self.best = best
        width = self.widths(found)
        score = found.shares * np.sqrt(width / width.max(axis=1, keepdims=True))
        split = first_largest(np.where(width > 0, score, -1.0))
        # Nothing is known of a box in which dependent coordinates are not.
        bound = np.where(found.boxes.is_known, -found.smallest, np.inf)
        return self.verdicts(self.boxes_of(found, bound, split))
