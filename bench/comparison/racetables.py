"""Markdown tables of the comparison of methods: methods, expected times by case, and one table for each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .summary import Best, Score, best_of, elsewhere, score_of
from .tables import number, percent, table

#: Row to which the ratios refer.
_OWN = "screwsynth solve"


def race_tables(section: Mapping[str, Any]) -> str:
    """Return all tables of the comparison."""
    peers = {peer["name"]: peer for peer in section["peers"]}
    best, scores = {}, {}
    for name, case in section["cases"].items():
        pairs = [pair for pair in section["pairs"] if pair["case"] == name]
        best[name] = best_of(case, pairs)
        scores[name] = [
            score_of(pair, best[name].reference, is_global=peers[pair["peer"]]["kind"] == "global") for pair in pairs
        ]
    parts = [_plan_lines(section), _methods(section["peers"]), _expected(scores)]
    for name, case in section["cases"].items():
        pairs = [pair for pair in section["pairs"] if pair["case"] == name]
        parts += [f"### `{name}`\n", _case_lines(name, case, best[name], pairs), _case_table(scores[name])]
    return "\n".join(parts)


def _plan_lines(section: Mapping[str, Any]) -> str:
    """Return the budgets, and the share of CPU time in wall time."""
    plan, budget = section["plan"], section["plan"]["budget"]
    attempts = [each for pair in section["pairs"] for each in pair["attempts"]]
    seconds, wall = (sum(each[key] for each in attempts) for key in ("seconds", "wall"))
    share = f" CPU time was {percent(seconds / wall)} of wall time." if wall else ""
    return (
        f"Each method has up to {plan['seeds']} attempts on each case, "
        f"within {number(plan['pair_seconds'])} s of CPU time. "
        f"An attempt has at most {budget['evaluations']:,} evaluations and {number(budget['seconds'])} s. "
        f"{len(attempts):,} attempts in total.{share}\n"
    )


def _methods(peers: Sequence[Mapping[str, Any]]) -> str:
    """Return the methods with search, derivatives and constraints, and the number of lines of their call."""
    rows = [
        (
            each["name"],
            each["kind"],
            each["derivatives"],
            "native" if each["constraints"] == "own" else each["constraints"],
            str(each["lines"]),
            f"`bench/peers/{each['module']}.py`",
        )
        for each in peers
    ]
    return table(("method", "search", "derivatives", "constraints", "lines", "file"), rows)


def _expected(scores: Mapping[str, Sequence[Score]]) -> str:
    """Return the expected time to a correct answer of every method on every case."""
    names = [score.peer for score in next(iter(scores.values()), [])]
    least = [
        min((score.expected for score in each if score.expected is not None), default=None) for each in scores.values()
    ]
    rows = []
    for k, name in enumerate(names):
        found = [None if each[k].expected is None else 1e3 * each[k].expected for each in scores.values()]
        is_least = [each[k].expected == best for each, best in zip(scores.values(), least, strict=True)]
        cells = [f"**{number(ms)}**" if bold and ms else number(ms) for ms, bold in zip(found, is_least, strict=True)]
        tried = [each[k].attempts > 0 for each in scores.values()]
        rows.append((name, *(cell if has else "" for cell, has in zip(cells, tried, strict=True))))
    text = "Expected CPU time to a correct answer, ms. A dash: no correct attempt. Empty: no attempt:\n\n"
    return text + table(("method", *(f"`{case}`" for case in scores)), rows)


def _case_lines(name: str, case: Mapping[str, Any], best: Best, pairs: Sequence[Mapping[str, Any]]) -> str:
    """Return the sizes of a case, its best known F, and remarks."""
    proof = ", proved to be the optimum" if best.reference.is_proved else ", the best known"
    sizes = f"{case['variables']} variables, {case['constraints']} inequalities, {case['equations']} equations"
    formulation = f"Formulation: {number(1e3 * case['formulation_seconds'])} ms."
    lines = [f"{sizes}; F = {best.reference.F:.9g}{proof}. {formulation}"]
    if best.finder:
        lines.append(f"{best.finder} has this F; `screwsynth solve` with {case['starts']} starts has {case['F']:.9g}.")
    if best.contradicts_proof:
        lines.append(f"**A feasible answer contradicts the proof of {name}.**")
    others = elsewhere(case, pairs)
    if others.count:
        lines.append(
            f"{others.count} answers in another working mode than that of home are not counted; "
            f"the best has F = {others.F:.7g}."
        )
    return " ".join(lines) + "\n"


def _case_table(scores: Sequence[Score]) -> str:
    """Return the scores of a case."""
    own = next((each.expected for each in scores if each.peer == _OWN), None)
    rows = []
    for each in scores:
        ratio = None if own is None or each.expected is None else each.expected / own
        work = f"{each.iterations:,.0f} it." if each.iterations is not None else number(each.evaluations)
        rows.append(
            (
                each.peer,
                f"{each.correct} of {each.attempts}" if each.attempts else "-",
                "" if each.polished is None or not each.attempts else f"{each.polished} of {each.attempts}",
                "-" if each.error is None else f"{each.error:.0e}",
                "-" if each.seconds is None else number(1e3 * each.seconds),
                work,
                "-" if each.expected is None else number(1e3 * each.expected),
                number(ratio, 2),
                "; ".join(part for part in (_spent(each), each.note) if part),
            )
        )
    columns = (
        "method",
        "correct",
        "correct after polishing",
        "error of F",
        "median ms",
        "evaluations",
        "expected ms",
        "ratio",
        "remark",
    )
    return table(columns, rows)


def _spent(score: Score) -> str:
    return f"budget spent in {score.spent} of {score.attempts}" if score.spent else ""
