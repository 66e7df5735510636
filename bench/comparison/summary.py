"""What the attempts of a race come to: correct answers, times and evaluations, by case and peer.

An answer is correct by :class:`.judging.Reference`: the best F known is that of this program's own search, or a better
feasible one of any method in the same run.
"""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from .judging import Reference, Verdict


class Best(NamedTuple):
    """The best answer known of a case: its reference, and the method that found it where that is not this program's."""

    reference: Reference
    finder: str
    contradicts_proof: bool


class Elsewhere(NamedTuple):
    """Answers in another working mode than home's: their number, and the best F among them, if any."""

    count: int
    F: float | None


class Score(NamedTuple):
    """A peer on a case.

    Attributes:
        peer: its name.
        attempts: number.
        correct: of them, as returned.
        polished: of them, after the polish; None for local methods.
        error: median difference of F from the best known, as returned, of feasible answers: a part of F, or of its
            scale where the best is 0; None where none is feasible.
        seconds: median CPU time of an attempt.
        evaluations: median number of evaluations of F; None for this program's searches.
        iterations: median number of iterations of this program's searches; None for others.
        spent: attempts that their budget ended.
        expected: CPU seconds of all attempts, with their polish, for each correct answer; None where there is none.
        note: why there are fewer attempts, or faults; nothing where there is nothing to say.
    """

    peer: str
    attempts: int
    correct: int
    polished: int | None
    error: float | None
    seconds: float | None
    evaluations: float | None
    iterations: float | None
    spent: int
    expected: float | None
    note: str


def best_of(case: Mapping[str, Any], pairs: Sequence[Mapping[str, Any]]) -> Best:
    """Return the best answer known of a case from all attempts on it."""
    best = Reference(case["F"], case["is_proved"], case["sign"], case["scale"])
    finder, contradicts = "", False
    for pair in pairs:
        for verdict in (found for attempt in pair["attempts"] for found in _verdicts(attempt)):
            if best.is_beaten_by(verdict):
                contradicts = contradicts or best.is_proved
                best, finder = best._replace(F=verdict.F, is_proved=False), pair["peer"]
    return Best(best, finder, contradicts)


def elsewhere(case: Mapping[str, Any], pairs: Sequence[Mapping[str, Any]]) -> Elsewhere:
    """Return the answers that are points of the case in another working mode than home's."""
    found = [
        verdict.F
        for pair in pairs
        for attempt in pair["attempts"]
        for verdict in [_verdicts(attempt)[-1]]
        if verdict.is_assembled and not verdict.in_home_mode
    ]
    return Elsewhere(len(found), min(found, key=lambda F: case["sign"] * F, default=None))


def score_of(pair: Mapping[str, Any], best: Reference, *, is_global: bool) -> Score:
    """Return what a peer's attempts on a case come to."""
    attempts = pair["attempts"]
    judged = [_verdicts(attempt) for attempt in attempts]
    correct = sum(best.accepts(verdicts[0]) for verdicts in judged)
    at_last = sum(best.accepts(verdicts[-1]) for verdicts in judged)
    spent = sum(each["seconds"] + each["polish_seconds"] for each in attempts)
    faults = [each["fault"] for each in attempts if each["fault"]]
    notes = [pair["note"]] if pair["note"] else []
    notes += [f"{pair['losses']} times its process was lost"] if pair["losses"] and not pair["note"] else []
    notes += [f"{len(faults)} failed: {faults[0]}"] if faults else []
    return Score(
        pair["peer"],
        len(attempts),
        correct,
        at_last if is_global else None,
        _median([abs(each[0].F - best.F) / best.unit for each in judged if each[0].is_feasible]),
        _median([each["seconds"] for each in attempts]),
        _median([each["evaluations"] for each in attempts if each["evaluations"] is not None]),
        _median([each["iterations"] for each in attempts if each["iterations"] is not None]),
        sum(each["spent"] for each in attempts),
        spent / at_last if at_last else None,
        "; ".join(notes),
    )


def _verdicts(attempt: Mapping[str, Any]) -> list[Verdict]:
    """Return the verdicts on an attempt: as returned, and after the polish."""
    found = [attempt["verdict"], *([attempt["polished"]] if attempt["polished"] else [])]
    return [Verdict(**each) for each in found]


def _median(values: Sequence[float]) -> float | None:
    return statistics.median(values) if values else None
