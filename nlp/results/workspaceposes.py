"""Poses that a judged workspace names: those that refute a claim, the worst one, and the command that shows each."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ..case.task import Sense
from ..proof.workspace.verdict import Outcome
from .rounding import number, ordered
from .text import Line
from .verdictwording import SHOWN

if TYPE_CHECKING:
    from .verdicts import VerdictData, WorkspacePose
    from .workspace import WorkspaceResult

#: Beginning of the keys of limits that no single pose refutes, but two: the shortest and the longest length of a leg.
_OVER_POSES = "actuator."
#: Beginning of the names of the lengths of legs.
_LENGTH = "leg_length limb "


class PosedClaim(NamedTuple):
    """A claim at a pose.

    Attributes:
        words: the claim, and its value there.
        outcome: of the claim over the workspace.
        pose: the pose.
        key: dotted key, below ``limits``, of the limit in the case; empty for regular poses and without a limit.
        beyond: part of the limit by which it is passed; negative where it is kept.
    """

    words: str
    outcome: Outcome
    pose: WorkspacePose
    key: str = ""
    beyond: float = 0.0

    @property
    def name(self) -> str:
        """The claim alone."""
        return self.words.partition(":")[0]


def refuted_claims(result: WorkspaceResult) -> Iterator[PosedClaim]:
    """Yield the claims that are refuted, each with its pose; a limit on a stroke has two poses."""
    regular = result.regular
    if regular.outcome is Outcome.REFUTED and regular.pose is not None:
        yield PosedClaim("regular: J is singular", regular.outcome, regular.pose)
    lost = result.constraints
    if lost is not None and lost.outcome is Outcome.REFUTED and lost.pose is not None:
        yield PosedClaim("constraints regular: their rank is lost", lost.outcome, lost.pose)
    for each in result.extremes:
        if each.outcome is Outcome.REFUTED:
            yield from _at_poses(result, each)


def worst_claim(result: WorkspaceResult, sense: Sense) -> PosedClaim | None:
    """Return the claim that is farthest beyond its limit, or, where all are kept, nearest to it; with its pose.

    A singular pose is worse than any limit. Without limits it is the worst F. None where no pose is known.

    Args:
        result: of judging the workspace.
        sense: of the first task.
    """
    singular = next((each for each in refuted_claims(result) if each.words.startswith("regular")), None)
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


def seeing_lines(result: WorkspaceResult, command: Callable[[WorkspacePose], str]) -> Iterator[Line]:
    """Yield the commands that show what refutes claims: of each limit the claim that is farthest beyond it.

    Args:
        result: of judging the workspace.
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
        yield Line(each.words, label="refuted", part=part)
        yield Line(command(each.pose), label="see it with", is_command=True, part=part)
    # One number may have two limits: a claim is its name with the limit's key.
    left = len({(each.name, each.key) for each in claims}) - len(shown)
    if left:
        yield Line(f"{left}: --all, --csv FILE and --json FILE list them", label="other refuted claims")


def _at_poses(result: WorkspaceResult, each: VerdictData) -> Iterator[PosedClaim]:
    """Yield an extreme with the poses at which it is reached."""
    worst = "smallest" if each.sense is Sense.MIN else "largest"
    value = "" if each.reached is None else f" {worst} {number(each.reached)} {each.unit}".rstrip()
    limit = "" if each.limit is None else f", limit {each.key} = {number(each.limit)} {each.unit}".rstrip()
    if each.key is not None and each.key.startswith(_OVER_POSES):
        limb = each.name.partition(" limb ")[2]
        for own in _lengths(result.extremes, limb):
            if own.pose is not None:
                end = "shortest" if own.sense is Sense.MIN else "longest"
                yield PosedClaim(
                    f"{each.name}:{value}{limit}; limb {limb} at its {end}",
                    each.outcome,
                    own.pose,
                    each.key,
                    _beyond(each),
                )
    elif each.pose is not None:
        yield PosedClaim(f"{each.name}:{value}{limit}", each.outcome, each.pose, each.key or "", _beyond(each))


def _lengths(extremes: Sequence[VerdictData], limb: str) -> list[VerdictData]:
    """Return the smallest and the largest length of a leg."""
    return [each for each in extremes if each.name == f"{_LENGTH}{limb}"]


def _beyond(each: VerdictData) -> float:
    """Return how far a number is beyond its limit, as a part of the limit; negative where it is kept."""
    if each.limit is None or each.reached is None or each.sense is None:
        return float("-inf")
    sign = each.sense.sign
    return sign * (each.reached - each.limit) / (abs(each.limit) or 1.0)
