"""Search of a workspace for poses at which a matrix of a robot loses its rank: bisection until every box is proved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from .....models import FloatArray, frozen_array
from ....interruption import one_search
from ...boxes.rows import Boxes, joined, some
from ...boxes.search import TOO_SMALL, Effort, Order, Search, Verdicts
from ...enclosure.engine import ENGINE
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from ..verdict import Outcome, Regularity
from .covering import APART, Followed, LoopRule, contracted_cells, coordinates_to_split
from .loop_boxes import Cells, Examiner
from .rank_rule import RankTest
from .refuters import NewtonRefuter, Refuter, Singular

if TYPE_CHECKING:
    from ...boxes.tree import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Widths of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTHS = 2.0**-24, 2.0**-24

#: Callback with seconds, number of boxes examined, and number of boxes open.
RankProgress = Callable[[float, int, int], None]


def prove_rank(
    problem: Problem,
    matrix: RankMatrix,
    *,
    family: Family | None = None,
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
        time_limit: seconds after which the search stops.
        most_boxes: number of boxes after which it stops.
        progress: called about ten times a second.
        recorder: records the boxes for a proof.
        refuter: looks for singular poses; Newton's method if left out.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    effort = Effort(most_boxes)
    with one_search(time_limit):
        rule = _RankRule(
            problem,
            matrix,
            family,
            recorder,
            NewtonRefuter(problem, matrix, family) if refuter is None else refuter,
        )
        search = Search(rule, rule.root, whole=rule.whole, least=_LEAST_WIDTHS, order=Order.NEWEST)

        def ending() -> str | None:
            if rule.singular is not None:
                return ""
            if search.is_open:
                return None
            if search.state.small:
                return TOO_SMALL
            return "" if rule.is_one_assembly() else APART

        if progress is not None:
            effort = replace(effort, progress=lambda seconds: progress(seconds, search.boxes, search.left))
        reason = effort.run(search, ending)
    singular, left = rule.singular, search.state.left
    outcome, y, share = Outcome.PROVED, None, 0.0
    if singular is not None:
        outcome, reason, y = Outcome.REFUTED, singular.reason, singular.y
    elif left:
        outcome, own = Outcome.OPEN, np.flatnonzero(rule.whole > 0)
        boxes = joined(left)
        widths = (boxes.upper - boxes.lower)[:, own] / rule.whole[own]
        share = float(widths.prod(axis=1).sum())
        widest = int(np.argmax(widths.max(axis=1, initial=0.0)))
        centre = 0.5 * boxes.lower[widest] + 0.5 * boxes.upper[widest]
        y = problem.pose_of(np.where(np.isfinite(centre), centre, boxes.more.near[widest]))
    elif reason:
        outcome, y = Outcome.OPEN, problem.pose_of(problem.start)
    return Regularity(
        outcome=outcome,
        box=problem.box,
        y=None if y is None else frozen_array(y, (6,)),
        sides=None if singular is None else singular.sides,
        engine=ENGINE,
        boxes=search.boxes,
        open=search.left,
        share=share,
        seconds=effort.seconds,
        reason="" if outcome is Outcome.PROVED else reason,
        errors=None if singular is None else singular.errors,
        centres=None if singular is None else singular.centres,
    )


class _RankRule(LoopRule):
    """Rule of the rank of a matrix.

    Args:
        problem, matrix, family, recorder, refuter: as in :func:`prove_rank`.

    Attributes:
        singular: a singular pose; None while none is known.
    """

    block = _BLOCK

    def __init__(
        self,
        problem: Problem,
        matrix: RankMatrix,
        family: Family | None,
        recorder: TreeRecord | None,
        refuter: Refuter,
    ) -> None:
        test = RankTest(matrix, problem.z, problem.start)
        if family is not None:
            test = RankTest(family.matrix(matrix), family.coordinates, family.start)
        super().__init__(problem, Examiner(problem, test, family))
        self.singular: Singular | None = None
        self._recorder, self._refuter, self._examined = recorder, refuter, 0

    def divided(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves of boxes."""
        if self._recorder is not None:
            along = np.array(self._problem.free)[boxes.split]
            self._recorder.cuts(*self._ends(boxes.lower, boxes.upper), along)
        return super().divided(boxes)

    def examine(self, boxes: Boxes[Followed]) -> Verdicts[Followed]:
        """Return the boxes over which the rank is not proved to be full."""
        found = self.examined(boxes)
        count = len(found.is_regular)
        self._examined += count
        if count:
            self.singular = self._refuter.look(found, self._examined)
        found = some(found, np.flatnonzero(~found.is_regular))
        split = coordinates_to_split(found.shares, self.widths(found))
        return Verdicts(self.boxes_of(found, np.zeros(len(split)), split), 0.0, count)

    def _contracted(self, cells: Cells) -> Cells:
        """Return boxes contracted to the workspace, and record where they lead."""
        found = contracted_cells(self._problem, cells)
        if self._recorder is not None:
            before, after = (self._ends(each.lower, each.upper) for each in (cells, found.cells))
            self._recorder.contractions(before, after, ~found.kept)
            self._recorder.lacks_boxes |= bool(found.beyond.any())
        return some(found.cells, found.kept)

    def _ends(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return boxes by the ends of all six coordinates (B, 6): those that follow from others have their range."""
        box, free = self._problem.box, self._problem.free
        low, high = (np.broadcast_to(each, (len(lower), 6)).copy() for each in (box.lower, box.upper))
        for j in self._independent:
            if j < len(free):
                low[:, free[j]], high[:, free[j]] = lower[:, j], upper[:, j]
        return low, high
