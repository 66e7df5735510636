"""A comparison of robots as a page of HTML."""

from __future__ import annotations

from ...comparison.compare import Comparison
from ...results.comparison import ComparedRobotData, ComparisonResult, comparison_table
from ...results.text import TextTable
from ..pictures.comparisons import comparison_drawings, comparison_figure
from ..pictures.figures import picture_of
from .markup import Markup, answer_box, html_table, join_markup, paragraphs, picture_figure, tag, whole_page


def comparison_page(found: Comparison, result: ComparisonResult) -> str:
    """Return a whole page about a comparison, which opens without a network.

    Args:
        found: the comparison, whose designs are drawn.
        result: the same as data.
    """
    title = result.title or result.case
    ranked = [each for each in result.robots if each.part == "ranked"]
    words = f"{len(ranked)} of {len(result.robots)} robots can be compared"
    if ranked and ranked[0].value is not None:
        words = f"{ranked[0].name} has the best value, {ranked[0].value:.7g}; {words}"
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
        picture = picture_figure(
            picture_of(".svg", comparison_figure, found),
            "Each robot at its design, all in one scale; colours are rates of the limbs.",
        )
        parts += [tag("h2", "Designs"), picture]
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
