"""Smallest value of a number over all machines within a tolerance, at every pose of a workspace: bisection.

Over a box of poses, and for all machines, an expression has a form ``g + a e_I + b e_D + d e_E + [-r, r]``. With the
dependent coordinates replaced by their relation, no machine at a pose of the box has a smaller value than

    (g + b off) - sum |a - b T| - sum_j |(d - b E)_j| - (r + |b| rho),

where the errors of joint centre j count as one vector. Boxes of poses are bisected, those with the smallest bounds
first; errors never are. Values are those of machines whose errors are along the gradient, at the corner of a box.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from casadi import SX

from .....models import FloatArray
from .....models.arrays import first_largest
from ....interruption import one_search, reason_of, reason_to_stop
from ...enclosure.forms import Forms
from ..ranks.connected import is_connected
from ..ranks.covering import in_workspace, whole_workspace, widths_of
from ..ranks.krawczyk import ROUNDING, Relation, by_centres
from ..ranks.loop_boxes import Cells, Examined, Examiner, joined
from ..ranks.rank_rule import Tested
from ..robot.tolerance_model import Family
from .machine_points import MachinePoints, PointValue

#: Number of boxes examined at once, and number of those with the smallest bounds at which values are computed.
_BLOCK, _TRIED = 128, 8
#: Width of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTH = 2.0**-24
#: Value below which gaps are parts of this one.
_NEAR_ZERO = 1e-6


class _Bound:
    """Lower bounds of one expression, as a test of boxes.

    Args:
        expression: (1, 1) in the coordinates of a family.
    """

    def __init__(self, expression: SX) -> None:
        self.entries: SX = expression

    def examine(
        self, forms: Forms, relation: Relation, independent: list[int], dependent: list[int], errors: list[int]
    ) -> Tested:
        """Return the lower bounds of boxes as their smallest values; none is regular."""
        c, a, r = (each[:, 0] for each in forms)
        own, size = a[:, dependent], np.abs(a[:, dependent])
        with np.errstate(all="ignore"):
            by_pose = a[:, independent] - (own[:, None] @ relation.T)[:, 0]
            by_error = a[:, errors] - (own[:, None] @ relation.E)[:, 0]
            rest = r + (size * relation.rho).sum(axis=1)
            whole = np.abs(by_pose).sum(axis=1) + by_centres(by_error) + rest
            terms = np.abs(c) + np.abs(a).sum(axis=1) + (size * relation.reach).sum(axis=1) + whole
            lower = c + (own * relation.off).sum(axis=1) - whole - 2 * ROUNDING * terms
        known = np.isfinite(lower)
        # Each coordinate has a part of the rest, so that one with little slope is divided once the others are narrow.
        shares = np.abs(by_pose) + rest[:, None] / max(by_pose.shape[1], 1)
        none = np.zeros(len(c), dtype=np.int32)
        return Tested(none.astype(bool), np.nan_to_num(shares), np.where(known, lower, -np.inf), none)


@dataclass(frozen=True, eq=False)
class MachineMinimum:
    """The smallest value of a number over all machines and poses.

    Attributes:
        bound: proven: no machine has a smaller value at a pose.
        value: at ``z``; NaN without a machine.
        z: (n + 3 m,) coordinates of the pose, and errors, of the machine with the smallest value known; None without.
        boxes: number of boxes examined.
        seconds: wall time.
        reason: for stopping before the gap was met; else empty.
    """

    bound: float
    value: float
    z: FloatArray | None
    boxes: int
    seconds: float
    reason: str


def smallest_of_machines(
    family: Family,
    expression: SX,
    *,
    gap: float,
    limit: float | None = None,
    slack: float = 0.0,
    time_limit: float | None = None,
    engine: str | None = None,
) -> MachineMinimum:
    """Prove the smallest value of an expression over all machines and poses.

    Args:
        family: the machines.
        expression: (1, 1) in their coordinates.
        gap: allowed distance of the bound from the smallest value known, as a part of it.
        limit: the search ends once the bound is at least this, or a smaller value is known.
        slack: how far a value may be below the limit and still count as on it.
        time_limit: seconds after which the search stops with the bound reached.
        engine: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.

    Raises:
        UncoveredError: the expression holds an operation without a rule.
    """
    with one_search(time_limit):
        return _Search(family, expression, engine).run(gap, limit, slack)


class _State(NamedTuple):
    """What is left after a step: open boxes, and the smallest bound of those that are closed."""

    open: Examined
    closed: float

    @property
    def bounds(self) -> FloatArray:
        """Lower bounds of the open boxes; nothing is known of a box in which dependent coordinates are not."""
        return np.where(self.open.cells.is_known, self.open.smallest, -np.inf)


class _Search:
    """The state of a search."""

    def __init__(self, family: Family, expression: SX, engine: str | None) -> None:
        self._began, self._family, problem = time.perf_counter(), family, family.problem
        self._examiner = Examiner(problem, _Bound(expression), engine, family)
        self._points = MachinePoints(family, expression)
        self._independent, self._dependent = list(problem.independent), list(problem.dependent)
        whole = whole_workspace(problem)
        self._whole = (whole.upper - whole.lower)[0, self._independent]
        self._roots: list[Cells] = []
        self._best = PointValue(math.inf, family.start)
        self._boxes = 0
        self._state = _State(self._examined(whole), math.inf)

    def run(self, gap: float, limit: float | None, slack: float) -> MachineMinimum:
        """Search until the gap is met and the limit decided."""

        def run() -> str:
            while len(self._state.open.smallest):
                (found, closed), bounds = self._state, self._state.bounds
                if min(closed, float(bounds.min())) >= self._target(gap, limit, slack):
                    break
                reason = reason_to_stop(time.perf_counter() - self._began)
                if reason:
                    return reason
                order = np.argpartition(bounds, min(_BLOCK, len(bounds)) - 1)
                now, later = found.some(order[:_BLOCK]), found.some(order[_BLOCK:])
                width = widths_of(now.cells, self._independent, self._whole)
                if (width.max(axis=1, initial=0.0) < _LEAST_WIDTH).any():
                    return "the boxes that are left are too small to be divided"
                score = now.shares * np.sqrt(width / width.max(axis=1, keepdims=True))
                split = first_largest(np.where(width > 0, score, -1.0))
                following = _State(later.followed_by(self._examined(self._examiner.halves(now, split))), closed)
                done = following.bounds >= self._target(gap, limit, slack)
                least = float(following.bounds[done].min(initial=math.inf))
                self._state = _State(following.open.some(np.flatnonzero(~done)), min(closed, least))
            return ""

        return self._result(reason_of(run))

    def _target(self, gap: float, limit: float | None, slack: float) -> float:
        """Return the bound at which the search ends."""
        value = self._best.value
        target = value - gap * max(abs(value), _NEAR_ZERO) if math.isfinite(value) else math.inf
        if limit is None or value < limit - slack:
            return target
        undecided = limit if value >= limit else limit - slack
        return max(target, undecided) if math.isfinite(target) else undecided

    def _examined(self, cells: Cells) -> Examined:
        """Return bounds of boxes, and take note of small values in them."""
        cells = in_workspace(self._family.problem, cells)
        found = self._examiner.examine(cells)
        self._boxes += len(cells.lower)
        new = np.flatnonzero(found.cells.is_known & ~cells.is_known)
        if new.size:
            self._roots.append(found.cells.some(new))
        known = np.flatnonzero(found.cells.is_known & np.isfinite(found.smallest))
        if known.size:
            order = np.argsort(found.smallest[known])[:_TRIED]
            best = self._points.smallest_in(found.cells.some(known[order]))
            if best is not None and best.value < self._best.value:
                self._best = best
        return found

    def _result(self, reason: str) -> MachineMinimum:
        """Return the result at this state of the search."""
        bound = min(self._state.closed, float(self._state.bounds.min(initial=math.inf)), self._best.value)
        if (
            self._dependent
            and math.isfinite(bound)
            and not is_connected(self._examiner, joined(self._roots), self._independent)
        ):
            bound, reason = -math.inf, "the assemblies in two neighbouring boxes are not proved to be the same"
        has_point = math.isfinite(self._best.value)
        return MachineMinimum(
            bound=bound if math.isfinite(bound) else -math.inf,
            value=self._best.value if has_point else math.nan,
            z=self._best.z if has_point else None,
            boxes=self._boxes,
            seconds=time.perf_counter() - self._began,
            reason=reason,
        )
