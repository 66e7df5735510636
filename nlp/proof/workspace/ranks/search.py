"""Search of a workspace for poses at which a matrix of a robot loses its rank: bisection until every box is proved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from .....models import FloatArray, frozen_array
from ....interruption import one_search
from ...boxes.rows import Boxes, joined, some
from ...boxes.search import TOO_SMALL, Effort, Order, Search, Verdicts
from ...enclosure.engine import ENGINE
from ...statement.machine import CentreErrors, JointErrors
from ..robot.motion_matrix import RankMatrix
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import Family
from ..tolerance.singular_machine import SingularMachine
from ..verdict import Outcome, Regularity
from .covering import APART, Followed, LoopRule, contracted_boxes, coordinates_to_split
from .loop_boxes import Examined, Examiner, LoopBoxes
from .rank_rule import RankTest
from .singular_pose import SingularPose

if TYPE_CHECKING:
    from ...boxes.tree import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Widths of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTHS = 2.0**-24, 2.0**-24

#: Smallest singular value, in parts of the largest, from which Newton's method looks for a singular pose, and most
#: attempts.
_SMALL, _MOST = 0.1, 24
#: Number of boxes after which a singular machine is looked for first; later ones are twice as many each.
_FIRST = 64
#: Part of the value before at which it tries again.
_SMALLER = 0.6
#: Random poses from which Newton's method looks for a singular one, and number of the worst that are tried.
_POSES, _TRIED, _SEED = 2048, 8, 0
#: How a singular pose of Newton's method is known.
BY_NEWTON = "found singular to 1e-10 by Newton's method"

#: Callback with seconds, number of boxes examined, and number of boxes open.
RankProgress = Callable[[float, int, int], None]


class Singular(NamedTuple):
    """A singular pose.

    Attributes:
        y: (6,) its coordinates.
        reason: how it is known, where that is no proof; else empty.
        sides: (2, 6) two poses at which the determinant has opposite signs, without rounding; None without them.
        errors: of the joint centres of the machine that is singular, of six straight legs; None for the design.
        centres: the same for another robot.
    """

    y: FloatArray
    reason: str = ""
    sides: FloatArray | None = None
    errors: JointErrors | None = None
    centres: CentreErrors | None = None


class Refuter(Protocol):
    """Search for a singular pose."""

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose, or None.

        Args:
            found: the boxes that were examined last.
            boxes: number of all that were examined.
        """


class NewtonRefuter:
    """Newton's method from the boxes whose matrices are nearest to a singular one.

    Args:
        problem: the robot.
        matrix: whose rank is judged.
        family: all machines that are meant; None for the design alone.
        is_shown: whether a singular point (n,), or (n + 3 m,) of another machine, is one in home's assembly.
    """

    def __init__(
        self,
        problem: Problem,
        matrix: RankMatrix,
        family: Family | None = None,
        is_shown: Callable[[FloatArray], bool] = lambda _: True,
    ) -> None:
        self._problem, self._family, self._is_shown = problem, family, is_shown
        self._newton = SingularPose(problem, matrix)
        self._machine = None if family is None else SingularMachine(family, family.matrix(matrix))
        self._attempts, self._last = 0, _SMALL
        # Number of boxes from which a singular machine is looked for, although no pose of the design is near to one.
        self._due = _FIRST

    def look(self, found: Examined, boxes: int) -> Singular | None:
        """Return a singular pose from the worst of these boxes."""
        values = np.where(found.is_regular, np.inf, found.smallest)
        order = np.argsort(values)[:2]
        for k in order:
            if not values[k] < self._last or self._attempts >= _MOST:
                break
            self._attempts += 1
            near = self._newton.search(self._middle(found.boxes, k))
            shown = self._if_shown(near)
            if shown is not None:
                return shown
            # A singular pose of another assembly says nothing about where one of home's is.
            self._last = _SMALLER * float(values[k]) if near is None else self._last
        if self._machine is None or boxes < self._due or not np.isfinite(values[order[0]]):
            return None
        self._due = 2 * boxes
        return self._if_shown(self._machine.search(self._middle(found.boxes, order[0])))

    def from_random(self) -> Singular | None:
        """Return a singular pose near random ones, from those with the smallest singular values."""
        points = self._problem.box.random(_POSES, np.random.default_rng(_SEED))[:, list(self._problem.free)]
        values = np.array([self._newton.smallest(each) for each in points])
        worst = [points[k] for k in np.argsort(values)[:_TRIED] if np.isfinite(values[k])]
        searches: list[Callable[[FloatArray], FloatArray | None]] = [self._newton.search]
        if self._machine is not None:
            searches.append(self._machine.search)
        for search in searches:
            for point in worst:
                shown = self._if_shown(search(point))
                if shown is not None:
                    return shown
        return None

    def _if_shown(self, z: FloatArray | None) -> Singular | None:
        """Return a singular pose if it is one in home's assembly: Newton's method may end in another one."""
        return singular_at(self._problem, self._family, z) if z is not None and self._is_shown(z) else None

    def _middle(self, boxes: LoopBoxes, k: np.int64) -> FloatArray:
        """Return a point (n,) in the middle of a box, with closed loops or near them."""
        z: FloatArray = boxes.near[k].copy()
        own = [*self._problem.independent, *self._problem.dependent]
        z[own] = boxes.centre[k, own]
        return z


def singular_at(problem: Problem, family: Family | None, z: FloatArray) -> Singular:
    """Return the singular pose at a point (n,), or (n + 3 m,) of another machine."""
    is_machine = family is not None and len(z) > len(problem.start)
    centres = family.errors_of(z) if family is not None and is_machine else None
    return Singular(frozen_array(problem.pose_of(z), (6,)), BY_NEWTON, centres=centres)


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

    def _contracted(self, boxes: LoopBoxes) -> LoopBoxes:
        """Return boxes contracted to the workspace, and record where they lead."""
        found, kept, beyond = contracted_boxes(self._problem, boxes)
        if self._recorder is not None:
            before, after = (self._ends(each.lower, each.upper) for each in (boxes, found))
            self._recorder.contractions(before, after, ~kept)
            self._recorder.lacks_boxes |= bool(beyond.any())
        return some(found, kept)

    def _ends(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return boxes by the ends of all six coordinates (B, 6): those that follow from others have their range."""
        box, free = self._problem.box, self._problem.free
        low, high = (np.broadcast_to(each, (len(lower), 6)).copy() for each in (box.lower, box.upper))
        for j in self._independent:
            if j < len(free):
                low[:, free[j]], high[:, free[j]] = lower[:, j], upper[:, j]
        return low, high
