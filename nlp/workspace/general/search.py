"""Search of a workspace for poses at which a matrix of a robot loses its rank: bisection until every box is proved."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from ....models import FloatArray, frozen_array
from ...interruption import Milestone, reached
from ..regular.search import REPORT_EVERY, RankProgress, reason_to_stop
from ..verdict import Outcome, Regularity
from .cells import Cells, Examined, Examiner, joined
from .connected import is_connected
from .matrices import RankMatrix
from .problem import Problem
from .rank import RankTest
from .singularpose import SingularPose

if TYPE_CHECKING:
    from ..paper.record import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 128
#: Width of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTH = 2.0**-24
#: Smallest singular value, in parts of the largest, from which Newton's method looks for a singular pose, and most
#: attempts.
_SMALL, _MOST = 0.1, 24
#: Part of the value before at which it tries again.
_SMALLER = 0.6
#: How a singular pose of this search is known.
BY_NEWTON = "found singular to 1e-10 by Newton's method"


def prove_rank(
    problem: Problem,
    matrix: RankMatrix,
    *,
    engine: str | None = None,
    time_limit: float | None = None,
    most_boxes: int | None = None,
    progress: RankProgress | None = None,
    recorder: TreeRecord | None = None,
) -> Regularity:
    """Prove that a matrix keeps its rank at every pose of a workspace, or find a pose at which it does not.

    Args:
        problem: the robot.
        matrix: its matrix.
        engine: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        time_limit: seconds after which the search stops.
        most_boxes: number of boxes after which it stops.
        progress: called about ten times a second.
        recorder: records the boxes for a proof.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    search = _Search(problem, matrix, engine, recorder)
    try:
        reason = search.run(time_limit, most_boxes, progress)
    except KeyboardInterrupt:
        reason = "interrupted"
    return search.verdict(reason)


