"""Verdicts over a workspace or along a tool path: the answer, counts, the limits with the smallest margin, tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ..case.case import Case
from ..case.pose import RotationForm
from ..case.task import Sense
from ..case.workspace import POSITION
from ..proof.workspace.verdict import Outcome
from ..results.rounding import ordered
from .lines import counted, title_line
from .motors import OUTCOME_WORDS, TONES
from .numbers import number, quantity_words
from .poses import pose_words
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from ..results.exchange import ExchangeData
    from ..results.verdicts import JointErrorsData, VerdictData

#: Largest number of claims in the digest, and of kinds of limits in the count of an outcome.
_TIGHTEST, _GROUPS = 5, 6
#: Number of violated claims, and of undecided ones, that a short view shows in full.
SHOWN = 2
_ORDER = (Outcome.REFUTED, Outcome.OPEN, Outcome.PROVED)


def answer_words(ranks: Sequence[Outcome], limits: Sequence[Outcome], where: str, *, is_proved: bool) -> str:
    """Return the answer: PROVED, or NOT PROVED with the numbers of violated, undecided and proved claims.

    Args:
        ranks: outcomes of the ranks.
        limits: outcomes of the limits.
        where: the domain in words, such as ``at every point``.
        is_proved: If true, everything is proved.
    """
    if is_proved:
        return f"PROVED {where}: no singularity" + (f", {counted(len(limits), 'limit')} satisfied" if limits else "")
    every = [*ranks, *limits]
    parts = ["a singularity"] if Outcome.REFUTED in ranks else []
    parts.append(f"{counted(limits.count(Outcome.REFUTED), 'limit')} violated")
    parts += [f"{every.count(each)} {OUTCOME_WORDS[each]}" for each in (Outcome.OPEN, Outcome.PROVED)]
    return f"NOT PROVED: {', '.join(parts)}"


def proof_line(
    proof: ExchangeData, ranks: Iterable[str], claims: Iterable[VerdictData], where: str, place: str, whose: str = ""
) -> Line:
    """Return the outcome of the proof for a solved design over its workspace or along its path.

    Args:
        proof: the proof.
        ranks: ranks that are not proved, in words.
        claims: verdicts of the proof; limits that are not proved are named.
        where: name of the domain: ``workspace`` or ``path``.
        place: word for a pose of the domain, ``pose`` or ``point``.
        whose: text before the answer.
    """
    if proof.proved:
        return Line(
            f"{whose}proved: no singularity and no violated limit at any {place}", label=where, tone=Tone.ANSWER
        )
    words = f"not proved: {counted(proof.designs[-1].unproved, 'claim')} violated or undecided"
    named = _tightest([each for each in claims if each.limit is not None and each.outcome is not Outcome.PROVED])
    texts = [*ranks, *map(_unproved_words, named)][:SHOWN]
    words += f": {'; '.join(texts)}" if texts else ""
    return Line(whose + words, label=where, tone=Tone.NO_ANSWER)


def _unproved_words(each: VerdictData) -> str:
    """Return a limit that is not proved with its outcome, the proved bound and the reached value."""
    values = {"proved bound": each.bound, "reached": each.reached}
    texts = [OUTCOME_WORDS[each.outcome], *(f"{key} {number(x)}" for key, x in values.items() if x is not None)]
    return f"{quantity_words(each.name)} {_limit_words(each)} ({', '.join(texts)})"


def exchange_lines(proof: ExchangeData, where: str) -> Iterator[Line]:
    """Yield F at each iteration of a solve with a proof, and the number of poses that were added as constraints.

    Args:
        proof: proof of a solved design.
        where: domain of the poses: ``workspace`` or ``path``.
    """
    first, *others = proof.designs
    steps = [f"F = {first.F:.7g} ({counted(first.unproved, 'claim')} not proved)"]
    steps += [f"{each.F:.7g} ({each.unproved})" for each in others]
    yield Line(", ".join(steps), label="iterations")
    count = len(proof.poses)
    words = f"{count} {where} pose was" if count == 1 else f"{count or 'no'} {where} poses were"
    tighter = count and proof.tighter
    after = f" (with a safety margin of {100 * tighter:g} %)" if tighter else ""
    yield Line(f"{words} added as constraint{'' if count == 1 else 's'}", label="exchange", after=after)


def head_lines(
    case: Case,
    answer: str,
    claims: Sequence[VerdictData],
    dependent: Sequence[str] | None,
    *,
    is_proved: bool,
    subject: Iterable[Line] = (),
    about: Iterable[Line] = (),
) -> Iterator[Line]:
    """Yield the head of a summary: title and answer, then the proved range of each dependent coordinate.

    Args:
        case: the case.
        answer: the answer in words.
        claims: the verdicts.
        dependent: names of the dependent coordinates, or None.
        is_proved: If true, everything is proved.
        subject: lines before the answer.
        about: lines after the answer, about the robots and poses that the answer covers.
    """
    yield title_line(case)
    yield from subject
    yield Line(answer, label="verdict", tone=Tone.ANSWER if is_proved else Tone.NO_ANSWER)
    yield from about
    yield from _following_lines(dependent or (), claims)


def _following_lines(names: Sequence[str], claims: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield the proved range of each dependent coordinate of the pose."""
    for name in names:
        ends = {each.sense: each for each in claims if each.name == name}
        bounds = [ends[sense].bound if sense in ends else None for sense in (Sense.MIN, Sense.MAX)]
        size = _size_of(name, claims)
        low, high = ("unknown" if each is None else number(each, size) for each in bounds)
        unit = next((each.unit or "" for each in ends.values()), "")
        words = f"{name} {low} to {high} {unit}".rstrip() if None not in bounds else f"{name}, no range is proved"
        yield Line(words, label="dependent coordinate")


