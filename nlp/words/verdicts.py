"""Verdicts over a workspace or along a path in words: the answer, counts, the tightest limits, and every number."""

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
from .motors import TONES
from .numbers import number
from .poses import pose_words
from .text import Line, TextTable, Tone

if TYPE_CHECKING:
    from ..results.exchange import ExchangeData
    from ..results.verdicts import MachineData, VerdictData

#: So many claims are in the digest, and so many kinds of limits in the count of an outcome.
_TIGHTEST, _GROUPS = 5, 6
#: So many refuted claims, and open ones, are shown in full in a short view.
SHOWN = 2
_ORDER = (Outcome.REFUTED, Outcome.OPEN, Outcome.PROVED)


def answer_words(outcomes: Sequence[Outcome], where: str, *, is_proved: bool) -> str:
    """Return whether everything is proved, or how many claims are refuted, open and proved.

    Args:
        outcomes: outcomes of ranks and limits.
        where: the domain, such as ``at every point``.
        is_proved: whether everything is proved.
    """
    counts = ", ".join(f"{outcomes.count(each)} {each.value}" for each in _ORDER)
    return f"everything is proved {where}" if is_proved else f"not everything is proved: {counts}"


def proof_line(proof: ExchangeData, where: str, place: str, whose: str = "") -> Line:
    """Return whether a solved design is proved at every pose or point.

    Args:
        proof: the proof.
        where: name of the domain: ``workspace`` or ``path``.
        place: word for one of its poses.
        whose: words before the answer.
    """
    if proof.proved:
        return Line(f"{whose}proved: regular and within the limits at every {place}", label=where, tone=Tone.ANSWER)
    words = f"not proved: {counted(proof.designs[-1].unproved, 'claim')} refuted or open"
    return Line(whose + words, label=where, tone=Tone.NO_ANSWER)


def exchange_lines(proof: ExchangeData, where: str) -> Iterator[Line]:
    """Yield the designs of an exchange, and the number of its poses.

    Args:
        proof: proof of a solved design.
        where: domain of the poses: the workspace, or the path.
    """
    steps = ", ".join(f"{each.F:.7g} ({each.unproved} refuted or open)" for each in proof.designs)
    yield Line(f"F = {steps}", label="designs")
    count = len(proof.poses)
    words = f"{count} pose{'' if count == 1 else 's'} of the {where} became constraints"
    tighter = count and proof.tighter
    after = f", tighter than the limits by {tighter:g} of the program's number" if tighter else ""
    yield Line(words, label="exchange", after=after)


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
    """Yield the head of a judgement: title and answer, then the proved range of each dependent coordinate.

    Args:
        case: the case.
        answer: the answer in words.
        claims: the verdicts.
        dependent: names of the dependent coordinates; None without any.
        is_proved: whether everything is proved.
        subject: lines before the answer.
        about: lines after it, about the robots and poses that it covers.
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
        yield Line(words, label="follows")


def _size_of(name: str, claims: Sequence[VerdictData]) -> float:
    """Return a size beside which a coordinate is rounding: that of the positions of poses; 0 for a rotation."""
    poses = [each.pose for each in claims if each.pose is not None] if name in POSITION else []
    return max((abs(part) for pose in poses for part in pose.position), default=0.0)


def machine_lines(case: Case, joint_centre: float | None) -> Iterator[Line]:
    """Yield the machines that a verdict is about, where it is about more than the exact one."""
    if joint_centre is not None:
        words = f"every one whose joint centres are off by at most {joint_centre:g} {case.units.length}".rstrip()
        yield Line(words, label="machines")


def tightest_table(
    extremes: Sequence[VerdictData], title: str = "tightest limits over every pose"
) -> Iterator[TextTable]:
    """Yield the claims that are nearest to their limits: refuted ones first, then open ones."""
    limited = [each for each in extremes if each.limit is not None]
    limited.sort(key=lambda each: (_ORDER.index(each.outcome), ordered(_room(each))))
    seen: dict[str, VerdictData] = {}
    for each in limited:
        # The nearest of each limit stands for all legs and joints.
        key = getattr(each, "key", None) or f"{each.name.partition(' ')[0]} {each.sense}"
        seen.setdefault(f"{each.outcome} {key}", each)
    rows = [
        (
            each.name,
            _limit_words(each),
            "none" if each.bound is None else number(each.bound),
            "none" if each.reached is None else number(each.reached),
            Line(each.outcome.value, tone=TONES[each.outcome]),
        )
        for each in list(seen.values())[:_TIGHTEST]
    ]
    if rows:
        headers = ("nearest to its limit", "limit", "proven", "reached", "outcome")
        yield TextTable(headers, tuple(rows), name="tightest", title=title)


def _room(each: VerdictData) -> float:
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


def outcome_lines(claims: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield in one line each how many limits are proved, refuted and open, and which of them wholly."""
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
        yield Line(words, label=outcome.value, tone=TONES[outcome])


def _limit_of(claim: VerdictData) -> str:
    """Return the name of a claim's limit, the same for all limbs, joints and actuators."""
    return claim.name.partition(" ")[0].partition(".")[0]


def open_lines(claims: Sequence[VerdictData]) -> Iterator[Line]:
    """Yield the open claims with their reasons; the first ones belong to the answer."""
    found = [each for each in claims if each.outcome is Outcome.OPEN]
    for k, each in enumerate(found):
        reason = f": {each.reason}" if each.reason else ""
        yield Line(f"{each.name} {_limit_words(each)}{reason}", label="open", part="open claims" if k >= SHOWN else "")


def _limit_words(each: VerdictData) -> str:
    """Return the limit of a number with its sense and unit."""
    return f"{'>=' if each.sense is Sense.MIN else '<='} {number(each.limit or 0.0)} {each.unit}".rstrip()


def verdict_table(
    case: Case, name: str, title: str, rows: Sequence[VerdictData], *, lines: Sequence[int | None] = ()
) -> Iterator[TextTable]:
    """Yield a table of verdicts on numbers; none without rows.

    Args:
        case: the case.
        name: name of the table; that of numbers without a limit is ``ranges``.
        title: its title.
        rows: the verdicts.
        lines: line of a path's file of each row; rotations of its poses are roll, pitch and yaw. Empty for a workspace.
    """
    has_limits, form = name != "ranges", RotationForm.RPY if lines else None
    cells = []
    for k, each in enumerate(rows):
        reason = f": {each.reason}" if each.reason else ""
        values = [each.limit, each.bound, each.reached][0 if has_limits else 1 :]
        cells.append(
            (
                each.name,
                each.unit or "",
                "smallest" if each.sense is Sense.MIN else "largest",
                *("" if value is None else number(value) for value in values),
                Line(each.outcome.value, tone=TONES[each.outcome], after=reason),
                *(["" if lines[k] is None else str(lines[k])] if lines else []),
                "" if each.pose is None else pose_words(case, each.pose, form),
            )
        )
    limit, line = ("limit",) * has_limits, ("line",) * bool(lines)
    headers = ("number", "unit", "value", *limit, "proven bound", "reached", "outcome", *line, "at")
    if cells:
        yield TextTable(headers, tuple(cells), name=name, title=title)
