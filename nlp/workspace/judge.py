"""A machine judged over its whole workspace."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from ..case.case import Case
from ..case.limits.constraint import LENGTH
from ..case.task import Sense
from ..case.workspace import Workspace
from ..interruption import is_requested
from ..program.layout import Layout
from .builtclaims import NO_LEGS, built_claims
from .claims import Claim, claims_of
from .extremes import GAP, Extreme, prove_extreme
from .machine import Legs, legs_of, workspace_of_case
from .ownsearches import own_searches, pose_errors
from .posebox import pose_box
from .posed import posed_layout
from .search import RankProgress, prove_regular
from .strokes import with_strokes
from .verdict import Outcome, Regularity
from .worst import Directions, length_beside

if TYPE_CHECKING:
    from .paper.record import PaperRecord

#: Seconds for each search where none are asked for: the searches of singular values have no other end in six
#: dimensions.
TIME_LIMIT = 20.0
#: Gap of the shortest lengths of legs that bounds of errors of joint centres rest on: they change little with it.
_ROUGH = 1e-2


@dataclass(frozen=True, eq=False)
class Judgement:
    """Verdicts on a machine over its workspace; with a tolerance on joint centres, on every machine within it.

    Attributes:
        case: the case, its dimensions fixed.
        workspace: the poses.
        regularity: whether J has full rank at every pose; None for a robot that is not six straight legs.
        extremes: of the limits, lengths of legs, measures and tasks, in this order.
    """

    case: Case
    workspace: Workspace
    regularity: Regularity | None
    extremes: tuple[Extreme, ...]

    @property
    def is_proved(self) -> bool:
        """Whether J is proved to have full rank, every limit holds, and every other number is bounded to the gap."""
        regular = self.regularity is not None and self.regularity.outcome is Outcome.PROVED
        return regular and all(each.outcome is Outcome.PROVED for each in self.extremes)

    @property
    def is_refuted(self) -> bool:
        """Whether a pose is known that is singular or outside of a limit."""
        outcomes = [] if self.regularity is None else [self.regularity.outcome]
        return Outcome.REFUTED in (*outcomes, *(each.outcome for each in self.extremes))


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
    paper: PaperRecord | None = None,
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
        paper: records the searches for a proof.

    Raises:
        CaseError: the case has no workspace, or a free dimension.
        InputError: the robot has no measure of a name.
    """
    own = workspace_of_case(case)
    workspace = own if workspace is None else workspace
    box, legs = pose_box(workspace), legs_of(case)
    layout = posed_layout(case, workspace)
    claims = claims_of(layout, quantities, with_objective=with_objective) if with_limits else []
    prove = partial(prove_extreme, layout, time_limit=time_limit, jobs=jobs, interrupted=is_requested, legs=legs)
    shortest, regularity = 0.0, None
    if legs is not None:
        recorder = None if paper is None else paper.rank
        regularity = prove_regular(
            legs, box, engine=engine, time_limit=time_limit, progress=rank_progress, recorder=recorder
        )
    extremes: list[Extreme] = []
    if until_fault and not (regularity is not None and regularity.outcome is Outcome.PROVED):
        return Judgement(case, workspace, regularity, ())
    shortest, claims = _as_built(layout, workspace, legs, claims, prove)
    for done, claim in enumerate(claims):
        if progress is not None:
            progress(claim.name, done, len(claims))
        found = prove(claim, gap=gap, paper=paper)
        extremes.append(found)
        if until_fault and found.outcome is not Outcome.PROVED:
            return Judgement(case, workspace, regularity, tuple(extremes))
    if legs is not None and with_limits:
        refine = partial(_refined, layout, legs, shortest, claims, partial(prove, paper=paper, again=True))
        extremes = with_strokes(case, legs, extremes, refine)
        each_own = partial(own_searches, gap=gap, time_limit=time_limit, interrupted=is_requested, shortest=shortest)
        for found in each_own(case, legs, box, paper=paper):
            extremes.append(found)
            if until_fault and found.outcome is not Outcome.PROVED:
                break
    eps = leg_error + 2 * (case.joint_centre_tolerance or 0.0)
    if legs is not None and with_limits and with_objective and eps > 0:
        least = min((each.bound for each in extremes if each.name.startswith("leg_length limb ")), default=-math.inf)
        shortest = least + 2 * legs.tolerance if least > 0 else -math.inf  # of the exact machine
        extremes += pose_errors(legs, box, eps, shortest, time_limit=time_limit, interrupted=is_requested, paper=paper)
    return Judgement(case, workspace, regularity, tuple(extremes))


class _AsBuilt(NamedTuple):
    """Claims about every machine within the tolerance, and a proven shortest length of the exact machine's legs."""

    shortest: float
    claims: list[Claim]


def _as_built(
    layout: Layout, workspace: Workspace, legs: Legs | None, claims: list[Claim], prove: Callable[..., Extreme]
) -> _AsBuilt:
    """Return claims about every machine within the case's tolerance from those about the exact one."""
    if legs is None and layout.case.joint_centre_tolerance:
        return _AsBuilt(0.0, [replace(each, uncovered=NO_LEGS) for each in claims])
    if legs is None or not legs.tolerance or not claims:
        return _AsBuilt(0.0, claims)
    lengths = [replace(each, limit=None) for each in claims if each.leg is not None and each.sense is Sense.MIN]
    shortest = min(prove(each, gap=_ROUGH).bound for each in lengths)
    return _AsBuilt(shortest, built_claims(layout, workspace, legs, claims, shortest))


def _refined(
    layout: Layout,
    legs: Legs,
    shortest: float,
    claims: Sequence[Claim],
    prove: Callable[..., Extreme],
    leg: int,
    sense: Sense,
    gap: float,
    about: Directions | None,
) -> Extreme | None:
    """Return a length of a leg, proved more finely; None where the work is requested to stop, or none is bounded."""
    if is_requested():
        return None
    claim = next(each for each in claims if each.leg == leg and each.sense is sense)
    if about is None:
        return prove(claim, gap=gap)
    if not shortest > 2 * legs.tolerance:
        return None
    sign = 1.0 if sense is Sense.MAX else -1.0
    expression = length_beside(legs, leg, layout.robots[0], sign, shortest, about)
    return prove(Claim(claim.name, sense, expression, LENGTH), gap=gap)
