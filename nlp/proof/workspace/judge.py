"""A machine judged over its whole workspace."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from ....models.joints.closedform import ClosedForm, closed_form
from ...case.case import Case
from ...case.task import Sense
from ...case.workspace import Workspace
from ...interruption import is_requested, one_call, within
from ...program.layout import Layout
from ..enclosure.engine import kernel
from ..statement.claims import SPECTRAL, Claim, claims_of
from ..statement.machine import Legs, check_leg_error, joint_centres, legs_of, workspace_of_case
from ..statement.posed_layout import closed_layout, posed_layout, reach_claims
from ..statement.tolerance import Directions, length_of_one_machine
from .home_poses import Homes
from .numbers.extremes import GAP, Extreme, prove_extreme
from .numbers.loop_limits import loop_extremes
from .numbers.pose_error import pose_errors
from .numbers.searched import Subject, asked_spectra_extremes, searched_limits
from .numbers.strokes import Refine, with_strokes
from .ranks.ranks import RankProgress, Ranks, not_judged, prove_ranks
from .robot.pose_box import PoseBox, pose_box
from .robot.posed_robot import NotJudgedError
from .tolerance.machines import Machines, not_bounded
from .verdict import Outcome, Regularity

if TYPE_CHECKING:
    from .proof_record import PaperRecord

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
    regularity: Regularity
    extremes: tuple[Extreme, ...]
    constraints: Regularity | None = None

    @property
    def ranks(self) -> tuple[Regularity, ...]:
        """Verdicts on ranks."""
        return (self.regularity,) if self.constraints is None else (self.regularity, self.constraints)

    @property
    def is_regular(self) -> bool:
        """Whether all ranks are proved to be full."""
        return all(each.outcome is Outcome.PROVED for each in self.ranks)

    @property
    def is_proved(self) -> bool:
        """Whether all ranks are proved to be full, and every limit holds; a number without a limit is information."""
        return self.is_regular and not any(each.fails for each in self.extremes)

    @property
    def is_refuted(self) -> bool:
        """Whether a pose is known that is singular or outside of a limit."""
        return Outcome.REFUTED in [*(each.outcome for each in self.ranks), *(each.outcome for each in self.extremes)]


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
            search takes at most half of what is left.
        jobs: threads.
        with_limits: whether numbers are bounded at all, and not regularity alone.
        with_objective: whether F of each task is bounded.
        leg_error: largest error of a leg's length, length. With it, or with a tolerance of the case for joint centres,
            the errors of the platform's pose are bounded, where F is.
        until_fault: whether the work ends at the first rank or limit that is not proved.
        rank_progress: called during the search for singular poses.
        progress: called before each number with its name, the number of those done, and of all.
        paper: records the searches for a proof.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
        InputError: the robot has no measure of a name, the error of legs is negative, or for a robot that is not six
            straight legs, or the C kernel was not built.
    """
    own = workspace_of_case(case)
    kernel()  # before any work where it is missing
    check_leg_error(case, leg_error)
    workspace = own if workspace is None else workspace
    with within(time_limit, _PART):
        box, legs = pose_box(workspace), legs_of(case)
        closed = closed_form(case.model)
        machines, unknown = _machines(case, closed, box)
        homes = Homes(case, box, [name for name in quantities if name not in SPECTRAL], machines)
        ranks = (
            Ranks(not_judged(box, unknown), None)
            if unknown
            else prove_ranks(closed.model, homes, legs=legs, progress=rank_progress, paper=paper)
        )
        judged = Judgement(case, workspace, ranks.regular, (), ranks.constraints)
        if not with_limits or (until_fault and not judged.is_regular):
            return judged
        numbers = _Numbers(case, workspace, closed, legs, gap, jobs, progress, paper, machines, unknown)
        found: list[Extreme] = []
        for each in numbers.add(found, quantities, leg_error, with_objective=with_objective):
            if until_fault and each.fails:
                break
        return replace(judged, extremes=tuple(homes.shown(each) for each in found))


