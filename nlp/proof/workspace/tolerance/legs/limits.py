"""Claims about every machine within a tolerance, of six straight legs, from searches about the exact one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from .....case.limits.constraint import LENGTH
from .....case.task import Sense
from .....case.workspace import Workspace
from .....interruption import is_requested
from .....program.layout import Layout
from ....statement.claims import Claim, exact_length_name, one_machine_name
from ....statement.machine import Legs
from ...numbers.extremes import Extreme
from .claims import built_claims
from .worst import Directions, length_beside

if TYPE_CHECKING:
    from ...proof_record import PaperRecord

#: Gap of the shortest lengths of legs that bounds of errors of joint centres rest on: they change little with it.
_ROUGH = 1e-2


class AsBuilt(NamedTuple):
    """Claims about every machine within the tolerance, and a proven shortest length of the exact machine's legs."""

    shortest: float
    claims: list[Claim]


def as_built(
    layout: Layout, workspace: Workspace, legs: Legs | None, claims: list[Claim], prove: Callable[..., Extreme]
) -> AsBuilt:
    """Return claims about every machine within the case's tolerance from those about the exact one."""
    if legs is None or not legs.tolerance or not claims:
        return AsBuilt(0.0, claims)
    # A proof on paper has these searches beside those of the same lengths that are claims, which have other gaps.
    names = {k: exact_length_name(leg.name) for k, leg in enumerate(layout.robots[0].legs)}
    lengths = [
        replace(each, limit=None, name=names[each.leg])
        for each in claims
        if each.leg is not None and each.sense is Sense.MIN
    ]
    shortest = min(prove(each, gap=_ROUGH).bound for each in lengths)
    return AsBuilt(shortest, built_claims(layout, workspace, legs, claims, shortest))


def refined(
    layout: Layout,
    legs: Legs | None,
    shortest: float,
    claims: Sequence[Claim],
    prove: Callable[..., Extreme],
    paper: PaperRecord | None,
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
    if legs is None or not shortest > 2 * legs.tolerance:
        return None
    sign = 1.0 if sense is Sense.MAX else -1.0
    expression = length_beside(legs, leg, layout.robots[0], sign, shortest, about)
    name = one_machine_name(about.claim)
    if paper is not None:
        paper.directions[name] = about.base, about.platform
    return prove(Claim(name, sense, expression, LENGTH), gap=gap)
