"""Verdicts along a tool path: the answer, the first violation with its line, and the table of quantities."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ..case.pathfile import PLACE
from ..case.pose import Free
from ..case.task import Sense
from ..path.idle import BEFORE_PATH
from ..proof.workspace.verdict import Outcome
from .claims import CLAIM_WORDS, SINGULAR, rank_line, unproved_ranks
from .motors import OUTCOME_WORDS, TONES
from .numbers import number, quantity_words
from .text import Line, TextTable, Tone, in_part
from .verdicts import (
    SHOWN,
    answer_words,
    exchange_lines,
    head_lines,
    open_lines,
    outcome_lines,
    proof_line,
    tightest_table,
    tolerance_lines,
    verdict_table,
)

if TYPE_CHECKING:
    from ..case.case import Case
    from ..path.idle import Idle
    from ..results.path import PathData, PathFaultData, PathProofData, PathResult, PathVerdictData

#: Title of the table of limits with the smallest margin.
TIGHTEST_ALONG = "limits with the smallest margin along the path"
#: Largest number of ignored G-code words that are shown.
_SHOWN = 6


def path_summary(
    case: Case, result: PathResult, command: Callable[[PathVerdictData], str] | None = None
) -> Iterator[Line | TextTable]:
    """Yield the verdicts on a robot along a tool path.

    Args:
        case: the case.
        result: the verdicts.
        command: function that returns the command that shows a violated claim, empty without such a command; None for a
            page, which lists claims only in tables.
    """
    path, answer = result.path, verdict_words(result)
    limited = [each for each in path.claims if each.limit is not None]
    subject = _subject_lines(path)
    yield from head_lines(case, answer, path.claims, path.dependent, is_proved=result.proved, subject=subject)
    wrong = first_refuted(result)
    if wrong is not None and wrong.fault is not None:
        yield Line(fault_words(wrong, wrong.fault), label="first violation", tone=Tone.FAULT)
        if shown := command and command(wrong):
            yield Line(shown, label="see it with", is_command=True)
    for each in path.claims:
        if each.sense is None:
            after = f": {each.reason}" if each.reason else ""
            yield rank_line(each.name, each.outcome, after + _place_words(each))
    yield from outcome_lines(limited)
    if command is not None:
        yield from _other_faults(path, wrong)
        yield from open_lines(limited)
    yield from _knot_lines(path, case.units.length)
    if path.actuators and (path.time is not None or path.knots is not None):
        yield _actuator_table(path)
    yield from in_part("smallest margins", tightest_table(limited, TIGHTEST_ALONG))
    yield from in_part("all quantities", along_table(case, path.claims))


def _subject_lines(path: PathData) -> Iterator[Line]:
    """Yield the file, the time and the ignored words of a path."""
    yield Line(f"{path.file}: {path.segments:,} segment{'s' * (path.segments != 1)}", label="path")
    if path.time is not None:
        yield Line(f"{number(path.time)} s", label="time", after=_untimed_words(path))
    idle = [each for each in path.idle if not each.is_motion]
    if idle:
        words = ", ".join(f"{each.word} (line {each.line})" for each in idle[:_SHOWN])
        rest = len(idle) - _SHOWN
        yield Line(words + (f", and {rest} more" if rest > 0 else ""), label="ignored (no motion)")
    for sentence in (*(_unchecked_words(each) for each in path.idle if each.is_motion), *(path.warnings or ())):
        yield Line(sentence, label="note", tone=Tone.CAUTION)


def _unchecked_words(motion: Idle) -> str:
    """Return a sentence about motions whose start is unknown, which are not part of the path."""
    one = f"line {motion.line}: its start is unknown, so this motion is not checked"
    lines = f"line {motion.line} and {motion.lines - 1} more"
    several = f"{lines}: the start of these motions is unknown, so they are not checked"
    hint = "; state it with --start X,Y,Z,A,B,C" if motion.word == BEFORE_PATH else ""
    return (one if motion.lines == 1 else several) + hint


def _other_faults(path: PathData, first: PathVerdictData | None) -> Iterator[Line]:
    """Yield the violated claims after the first one, in the order of the path."""
    others = [(each, each.fault) for each in path.claims if each.fault is not None and each is not first]
    others.sort(key=lambda pair: (pair[1].segment, pair[1].parameter) if pair[1] is not None else (0, 0.0))
    for k, (each, fault) in enumerate(others):
        if fault is not None:
            part = "violated claims" if k >= SHOWN else ""
            yield Line(fault_words(each, fault), label=OUTCOME_WORDS[Outcome.REFUTED], tone=Tone.FAULT, part=part)


def along_table(case: Case, verdicts: Sequence[PathVerdictData]) -> Iterator[TextTable]:
    """Yield the table of the verdicts on quantities."""
    rows = [each for each in verdicts if each.sense is not None]
    title, lines = "quantities along the path", [each.line for each in rows]
    yield from verdict_table(case, "claims", title, rows, lines=lines)


def _untimed_words(path: PathData) -> str:
    """Return the number of segments without a time; empty if all segments have a time."""
    if not path.untimed:
        return ""
    verb = "has" if path.untimed == 1 else "have"
    return f"; {path.untimed:,} of {path.segments:,} segments {verb} no feed rate or time: no speed is checked there"


def _knot_lines(path: PathData, unit: str) -> Iterator[Line]:
    """Yield the number of knots, and the proved deviation from the path between them."""
    knots = path.knots
    if knots is None:
        return
    lost = knots.number - knots.closed
    yield Line(f"{knots.number:,}", label="knots", after=f"; the robot cannot reach {lost:,} of them" if lost else "")
    if knots.within is None:
        return
    asked = f"{number(knots.within)} {unit}"
    if knots.deviation is None:
        yield Line(
            OUTCOME_WORDS[Outcome.OPEN], label=f"within {asked}", tone=TONES[Outcome.OPEN], after=f": {knots.reason}"
        )
    else:
        words = f"proved: between knots the platform stays within {number(knots.deviation)} {unit} of the path"
        yield Line(words, label=f"within {asked}", tone=TONES[Outcome.PROVED])


def _actuator_table(path: PathData) -> TextTable:
    """Return the table of the actuators' ranges, speeds and accelerations."""

    def column(word: str, values: Iterable[float | None]) -> list[str]:
        """Return a column with its head; empty if no value is known."""
        cells = ["" if each is None else number(each) for each in values]
        return [word, *cells] if any(cells) else []

    every = path.actuators
    columns = [
        ["actuator", *(each.actuator for each in every)],
        ["unit", *(each.unit for each in every)],
        column("smallest", (each.smallest for each in every)),
        column("largest", (each.largest for each in every)),
        column("speed", (each.speed for each in every)),
        column("acceleration", (each.acceleration for each in every)),
    ]
    headers, *rows = zip(*filter(None, columns), strict=True)
    has_knots = path.knots is not None and path.time is not None
    title = "proved ranges and largest speeds (per second)" if path.time is not None else "proved ranges"
    title += ", and largest accelerations between knots" if has_knots else ""
    return TextTable(headers, tuple(rows), name="actuators", title=title)