def _size_of(name: str, claims: Sequence[VerdictData]) -> float:
    """Return the magnitude to which the rounding error of a coordinate is relative; 0 for a rotation."""
    poses = [each.pose for each in claims if each.pose is not None] if name in POSITION else []
    return max((abs(part) for pose in poses for part in pose.position), default=0.0)


def tolerance_lines(case: Case, joint_centre: float | None) -> Iterator[Line]:
    """Yield the tolerance that a verdict covers; nothing for a verdict on the exact robot only."""
    if joint_centre is not None:
        words = f"covers every robot whose joint centres are off by at most {joint_centre:g} {case.units.length}"
        yield Line(words.rstrip(), label="tolerance")


def tightest_table(
    extremes: Sequence[VerdictData], title: str = "limits with the smallest margin over all poses"
) -> Iterator[TextTable]:
    """Yield the limits with the smallest margin: violated ones first, then undecided ones."""
    rows = [
        (
            quantity_words(each.name),
            _limit_words(each),
            "none" if each.bound is None else number(each.bound),
            "none" if each.reached is None else number(each.reached),
            Line(OUTCOME_WORDS[each.outcome], tone=TONES[each.outcome]),
        )
        for each in _tightest([each for each in extremes if each.limit is not None])[:_TIGHTEST]
    ]
    if rows:
        headers = ("quantity", "limit", "proved bound", "reached", "outcome")
        yield TextTable(headers, tuple(rows), name="tightest", title=title)


def _tightest(limited: Sequence[VerdictData]) -> list[VerdictData]:
    """Return the claim with the smallest margin of each limit and outcome: violated, undecided, then proved ones."""
    seen: dict[str, VerdictData] = {}
    for each in sorted(limited, key=lambda each: (_ORDER.index(each.outcome), ordered(_room(each)))):
        # One claim stands for all legs and joints with this limit.
        key = getattr(each, "key", None) or f"{each.name.partition(' ')[0]} {each.sense}"
        seen.setdefault(f"{each.outcome} {key}", each)
    return list(seen.values())


def _room(each: VerdictData) -> float:
    """Return the relative margin between the proved bound and the limit; negative beyond the limit."""
    limit = each.limit or 0.0
    value = each.bound if each.bound is not None else each.reached
    if value is None:
        return 0.0
    return (value - limit if each.sense is Sense.MIN else limit - value) / (abs(limit) or 1.0)