class _Search:
    """The state of a search."""

    def __init__(
        self, problem: Problem, matrix: RankMatrix, engine: str | None, recorder: TreeRecord | None = None
    ) -> None:
        self._began = time.perf_counter()
        self._problem, self._recorder = problem, recorder
        self._examiner = Examiner(problem, RankTest(matrix, problem.z, problem.start), engine)
        self._newton = SingularPose(problem, matrix)
        self._independent = list(problem.independent)
        box = problem.box
        n = len(problem.start)
        lower, upper = np.full((1, n), np.nan), np.full((1, n), np.nan)
        free = list(problem.free)
        lower[0, : len(free)], upper[0, : len(free)] = box.lower[free], box.upper[free]
        dependent = list(problem.dependent)
        lower[0, dependent] = upper[0, dependent] = np.nan
        self._whole = (upper - lower)[0, self._independent]
        is_known = np.full(1, not dependent)
        self._stack = [Cells(lower, upper, problem.start[None].copy(), is_known)]
        self._small: list[Cells] = []
        # The boxes in which dependent coordinates became known.
        self._roots: list[Cells] = []
        self._boxes, self._attempts, self._last = 0, 0, _SMALL
        self._singular: FloatArray | None = None
        self._is_one = True

    @property
    def _open(self) -> int:
        return sum(len(each.lower) for each in (*self._stack, *self._small))

    def run(self, time_limit: float | None, most_boxes: int | None, progress: RankProgress | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text."""
        reported = -math.inf
        reached(Milestone.BOUND)
        while self._stack:
            seconds = time.perf_counter() - self._began
            reason = reason_to_stop(seconds, self._boxes, time_limit, most_boxes)
            if reason:
                return reason
            if progress is not None and seconds - reported >= REPORT_EVERY:
                reported = seconds
                progress(seconds, self._boxes, self._open)
            cells = self._in_workspace(self._next())
            if not len(cells.lower):
                continue
            self._boxes += len(cells.lower)
            found = self._examiner.examine(cells)
            new = np.flatnonzero(found.cells.is_known & ~cells.is_known)
            if new.size:
                self._roots.append(found.cells.some(new))
            if self._is_refuted(found):
                return ""
            self._branch(found)
        if self._small:
            return "the boxes that are left are too small to be divided"
        self._is_one = not self._roots or is_connected(self._examiner, joined(self._roots), self._independent)
        return "" if self._is_one else "the assemblies in two neighbouring boxes are not proved to be the same"

    def _next(self) -> Cells:
        """Return the next boxes, and take them off the stack."""
        cells = self._stack.pop()
        if len(cells.lower) > _BLOCK:
            self._stack.append(cells.some(np.arange(_BLOCK, len(cells.lower))))
            cells = cells.some(np.arange(_BLOCK))
        return cells

    def _in_workspace(self, cells: Cells) -> Cells:
        """Return the boxes that hold poses of the workspace, contracted to them."""
        problem, free = self._problem, list(self._problem.free)
        box, count = problem.box, len(free)
        ends = [problem.pose_of(each) for each in (cells.lower, cells.upper)]
        # Numbers of the pose that are not known yet may be any of the workspace.
        lower = np.where(np.isnan(ends[0]), box.lower, ends[0])
        upper = np.where(np.isnan(ends[1]), box.upper, ends[1])
        apart = (lower > box.upper).any(axis=1) | (upper < box.lower).any(axis=1)
        found = box.contracted(lower, upper)
        kept = ~(apart | found.outside)
        before = cells
        own = [j for j in self._independent if j < count]
        columns = [free[j] for j in own]
        new_lower, new_upper = cells.lower.copy(), cells.upper.copy()
        new_lower[:, own], new_upper[:, own] = found.lower[:, columns], found.upper[:, columns]
        cells = cells._replace(lower=new_lower, upper=new_upper)
        if self._recorder is not None:
            self._recorder.contractions(self._ends(before), self._ends(cells), ~kept)
            self._recorder.lacks_boxes |= bool(apart.any())
        return cells.some(np.flatnonzero(kept))

    def _ends(self, cells: Cells) -> tuple[FloatArray, FloatArray]:
        """Return boxes by the ends of all six coordinates (B, 6): those that follow from others have their range."""
        box, free = self._problem.box, self._problem.free
        lower, upper = (np.broadcast_to(each, (len(cells.lower), 6)).copy() for each in (box.lower, box.upper))
        for j in self._independent:
            if j < len(free):
                lower[:, free[j]], upper[:, free[j]] = cells.lower[:, j], cells.upper[:, j]
        return lower, upper

    def _is_refuted(self, found: Examined) -> bool:
        """Return whether a singular pose is found from the worst of these boxes."""
        values = np.where(found.is_regular, np.inf, found.smallest)
        for k in np.argsort(values)[:2]:
            if not values[k] < self._last or self._attempts >= _MOST:
                return False
            self._attempts += 1
            self._last = _SMALLER * float(values[k])
            z = found.cells.near[k].copy()
            own = self._independent
            z[own] = found.cells.centre[k, own]
            dependent = list(self._problem.dependent)
            z[dependent] = found.cells.centre[k, dependent]
            self._singular = self._newton.search(z)
            if self._singular is not None:
                return True
        return False

    def _branch(self, found: Examined) -> None:
        """Bisect the open boxes."""
        rows = np.flatnonzero(~found.is_regular)
        if not rows.size:
            return
        part = Examined(
            found.cells.some(rows),
            type(found.relation)(*(each[rows] for each in found.relation)),
            found.is_regular[rows],
            found.shares[rows],
            found.smallest[rows],
        )
        own = self._independent
        width = (part.cells.upper - part.cells.lower)[:, own]
        whole = np.where(self._whole > 0, self._whole, np.inf)
        score = np.where(width > 0, part.shares, -1.0)
        flat = ~(score > 0).any(axis=1)
        score[flat] = width[flat] / whole
        # A coordinate that counts for little is divided where it is much wider than all others.
        score += 1e-3 * score.max(axis=1, keepdims=True) * width / whole
        split = np.argmax(score, axis=1)
        every = np.arange(len(rows))
        low, high = (each[every, np.array(own)[split]] for each in (part.cells.lower, part.cells.upper))
        middle = 0.5 * low + 0.5 * high
        small = ((width / whole).max(axis=1) < _LEAST_WIDTH) | ~((low < middle) & (middle < high))
        if small.any():
            self._small.append(part.cells.some(np.flatnonzero(small)))
        if (~small).any():
            if self._recorder is not None:
                along = np.array([self._problem.free[own[k]] for k in split[~small]])
                self._recorder.cuts(*self._ends(part.cells.some(~small)), along)
            halves = self._examiner.halves(part, split)
            self._stack.append(halves.some(np.concatenate([~small, ~small])))

    def verdict(self, reason: str) -> Regularity:
        """Return the verdict at this state of the search."""
        problem = self._problem
        outcome, y, share, left = Outcome.PROVED, None, 0.0, [*self._stack, *self._small]
        if self._singular is not None:
            outcome, reason = Outcome.REFUTED, BY_NEWTON
            y = problem.pose_of(self._singular)
        elif left:
            outcome, cells = Outcome.OPEN, joined(left)
            own = [j for j in self._independent if self._whole[self._independent.index(j)] > 0]
            widths = (cells.upper - cells.lower)[:, own] / self._whole[[self._independent.index(j) for j in own]]
            share = float(widths.prod(axis=1).sum())
            widest = int(np.argmax(widths.max(axis=1, initial=0.0)))
            z = np.where(np.isfinite(cells.centre[widest]), cells.centre[widest], cells.near[widest])
            y = problem.pose_of(z)
        elif not self._is_one:
            outcome, y = Outcome.OPEN, problem.pose_of(problem.start)
        return Regularity(
            outcome=outcome,
            box=problem.box,
            y=None if y is None else frozen_array(y, (6,)),
            sides=None,
            engine=self._examiner.engine,
            boxes=self._boxes,
            open=self._open,
            share=share,
            seconds=time.perf_counter() - self._began,
            reason="" if outcome is Outcome.PROVED else reason,
        )
