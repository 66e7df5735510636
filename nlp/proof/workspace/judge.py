"""A machine judged over its whole workspace."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from ....models.joints.closedform import closed_form
from ...case.case import Case
from ...case.task import Sense
from ...case.workspace import Workspace
from ...interruption import is_requested, one_call, within
from ..enclosure.engine import kernel
from ..statement.claims import REACH, SPECTRAL, Claim, claims_of, dependent_claims
from ..statement.machine import check_leg_error, has_straight_legs, workspace_of_case
from ..statement.posed_layout import closed_layout, posed_layout, reach_claims
from ..statement.tolerance import Directions, coordinate_layout, length_of_one_machine
from .home_poses import Homes
from .numbers.bound_search import Minimum
from .numbers.extremes import GAP, Extreme, extreme_of, prove_extreme
from .numbers.machines import Machines
from .numbers.pose_error import pose_errors
from .numbers.searched import Subject, motor_extremes, searched_extremes
from .numbers.strokes import with_strokes
from .ranks.ranks import RankProgress, Ranks, not_judged, prove_ranks
from .robot.pose_box import pose_box, pose_coordinates
from .robot.posed_robot import NotJudgedError, Problem, build_problem
from .verdict import Outcome, RankVerdict

if TYPE_CHECKING:
    from .paper_record import PaperRecord

#: Seconds for all searches together where none are asked for: those of singular values have no other end in six
#: dimensions. Of what is left, each takes half at most.
TIME_LIMIT = 60.0
_PART = 0.5
#: Gap of the proof on paper of a limit that is known to hold: it is made finer where the limit needs it.
_AS_NEEDED = 1.0
#: Reason for numbers of a robot that does not have all poses.
_OUT_OF_REACH = "not every machine within the tolerance is proved to reach every pose"


@dataclass(frozen=True, eq=False)
class Judgement:
    """Verdicts on a machine over its workspace; with a tolerance on joint centres, on every machine within it.

    Attributes:
        case: the case, its dimensions fixed.
        workspace: the poses.
        regularity: whether J has full rank at every pose.
        extremes: of the reach of limbs, limits, lengths of legs, measures and tasks, in this order.
        constraints: whether the constraint wrenches alone keep their rank; None for a robot without any.
    """

    case: Case
    workspace: Workspace
    regularity: RankVerdict
    extremes: tuple[Extreme, ...]
    constraints: RankVerdict | None = None

    @property
    def ranks(self) -> tuple[RankVerdict, ...]:
        """Verdicts on ranks."""
        return (self.regularity,) if self.constraints is None else (self.regularity, self.constraints)

    @property
    def verdicts(self) -> tuple[RankVerdict | Extreme, ...]:
        """Verdicts on ranks, then on numbers."""
        return (*self.ranks, *self.extremes)

    @property
    def is_regular(self) -> bool:
        """Whether all ranks are proved to be full."""
        return not any(each.fails for each in self.ranks)

    @property
    def is_proved(self) -> bool:
        """Whether all ranks are proved to be full, and every limit holds; a number without a limit is information."""
        return not any(each.fails for each in self.verdicts)

    @property
    def is_refuted(self) -> bool:
        """Whether a pose is known that is singular or outside of a limit."""
        return any(each.outcome is Outcome.REFUTED for each in self.verdicts)


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
    progress: Callable[[str, int, int], None] | None = None,
    paper: PaperRecord | None = None,
) -> Judgement:
    """Prove, for every pose of a case's workspace, that its machine is regular and keeps its limits, or find a pose.

    Args:
        case: a case with fixed dimensions.
        workspace: the poses; those of the case if left out.
        quantities: names of measures of the robot whose smallest and largest values are asked for.
        gap: allowed distance of a bound from the best value known, as a part of it.
        time_limit: seconds for all searches together, which then stop with the bounds reached; None for no limit. A
            search takes at most half of what is left, and those of actuators even shares of it.
        jobs: threads.
        with_limits: whether numbers are bounded at all, and not regularity alone.
        with_objective: whether F of each task is bounded, and numbers of actuators without a limit are.
        leg_error: largest error of a leg's length, length. With it, or with a tolerance of the case for joint centres,
            the errors of the platform's pose are bounded, where F is.
        until_fault: whether the work ends at the first rank or limit that is not proved.
        rank_progress: called during the search for singular poses.
        progress: called before each number with its name, the number of those done, and of all of its kind.
        paper: records the searches for a proof.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
        InputError: the robot has no such measure, the error of legs is negative or not for it, or there is no C kernel.
    """
    workspace = workspace_of_case(case if workspace is None else replace(case, workspace=workspace))
    kernel()  # before any work where it is missing
    check_leg_error(case, leg_error)
    with within(time_limit, _PART):
        whole = (case, workspace, quantities, leg_error, with_objective, gap, jobs, progress, paper)
        numbers = _Numbers(*whole, at_once=until_fault)
        homes, meant = Homes(case, numbers.box, numbers.names, numbers.machines), numbers.meant
        ranks = (
            Ranks(not_judged(numbers.box, numbers.reason), None)
            if meant is None
            else prove_ranks(meant, homes.is_singular, rank=case.model.rank, progress=rank_progress, paper=paper)
        )
        judged = Judgement(case, workspace, ranks.regular, (), ranks.constraints)
        if not with_limits or (until_fault and not judged.is_regular):
            return judged
        for each in numbers.extremes():
            numbers.found.append(each)
            if until_fault and each.fails:
                break
        return replace(judged, extremes=tuple(homes.shown(each) for each in numbers.found))


@dataclass(eq=False)
class _Numbers:
    """The numbers of a machine over its workspace.

    Attributes:
        case, workspace, quantities, leg_error, with_objective, gap, jobs, progress, paper: as in
            :func:`judge_workspace`.
        at_once: whether verdicts alone are asked for: limits are then decided by one search where that can.
        box: the poses.
        closed: the robot without unknowns in closed form.
        names: measures that are numbers of the robot.
        machines: every machine within the tolerance; None where the design is judged, or none.
        meant: the design, or these machines, over the workspace; None where they are not judged.
        reason: why they are not; else empty.
        found: the extremes so far. Lengths that a stroke needs more finely take the place of those before.
    """

    case: Case
    workspace: Workspace
    quantities: Sequence[str]
    leg_error: float
    with_objective: bool
    gap: float
    jobs: int | None
    progress: Callable[[str, int, int], None] | None
    paper: PaperRecord | None
    at_once: bool = False

    def __post_init__(self) -> None:
        self.box, self.closed = pose_box(self.workspace), closed_form(self.case.model)
        self.names = [name for name in self.quantities if name not in SPECTRAL]
        self.machines: Machines | None = None
        self.meant: Problem | None = None
        self.reason = ""
        try:
            design = build_problem(self.case, self.closed.model, self.box)
            if self.case.joint_centre_tolerance:
                self.machines = Machines(self.case, self.closed, design)
            self.meant = design if self.machines is None else self.machines.family
        except NotJudgedError as error:
            self.reason = str(error)
        self.found: list[Extreme] = []
        self._claims: Sequence[Claim] = ()
        self._prove: Callable[..., Extreme] = prove_extreme

    def extremes(self) -> Iterator[Extreme]:
        """Yield the extremes of the reach of limbs, limits, lengths of legs, measures, tasks, and errors of the pose.

        Each has to be among those found before the next one is proved.

        Raises:
            InputError: the robot has no measure of a name.
        """
        yield from self._of_design() if self.machines is None else self._of_machines(self.machines)
        lengths = [each for each in self.found if each.name.startswith("leg_length limb ") and each.sense is Sense.MIN]
        shortest = min((each.bound for each in lengths), default=0.0)
        subject = Subject(self.case, self.closed.model, self.meant, self.reason, shortest)
        count = len(self.found)
        whole = with_strokes(subject, self.found, self._finer)
        self.found, strokes = whole[:count], whole[count:]
        yield from strokes
        yield from searched_extremes(subject, self.quantities, gap=self.gap, paper=self.paper)
        yield from motor_extremes(subject, with_all=self.with_objective, paper=self.paper)
        if has_straight_legs(self.case.model) and self.with_objective:
            yield from pose_errors(subject, self.leg_error, paper=self.paper)

    def _of_machines(self, machines: Machines) -> Iterator[Extreme]:
        """Yield the extremes of expressions over all machines."""
        reaches, claims = machines.symbols.claims(self.names, with_objective=self.with_objective)
        prove = partial(machines.extreme, jobs=self.jobs, paper=self.paper)
        yield from self._proved([*reaches, *dependent_claims(machines.symbols.layout.robots[0], self.workspace)], prove)
        if any(each.fails and each.key == REACH for each in self.found):
            yield from (extreme_of(claim, Minimum(reason=_OUT_OF_REACH)) for claim in claims)
        else:
            yield from self._proved(claims, prove)

    def _of_design(self) -> Iterator[Extreme]:
        """Yield the extremes of expressions of the design."""
        case, closed, workspace = self.case, self.closed, self.workspace
        if workspace.dependent:
            yield from self._followed(self.meant)
            return
        if closed.reaches:
            layout, reaches = reach_claims(case, closed, workspace)
            yield from self._proved(reaches, partial(prove_extreme, layout, jobs=self.jobs, paper=self.paper))
        is_reached = not any(each.fails for each in self.found)
        # Without unknowns there are fewer coordinates. Where a limb does not reach, its loop has to be kept.
        is_closed = closed.reaches and is_reached
        layout = closed_layout(case, closed, workspace) if is_closed else posed_layout(case, workspace)
        claims = claims_of(layout, self.names, with_objective=self.with_objective)
        is_together = self.meant is not None and (bool(closed.model.unknowns) or (self.at_once and is_reached))
        decided = self._in_home(self.meant, is_reached=is_reached) if self.meant and is_together else []
        yield from self._proved(claims, partial(prove_extreme, layout, jobs=self.jobs, paper=self.paper), decided)

    def _followed(self, design: Problem | None) -> Iterator[Extreme]:
        """Yield the extremes of a design with dependent coordinates of the pose, in the home assembly mode.

        No other search keeps to the poses that the robot can take.
        """
        if design is None:
            layout = coordinate_layout(self.case, pose_coordinates(self.box))
            claims = [
                *dependent_claims(layout.robots[0], self.workspace),
                *claims_of(layout, self.names, with_objective=False),
            ]
            yield from (extreme_of(claim, Minimum(reason=self.reason)) for claim in claims)
            return
        alone = Machines(self.case, self.closed, design)
        reaches, claims = alone.symbols.claims(self.names, with_objective=self.with_objective)
        # The range of a dependent coordinate is part of the answer, however wide its limits are.
        every = [*reaches, *dependent_claims(alone.symbols.layout.robots[0], self.workspace), *claims]
        limited = [claim for claim in (*reaches, *claims) if claim.limit is not None]
        decided = {(each.name, each.sense, each.key): each for each in alone.followed(limited, gap=self.gap)}
        prove = partial(alone.extreme, jobs=self.jobs, paper=self.paper)
        yield from self._proved(every, prove, [each for each in decided.values() if each.outcome is not Outcome.OPEN])

    def _in_home(self, design: Problem, *, is_reached: bool) -> Iterator[Extreme]:
        """Yield the extremes of a design with loops that are decided in the assembly of home.

        Loop equations as conditions of a program hold in every assembly, and F has no bound where one of these is
        singular. The loops are followed here, and the design is the only machine within no tolerance.
        """
        alone = Machines(self.case, self.closed, design)
        claims = alone.symbols.claims(self.names, with_objective=self.with_objective)[1]
        limited = alone.followed([claim for claim in claims if claim.limit is not None], gap=self.gap)
        yield from (each for each in limited if each.outcome is not Outcome.OPEN)
        for claim in claims if is_reached and self.closed.model.unknowns else ():
            if claim.limit is None:
                yield alone.extreme(claim, gap=self.gap, jobs=self.jobs)

    def _proved(
        self, claims: Sequence[Claim], prove: Callable[..., Extreme], decided: Iterable[Extreme] = ()
    ) -> Iterator[Extreme]:
        """Yield the extremes of claims; those that are decided are searched again for the paper alone."""
        self._claims, self._prove = claims, prove
        # What is proved of the design says nothing of the machines that are meant.
        uncovered = self.reason if self.case.joint_centre_tolerance else ""
        known = {(each.name, each.sense, each.key): each for each in decided}
        for done, claim in enumerate(claims):
            if self.progress is not None:
                self.progress(claim.name, done, len(claims))
            own = known.get((claim.name, claim.sense, claim.key))
            is_limit = own is not None and own.limit is not None
            if own is None or (self.paper is not None and not (is_limit and own.outcome is not Outcome.PROVED)):
                gap = _AS_NEEDED if is_limit else self.gap
                again = prove(replace(claim, uncovered=uncovered), gap=gap)
                own = own or again
            yield own

    def _finer(self, leg: int, sense: Sense, gap: float, about: Directions | None) -> Extreme | None:
        """Return a length of a leg, proved more finely; None where the work is requested to stop.

        With directions it is less the part of its errors along them, which no pose changes.
        """
        if is_requested() or (about is not None and self.machines is None):
            return None
        if about is None or self.machines is None:
            claim = next(each for each in self._claims if each.legs == (leg,) and each.sense is sense)
        else:
            claim = length_of_one_machine(self.machines.symbols, leg, sense, about)
            if self.paper is not None:
                self.paper.directions[claim.name] = about
        return self._prove(claim, gap=gap)