def violating_robot(case: Case, name: str, machine: JointErrorsData) -> TextTable:
    """Return the joint-centre errors of the robot within the tolerance that violates a claim."""
    unit, title = case.units.length, f"robot within the tolerance that violates: {quantity_words(name)}"
    if machine.centres is not None:
        off = [(each.joint, ", ".join(f"{part:.6g}" for part in each.error)) for each in machine.centres]
        return TextTable(("joint", f"error\n{unit}"), tuple(off), name="machine", title=title)
    rows = [
        (leg.name, *(", ".join(f"{part:.6g}" for part in each) for each in (base, platform)))
        for leg, base, platform in zip(case.model.legs, machine.base or (), machine.platform or (), strict=True)
    ]
    headers = ("leg", f"base joint error\n{unit}", f"platform joint error\n{unit}")
    return TextTable(headers, tuple(rows), name="machine", title=title)


def outcome_lines(claims: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield a line for each outcome: the number of limits, and their names."""
    every = Counter(map(_limit_of, claims))
    for outcome in _ORDER:
        counts = Counter(_limit_of(each) for each in claims if each.outcome is outcome)
        if not counts:
            continue
        texts = []
        for name, count in counts.items():
            size = every[name]
            share = f"{count} of {size}" if count < size else "the" if size == 1 else f"all {size}"
            texts.append(f"{share} {name}")
        words = f"{counted(counts.total(), 'limit')}: {', '.join(texts[:_GROUPS])}"
        words += f" and {len(texts) - _GROUPS} more kinds" if len(texts) > _GROUPS else ""
        yield Line(words, label=OUTCOME_WORDS[outcome], tone=TONES[outcome])


def _limit_of(claim: VerdictData) -> str:
    """Return the name of the limit of a claim, without limb, joint or actuator."""
    name = claim.name.partition(" ")[0]
    return name if name.startswith("actuator.") else name.partition(".")[0]


def open_lines(claims: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield the undecided claims with their reasons; those after the first few are in the part "undecided claims"."""
    found = [each for each in claims if each.outcome is Outcome.OPEN]
    for k, each in enumerate(found):
        reason = f": {each.reason}" if each.reason else ""
        part = "undecided claims" if k >= SHOWN else ""
        yield Line(
            f"{quantity_words(each.name)} {_limit_words(each)}{reason}", label=OUTCOME_WORDS[Outcome.OPEN], part=part
        )


def _limit_words(each: VerdictData) -> str:
    """Return the limit of a quantity as an inequality with its unit."""
    return f"{'>=' if each.sense is Sense.MIN else '<='} {number(each.limit or 0.0)} {each.unit}".rstrip()


def verdict_table(
    case: Case, name: str, title: str, rows: Sequence[VerdictData], *, lines: Sequence[int | None] = ()
) -> Iterator[TextTable]:
    """Yield a table of verdicts on quantities; no table without rows.

    Args:
        case: the case.
        name: name of the table; ``ranges`` for quantities without a limit.
        title: title of the table.
        rows: verdicts, a row each.
        lines: line number in the path file for each row; empty for a workspace. Along a path, rotations are shown as
            roll, pitch and yaw.
    """
    has_limits, form = name != "ranges", RotationForm.RPY if lines else None
    cells = []
    for k, each in enumerate(rows):
        reason = f": {each.reason}" if each.reason else ""
        values = [each.limit, each.bound, each.reached][0 if has_limits else 1 :]
        cells.append(
            (
                quantity_words(each.name),
                each.unit or "",
                "smallest" if each.sense is Sense.MIN else "largest",
                *("" if value is None else number(value) for value in values),
                Line(OUTCOME_WORDS[each.outcome], tone=TONES[each.outcome], after=reason),
                *(["" if lines[k] is None else str(lines[k])] if lines else []),
                "" if each.pose is None else pose_words(case, each.pose, form),
            )
        )
    limit, line = ("limit",) * has_limits, ("line",) * bool(lines)
    headers = ("quantity", "unit", "extreme", *limit, "proved bound", "reached", "outcome", *line, "pose")
    if cells:
        yield TextTable(headers, tuple(cells), name=name, title=title, with_unit=tuple(range(3, 5 + has_limits)))
