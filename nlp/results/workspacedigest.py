"""The digest of verdicts on a workspace: verdict, machines, F, and the claims that are nearest to their limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..case.case import Case
from ..case.task import Sense
from ..proof.workspace.verdict import Outcome
from .rounding import number, ordered
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from .workspace import ExtremeData, MachineData, WorkspaceProofData, WorkspaceResult

#: Tone of each outcome.
TONES = {Outcome.PROVED: Tone.HOLDS, Outcome.REFUTED: Tone.FAULT, Outcome.OPEN: Tone.CAUTION}
#: So many claims are in the digest.
_TIGHTEST = 5
_ORDER = (Outcome.REFUTED, Outcome.OPEN, Outcome.PROVED)


def verdict_lines(case: Case, result: WorkspaceResult) -> Iterator[Line | TextTable]:
    """Yield the verdict on a machine, what it is about, F, and the tightest claims."""
    yield Line(verdict_words(result), label="verdict", tone=Tone.ANSWER if result.proved else Tone.NO_ANSWER)
    yield from machine_lines(case, result.joint_centre)
    for low, high in zip(result.extremes, result.extremes[1:], strict=False):
        if low.name == high.name and low.name.partition(" ")[0] == "F" and low.bound and high.bound:
            ends = f"{number(low.bound)} to {number(high.bound)}"
            yield Line(ends, label=low.name, after=", at no pose smaller or larger")
    yield from tightest_table(result.extremes)


def verdict_words(result: WorkspaceResult) -> str:
    """Return the verdict in one clause: counts of ranks and limits, and of numbers without a limit that stay open."""
    claims = [each.outcome for each in (result.regular, result.constraints) if each is not None]
    claims += [each.outcome for each in result.extremes if each.limit is not None]
    counts = ", ".join(f"{claims.count(each)} {each.value}" for each in _ORDER)
    words = "everything is proved for every pose" if result.proved else f"not everything is proved: {counts}"
    shown = sum(each.limit is None and each.outcome is Outcome.OPEN for each in result.extremes)
    if not shown:
        return words
    return f"{words}; {shown} number{' without a limit stays' if shown == 1 else 's without a limit stay'} open"


def machine_lines(case: Case, joint_centre: float | None) -> Iterator[Line]:
    """Yield the machines that a verdict is about, where it is about more than the exact one."""
    if joint_centre is not None:
        words = f"every one whose joint centres are off by at most {joint_centre:g} {case.units.length}".rstrip()
        yield Line(words, label="machines")


def tightest_table(extremes: Sequence[ExtremeData]) -> Iterator[TextTable]:
    """Yield the claims that are nearest to their limits: refuted ones first, then open ones."""
    limited = [each for each in extremes if each.limit is not None]
    limited.sort(key=lambda each: (_ORDER.index(each.outcome), ordered(_room(each))))
    seen: dict[str, ExtremeData] = {}
    for each in limited:
        # The nearest of each limit stands for all legs and joints.
        seen.setdefault(f"{each.outcome} {each.key}", each)
    rows = [
        (
            each.name,
            f"{'>=' if each.sense is Sense.MIN else '<='} {number(each.limit or 0.0)} {each.unit}".rstrip(),
            "none" if each.bound is None else number(each.bound),
            "none" if each.reached is None else number(each.reached),
            Line(each.outcome.value, tone=TONES[each.outcome]),
        )
        for each in list(seen.values())[:_TIGHTEST]
    ]
    if rows:
        headers = ("nearest to its limit", "limit", "proven", "reached", "outcome")
        yield TextTable(headers, tuple(rows), name="tightest", title="tightest limits over every pose")


def _room(each: ExtremeData) -> float:
    """Return the distance of a claim's bound from its limit, as a part of the limit; negative beyond it."""
    limit = each.limit or 0.0
    value = each.bound if each.bound is not None else each.reached
    if value is None:
        return 0.0
    return (value - limit if each.sense is Sense.MIN else limit - value) / (abs(limit) or 1.0)


def refuting_machine(case: Case, name: str, machine: MachineData) -> TextTable:
    """Return the errors of the joint centres of the machine that refutes a claim."""
    unit = case.units.length
    if machine.centres is not None:
        off = [(each.joint, ", ".join(f"{part:.6g}" for part in each.error)) for each in machine.centres]
        return TextTable(
            ("joint", f"off by\n{unit}"), tuple(off), name="machine", title=f"the machine that refutes: {name}"
        )
    rows = [
        (leg.name, *(", ".join(f"{part:.6g}" for part in each) for each in (base, platform)))
        for leg, base, platform in zip(case.model.legs, machine.base or (), machine.platform or (), strict=True)
    ]
    headers = ("leg", f"base joint off by\n{unit}", f"platform joint off by\n{unit}")
    return TextTable(headers, tuple(rows), name="machine", title=f"the machine that refutes: {name}")


def proof_digest(case: Case, proof: WorkspaceProofData | None) -> Iterator[Line | TextTable]:
    """Yield the machines of a proof of a solved design, and its tightest claims."""
    if proof is not None:
        yield from machine_lines(case, proof.joint_centre)
        yield from tightest_table(proof.extremes)
