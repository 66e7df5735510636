"""Ranks of the matrices of a robot over a workspace: bisection until every box is proved, or a pose is singular."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray, Model, frozen_array
from ....errors import UncoveredError
from ....interruption import one_search
from ...boxes.rows import Boxes, joined, some
from ...boxes.search import TOO_SMALL, Effort, Order, Search, Verdicts
from ...enclosure.engine import ENGINE
from ...statement.claims import CONSTRAINTS, REGULAR
from ...statement.machine import Legs
from ..home_poses import Homes
from ..robot.motion_matrix import RankMatrix
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import NotJudgedError, Problem, build_problem
from ..robot.tolerance_model import ToleranceModel
from ..verdict import Outcome, RankVerdict
from .covering import APART, Followed, LoopRule, coordinates_to_split
from .loop_boxes import Examiner
from .rank_rule import RankTest
from .signs import SignRefuter
from .singular_pose import NewtonRefuter, Refuter, Singular, singular_at

if TYPE_CHECKING:
    from ...boxes.tree import TreeRecord
    from ..proof_writer import PaperRecord

#: Number of boxes examined at once.
_BLOCK = 1024
#: Widths of a box, in parts of the whole box, below which it is not bisected.
_LEAST_WIDTHS = 2.0**-24, 2.0**-24
#: Callback with seconds, number of boxes examined, and number of boxes open.
RankProgress = Callable[[float, int, int], None]


class Ranks(NamedTuple):
    """Verdicts on J, and on the constraint wrenches; None for a robot without them."""

    regular: RankVerdict
    constraints: RankVerdict | None


def prove_ranks(
    model: Model,
    homes: Homes,
    *,
    legs: Legs | None = None,
    progress: RankProgress | None = None,
    paper: PaperRecord | None = None,
) -> Ranks:
    """Prove that J and the constraint wrenches keep their ranks at every pose of a box, or find a pose.

    Args:
        model: the robot, without unknowns that follow in closed form.
        homes: the case, its poses and the machines that are meant.
        legs: joint centres of six straight legs; None for another robot.
        progress: called during them.
        paper: records the searches for a proof.
    """
    try:
        family = None if homes.machines is None else homes.machines.family
        problem = build_problem(homes.case, model, homes.box) if family is None else family.problem
        found = []
        for name, matrix in ((REGULAR, problem.locked), (CONSTRAINTS, problem.unactuated)):
            if matrix is None:
                continue
            recorder = None if paper is None else paper.own(name)
            is_shown = partial(_is_shown, problem, family, homes, constraints=name == CONSTRAINTS)
            newton = partial(NewtonRefuter, problem, matrix, None if legs else family, is_shown)
            refuter = newton() if legs is None else SignRefuter(legs, problem)
            verdict = prove_rank(problem, matrix, family=family, progress=progress, recorder=recorder, refuter=refuter)
            if name == REGULAR and verdict.outcome is Outcome.OPEN and not problem.dependent:
                at = newton().from_random()
                if at is not None:
                    verdict = replace(verdict, outcome=Outcome.REFUTED, y=at.y, reason=at.reason, centres=at.centres)
            found.append(verdict)
    except (UncoveredError, NotJudgedError) as error:
        return Ranks(not_judged(homes.box, str(error)), None)
    return Ranks(found[0], found[1] if len(found) > 1 else None)


def _is_shown(
    problem: Problem, family: ToleranceModel | None, homes: Homes, z: FloatArray, *, constraints: bool
) -> bool:
    """Return whether a singular point, or one of another machine, is singular in home's assembly."""
    at = singular_at(problem, family, z)
    return homes.is_singular(at.y, at.centres, constraints=constraints)


def not_judged(box: PoseBox, reason: str) -> RankVerdict:
    """Return the verdict on a robot that no search covers."""
    return RankVerdict(Outcome.OPEN, box, None, None, "none", 0, 1, 1.0, 0.0, reason)


def prove_rank(
    problem: Problem,
    matrix: RankMatrix,
    *,
    family: ToleranceModel | None = None,
    time_limit: float | None = None,
    most_boxes: int | None = None,
    progress: RankProgress | None = None,
    recorder: TreeRecord | None = None,
    refuter: Refuter | None = None,
) -> RankVerdict:
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
    return RankVerdict(
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
        family: ToleranceModel | None,
        recorder: TreeRecord | None,
        refuter: Refuter,
    ) -> None:
        test = RankTest(matrix, problem.z, problem.start)
        if family is not None:
            test = RankTest(family.matrix(matrix), family.coordinates, family.start)
        super().__init__(problem, Examiner(problem, test, family), recorder)
        self.singular: Singular | None = None
        self._refuter, self._examined = refuter, 0

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
