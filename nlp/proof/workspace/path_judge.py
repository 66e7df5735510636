"""Judgement of a robot along a tool path.

The claims are the same as over a box of poses. Boxes cover pieces of the path; these pieces are bisected. Values are
computed at points of the path. With a joint-centre tolerance, the claims cover every robot within the tolerance.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import casadi as ca

from ...case.case import Case
from ...case.checks import check_determined_joints
from ...case.motors import ActuatorQuantity
from ...case.workspace import Workspace
from ...errors import UncoveredError
from ...interruption import one_call, within
from ...path.path import ProgrammedPath
from ...path.settings import case_along
from ...program.layout import robot_length
from ..boxes.search import TOO_SMALL
from ..enclosure.engine import kernel
from ..statement.claims import ACTUATED, CONSTRAINTS, REGULAR, Claim, ClaimKind, dependent_claims
from ..statement.fixed_robot import check_changing
from ..statement.motors import in_motion, in_path_motion, motor_claims
from ..statement.tolerance import Directions
from .judgement import Judgement
from .judging import Judging
from .numbers.bound_search import Minimum, Number
from .numbers.expressions import Expressions
from .numbers.extremes import NumberSearch, verdict_of
from .numbers.motors import Motors
from .numbers.searched import Subject, motor_extremes
from .numbers.within_tolerance import RobotsWithinTolerance
from .path_closing import closed_form_along
from .path_domain import covered, design_along, with_dependent
from .path_faults import first_faults, refuted
from .path_knots import Sampling, knots_of
from .path_motion import speeds_on_path
from .path_ranks import rank_along, rank_at_start
from .proof_record import ProofRecord
from .robot.path_cover import PathCover
from .robot.posed_robot import NotJudgedError
from .verdict import Fault, Verdict, not_judged

#: Default time limit of a judgement, in seconds.
TIME_LIMIT = 600.0
#: Largest fraction of the remaining time for one search; and relative gap of a quantity without a limit.
_PART, GAP = 0.5, 1e-3
#: Reason for quantities with an operation without an interval rule.
_NO_RULE = "its expression contains an operation without an interval rule"


@one_call
def judge_path(
    case: Case,
    path: ProgrammedPath,
    *,
    gap: float = GAP,
    time_limit: float | None = TIME_LIMIT,
    sampling: Sampling | None = None,
    limits_only: bool = False,
    progress: Callable[[str], None] | None = None,
    record: ProofRecord | None = None,
) -> Judgement:
    """Judge a robot at every point of a path.

    Args:
        case: the robot and its limits; poses and workspace of the case are not used.
        path: the tool path, in the case's unit of length.
        gap: largest relative gap of a quantity without a limit.
        time_limit: seconds for all searches together; None for no limit.
        sampling: rule for the knots of the path; None for no knots.
        limits_only: If true, omit actuator quantities that have no limit.
        progress: function that is called with the name of the next step.
        record: recorder of the searches for a proof file.

    Raises:
        CaseError: a dimension of the robot is free, or limits need a motion that neither the case nor the path states.
        InputError: rotations of the path are not supported, the C kernel was not built, or there are too many knots. Or
            knots are requested for a robot whose actuator positions are not known.
    """
    cover, box, workspace = covered(path, robot_length(case))
    case = replace(case_along(case, path.settings), workspace=workspace)
    case.refuse_settings("along a path, settings that move change the speeds of the actuators")
    check_changing(case, path.settings.names)
    check_determined_joints(case.model, "path", case.source)
    if not path.is_timed:
        case.require_motion(", or a path that states times")
    moving = in_motion(case) if case.without_motion else case
    kernel()
    report = progress or (lambda _: None)
    with within(time_limit, _PART):
        knots = None
        if sampling is not None:
            report("knots")
            knots = knots_of(moving, path, cover, workspace, sampling)
        closed, robots, reason = closed_form_along(moving, path), None, ""
        try:
            box, workspace = with_dependent(moving, box, workspace)
            moving = replace(moving, workspace=workspace)
            robots = RobotsWithinTolerance(moving, closed, design_along(moving, closed, box, cover))
        except NotJudgedError as error:
            reason = str(error)
        judging = _AlongPath(moving, workspace, robots, cover, NumberSearch(gap, record=record))
        judging.is_timed, judging.with_all, judging.reason, judging.report = (
            path.is_timed,
            not limits_only,
            reason,
            report,
        )
        found = judging.judgement()
    return replace(found, case=replace(case, workspace=workspace), tool_path=path, knots=knots)


class _AlongPath(Judging):
    """Judgement of a robot along a tool path, in progress.

    Args:
        case: the case, with a motion.
        workspace: box that contains the path.
        robots: robots within the tolerance; None if these robots are not judged.
        cover: boxes of the path.
        search: requested gap, threads, and recorder for a proof file.

    Attributes:
        is_timed: whether the path states times.
        with_all: whether quantities of actuators without a limit are judged too.
        reason: reason why the robot is not judged; otherwise empty.
        report: function that is called with the name of the next step.
    """

    is_timed, with_all, reason = False, True, ""
    report: Callable[[str], None]

    def __init__(
        self,
        case: Case,
        workspace: Workspace,
        robots: RobotsWithinTolerance | None,
        cover: PathCover,
        search: NumberSearch,
    ) -> None:
        super().__init__(case, workspace, search=search)
        self._within_tolerance, self._cover = robots, cover
        self._faults: dict[Claim, Fault] = {}
        if search.record is not None:
            search.record.pieces = cover.pieces
        self.has_numbers = robots is not None

    @property
    def _robots(self) -> RobotsWithinTolerance:
        """Robots within the tolerance.

        Raises:
            NotJudgedError: the robots are not judged.
        """
        if self._within_tolerance is None:
            raise NotJudgedError(self.reason)
        return self._within_tolerance

    def ranks(self) -> Iterator[Verdict]:
        """Yield the verdicts on ranks."""
        if self._within_tolerance is None:
            yield not_judged(REGULAR, self.reason)
            return
        family, cover = self._within_tolerance.family, self._cover
        for name, matrix in ((REGULAR, family.locked), (CONSTRAINTS, family.unactuated)):
            if matrix is not None:
                self.report(name)
                if self.case.model.rank < 6 and name == REGULAR:
                    yield rank_at_start(family, matrix, cover)
                    continue
                recorder = None if self.search.record is None else self.search.record.tree(name)
                yield rank_along(family, matrix, name, cover, recorder)

    def expressions(self) -> Iterator[Verdict]:
        """Yield the verdicts on expressions of the pose."""
        self.report("limits")
        robots = self._robots
        measures = (*ACTUATED, "leg_length") if self.with_all else ()
        names = [item.name for item in self.case.model.quantities if item.name in measures]
        reaches, claims = robots.symbols.claims(names, with_objective=False)
        claims += dependent_claims(robots.symbols.layout.robots[0], self.workspace)
        for group in (reaches, claims):
            found = self._searched(group)
            wrong = list(refuted(found).values())
            if wrong:
                numbers = Expressions(robots.family, ca.vertcat(*[robots.number(each.claim) for each in wrong]))
                self._keep_faults(numbers, dict(enumerate(wrong)))
            yield from found

    def subject(self, shortest: float) -> Subject:
        """Return the robot for the searches of clearances, singular values and actuator quantities."""
        robots = self._robots
        return Subject(self.case, robots.model, robots.family, "", shortest)

    def actuators(self, subject: Subject) -> Iterator[Verdict]:
        """Yield the verdicts on actuators; if the path has times, its motion replaces the motion of the case."""
        for each in refuted(list(self.verdicts.values())).values():
            if each.claim.kind in (ClaimKind.CLEARANCE, ClaimKind.SPECTRUM):
                self._keep_faults(subject.number(each.claim), {0: each})
        self.report("actuators")
        if not self.is_timed:
            yield from self._motors(subject)
            return
        # A path with times defines the motion for powers, even if the case states another motion.
        speeds, case = speeds_on_path(self._robots, self._cover, self.search.gap, self.search.record), subject.case
        yield from speeds.verdicts
        moving = in_path_motion(case)
        if speeds.number is not None:
            self._keep_faults(speeds.number, refuted(speeds.verdicts))
            subject = replace(subject, case=moving, family=speeds.number.problem)
        else:
            subject = replace(subject, case=replace(moving, loading=moving.loading._replace(motion=None)))
        yield from self._motors(subject, {each.motor.actuator: each.bound for each in speeds.verdicts if each.motor})
        if speeds.number is None:
            powers = [
                each for each in motor_claims(moving) if each.motor and each.motor.number is ActuatorQuantity.POWER
            ]
            reason = speeds.verdicts[0].reason
            yield from (verdict_of(each, Minimum(reason=reason)) for each in powers if each.limit is not None)

    def finer(self, claim: Claim, gap: float, about: Directions | None) -> Verdict | None:
        """Return the verdict on a leg length with a smaller gap; None if ``about`` states directions."""
        search = replace(self.search, gap=gap)
        return None if about is not None else self._robots.searched([claim], search, is_enough=False)[0]

    def shown(self, verdict: Verdict) -> Verdict:
        """Return a verdict with the first known point that refutes it."""
        return replace(verdict, fault=self._faults.get(verdict.claim))

    def _keep_faults(self, numbers: Number, wrong: Mapping[int, Verdict]) -> None:
        """Store the first known points of the path that refute limits."""
        self._faults |= first_faults(numbers, wrong, self._cover)

    def _motors(self, subject: Subject, speeds: Mapping[str, float] | None = None) -> Iterator[Verdict]:
        """Yield the verdicts on actuator forces, powers and speeds in any direction, and store violations."""
        found = list(motor_extremes(subject, with_all=self.with_all, speeds=speeds, record=self.search.record))
        yield from found
        for _, group in itertools.groupby(refuted(found).values(), lambda each: each.motor and each.motor.place):
            wrong = list(group)
            if subject.family is not None:
                numbers = Motors(subject.family, subject.case, [each.claim for each in wrong])
                self._keep_faults(numbers, dict(enumerate(wrong)))

    def _searched(self, claims: Sequence[Claim]) -> list[Verdict]:
        """Return the verdicts on quantities by one search; quantities without interval rules stay open."""
        robots, search, reason = self._robots, self.search, _NO_RULE
        covered = [claim for claim in claims if robots.is_covered(claim)]
        found = dict[Claim, Verdict]()
        try:
            found = dict(zip(covered, robots.searched(covered, search) if covered else [], strict=True))
            # A quantity that cannot be decided ends the common search.
            limited = [each for each in covered if each.limit is not None and len(covered) > 1]
            for claim in (each for each in limited if found[each].reason == TOO_SMALL):
                (found[claim],) = robots.searched([claim], search)
        except UncoveredError as error:  # from a loop equation
            reason = str(error)
        return [found.get(claim) or verdict_of(claim, Minimum(reason=reason)) for claim in claims]
