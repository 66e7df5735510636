"""Trade-off curves as HTML: within the page about a case, and as a page of their own."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...case.case import Case
from ...errors import EvaluationError
from ...results.objective import objective_label
from ...results.tradeoff import (
    TradeoffPointData,
    TradeoffResult,
    over_words,
    throughout_words,
    tradeoff_table,
    tradeoff_words,
)
from ...solver.tradeoff import Tradeoff, TradeoffPoint
from ..pictures.solutions import drawings_of
from .charts import Curve, Spot, line_chart
from .designs import Design, bend_lines, bends, design_figures, free_numbers
from .markup import (
    Markup,
    answer_box,
    contents_and_body,
    html_table,
    join_markup,
    paragraphs,
    tag,
    whole_page,
)


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


def tradeoff_page(found: Tradeoff, result: TradeoffResult) -> str:
    """Return a whole page about a trade-off, which opens without a network.

    Its script only says which tables scroll: all words, charts, pictures and tables stand there without it.

    Args:
        found: the trade-off.
        result: the same as a result.
    """
    case = found.points[0].solution.case
    title = case.title or case.name
    solved = [point for point in result.points if point.status.is_answer]
    answer = f"{len(solved)} of {len(result.points)} values have an answer"
    designs = [
        _design(result, row, point)
        for row, point in zip(result.points, found.points, strict=False)
        if row.status.is_answer
    ]
    sections = [
        (
            "curve",
            "F against the number",
            join_markup(
                [
                    paragraphs(["Each point is a solve of its own, with everything that is free chosen anew."]),
                    tag(
                        "div",
                        tag("div", tradeoff_figures(case, [result]), class_="wide"),
                        bend_lines(designs, "Where the curve bends"),
                        class_="beside",
                    ),
                    paragraphs(f"{line}." for line in tradeoff_words(result)),
                ]
            ),
        ),
        ("designs", "The design at each value", design_figures(designs)),
        ("values", "Every value", tradeoff_rows(result)),
    ]
    contents, body = contents_and_body(sections)
    return whole_page(
        f"{title} - trade-off",
        f"{case.name}, robot {case.model.name}: {over_words(result)}",
        answer_box([answer], is_answer=bool(solved)),
        body,
        heading=title,
        contents=contents,
    )


def _design(result: TradeoffResult, row: TradeoffPointData, point: TradeoffPoint) -> Design:
    """Return the design at a value that has an answer."""
    outcome = point.solution.outcomes[0]
    try:
        drawing = drawings_of(point.solution)[0]
    except EvaluationError:
        drawing = None
    F = "" if row.F is None else f"F = {row.F:.6g}"
    return Design(
        f"{result.over} = {row.value:.5g} {result.unit}".rstrip(),
        F or ", ".join(f"F of {name} = {each:.6g}" for name, each in zip(result.tasks, row.tasks, strict=True) if each),
        free_numbers(outcome.own.nlp, outcome.x),
        tuple(each.removeprefix("limits.") for each in row.active),
        drawing,
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
    middles = _bend_values(result)
    if middles:
        words += " Vertical lines: other bounds and limits become active there."
    chart = line_chart(
        [Curve(values, F, "curve")],
        [
            Spot(value, each, "spot" if value == here else "other", f"{value:.6g}{unit}: F = {each:.7g}")
            for value, each in solved
        ],
        words=words,
        labels=(f"{result.over}, {result.unit}" if result.unit else result.over, objective_label(case)),
        bounds=middles,
    )
    return tag("figure", chart, tag("figcaption", words))


def _bend_values(result: TradeoffResult) -> list[float]:
    """Return the middles between neighbouring values with an answer at which other bounds and limits are active."""
    solved = [point for point in result.points if point.status.is_answer]
    found = bends([frozenset(point.active) for point in solved])
    return [(solved[k - 1].value + solved[k].value) / 2 for k in found]
