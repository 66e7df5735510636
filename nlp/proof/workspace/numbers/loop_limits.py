"""Limits of a robot whose loops have no closed form, over a workspace, in the assembly of home.

Loop equations as conditions hold in every assembly of the joints. Here the closed loops of the assembly in the middle
of the workspace are followed over boxes (:mod:`..ranks.loop_boxes`), and each number with a limit is bounded over these
boxes. A box is bisected while its bound of some number is beyond the limit, or, where a value is known beyond it,
beyond this value by more than the gap.
"""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np

from .....models import FloatArray
from .....models.joints.closedform import ClosedForm
from ....case.case import Case
from ....errors import UncoveredError
from ....interruption import one_search, reason_of, reason_to_stop
from ..ranks.connected import is_connected
from ..ranks.covering import coordinates_to_split, in_workspace, whole_workspace, widths_of
from ..ranks.loop_boxes import Cells, Examiner, are_between, joined
from ..ranks.rank_rule import RankTest
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, Problem, build_problem
from ..verdict import Outcome
from .extremes import CLOSE, Extreme
from .limit_values import Enclosed, LimitValues

#: Boxes examined at once.
_BLOCK = 128
#: Width of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTH = 2.0**-24
#: Smallest size of a number that gaps are parts of.
_NEAR_ZERO = 1e-6
#: Derivative, as a part of the largest, that is rounding error and points to no end of a box.
_FLAT = 1e-9


def loop_extremes(
    case: Case,
    closed: ClosedForm,
    box: PoseBox,
    *,
    gap: float,
) -> list[Extreme]:
    """Return the extremes of numbers with a limit, in the assembly of home; none of a robot without open loops.

    Args:
        case: with fixed dimensions.
        closed: its robot without unknowns in closed form.
        box: the poses.
        gap: allowed distance of a bound from a value beyond its limit, as a part of the value.
    """
    if not closed.model.unknowns:
        return []
    with one_search():
        try:
            problem = build_problem(case, closed.model, box)
            values = LimitValues(case, closed, problem)
            if not values.claims:
                return []
            search = _Search(problem, values, gap)
        except (NotJudgedError, UncoveredError):
            return []
        return search.run()


class _Best(NamedTuple):
    """Largest values (K,) that are known of K numbers, -inf without one, and the points (K, n) that have them."""

    value: FloatArray
    z: FloatArray


