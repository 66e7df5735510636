"""Judgement of a robot over a box of poses.

Expressions of the pose are bounded by the search of ``certify`` or by the search of boxes; ``expressions`` chooses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ....models import FloatArray
from ....models.joints.model.closedform import closed_form
from ...case.case import Case
from ...case.workspace import Workspace
from ...interruption import one_call, within
from ..enclosure.engine import kernel
from ..statement.claims import REACH, REGULAR, SPECTRAL, Claim, claims_of, dependent_claims
from ..statement.fixed_robot import check_leg_error, has_straight_legs, workspace_of_case
from ..statement.posed_layout import closed_layout, posed_layout, reach_claims
from ..statement.tolerance import Directions, coordinate_layout, length_of_one_robot
from .home_poses import Homes
from .judgement import Judgement
from .judging import Judging
from .numbers.bound_search import Minimum
from .numbers.expressions import Expressions
from .numbers.extremes import GAP, NumberSearch, goal_of, prove_extreme, verdict_of
from .numbers.pose_error import pose_errors
from .numbers.searched import Subject, motor_extremes
from .numbers.within_tolerance import RobotsWithinTolerance
from .ranks.ranks import RankProgress, prove_ranks
from .robot.pose_box import pose_box, pose_coordinates
from .robot.posed_robot import NotJudgedError, Problem, build_problem
from .verdict import Outcome, Verdict, not_judged

if TYPE_CHECKING:
    from .proof_record import ProofRecord

#: Default time limit of all searches together, in seconds; singular values in six dimensions would take longer. Each
#: search
#: takes at most half of the time left.
TIME_LIMIT = 60.0
_PART = 0.5
#: First gap of the recorded search of a limit that is known to be satisfied; the search reduces it if necessary.
_AS_NEEDED = 1.0
#: Number of sampled poses, of random corners as well.
_SAMPLES, _SEED = 1000, 0
#: Reason for quantities of a robot that may not reach all poses.
_OUT_OF_REACH = "not proved: a robot within the joint-centre tolerance may not reach every pose"
#: Function that is called before each quantity, with the name of the quantity, the number of completed quantities of
#: this kind, and the number of all.
Progress = Callable[[str, int, int], None]


@one_call
def judge_workspace(
    case: Case,
    *,
    workspace: Workspace | None = None,
    quantities: Sequence[str] = (),
    gap: float = GAP,
    time_limit: float | None = TIME_LIMIT,
    jobs: int | None = None,
    with_limits: bool = True,
    with_objective: bool = True,
    until_fault: bool = False,
    leg_error: float = 0.0,
    rank_progress: RankProgress | None = None,
    progress: Progress | None = None,
    record: ProofRecord | None = None,
) -> Judgement:
    """Judge a robot over a box of poses: prove full rank and all limits, or find a pose that refutes a claim.

    Args:
        case: case with fixed dimensions.
        workspace: box of poses; the workspace of the case if left out.
        quantities: names of quantities of the robot whose smallest and largest values are requested.
        gap: largest relative gap between the bound and the best known value.
        time_limit: seconds for all searches together; None for no limit. At the limit, searches stop with their present
            bounds. A search takes at most half of the remaining time; searches of actuators take equal shares of the
            remaining time.
        jobs: number of threads.
        with_limits: If false, judge only ranks.
        with_objective: If true, bound F of each task, and quantities of actuators without a limit.
        until_fault: If true, stop at the first claim about a rank or limit that is not proved.
        leg_error: largest leg-length error, length. If this error or the joint-centre tolerance is not 0 and
            ``with_objective`` is true, pose errors are bounded.
        rank_progress: function that is called during the search for singular poses.
        progress: function that is called before each quantity.
        record: recorder of the searches for a proof file.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
        InputError: the robot has no quantity of a requested name, the leg error is negative or does not apply to this
            robot, or the C kernel was not built.
    """
    workspace = workspace_of_case(case if workspace is None else replace(case, workspace=workspace))
    kernel()  # fails at once if it is missing
    check_leg_error(case, leg_error)
    search = NumberSearch(gap, jobs, record)
    with within(time_limit, _PART):
        judging = _OverBox(case, workspace, quantities, search, until_fault=until_fault)
        judging.with_objective, judging.leg_error = with_objective, leg_error
        judging.progress, judging.rank_progress = progress, rank_progress
        return judging.judgement(with_numbers=with_limits)


class _OverBox(Judging):
    """Judgement of a robot over a box of poses, in progress.

    Attributes:
        with_objective, leg_error, progress, rank_progress: arguments of :func:`judge_workspace`.
    """

    with_objective, leg_error = True, 0.0
    progress: Progress | None = None
    rank_progress: RankProgress | None = None

    def __init__(
        self, case: Case, workspace: Workspace, measures: Sequence[str], search: NumberSearch, *, until_fault: bool
    ) -> None:
        super().__init__(case, workspace, measures, search, until_fault=until_fault)
        self._box, self._closed = pose_box(workspace), closed_form(case.model)
        self._names = [name for name in measures if name not in SPECTRAL]
        # Robots within the tolerance; None without a tolerance.
        self._robots: RobotsWithinTolerance | None = None
        self._problem: Problem | None = None
        # The design; made when it is needed.
        self._exact: RobotsWithinTolerance | None = None
        self._reason = ""
        try:
            design = build_problem(case, self._closed.model, self._box)
            if case.joint_centre_tolerance:
                self._robots = RobotsWithinTolerance(case, self._closed, design)
            self._problem = design if self._robots is None else self._robots.family
        except NotJudgedError as error:
            self._reason = str(error)
        self._homes = Homes(case, self._box, self._names, self._robots)
        # Function that proves a claim about a leg length with a smaller gap; the search of the leg lengths sets it.
        self._prove: Callable[[Claim, NumberSearch], Verdict] | None = None

    def sampled_fault(self) -> Verdict | None:
        """Return the first limit that a sampled pose violates; None if none is found, or for loops without closed form.

        Where limbs do not reach some poses, ranks have no bound, and their search would not end.
        """
        design = None if self._problem is None else self._problem.problem
        if design is None or design.dependent:
            return None
        robots = self._robots or self._design_robots(design)
        reaches, claims = robots.symbols.claims([], with_objective=False)
        limited = [each for each in (*reaches, *claims) if each.limit is not None]
        if not limited:
            return None
        family, rng = robots.family, np.random.default_rng(_SEED)
        poses = self._box.random(_SAMPLES, rng)
        y = np.concatenate([poses, self._box.clipped(np.where(rng.uniform(size=poses.shape) < 0.5, *self._ends))])
        points, goals = family.exact(y[:, list(family.free)]), [goal_of(each) for each in limited]
        with np.errstate(all="ignore"):
            values = Expressions(family, ca.vertcat(*map(robots.number, limited))).values(points)
        beyond = np.array([(goal.limit or 0.0) - goal.slack for goal in goals]) - values
        beyond = np.where(np.isfinite(beyond), beyond, -np.inf)
        for k, claim in enumerate(limited):
            at = int(beyond[:, k].argmax())
            if beyond[at, k] > 0:
                found = Minimum(value=float(values[at, k]), at=points[at])
                return verdict_of(claim, found, family.box.pose(family.pose_of(points[at])))
        return None

    def _design_robots(self, design: Problem) -> RobotsWithinTolerance:
        """Return the nominal robot as the set of robots within a tolerance of 0."""
        if self._exact is None:
            self._exact = RobotsWithinTolerance(self.case, self._closed, design)
        return self._exact

    @property
    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Ends of the box."""
        return self._box.lower, self._box.upper

    def ranks(self) -> Iterator[Verdict]:
        """Yield the verdicts on ranks."""
        if self._problem is None:
            yield not_judged(REGULAR, self._reason)
            return
        is_singular, rank = self._homes.is_singular, self.case.model.rank
        yield from prove_ranks(
            self._problem, is_singular, rank=rank, progress=self.rank_progress, record=self.search.record
        )

    def shown(self, verdict: Verdict) -> Verdict:
        """Return a verdict with the value of the quantity in the home assembly mode."""
        return verdict if verdict.is_rank else self._homes.shown(verdict)

    def subject(self, shortest: float) -> Subject:
        """Return the robot for the searches of clearances, singular values and actuator quantities."""
        return Subject(self.case, self._closed.model, self._problem, self._reason, shortest)

    def actuators(self, subject: Subject) -> Iterator[Verdict]:
        """Yield the verdicts on actuator forces, speeds and powers, and on pose errors."""
        yield from motor_extremes(subject, with_all=self.with_objective, record=self.search.record)
        if has_straight_legs(self.case.model) and self.with_objective:
            yield from pose_errors(subject, self.leg_error, self.search.record)

    def expressions(self) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of the pose."""
        if self._robots is not None:
            yield from self._within_tolerance(self._robots)
        elif self.workspace.dependent or self.workspace.position_set is not None:
            # Only the search of boxes follows loops to dependent coordinates, and contracts boxes to a set.
            yield from self._followed(self._problem)
        else:
            yield from self._of_design()

    def _within_tolerance(self, robots: RobotsWithinTolerance) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of all robots within the tolerance."""
        reaches, claims = robots.symbols.claims(self._names, with_objective=self.with_objective)
        dependent = dependent_claims(robots.symbols.layout.robots[0], self.workspace)
        yield from self._proved([*reaches, *dependent], robots.extreme)
        if any(each.fails and each.key == REACH for each in self.verdicts.values()):
            yield from (verdict_of(claim, Minimum(reason=_OUT_OF_REACH)) for claim in claims)
        else:
            yield from self._proved(claims, robots.extreme)

    def _of_design(self) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of the nominal robot."""
        case, closed, workspace = self.case, self._closed, self.workspace
        if closed.reaches:
            layout, reaches = reach_claims(case, closed, workspace)
            yield from self._proved(reaches, partial(prove_extreme, layout))
        is_reached = not any(each.fails for each in self.verdicts.values() if not each.is_rank)
        # Closed forms reduce the number of coordinates. The loop equations of a limb that may not reach a pose are
        # kept.
        is_closed = closed.reaches and is_reached
        layout = closed_layout(case, closed, workspace) if is_closed else posed_layout(case, workspace)
        claims = claims_of(layout, self._names, with_objective=self.with_objective)
        is_together = bool(closed.model.unknowns) or (self.until_fault and is_reached)
        decided = self._in_home(self._problem, is_reached=is_reached) if self._problem and is_together else ()
        yield from self._proved(claims, partial(prove_extreme, layout), decided)

    def _followed(self, design: Problem | None) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of a robot with dependent coordinates, in the home assembly mode.

        Only this search is restricted to poses that the robot can reach.
        """
        if design is None:
            layout = coordinate_layout(self.case, pose_coordinates(self._box))
            claims = [
                *dependent_claims(layout.robots[0], self.workspace),
                *claims_of(layout, self._names, with_objective=False),
            ]
            yield from (verdict_of(claim, Minimum(reason=self._reason)) for claim in claims)
            return
        robots = self._design_robots(design)
        reaches, claims = robots.symbols.claims(self._names, with_objective=self.with_objective)
        # The range of a dependent coordinate is a result, however wide its limits are.
        every = [*reaches, *dependent_claims(robots.symbols.layout.robots[0], self.workspace), *claims]
        limited = [claim for claim in (*reaches, *claims) if claim.limit is not None]
        decided = (each for each in robots.followed(limited, self.search.gap) if each.outcome is not Outcome.OPEN)
        yield from self._proved(every, robots.extreme, decided)

    def _in_home(self, design: Problem, *, is_reached: bool) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of a robot with loops, decided in the home assembly mode.

        In a nonlinear program, loop equations as constraints admit every assembly mode, and F is unbounded if one of
        these modes is singular. This search follows the loops in the home assembly mode only.
        """
        robots = self._design_robots(design)
        claims = robots.symbols.claims(self._names, with_objective=self.with_objective)[1]
        limited = robots.followed([claim for claim in claims if claim.limit is not None], self.search.gap)
        yield from (each for each in limited if each.outcome is not Outcome.OPEN)
        for claim in claims if is_reached and self._closed.model.unknowns else ():
            if claim.limit is None:
                yield robots.extreme(claim, replace(self.search, record=None))

    def _proved(
        self, claims: Sequence[Claim], prove: Callable[[Claim, NumberSearch], Verdict], decided: Iterable[Verdict] = ()
    ) -> Iterator[Verdict]:
        """Yield the verdicts on claims. Claims that are already decided are searched again only for a proof file."""
        self._prove = prove
        # A proof for the nominal robot does not cover other robots within the tolerance.
        uncovered = self._reason if self.case.joint_centre_tolerance else ""
        known = {(each.name, each.sense, each.key): each for each in decided}
        for done, claim in enumerate(replace(each, uncovered=uncovered) for each in claims):
            if self.progress is not None:
                self.progress(claim.name, done, len(claims))
            verdict = known.get((claim.name, claim.sense, claim.key))
            is_limit = verdict is not None and verdict.limit is not None
            is_refuted = is_limit and verdict is not None and verdict.outcome is not Outcome.PROVED
            if verdict is None or (self.search.record is not None and not is_refuted):
                again = prove(claim, replace(self.search, gap=_AS_NEEDED) if is_limit else self.search)
                verdict = verdict or again
            yield replace(verdict, claim=claim)

    def finer(self, claim: Claim, gap: float, about: Directions | None) -> Verdict | None:
        """Return the verdict on a leg length with a smaller gap."""
        search, robots = replace(self.search, gap=gap), self._robots
        if self._prove is None or (about is not None and robots is None):
            return None
        if about is None or robots is None:
            return self._prove(claim, search)
        (leg,), record = claim.legs, search.record
        of_one = length_of_one_robot(robots.symbols, leg, claim.sense, about)
        if record is not None:
            record.directions[of_one.name] = about
        return self._prove(of_one, search)
