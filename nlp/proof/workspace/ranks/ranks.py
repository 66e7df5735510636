"""Ranks of the matrices of a robot over a workspace: bisection until every box is proved, or a pose is singular."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ....errors import UncoveredError
from ....interruption import one_search
from ...boxes.search import TOO_SMALL, Boxes, BoxResults, Effort, Order, joined, some
from ...statement.claims import CONSTRAINTS, RANKS, REGULAR
from ..robot.posed_model import RankMatrix
from ..robot.posed_robot import Problem
from ..verdict import Outcome, Verdict, not_judged
from .loop_boxes import APART, Examined, Examiner, Followed, LoopRule, coordinates_to_split
from .rank_rule import RankTest
from .singular_pose import Singular, SingularSearch

if TYPE_CHECKING:
    from ...boxes.tree import TreeRecord
    from ..proof_record import ProofRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Callback with seconds, number of examined boxes, and number of open boxes.
RankProgress = Callable[[float, int, int], None]
#: Search for a singular pose from the boxes that were examined last, and the number of all examined boxes.
Look = Callable[[Examined, int], Singular | None]
#: Whether J, or the constraint wrenches, lose their rank at a pose (6,) of the robot with joint-centre errors.
IsSingular = Callable[..., bool]


def prove_ranks(
    problem: Problem,
    is_singular: IsSingular,
    *,
    rank: int = 6,
    progress: RankProgress | None = None,
    record: ProofRecord | None = None,
) -> tuple[Verdict, ...]:
    """Prove that J and the constraint wrenches keep their ranks at every pose of a box, or find a singular pose.

    Args:
        problem: the nominal robot, or all robots within the tolerance.
        is_singular: function that tests a single pose in the home assembly mode; only such poses refute a claim.
        rank: rank of J at almost all dimensions and poses.
        progress: function that is called during the searches.
        record: recorder of the searches for a proof file.

    Returns:
        The verdict on J, and on the constraint wrenches if the robot has any.
    """
    found = []
    try:
        for name, matrix in ((REGULAR, problem.locked), (CONSTRAINTS, problem.unactuated)):
            if matrix is None:
                continue

            def is_shown(at: Singular, *, constraints: bool = name == CONSTRAINTS) -> bool:
                return is_singular(at.y, at.errors, constraints=constraints)

            recorder, search = None if record is None else record.tree(name), SingularSearch(problem, matrix, is_shown)
            at_start = search.everywhere() if name == REGULAR and rank < 6 else None
            if at_start is not None:
                found.append(_refuted(not_judged(name, at_start.reason), problem, at_start))
                continue
            verdict = prove_rank(problem, matrix, name, progress=progress, recorder=recorder, look=search.look)
            if name == REGULAR and verdict.outcome is Outcome.OPEN and not problem.dependent:
                verdict = _refuted(verdict, problem, search.from_random())
            found.append(verdict)
    except UncoveredError as error:
        return (not_judged(REGULAR, str(error)),)
    return tuple(found)


def _refuted(verdict: Verdict, problem: Problem, at: Singular | None) -> Verdict:
    """Return a verdict as refuted by a singular pose; without a pose, the verdict stays the same."""
    if at is None:
        return verdict
    pose = problem.box.pose(at.y)
    return replace(verdict, outcome=Outcome.REFUTED, pose=pose, reason=at.reason, sides=at.sides, errors=at.errors)


def prove_rank(
    problem: Problem,
    matrix: RankMatrix,
    name: str = REGULAR,
    *,
    most_boxes: int | None = None,
    progress: RankProgress | None = None,
    recorder: TreeRecord | None = None,
    look: Look | None = None,
) -> Verdict:
    """Prove that a matrix keeps its rank at every pose of a workspace, or find a singular pose.

    Args:
        problem: the robot.
        matrix: one of the robot's two matrices.
        name: name of the claim.
        most_boxes: number of boxes after which the search stops.
        progress: function that is called about ten times a second.
        recorder: recorder of the boxes for a proof.
        look: function that searches examined boxes for singular poses; if left out, a new :class:`.SingularSearch`.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
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
        varying, boxes = np.flatnonzero(rule.whole > 0), joined(left)
        widths = (boxes.upper - boxes.lower)[:, varying] / rule.whole[varying]
        share = float(widths.prod(axis=1).sum())
        widest = int(np.argmax(widths.max(axis=1, initial=0.0)))
        centre = 0.5 * boxes.lower[widest] + 0.5 * boxes.upper[widest]
        y = problem.pose_of(np.where(np.isfinite(centre), centre, boxes.more.near[widest]))
    elif reason:
        y = problem.pose_of(problem.start)
    verdict = Verdict(
        RANKS[name],
        Outcome.PROVED if y is None else Outcome.OPEN,
        pose=None if y is None else problem.box.pose(y),
        reason=reason,
        boxes=search.boxes,
        open=search.left,
        share=share,
        seconds=effort.seconds,
    )
    return _refuted(verdict, problem, rule.singular)


class RankRule(LoopRule):
    """Rule for the rank of a matrix.

    Args:
        problem, matrix, recorder, look: arguments of :func:`prove_rank`.

    Attributes:
        singular: singular pose; None if no singular pose is known yet.
    """

    block = _BLOCK

    def __init__(self, problem: Problem, matrix: RankMatrix, recorder: TreeRecord | None, look: Look) -> None:
        super().__init__(problem, Examiner(problem, RankTest(matrix, problem.z, problem.start)), recorder)
        self.singular: Singular | None = None
        self._more, self._columns = np.zeros((1, len(self._independent))), matrix.matrix.shape[1]
        self._look, self._examined = look, 0

    def examine(self, boxes: Boxes[Followed]) -> BoxResults[Followed]:
        """Return the boxes over which full rank is not proved."""
        found = self.examined(boxes)
        count = len(found.is_regular)
        self._examined += count
        if count:
            self.singular = self._look(found, self._examined)
        found = some(found, np.flatnonzero(~found.is_regular))
        split = coordinates_to_split(found.shares, self.widths(found.boxes))
        return BoxResults(self.boxes_of(found, np.zeros(len(split)), split, found.shares), 0.0, count)

    def divided(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves of boxes; quarters if the first-order terms show that a half fails the rank test."""
        parts = super().divided(boxes)
        if self._problem.dependent:
            return parts
        # With the positive vector of the box, all shares add up to the sum of the row sums.
        shares = parts.more.more
        shares[np.arange(len(shares)), parts.split] *= 0.5
        fails = shares.sum(axis=1) >= self._columns
        if not fails.any():
            return parts
        halves = some(parts, fails)
        split = coordinates_to_split(halves.more.more, self.widths(halves))
        return joined([some(parts, ~fails), super().divided(halves._replace(split=split))])