def _machines(case: Case, closed: ClosedForm, box: PoseBox) -> tuple[Machines | None, str]:
    """Return the machines that are meant, or why they are not judged: None and no reason for the design alone."""
    if not case.joint_centre_tolerance:
        return None, ""
    try:
        return Machines(case, closed, box), ""
    except NotJudgedError as error:
        return None, str(error)


@dataclass(frozen=True, eq=False)
class _Numbers:
    """The numbers of a machine over its workspace.

    Attributes:
        case: with fixed dimensions.
        workspace: the poses.
        closed: its robot without unknowns in closed form.
        legs: joint centres; None for a robot that is not six straight legs.
        gap, jobs, progress, paper: as in :func:`judge_workspace`.
        machines: every machine within the tolerance; None where the design is judged, or none.
        unknown: reason why the machines that are meant are not judged; else empty.
    """

    case: Case
    workspace: Workspace
    closed: ClosedForm
    legs: Legs | None
    gap: float
    jobs: int | None
    progress: Callable[[str, int, int], None] | None
    paper: PaperRecord | None
    machines: Machines | None
    unknown: str

    def add(
        self, found: list[Extreme], quantities: Sequence[str], leg_error: float, *, with_objective: bool
    ) -> Iterator[Extreme]:
        """Add the extremes of the reach of limbs, limits, lengths of legs, measures and tasks, and yield each.

        Args:
            found: gets the extremes; lengths that a stroke needs more finely take the place of those found before.
            quantities: names of measures.
            leg_error: largest error of a leg's length, length.
            with_objective: whether F of each task, and errors of the pose, are bounded.

        Raises:
            InputError: the robot has no measure of a name.
        """
        case, legs, machines = self.case, self.legs, self.machines
        names = [name for name in quantities if name not in SPECTRAL]
        refine: Refine
        if machines is not None:
            reaches, claims = machines.symbols.claims(names, with_objective=with_objective)
            prove = partial(machines.extreme, jobs=self.jobs, paper=self.paper)
            yield from self._add_proved(found, prove, reaches)
            if any(each.fails for each in found):
                yield from _add(found, (not_bounded(claim, _OUT_OF_REACH) for claim in claims))
            else:
                yield from self._add_proved(found, prove, claims)
            refine = partial(_refined_machines, machines, prove, self.paper)
        else:
            refine = yield from self._add_design(found, names, with_objective=with_objective)
        lengths = [each for each in found if each.name.startswith("leg_length limb ") and each.sense is Sense.MIN]
        shortest = min((each.bound for each in lengths), default=0.0)
        subject = Subject(
            case=case,
            model=self.closed.model,
            box=pose_box(self.workspace),
            legs=joint_centres(case),
            built=None if machines is None else (machines.built, machines.family),
            unknown=self.unknown,
            shortest=shortest,
        )
        before = len(found)
        found[:] = with_strokes(subject, found, refine)
        yield from found[before:]
        yield from _add(found, searched_limits(subject, gap=self.gap, paper=self.paper))
        yield from _add(found, asked_spectra_extremes(subject, quantities, gap=self.gap, paper=self.paper))
        eps = leg_error + 2 * (case.joint_centre_tolerance or 0.0)
        if legs is not None and with_objective and eps > 0:
            exact = shortest + 2 * legs.tolerance if shortest > 0 else -math.inf
            yield from _add(found, pose_errors(legs, subject.problem, eps, exact, paper=self.paper))

    def _add_design(
        self, found: list[Extreme], names: Sequence[str], *, with_objective: bool
    ) -> Generator[Extreme, None, Refine]:
        """Add the extremes of the design, yield each, and return the function that proves its lengths more finely."""
        case, box = self.case, pose_box(self.workspace)
        is_reached = True
        if self.closed.reaches:
            place, reaches = reach_claims(case, self.closed, self.workspace)
            reaches = tuple(replace(each, uncovered=self.unknown) for each in reaches)
            yield from self._add_proved(found, self._prove(place), reaches)
            is_reached = not any(each.fails for each in found)
        # Without unknowns there are fewer coordinates. Where a limb does not reach, its loop has to be kept.
        is_closed = self.closed.reaches and is_reached
        layout = closed_layout(case, self.closed, self.workspace) if is_closed else posed_layout(case, self.workspace)
        claims = claims_of(layout, names, with_objective=with_objective)
        prove = self._prove(layout)
        claims = [replace(each, uncovered=self.unknown) for each in claims]
        decided: list[Extreme] = []
        if not case.joint_centre_tolerance:
            decided = [
                each for each in loop_extremes(case, self.closed, box, gap=self.gap) if each.outcome is not Outcome.OPEN
            ]
            if is_reached:
                decided += self._in_home(names, with_objective=with_objective)
        yield from self._add_proved(found, prove, claims, decided)
        return partial(_refined, prove, claims)

    def _in_home(self, names: Sequence[str], *, with_objective: bool) -> Iterator[Extreme]:
        """Yield the extremes of numbers without a limit of a design with loops, in the assembly of home.

        Loop equations as conditions of a program hold in every assembly, and F has no bound where one of these is
        singular. None is yielded of a robot without loops, or one whose loops cannot be followed.
        """
        if not self.closed.model.unknowns:
            return
        try:
            alone = Machines(self.case, self.closed, pose_box(self.workspace))
        except NotJudgedError:
            return
        for claim in alone.symbols.claims(names, with_objective=with_objective)[1]:
            if claim.limit is None:
                yield alone.extreme(claim, gap=self.gap, jobs=self.jobs)

    def _prove(self, layout: Layout) -> Callable[..., Extreme]:
        """Return the function that proves a claim to a gap."""
        return partial(prove_extreme, layout, jobs=self.jobs, paper=self.paper)

    def _add_proved(
        self,
        found: list[Extreme],
        prove: Callable[..., Extreme],
        claims: Sequence[Claim],
        decided: Sequence[Extreme] = (),
    ) -> Iterator[Extreme]:
        """Add the extremes of claims, and yield them; those that are decided are searched again for the paper alone."""
        known = {(each.name, each.sense, each.key): each for each in decided}
        for done, claim in enumerate(claims):
            if self.progress is not None:
                self.progress(claim.name, done, len(claims))
            own = known.get((claim.name, claim.sense, claim.key))
            is_limit = own is not None and own.limit is not None
            if own is None or (self.paper is not None and not (is_limit and own.outcome is not Outcome.PROVED)):
                again = prove(claim, gap=_AS_NEEDED if is_limit else self.gap)
                if is_limit and self.paper is not None and again.outcome is not Outcome.PROVED:
                    self.paper.elsewhere.add((claim.name, claim.sense.value))
                own = own or again
            yield from _add(found, [own])


def _refined(
    prove: Callable[..., Extreme],
    claims: Sequence[Claim],
    leg: int,
    sense: Sense,
    gap: float,
    about: Directions | None,  # noqa: ARG001 - the design is one machine at all poses
) -> Extreme | None:
    """Return a length of a leg, proved more finely; None where the work is requested to stop."""
    claim = next(each for each in claims if each.leg == leg and each.sense is sense)
    return None if is_requested() else prove(claim, gap=gap)


def _refined_machines(
    machines: Machines,
    prove: Callable[..., Extreme],
    paper: PaperRecord | None,
    leg: int,
    sense: Sense,
    gap: float,
    about: Directions | None,
) -> Extreme | None:
    """Return the same of all machines, less the part of their errors in these directions, which no pose changes."""
    claims = (
        machines.symbols.claims(())[1]
        if about is None
        else [length_of_one_machine(machines.symbols, leg, sense, about)]
    )
    if about is not None and paper is not None:
        paper.directions[claims[0].name] = about
    return _refined(prove, claims, leg, sense, gap, about)


def _add(found: list[Extreme], more: Iterable[Extreme]) -> Iterator[Extreme]:
    """Add extremes one by one, and yield each."""
    for each in more:
        found.append(each)
        yield each
