"""Refuted claims of a judged workspace in words, and the commands that show them."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from ..case.task import Sense
from ..proof.statement.claims import CONSTRAINTS, REGULAR
from ..results.claims import PosedClaim, refuted_claims
from .numbers import number
from .text import Line
from .verdicts import SHOWN

if TYPE_CHECKING:
    from ..evidence.state import WorkspacePose
    from ..results.workspace import WorkspaceResult

_SINGULAR = {REGULAR: f"{REGULAR}: J is singular", CONSTRAINTS: f"{CONSTRAINTS}: their rank is lost"}


def claim_words(claim: PosedClaim) -> str:
    """Return a claim, with its value and its limit where it is about a number."""
    each, length = claim.verdict, claim.length
    if each is None:
        return _SINGULAR[claim.name]
    worst = "smallest" if each.sense is Sense.MIN else "largest"
    value = "" if each.reached is None else f" {worst} {number(each.reached)} {each.unit}".rstrip()
    limit = "" if each.limit is None else f", limit {each.key} = {number(each.limit)} {each.unit}".rstrip()
    where = ""
    if length is not None:
        end = "shortest" if length.sense is Sense.MIN else "longest"
        where = f"; limb {each.name.partition(' limb ')[2]} at its {end}"
    return f"{each.name}:{value}{limit}{where}"


def seeing_lines(result: WorkspaceResult, command: Callable[[WorkspacePose], str]) -> Iterator[Line]:
    """Yield the commands that show what refutes claims: of each limit the claim that is farthest beyond it.

    Args:
        result: judgement over the workspace.
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
        part = "refuted claims" if k >= SHOWN else ""
        yield Line(claim_words(each), label="refuted", part=part)
        yield Line(command(each.pose), label="see it with", is_command=True, part=part)
    # One number may have two limits: a claim is its name with the limit's key.
    left = len({(each.name, each.key) for each in claims}) - len(shown)
    if left:
        yield Line(f"{left}: --all, --csv FILE and --json FILE list them", label="other refuted claims")
