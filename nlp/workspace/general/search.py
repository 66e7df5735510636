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
from .covering import contracted_cells, coordinates_to_split, whole_workspace, widths_of
from .family import Family
from .matrices import RankMatrix
from .problem import Problem
from .rank import RankTest
from .singularmachine import SingularMachine
from .singularpose import SingularPose

if TYPE_CHECKING:
    from ..paper.record import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Width of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTH = 2.0**-24
#: Smallest singular value, in parts of the largest, from which Newton's method looks for a singular pose, and most
#: attempts.
_SMALL, _MOST = 0.1, 24
#: Number of boxes after which a singular machine is looked for first; later ones are twice as many each.
_FIRST = 64
#: Part of the value before at which it tries again.
_SMALLER = 0.6
#: How a singular pose of this search is known.
BY_NEWTON = "found singular to 1e-10 by Newton's method"


def prove_rank(
    problem: Problem,
    matrix: RankMatrix,
    *,
    family: Family | None = None,
    engine: str | None = None,
    time_limit: float | None = None,
    most_boxes: int | None = None,
    progress: RankProgress | None = None,
    recorder: TreeRecord | None = None,
) -> Regularity:
    """Prove that a matrix keeps its rank at every pose of a workspace, or find a pose at which it does not.

    Args:
        problem: the robot.
        matrix: one of its two matrices.
        family: all machines that are meant; None for the design alone.
        engine: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        time_limit: seconds after which the search stops.
        most_boxes: number of boxes after which it stops.
        progress: called about ten times a second.
        recorder: records the boxes for a proof.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    search = _Search(problem, matrix, family, engine, recorder)
    try:
        reason = search.run(time_limit, most_boxes, progress)
    except KeyboardInterrupt:
        reason = "interrupted"
    return search.verdict(reason)


class _Search:
    """The state of a search."""

    def __init__(
        self,
        problem: Problem,
        matrix: RankMatrix,
        family: Family | None,
        engine: str | None,
        recorder: TreeRecord | None = None,
    ) -> None:
        self._began = time.perf_counter()
        self._problem, self._family, self._recorder = problem, family, recorder
        self._newton, self._machine = (
            SingularPose(problem, matrix),
            None if family is None else SingularMachine(family, family.matrix(matrix)),
        )
        test = RankTest(matrix, problem.z, problem.start)
        if family is not None:
            built = family.matrix(matrix)
            test = RankTest(built, family.coordinates, family.start)
        self._examiner = Examiner(problem, test, engine, family)
        self._independent = list(problem.independent)
        whole = whole_workspace(problem)
        self._whole = (whole.upper - whole.lower)[0, self._independent]
        self._stack = [whole]
        self._small: list[Cells] = []
        # The boxes in which dependent coordinates became known.
        self._roots: list[Cells] = []
        self._boxes, self._attempts, self._last = 0, 0, _SMALL
        # Number of boxes from which a singular machine is looked for, although no pose of the design is near to one.
        self._due = _FIRST
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

    def _in_workspace(self, before: Cells) -> Cells:
        """Return the boxes that hold poses of the workspace, contracted to them."""
        found = contracted_cells(self._problem, before)
        if self._recorder is not None:
            self._recorder.contractions(self._ends(before), self._ends(found.cells), ~found.kept)
            self._recorder.lacks_boxes |= bool(found.beyond.any())
        return found.cells.some(np.flatnonzero(found.kept))

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
        order = np.argsort(values)[:2]
        for k in order:
            if not values[k] < self._last or self._attempts >= _MOST:
                break
            self._attempts += 1
            self._last = _SMALLER * float(values[k])
            self._singular = self._newton.search(self._middle(found.cells, k))
            if self._singular is not None:
                return True
        if self._machine is None or self._boxes < self._due or not np.isfinite(values[order[0]]):
            return False
        self._due = 2 * self._boxes
        self._singular = self._machine.search(self._middle(found.cells, order[0]))
        return self._singular is not None

    def _middle(self, cells: Cells, k: np.int64) -> FloatArray:
        """Return a point (n,) in the middle of a box, with closed loops or near them."""
        z: FloatArray = cells.near[k].copy()
        own = [*self._independent, *self._problem.dependent]
        z[own] = cells.centre[k, own]
        return z

    def _branch(self, found: Examined) -> None:
        """Bisect the open boxes."""
        rows = np.flatnonzero(~found.is_regular)
        if not rows.size:
            return
        part = found.some(rows)
        own = self._independent
        width = widths_of(part.cells, own, self._whole)
        split = coordinates_to_split(part.shares, width)
        every = np.arange(len(rows))
        low, high = (each[every, np.array(own)[split]] for each in (part.cells.lower, part.cells.upper))
        middle = 0.5 * low + 0.5 * high
        small = (width.max(axis=1) < _LEAST_WIDTH) | ~((low < middle) & (middle < high))
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
        centres = None
        if self._singular is not None:
            outcome, reason = Outcome.REFUTED, BY_NEWTON
            if self._family is not None and len(self._singular) > len(problem.start):
                centres = self._family.errors_of(self._singular)
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
            centres=centres,
        )