class _Search:
    """The state of a search over K numbers."""

    def __init__(self, problem: Problem, values: LimitValues, gap: float) -> None:
        self._problem, self._values, self._gap = problem, values, gap
        self._independent, self._dependent = list(problem.independent), list(problem.dependent)
        self._examiner = Examiner(problem, RankTest(problem.locked, problem.z, problem.start), None, None)
        count, n = len(values.claims), len(problem.start)
        self._best = _Best(np.full(count, -np.inf), np.full((count, n), np.nan))
        self._bound = np.full(count, -np.inf)
        self._boxes = 0
        self._roots: list[Cells] = []

    def run(self) -> list[Extreme]:
        """Search until every claim is decided, or the time is over."""
        began = time.perf_counter()
        reason = reason_of(lambda: self._run(began))
        return self._extremes(reason, time.perf_counter() - began)

    def _run(self, began: float) -> str:
        """Search until no box is left; return the reason for stopping earlier, or an empty text."""
        problem, start = self._problem, whole_workspace(self._problem)
        whole = (start.upper - start.lower)[0, self._independent]
        stack = [start]
        while stack:
            reason = reason_to_stop(time.perf_counter() - began)
            if reason:
                return reason
            cells = stack.pop()
            if len(cells.lower) > _BLOCK:
                stack.append(cells.some(np.arange(_BLOCK, len(cells.lower))))
                cells = cells.some(np.arange(_BLOCK))
            cells = in_workspace(problem, cells)
            if not len(cells.lower):
                continue
            halves = self._halves(cells, whole)
            if halves is None:
                return "the boxes that are left are too small to be divided"
            if len(halves.lower):
                stack.append(halves)
        if self._roots and not self._is_one():
            return "the assemblies in two neighbouring boxes are not proved to be the same"
        return ""

    def _is_one(self) -> bool:
        """Return whether all boxes surely have the assembly of the middle."""
        roots, start = joined(self._roots), self._problem.start
        own, D = self._independent, self._dependent
        here = ((roots.lower <= start) & (roots.upper >= start))[:, own].all(axis=1)
        inside = ((roots.lower <= start) & (roots.upper >= start))[:, D].all(axis=1)
        return bool((inside | ~here).all()) and is_connected(self._examiner, roots, own)

    def _halves(self, cells: Cells, whole: FloatArray) -> Cells | None:
        """Return the halves of boxes on which a number is not decided; None where one is too small."""
        self._boxes += len(cells.lower)
        found = self._examiner.examine(cells)
        known = found.cells.is_known
        new = np.flatnonzero(known & ~cells.is_known)
        if new.size:
            self._roots.append(found.cells.some(new))
        shares, is_left = found.shares.copy(), np.ones(len(known), dtype=bool)
        rows = np.flatnonzero(known)
        if rows.size:
            enclosed = self._values.enclosed(found.cells.some(rows))
            upper = enclosed.numbers.upper
            self._add_points(found.cells.some(rows), enclosed)
            is_open = upper > self._least
            is_left[rows] = is_open.any(axis=1)
            closed = ~is_left[rows]
            self._bound = np.maximum(self._bound, upper[closed].max(axis=0, initial=-np.inf))
            size = np.nan_to_num(upper - enclosed.numbers.lower, nan=1.0, posinf=1.0)
            parts = np.abs(enclosed.numbers.slopes) * is_open[:, :, None] / np.maximum(size, 1e-300)[:, :, None]
            shares[rows] = np.nan_to_num(parts).sum(axis=1)
        left = np.flatnonzero(is_left)
        part = found._replace(shares=shares).some(left)
        width = widths_of(part.cells, self._independent, whole)
        if left.size and float(width.max(axis=1).min()) < _LEAST_WIDTH:
            return None
        return self._examiner.halves(part, coordinates_to_split(part.shares, width))

    @property
    def _least(self) -> FloatArray:
        """(K,) bounds up to which a number is decided."""
        best = self._best.value
        size = np.maximum(np.abs(best), _NEAR_ZERO)
        with np.errstate(invalid="ignore"):
            beyond = best + self._gap * size
        return np.asarray(np.where(best > self._values.limit, beyond, self._values.limit))

    def _add_points(self, cells: Cells, enclosed: Enclosed) -> None:
        """Try the middles of boxes, and for each number the end of the box with the largest bound."""
        upper, slopes = enclosed.numbers.upper, np.nan_to_num(enclosed.numbers.slopes)
        best = np.argmax(upper, axis=0)
        rows = np.concatenate([np.arange(len(cells.lower)), best])
        own = slopes[best, np.arange(len(best))]
        own = np.where(np.abs(own) > _FLAT * np.abs(own).max(axis=1, keepdims=True, initial=0.0), own, 0.0)
        ends = np.concatenate([np.zeros((len(cells.lower), len(self._independent))), np.sign(own)])
        z, half = cells.centre[rows], 0.5 * (cells.upper - cells.lower)[rows]
        z[:, self._independent] += half[:, self._independent] * ends
        off, T, _, _ = (each[rows] for each in enclosed.relation)
        z[:, self._dependent] += half[:, self._dependent] * (off - (T @ ends[:, :, None])[:, :, 0])
        free, count = list(self._problem.free), len(self._problem.free)
        inside = self._problem.box.clipped(self._problem.pose_of(z))[:, free]
        own = [k for k in self._independent if k < count]
        z[:, own] = inside[:, own]
        z = self._examiner.loops.all_closed(z.T, self._dependent).T
        z[~are_between(z, cells.some(rows), self._dependent)] = np.nan
        numbers = self._values.values(z)
        y = self._problem.pose_of(np.nan_to_num(z))
        held = np.array([self._problem.box.holds(each) for each in y]) & np.isfinite(z).all(axis=1)
        numbers = np.where(held & np.isfinite(numbers), numbers, -np.inf)
        place = np.argmax(numbers, axis=1)
        value = numbers[np.arange(len(place)), place]
        better = value > self._best.value
        self._best = _Best(np.where(better, value, self._best.value), np.where(better[:, None], z[place], self._best.z))

    def _extremes(self, reason: str, seconds: float) -> list[Extreme]:
        """Return the extremes of the numbers; with a reason for stopping before the end nothing is bounded."""
        found, values = [], self._values
        for k, claim in enumerate(values.claims):
            sign, read = float(values.sign[k]), claim.reading.from_value
            best = float(self._best.value[k])
            bound = math.inf if reason else max(float(self._bound[k]), best)
            pose = None
            if math.isfinite(best):
                pose = self._problem.box.pose(self._problem.pose_of(self._best.z[k]))
            outcome = Outcome.PROVED if bound <= values.limit[k] else Outcome.OPEN
            outcome = Outcome.REFUTED if best > values.limit[k] else outcome
            found.append(
                Extreme(
                    name=claim.name,
                    sense=claim.sense,
                    dimension=claim.reading.dimension,
                    key=claim.key,
                    limit=read(claim.limit or 0.0),
                    bound=read(sign * bound) if math.isfinite(bound) else sign * math.inf,
                    reached=read(sign * best) if math.isfinite(best) else math.nan,
                    pose=pose,
                    outcome=outcome,
                    boxes=self._boxes,
                    seconds=seconds,
                    reason="" if outcome is not Outcome.OPEN else reason or CLOSE,
                )
            )
        return found
