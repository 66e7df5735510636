"""Search of a workspace for poses at which a matrix of a robot loses its rank: bisection until every box is proved."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray, frozen_array
from ....interruption import Milestone, reached, reason_of, reason_to_stop
from ..regular.search import REPORT_EVERY, RankProgress
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from ..tolerance.singular_machine import SingularMachine
from ..verdict import Outcome, Regularity
from .connected import is_connected
from .covering import contracted_cells, coordinates_to_split, whole_workspace, widths_of
from .loop_boxes import Cells, Examined, Examiner, joined
from .rank_rule import RankTest
from .singular_pose import SingularPose

if TYPE_CHECKING:
    from ..proof_record import TreeRecord

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
    is_shown: Callable[[FloatArray], bool] = lambda _: True,
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
        is_shown: whether a singular point (n,), or (n + 3 m,) of another machine, is one in home's assembly.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    search = _Search(problem, matrix, family, engine, recorder, is_shown)
    return search.verdict(reason_of(lambda: search.run(time_limit, most_boxes, progress)))


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
        is_shown: Callable[[FloatArray], bool],
    ) -> None:
        self._began = time.perf_counter()
        self._problem, self._family, self._recorder, self._is_shown = problem, family, recorder, is_shown
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
        self._state = _State([whole], [], 0)
        # The boxes in which dependent coordinates became known.
        self._roots: list[Cells] = []
        self._attempts, self._last = 0, _SMALL
        # Number of boxes from which a singular machine is looked for, although no pose of the design is near to one.
        self._due = _FIRST
        self._singular: FloatArray | None = None

    def run(self, time_limit: float | None, most_boxes: int | None, progress: RankProgress | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text."""
        reported = -math.inf
        reached(Milestone.BOUND)
        while self._state.stack:
            (*stack, cells), small, boxes = self._state
            seconds = time.perf_counter() - self._began
            reason = reason_to_stop(seconds, time_limit, boxes=boxes, most_boxes=most_boxes)
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
            if self._is_refuted(found, boxes):
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

    def _is_refuted(self, found: Examined, boxes: int) -> bool:
        """Return whether a singular pose is found from the worst of these boxes."""
        values = np.where(found.is_regular, np.inf, found.smallest)
        order = np.argsort(values)[:2]
        for k in order:
            if not values[k] < self._last or self._attempts >= _MOST:
                break
            self._attempts += 1
            near = self._newton.search(self._middle(found.cells, k))
            self._singular = self._if_shown(near)
            if self._singular is not None:
                return True
            # A singular pose of another assembly says nothing about where one of home's is.
            self._last = _SMALLER * float(values[k]) if near is None else self._last
        if self._machine is None or boxes < self._due or not np.isfinite(values[order[0]]):
            return False
        self._due = 2 * boxes
        self._singular = self._if_shown(self._machine.search(self._middle(found.cells, order[0])))
        return self._singular is not None

    def _if_shown(self, z: FloatArray | None) -> FloatArray | None:
        """Return a singular point if it is one in home's assembly: Newton's method may end in another one."""
        return z if z is not None and self._is_shown(z) else None

    def _middle(self, cells: Cells, k: np.int64) -> FloatArray:
        """Return a point (n,) in the middle of a box, with closed loops or near them."""
        z: FloatArray = cells.near[k].copy()
        own = [*self._independent, *self._problem.dependent]
        z[own] = cells.centre[k, own]
        return z

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
        elif reason:
            outcome, y = Outcome.OPEN, problem.pose_of(problem.start)
        return Regularity(
            outcome=outcome,
            box=problem.box,
            y=None if y is None else frozen_array(y, (6,)),
            sides=None,
            engine=self._examiner.engine,
            boxes=self._state.boxes,
            open=self._state.open,
            share=share,
            seconds=time.perf_counter() - self._began,
            reason="" if outcome is Outcome.PROVED else reason,
            centres=centres,
        )
