"""Violated claims over a workspace, the commands that show violations, and verdicts on ranks, in words."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from ..case.task import Sense
from ..proof.statement.claims import CONSTRAINTS, REGULAR
from ..proof.workspace.verdict import Outcome
from ..results.claims import PosedClaim, refuted_claims
from .motors import OUTCOME_WORDS, TONES
from .numbers import number, quantity_words
from .text import Line
from .verdicts import SHOWN

if TYPE_CHECKING:
    from ..evidence.state import WorkspacePose
    from ..results.workspace import WorkspaceResult

#: Claims about ranks: name, singularity, label and proved sentence, each by the key of the claim.
CLAIM_WORDS = {REGULAR: "full rank of J", CONSTRAINTS: "rank of the constraint wrenches"}
SINGULAR = {REGULAR: "J is singular", CONSTRAINTS: "the constraint wrenches lose rank"}
_LABELS = {REGULAR: "singularities", CONSTRAINTS: "constraint singularities"}
_REGULAR = {REGULAR: "J has full rank", CONSTRAINTS: "the constraint wrenches keep their rank"}
#: Start of the names of claims that a limb reaches every pose.
_REACH = "reach limb "


def rank_line(name: str, outcome: Outcome, after: str = "") -> Line:
    """Return the verdict on a rank.

    Args:
        name: name of the claim.
        outcome: outcome of the claim.
        after: words after the verdict.
    """
    words = {
        Outcome.PROVED: f"none: {_REGULAR[name]} at every pose (proved)",
        Outcome.REFUTED: SINGULAR[name],
        Outcome.OPEN: "undecided",
    }
    return Line(words[outcome], label=_LABELS[name], tone=TONES[outcome], after=after)


def unproved_ranks(ranks: Mapping[str, Outcome]) -> Iterator[str]:
    """Yield the ranks that are not proved, with their outcomes, from the outcome of each rank by its claim."""
    for name, outcome in ranks.items():
        if outcome is not Outcome.PROVED:
            yield f"{CLAIM_WORDS[name]} ({OUTCOME_WORDS[outcome]})"


def claim_words(claim: PosedClaim) -> str:
    """Return a claim at a pose: a singularity, a limb that does not reach, or a value with its limit."""
    each, length = claim.verdict, claim.length
    if each is None:
        return SINGULAR[claim.name]
    if each.name.startswith(_REACH) and each.reached is not None and each.reached < 0:
        limb = each.name.removeprefix(_REACH)
        return f"limb {limb} cannot reach the pose: reach margin {number(each.reached, digits=4)}, required >= 0"
    worst = "smallest" if each.sense is Sense.MIN else "largest"
    value = "" if each.reached is None else f" {worst} {number(each.reached)} {each.unit}".rstrip()
    limit = "" if each.limit is None else f", limit {each.key} = {number(each.limit)} {each.unit}".rstrip()
    where = ""
    if length is not None:
        end = "shortest" if length.sense is Sense.MIN else "longest"
        where = f"; limb {each.name.partition(' limb ')[2]} at its {end} length"
    return f"{quantity_words(each.name)}:{value}{limit}{where}"


def violation_lines(result: WorkspaceResult, command: Callable[[WorkspacePose], str]) -> Iterator[Line]:
    """Yield the commands that show violations: for each limit, its most violated claim.

    Args:
        result: verdicts over the workspace.
        command: returns the command that shows a pose.
    """
    claims = list(refuted_claims(result))
    farthest: dict[str, float] = {}
    for each in claims:
        farthest[each.key] = max(each.beyond, farthest.get(each.key, each.beyond))
    shown: dict[str, list[PosedClaim]] = {}
    for each in claims:
        own = shown.setdefault(each.key, [])
        if each.beyond == farthest[each.key] and (not own or own[0].name == each.name):
            own.append(each)
    for k, each in enumerate(itertools.chain.from_iterable(shown.values())):
        part = "violated claims" if k >= SHOWN else ""
        yield Line(claim_words(each), label=OUTCOME_WORDS[Outcome.REFUTED], part=part)
        yield Line(command(each.pose), label="see it with", is_command=True, part=part)
    # A quantity may have two limits: a claim is a name with the key of the limit.
    left = len({(each.name, each.key) for each in claims}) - len(shown)
    if left:
        yield Line(f"{left}: --all, --csv FILE and --json FILE list them", label="other violated claims")
