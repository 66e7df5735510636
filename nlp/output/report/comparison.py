"""A comparison of robots as a page of HTML."""

from __future__ import annotations

from ...comparison.compare import Comparison
from ...proof.workspace.verdict import Outcome
from ...results.comparison import ComparedRobotData, ComparisonResult, comparison_table
from ...results.text import TextTable
from ..pictures.comparisons import comparison_drawings, comparison_pictures
from .markup import Markup, answer_box, html_table, image_source, join_markup, paragraphs, tag, whole_page


def comparison_page(found: Comparison, result: ComparisonResult) -> str:
    """Return a whole page about a comparison, which opens without a network.

    Args:
        found: the comparison, whose designs are drawn.
        result: the same as data.
    """
    title = result.title or result.case
    ranked = [each for each in result.robots if each.part == "ranked"]
    words = f"{len(ranked)} of {len(result.robots)} robots can be compared"
    if others := sum(each.part == "limits not kept" for each in result.robots):
        words += f", {others} {'does' if others == 1 else 'do'} not keep every limit"
    if ranked and ranked[0].value is not None:
        unit = ranked[0].tasks[0].unit if len(ranked[0].tasks) == 1 else ""
        best = f"{ranked[0].name} has the best value, {f'{ranked[0].value:.7g} {unit}'.rstrip()}"
        if ranked[0].workspace is Outcome.REFUTED:
            best += ", and is refuted over the workspace"
        words = f"{best}; {words}"
    names = ", ".join(each.name for each in result.robots)
    return whole_page(
        f"{title} - comparison",
        f"{result.case}, robots {names}",
        answer_box([f"{words}."], is_answer=bool(ranked)),
        tag("section", _body(found, result)),
    )


def _body(found: Comparison, result: ComparisonResult) -> Markup:
    parts = [
        tag("h2", "Robots in one table"),
        paragraphs(result.sentences),
        html_table(comparison_table(result), "robots, the best first"),
    ]
    if comparison_drawings(found):
        *robots, legend = map(image_source, comparison_pictures(found))
        words = "Each robot at its design, all from one side, in one scale and with one scale of the colours."
        images = (tag("img", src=source, alt="A robot at its design; the table has its numbers.") for source in robots)
        shown = [tag("div", *images, class_="designs"), tag("img", src=legend, alt="Colours are rates of the limbs.")]
        parts += [tag("h2", "Designs"), tag("figure", *shown, tag("figcaption", words))]
    for robot in result.robots:
        parts += [tag("h3", robot.name), paragraphs([f"{robot.description}.", *robot.sentences])]
        if robot.dimensions:
            parts.append(html_table(_dimension_table(robot), f"dimensions of {robot.name}"))
    return join_markup(parts)


def _dimension_table(robot: ComparedRobotData) -> TextTable:
    """Return the dimensions of a robot's design, with their ranges."""
    rows = tuple(
        (
            each.name,
            f"{each.value:.6g}",
            each.unit,
            "fixed" if each.range is None else f"{each.range[0]:.5g} to {each.range[1]:.5g}",
        )
        for each in robot.dimensions
    )
    return TextTable(("dimension", "value", "unit", "range"), rows)
