"""Trade-off curves as HTML: within the page about a case, and as a page of their own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...case.case import Case
from ...results.objective import objective_label
from ...results.tradeoff import (
    TradeoffResult,
    over_words,
    throughout_words,
    tradeoff_table,
    tradeoff_words,
)
from .charts import Curve, Spot, line_chart
from .markup import Markup, answer_box, html_table, join_markup, paragraphs, tag, whole_page


def tradeoff_figures(case: Case, results: Sequence[TradeoffResult], here: Mapping[str, float] | None = None) -> Markup:
    """Return charts of F over numbers, one for each number and task, side by side.

    Args:
        case: the case.
        results: its trade-offs.
        here: value of a number in the case that a page is about, by the number's name; marked in its chart.
    """
    charts = [
        _chart(case, each, task, None if here is None else here.get(each.over))
        for each in results
        for task in range(len(each.tasks))
    ]
    return tag("div", *charts, class_="charts")


def tradeoff_rows(result: TradeoffResult) -> Markup:
    """Return the table of a trade-off, and below it what is active at all of its values."""
    throughout = throughout_words(result)
    below = tag("p", f"Active throughout: {throughout}.") if throughout else None
    return join_markup([html_table(tradeoff_table(result), over_words(result)), below])


def tradeoff_page(case: Case, result: TradeoffResult) -> str:
    """Return a whole page about a trade-off, which opens without a network.

    Its script only says which tables scroll: all words, charts and tables stand there without it.
    """
    title = case.title or case.name
    solved = [point for point in result.points if point.status.is_answer]
    answer = f"{len(solved)} of {len(result.points)} values have an answer"
    body = join_markup(
        [
            tag("h2", "F against the number"),
            paragraphs(["Each point is a solve of its own, with everything that is free chosen anew."]),
            tradeoff_figures(case, [result]),
            paragraphs(f"{line}." for line in tradeoff_words(result)),
            tradeoff_rows(result),
        ]
    )
    return whole_page(
        f"{title} - trade-off",
        f"{case.name}, robot {case.model.name}: {over_words(result)}",
        answer_box([answer], is_answer=bool(solved)),
        tag("section", body),
        heading=title,
    )


def _chart(case: Case, result: TradeoffResult, task: int, here: float | None) -> Markup:
    values = [point.value for point in result.points]
    F = [math.nan if point.tasks[task] is None else float(point.tasks[task] or 0.0) for point in result.points]
    unit = f" {result.unit}" if result.unit else ""
    name = f"{result.tasks[task]}: " if len(result.tasks) > 1 else ""
    solved = [(value, each) for value, each in zip(values, F, strict=True) if math.isfinite(each)]
    words = f"{name}no value of {result.over} from {values[0]:.5g} to {values[-1]:.5g}{unit} has an answer."
    if solved:
        (first, F_first), (last, F_last) = solved[0], solved[-1]
        words = f"{name}F is {F_first:.6g} at {result.over} = {first:.5g}{unit} and {F_last:.6g} at {last:.5g}{unit}."
        missing = len(values) - len(solved)
        if missing:
            words += f" {missing} of {len(values)} values have no answer."
    chart = line_chart(
        [Curve(values, F, "curve")],
        [
            Spot(value, each, "spot" if value == here else "other", f"{value:.6g}{unit}: F = {each:.7g}")
            for value, each in solved
        ],
        words=words,
        labels=(f"{result.over}, {result.unit}" if result.unit else result.over, objective_label(case)),
    )
    return tag("figure", chart, tag("figcaption", words))
