"""Poses of a workspace result: the poses that refute claims, and the worst pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..case.task import Sense
from ..proof.statement.claims import CONSTRAINTS, REGULAR
from ..proof.workspace.verdict import Outcome
from .rounding import ordered

if TYPE_CHECKING:
    from ..evidence.state import WorkspacePose
    from .verdicts import VerdictData
    from .workspace import WorkspaceResult

#: Start of the keys of limits that two poses refute: those of the shortest and of the longest leg length.
_OVER_POSES = "actuator."
#: Start of the names of leg lengths.
_LENGTH = "leg_length limb "


class PosedClaim(NamedTuple):
    """Claim at a pose.

    Attributes:
        name: name of the claim, up to a colon.
        outcome: outcome of the claim over the workspace.
        pose: the pose.
        verdict: verdict on the claim; None for a rank.
        length: for a claim with two poses, verdict on the leg length that is extreme at the pose; otherwise None.
    """

    name: str
    outcome: Outcome
    pose: WorkspacePose
    verdict: VerdictData | None = None
    length: VerdictData | None = None

    @property
    def key(self) -> str:
        """Dotted key, below ``limits``, of the limit in the case; empty for a rank and without a limit."""
        return "" if self.verdict is None else self.verdict.key or ""

    @property
    def beyond(self) -> float:
        """Excess over the limit, divided by the limit; negative for a satisfied limit."""
        return 0.0 if self.verdict is None else _beyond(self.verdict)


def refuted_claims(result: WorkspaceResult) -> Iterator[PosedClaim]:
    """Yield the refuted claims with their poses; a limit on a stroke has two poses."""
    for name, rank in ((REGULAR, result.regular), (CONSTRAINTS, result.constraints)):
        if rank is not None and rank.outcome is Outcome.REFUTED and rank.pose is not None:
            yield PosedClaim(name, rank.outcome, rank.pose)
    for each in result.extremes:
        if each.outcome is Outcome.REFUTED:
            yield from _at_poses(result, each)


def worst_claim(result: WorkspaceResult, sense: Sense) -> PosedClaim | None:
    """Return the claim with the largest excess over its limit, or with the smallest margin, and its pose.

    A singular pose is worse than any violated limit. Without limits, the claim with the worst F is returned. None is
    returned if no pose is known.

    Args:
        result: verdicts over the workspace.
        sense: sense of the first task.
    """
    singular = next((each for each in refuted_claims(result) if each.name == REGULAR and each.verdict is None), None)
    if singular is not None:
        return singular
    limited = [(_beyond(each), each) for each in result.extremes if each.limit is not None and each.reached is not None]
    for _, each in sorted(limited, key=lambda pair: -ordered(pair[0])):
        found = next(_at_poses(result, each), None)
        if found is not None:
            return found
    worst = Sense.MIN if sense is Sense.MAX else Sense.MAX
    for each in result.extremes:
        if each.limit is None and each.sense is worst and (each.name == "F" or each.name.startswith("F of ")):
            return next(_at_poses(result, each), None)
    return None


def _at_poses(result: WorkspaceResult, each: VerdictData) -> Iterator[PosedClaim]:
    """Yield an extreme value with each of its poses."""
    name = each.name.partition(":")[0]
    if each.key is not None and each.key.startswith(_OVER_POSES):
        for length in _lengths(result.extremes, each.name.partition(" limb ")[2]):
            if length.pose is not None:
                yield PosedClaim(name, each.outcome, length.pose, each, length)
    elif each.pose is not None:
        yield PosedClaim(name, each.outcome, each.pose, each)


def _lengths(extremes: Sequence[VerdictData], limb: str) -> list[VerdictData]:
    """Return the verdicts on the smallest and the largest length of a leg."""
    return [each for each in extremes if each.name == f"{_LENGTH}{limb}"]


def _beyond(each: VerdictData) -> float:
    """Return the excess of a value over its limit, divided by the limit; negative for a satisfied limit."""
    if each.limit is None or each.reached is None or each.sense is None:
        return float("-inf")
    sign = each.sense.sign
    return sign * (each.reached - each.limit) / (abs(each.limit) or 1.0)
