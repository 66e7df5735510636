"""Search of a workspace for poses at which a matrix of a robot loses its rank: bisection until every box is proved."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray, frozen_array
from ....interruption import Milestone, one_search, reached, reason_of, reason_to_stop
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from ..verdict import Outcome, Regularity
from .connected import is_connected
from .covering import contracted_cells, coordinates_to_split, whole_workspace, widths_of
from .loop_boxes import Cells, Examined, Examiner, joined
from .rank_rule import RankTest
from .refuters import NewtonRefuter, Refuter, Singular

if TYPE_CHECKING:
    from ..proof_record import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Width of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTH = 2.0**-24
#: Seconds between two reports of progress.
REPORT_EVERY = 0.1

#: Callback with seconds, number of boxes examined, and number of boxes open.
RankProgress = Callable[[float, int, int], None]


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
    refuter: Refuter | None = None,
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
        refuter: looks for singular poses; Newton's method if left out.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    refuter = NewtonRefuter(problem, matrix, family) if refuter is None else refuter
    with one_search(time_limit):
        search = _Search(problem, matrix, family, engine, recorder, refuter)
        return search.verdict(reason_of(lambda: search.run(most_boxes, progress)))


class _State(NamedTuple):
    """What is left of the workspace after a step: blocks to examine, those too small to bisect, and boxes examined."""

    stack: list[Cells]
    small: list[Cells]
    boxes: int

    @property
    def open(self) -> int:
        """Number of boxes that are left."""
        return sum(len(each.lower) for each in (*self.stack, *self.small))


class _Search:
    """The state of a search."""

    def __init__(
        self,
        problem: Problem,
        matrix: RankMatrix,
        family: Family | None,
        engine: str | None,
        recorder: TreeRecord | None,
        refuter: Refuter,
    ) -> None:
        self._began = time.perf_counter()
        self._problem, self._recorder, self._refuter = problem, recorder, refuter
        test = RankTest(matrix, problem.z, problem.start)
        if family is not None:
            built = family.matrix(matrix)
            test = RankTest(built, family.coordinates, family.start)
        self._examiner = Examiner(problem, test, engine, family)
        self._independent = list(problem.independent)
        whole = whole_workspace(problem)
        self._whole = (whole.upper - whole.lower)[0, self._independent]
        self._state = _State([whole], [], 0)
        # The boxes in which dependent coordinates became known.
        self._roots: list[Cells] = []
        self._singular: Singular | None = None

    def run(self, most_boxes: int | None, progress: RankProgress | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text."""
        reported = -math.inf
        reached(Milestone.BOUND)
        while self._state.stack:
            (*stack, cells), small, boxes = self._state
            seconds = time.perf_counter() - self._began
            reason = reason_to_stop(seconds, boxes, most_boxes)
            if reason:
                return reason
            if progress is not None and seconds - reported >= REPORT_EVERY:
                reported = seconds
                progress(seconds, boxes, self._state.open)
            if len(cells.lower) > _BLOCK:
                stack.append(cells.some(np.arange(_BLOCK, len(cells.lower))))
            cells = self._in_workspace(cells.some(np.arange(min(_BLOCK, len(cells.lower)))))
            boxes += len(cells.lower)
            if not len(cells.lower):
                self._state = _State(stack, small, boxes)
                continue
            found = self._examiner.examine(cells)
            new = np.flatnonzero(found.cells.is_known & ~cells.is_known)
            if new.size:
                self._roots.append(found.cells.some(new))
            self._singular = self._refuter.look(found, boxes)
            if self._singular is not None:
                self._state = self._state._replace(boxes=boxes)
                return ""
            halves, undivided = self._halves(found)
            self._state = _State(stack + halves, small + undivided, boxes)
        if self._state.small:
            return "the boxes that are left are too small to be divided"
        is_one = not self._roots or is_connected(self._examiner, joined(self._roots), self._independent)
        return "" if is_one else "the assemblies in two neighbouring boxes are not proved to be the same"

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

    def _halves(self, found: Examined) -> tuple[list[Cells], list[Cells]]:
        """Return the halves of the open boxes, and those that are too small to bisect."""
        rows = np.flatnonzero(~found.is_regular)
        if not rows.size:
            return [], []
        part = found.some(rows)
        own = self._independent
        width = widths_of(part.cells, own, self._whole)
        split = coordinates_to_split(part.shares, width)
        every = np.arange(len(rows))
        low, high = (each[every, np.array(own)[split]] for each in (part.cells.lower, part.cells.upper))
        middle = 0.5 * low + 0.5 * high
        small = (width.max(axis=1) < _LEAST_WIDTH) | ~((low < middle) & (middle < high))
        undivided = [part.cells.some(np.flatnonzero(small))] * bool(small.any())
        if small.all():
            return [], undivided
        if self._recorder is not None:
            along = np.array([self._problem.free[own[k]] for k in split[~small]])
            self._recorder.cuts(*self._ends(part.cells.some(~small)), along)
        halves = self._examiner.halves(part, split)
        return [halves.some(np.concatenate([~small, ~small]))], undivided

    def verdict(self, reason: str) -> Regularity:
        """Return the verdict at this state of the search."""
        problem = self._problem
        outcome, y, share, left = Outcome.PROVED, None, 0.0, [*self._state.stack, *self._state.small]
        singular = self._singular
        if singular is not None:
            outcome, reason, y = Outcome.REFUTED, singular.reason, singular.y
        elif left:
            outcome, cells = Outcome.OPEN, joined(left)
            own = [j for j in self._independent if self._whole[self._independent.index(j)] > 0]
            widths = (cells.upper - cells.lower)[:, own] / self._whole[[self._independent.index(j) for j in own]]
            share = float(widths.prod(axis=1).sum())
            widest = int(np.argmax(widths.max(axis=1, initial=0.0)))
            z = np.where(np.isfinite(cells.centre[widest]), cells.centre[widest], cells.near[widest])
            y = problem.pose_of(z)
        elif reason:
            outcome, y = Outcome.OPEN, problem.pose_of(problem.start)
        return Regularity(
            outcome=outcome,
            box=problem.box,
            y=None if y is None else frozen_array(y, (6,)),
            sides=None if singular is None else singular.sides,
            engine=self._examiner.engine,
            boxes=self._state.boxes,
            open=self._state.open,
            share=share,
            seconds=time.perf_counter() - self._began,
            reason="" if outcome is Outcome.PROVED else reason,
            errors=None if singular is None else singular.errors,
            centres=None if singular is None else singular.centres,
        )
