"""A machine judged over its whole workspace."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from ..case.case import Case
from ..case.workspace import Workspace
from ..interruption import is_requested
from ..program.layout import Layout
from .anyrobot import prove_ranks, reach_claims, touched, without_identities
from .askedvalues import SPECTRAL, spectral_extremes
from .claims import Claim, claims_of
from .closedform import ClosedForm, closed_form
from .extremes import GAP, Extreme, prove_extreme
from .machine import legs_of, workspace_of_case
from .ownsearches import own_searches, pose_errors, strokes
from .posebox import pose_box
from .posed import posed_layout
from .search import RankProgress, prove_regular
from .verdict import Outcome, Regularity

#: Seconds for each search where none are asked for: the searches of singular values have no other end in six
#: dimensions.
TIME_LIMIT = 20.0


@dataclass(frozen=True, eq=False)
class Judgement:
    """Verdicts on a machine over its workspace.

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
        """Whether all ranks are proved to be full, every limit holds, and every other number is bounded to the gap."""
        return self.is_regular and all(each.outcome is Outcome.PROVED for each in self.extremes)

    @property
    def is_refuted(self) -> bool:
        """Whether a pose is known that is singular or outside of a limit."""
        return Outcome.REFUTED in [*(each.outcome for each in self.ranks), *(each.outcome for each in self.extremes)]


def judge_workspace(
    case: Case,
    *,
    workspace: Workspace | None = None,
    quantities: Sequence[str] = (),
    gap: float = GAP,
    time_limit: float | None = TIME_LIMIT,
    jobs: int | None = None,
    engine: str | None = None,
    with_limits: bool = True,
    with_objective: bool = True,
    until_fault: bool = False,
    leg_error: float = 0.0,
    rank_progress: RankProgress | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Judgement:
    """Prove, for every pose of a case's workspace, that its machine is regular and keeps its limits, or find a pose.

    Args:
        case: a case with fixed dimensions.
        workspace: the poses; those of the case if left out.
        quantities: names of measures of the robot whose smallest and largest values are asked for.
        gap: allowed distance of a bound from the best value known, as a part of it.
        time_limit: seconds for each search; it then stops with the bound reached.
        jobs: threads.
        engine: ``"c"`` or ``"numpy"`` for the search of singular poses; left out, the C kernel where it was built.
        with_limits: whether numbers are bounded at all, and not regularity alone.
        with_objective: whether F of each task is bounded.
        leg_error: largest error of a leg's length, length. With it, or with a tolerance of the case for joint centres,
            the errors of the platform's pose are bounded, where F is.
        until_fault: whether the work ends at the first claim that is not proved.
        rank_progress: called during the search for singular poses.
        progress: called before each number with its name, the number of those done, and of all.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
        InputError: the robot has no measure of a name.
    """
    own = workspace_of_case(case)
    workspace = own if workspace is None else workspace
    box, legs = pose_box(workspace), legs_of(case)
    closed, constraints = closed_form(case.model), None
    if legs is not None:
        regularity = prove_regular(legs, box, engine=engine, time_limit=time_limit, progress=rank_progress)
        regularity = touched(case, box, regularity)
    else:
        regularity, constraints = prove_ranks(
            case, closed.model, box, engine=engine, time_limit=time_limit, progress=rank_progress
        )
    judged = Judgement(case, workspace, regularity, (), constraints)
    if not with_limits or (until_fault and not judged.is_regular):
        return judged
    numbers = _Numbers(case, workspace, closed, gap, time_limit, jobs, progress)
    found: list[Extreme] = []
    eps = leg_error + 2 * (case.joint_centre_tolerance or 0.0)
    for extreme in numbers.extremes(quantities, eps, with_objective=with_objective):
        found.append(extreme)
        if until_fault and extreme.outcome is not Outcome.PROVED:
            break
    return replace(judged, extremes=tuple(found))


@dataclass(frozen=True, eq=False)
class _Numbers:
    """The numbers of a machine over its workspace.

    Attributes:
        case: with fixed dimensions.
        workspace: the poses.
        closed: its robot without unknowns in closed form.
        gap, time_limit, jobs, progress: as in :func:`judge_workspace`.
    """

    case: Case
    workspace: Workspace
    closed: ClosedForm
    gap: float
    time_limit: float | None
    jobs: int | None
    progress: Callable[[str, int, int], None] | None

    def extremes(self, quantities: Sequence[str], eps: float, *, with_objective: bool) -> Iterator[Extreme]:
        """Yield the extremes of the reach of limbs, limits, lengths of legs, measures and tasks.

        Args:
            quantities: names of measures.
            eps: largest error of a leg's length, those of its joint centres included, length; 0 without errors.
            with_objective: whether F of each task, and errors of the pose, are bounded.

        Raises:
            InputError: the robot has no measure of a name.
        """
        case, box, legs = self.case, pose_box(self.workspace), legs_of(self.case)
        names = [name for name in quantities if name not in SPECTRAL]
        asked = [name for name in quantities if name in SPECTRAL]
        layout = posed_layout(case, self.workspace)
        claims = claims_of(layout, names, with_objective=with_objective)
        if self.closed.reaches:
            reached = []
            for each in self._proved(*reach_claims(case, self.closed, self.workspace)):
                reached.append(each.outcome)
                yield each
            if all(outcome is Outcome.PROVED for outcome in reached):
                # Without unknowns there are fewer coordinates. Where a limb does not reach, its loop has to be kept.
                model = without_identities(case, self.closed.model, box)
                layout = posed_layout(replace(case, model=model), self.workspace)
                claims = claims_of(layout, names, with_objective=with_objective)
        found = []
        for each in self._proved(layout, claims):
            found.append(each)
            yield each
        if legs is not None:
            yield from strokes(case, found)
            yield from own_searches(case, legs, box, gap=self.gap, time_limit=self.time_limit, interrupted=is_requested)
        yield from spectral_extremes(
            case, self.closed.model, box, asked, gap=self.gap, time_limit=self.time_limit, interrupted=is_requested
        )
        if legs is not None and with_objective and eps > 0:
            lengths = [each.bound for each in found if each.name.startswith("leg_length limb ")]
            shortest = min(lengths, default=-math.inf)
            yield from pose_errors(legs, box, eps, shortest, time_limit=self.time_limit, interrupted=is_requested)

    def _proved(self, layout: Layout, claims: Sequence[Claim]) -> Iterator[Extreme]:
        """Yield the extremes of claims."""
        for done, claim in enumerate(claims):
            if self.progress is not None:
                self.progress(claim.name, done, len(claims))
            yield prove_extreme(
                layout, claim, gap=self.gap, time_limit=self.time_limit, jobs=self.jobs, interrupted=is_requested
            )
