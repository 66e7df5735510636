"""Ranks of the matrices of a robot over a workspace: bisection until every box is proved, or a pose is singular."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import frozen_array
from ....errors import UncoveredError
from ....interruption import one_search
from ...boxes.search import TOO_SMALL, Boxes, Effort, Order, Verdicts, joined, some
from ...enclosure.engine import ENGINE
from ...statement.claims import CONSTRAINTS, REGULAR
from ..robot.pose_box import PoseBox
from ..robot.posed_model import RankMatrix
from ..robot.posed_robot import Problem
from ..verdict import Outcome, RankVerdict
from .loop_boxes import APART, Examined, Examiner, Followed, LoopRule, coordinates_to_split
from .rank_rule import RankTest
from .singular_pose import Singular, SingularSearch

if TYPE_CHECKING:
    from ...boxes.tree import TreeRecord
    from ..paper_record import PaperRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Callback with seconds, number of boxes examined, and number of boxes open.
RankProgress = Callable[[float, int, int], None]
#: Search for a singular pose from the boxes that were examined last, and the number of all.
Look = Callable[[Examined, int], Singular | None]
#: Whether J, or the constraint wrenches, lose their rank at a pose (6,) of the machine with errors of joint centres.
IsSingular = Callable[..., bool]


class Ranks(NamedTuple):
    """Verdicts on J, and on the constraint wrenches; None for a robot without them."""

    regular: RankVerdict
    constraints: RankVerdict | None


def prove_ranks(
    problem: Problem,
    is_singular: IsSingular,
    *,
    rank: int = 6,
    progress: RankProgress | None = None,
    paper: PaperRecord | None = None,
) -> Ranks:
    """Prove that J and the constraint wrenches keep their ranks at every pose of a box, or find a pose.

    Args:
        problem: the design, or all machines that are meant.
        is_singular: shows single poses, in home's assembly; others refute nothing.
        rank: of J at almost all dimensions and poses.
        progress: called during them.
        paper: records the searches for a proof.
    """
    found = []
    try:
        for name, matrix in ((REGULAR, problem.locked), (CONSTRAINTS, problem.unactuated)):
            if matrix is None:
                continue

            def is_shown(at: Singular, *, constraints: bool = name == CONSTRAINTS) -> bool:
                return is_singular(at.y, at.errors, constraints=constraints)

            recorder, search = None if paper is None else paper.own(name), SingularSearch(problem, matrix, is_shown)
            at_start = search.everywhere() if name == REGULAR and rank < 6 else None
            if at_start is not None:
                found.append(_refuted(not_judged(problem.box, at_start.reason), at_start))
                continue
            verdict = prove_rank(problem, matrix, progress=progress, recorder=recorder, look=search.look)
            if name == REGULAR and verdict.outcome is Outcome.OPEN and not problem.dependent:
                verdict = _refuted(verdict, search.from_random())
            found.append(verdict)
    except UncoveredError as error:
        return Ranks(not_judged(problem.box, str(error)), None)
    return Ranks(found[0], found[1] if len(found) > 1 else None)


def _refuted(verdict: RankVerdict, at: Singular | None) -> RankVerdict:
    """Return a verdict that a singular pose refutes; the same without one."""
    if at is None:
        return verdict
    return replace(verdict, outcome=Outcome.REFUTED, y=at.y, reason=at.reason, sides=at.sides, errors=at.errors)


def not_judged(box: PoseBox, reason: str) -> RankVerdict:
    """Return the verdict on a robot that no search covers."""
    return RankVerdict(Outcome.OPEN, box, None, None, "none", 0, 1, 1.0, 0.0, reason)


def prove_rank(
    problem: Problem,
    matrix: RankMatrix,
    *,
    most_boxes: int | None = None,
    progress: RankProgress | None = None,
    recorder: TreeRecord | None = None,
    look: Look | None = None,
) -> RankVerdict:
    """Prove that a matrix keeps its rank at every pose of a workspace, or find a pose at which it does not.

    Args:
        problem: the robot.
        matrix: one of its two matrices.
        most_boxes: number of boxes after which it stops.
        progress: called about ten times a second.
        recorder: records the boxes for a proof.
        look: looks for singular poses; a search of its own if left out.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    effort = Effort(most_boxes)
    with one_search():
        rule = RankRule(problem, matrix, recorder, look or SingularSearch(problem, matrix).look)
        search = rule.search(Order.NEWEST)

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
    left, y, share = [] if rule.singular else search.state.left, None, 0.0
    if left:
        own, boxes = np.flatnonzero(rule.whole > 0), joined(left)
        widths = (boxes.upper - boxes.lower)[:, own] / rule.whole[own]
        share = float(widths.prod(axis=1).sum())
        widest = int(np.argmax(widths.max(axis=1, initial=0.0)))
        centre = 0.5 * boxes.lower[widest] + 0.5 * boxes.upper[widest]
        y = problem.pose_of(np.where(np.isfinite(centre), centre, boxes.more.near[widest]))
    elif reason:
        y = problem.pose_of(problem.start)
    outcome, at = (Outcome.PROVED, None) if y is None else (Outcome.OPEN, frozen_array(y, (6,)))
    numbers = search.boxes, search.left, share, effort.seconds, reason
    return _refuted(RankVerdict(outcome, problem.box, at, None, ENGINE, *numbers), rule.singular)


class RankRule(LoopRule):
    """Rule of the rank of a matrix.

    Args:
        problem, matrix, recorder, look: as in :func:`prove_rank`.

    Attributes:
        singular: a singular pose; None while none is known.
    """

    block = _BLOCK

    def __init__(self, problem: Problem, matrix: RankMatrix, recorder: TreeRecord | None, look: Look) -> None:
        super().__init__(problem, Examiner(problem, RankTest(matrix, problem.z, problem.start)), recorder)
        self.singular: Singular | None = None
        self._more, self._columns = np.zeros((1, len(self._independent))), matrix.matrix.shape[1]
        self._look, self._examined = look, 0

    def examine(self, boxes: Boxes[Followed]) -> Verdicts[Followed]:
        """Return the boxes over which the rank is not proved to be full."""
        found = self.examined(boxes)
        count = len(found.is_regular)
        self._examined += count
        if count:
            self.singular = self._look(found, self._examined)
        found = some(found, np.flatnonzero(~found.is_regular))
        split = coordinates_to_split(found.shares, self.widths(found.boxes))
        return Verdicts(self.boxes_of(found, np.zeros(len(split)), split, found.shares), 0.0, count)

    def divided(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves of boxes, and the quarters where a half would fail by its linear part alone."""
        parts = super().divided(boxes)
        if self._problem.dependent:
            return parts
        # With the positive vector of the box, the sum of all shares is that of as many row sums as there are columns.
        shares = parts.more.more
        shares[np.arange(len(shares)), parts.split] *= 0.5
        fails = shares.sum(axis=1) >= self._columns
        if not fails.any():
            return parts
        halves = some(parts, fails)
        split = coordinates_to_split(halves.more.more, self.widths(halves))
        return joined([some(parts, ~fails), super().divided(halves._replace(split=split))])