def checked_claims(result: PathResult) -> list[PathVerdictData]:
    """Return the claims that the verdict counts: ranks, and quantities with a limit."""
    return [each for each in result.path.claims if each.sense is None or each.limit is not None]


def verdict_words(result: PathResult) -> str:
    """Return the answer: everything is proved, or the numbers of violated, undecided and proved claims."""
    claims = checked_claims(result)
    ranks = [each.outcome for each in claims if each.sense is None]
    limits = [each.outcome for each in claims if each.sense is not None]
    return answer_words(ranks, limits, "at every point", is_proved=result.proved)


def path_proof_lines(case: Case, proof: PathProofData) -> Iterator[Line]:
    """Yield the proof of a solved design along its path."""
    whole = f"{proof.file}, {proof.segments:,} segment{'s' * (proof.segments != 1)}: "
    ranks = {each.name: each.outcome for each in proof.claims if each.name in CLAIM_WORDS}
    yield proof_line(proof, unproved_ranks(ranks), proof.claims, "path", "point", whole)
    stated = case.path
    for (name, dimension), value in zip(PLACE.items(), () if stated is None else stated.place, strict=False):
        if value != 0:
            given = getattr(proof.place, name)
            between = ""
            if isinstance(value, Free):
                ends = (number(case.units.shown(end, dimension)) for end in (value.lower, value.upper))
                between = f" (bounds {' .. '.join(ends)})"
            yield Line(f"{number(given)} {case.units.label(dimension)}", label=f"path placement {name}", after=between)
    yield from exchange_lines(proof, "path")
    yield from tolerance_lines(case, proof.joint_centre)


def tightest_along(proof: PathProofData) -> Iterator[TextTable]:
    """Yield the limits of a solved design with the smallest margin along its path."""
    yield from tightest_table(proof.claims, TIGHTEST_ALONG)


def first_refuted(result: PathResult) -> PathVerdictData | None:
    """Return the claim that is violated first in the order of the path; None without a violation."""
    claims = [(each, each.fault) for each in checked_claims(result)]
    places = [(fault.segment, fault.parameter, k) for k, (_, fault) in enumerate(claims) if fault is not None]
    return claims[min(places)[2]][0] if places else None


def fault_words(each: PathVerdictData, fault: PathFaultData) -> str:
    """Return a violated claim, with the first point of the path at which the violation is known."""
    where = f"line {fault.line}, {_along_words(fault.parameter)}"
    if each.limit is None or fault.value is None:
        return f"{where}: {SINGULAR[each.name]}"
    verb = "falls below" if each.sense is Sense.MIN else "exceeds"
    limit = f"{number(each.limit)} {each.unit}".rstrip()
    return f"{where}: {quantity_words(each.name)} {verb} {limit}"


def _along_words(parameter: float) -> str:
    """Return the position on a segment."""
    return f"at {number(parameter, 1.0)} of its segment"


def _place_words(each: PathVerdictData) -> str:
    """Return a comma, the line number and the position on the segment; empty if unknown."""
    if each.line is None or each.parameter is None:
        return ""
    return f", in line {each.line} {_along_words(each.parameter)}"
