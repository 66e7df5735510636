"""A front of several goals as a page of HTML."""

from __future__ import annotations

from ...errors import EvaluationError
from ...front.data import goal_units, goal_values
from ...front.front import Front, FrontPoint
from ...program.program import design_names
from ..fronttable import front_table, front_words
from ..pictures.curves import front_figure
from ..pictures.drawing import drawing_of
from ..pictures.figures import picture_of
from .designs import Design, bend_lines, design_figures, free_numbers
from .markup import (
    Markup,
    answer_box,
    contents_and_body,
    html_table,
    join_markup,
    paragraphs,
    picture_figure,
    tag,
    whole_page,
)


def front_page(front: Front) -> str:
    """Return a whole page about a front, which opens without a network."""
    title, words = front.case.title or front.case.name, front_words(front)
    rule = (
        "Each point is an optimum with evidence: one goal is optimised while the others keep bounds. None of the "
        "points is better than another in all goals."
    )
    picture = "One goal over the other; no line goes over a gap."
    if len(front.goals) > 2:
        picture = "A panel for each pair of goals" + ("; the third is the colour." if len(front.goals) == 3 else ".")
    designs = [_design(front, each) for each in front.points]
    sections = [
        (
            "front",
            "The front",
            join_markup(
                [
                    paragraphs([rule, *(f"{line}." for line in words[1:])]),
                    tag(
                        "div",
                        tag("div", picture_figure(picture_of(".svg", front_figure, front), picture), class_="wide"),
                        # Only a front of two goals has an order.
                        bend_lines(designs, "Where the front bends") if len(front.goals) == 2 else Markup(""),
                        class_="beside",
                    ),
                ]
            ),
        ),
        ("designs", "The designs", design_figures(designs)),
        ("points", "Every point", html_table(front_table(front), "points of the front")),
    ]
    contents, body = contents_and_body(sections)
    return whole_page(
        f"{title} - front",
        f"{front.case.name}, robot {front.case.model.name}",
        answer_box([f"{words[0]}."]),
        body,
        heading=title,
        contents=contents,
    )


def _design(front: Front, point: FrontPoint) -> Design:
    """Return the design of a point."""
    solution = point.solution
    task = next((goal.task for goal in front.goals if goal.task is not None), 0)
    try:
        drawing = drawing_of(solution.nlp, solution.x, solution.state, task)
    except EvaluationError:
        drawing = None
    units = (f" {unit}" if unit else "" for unit in goal_units(front))
    pairs = zip(front.goals, goal_values(front, point), units, strict=True)
    names = design_names(solution.nlp.program)
    sides = () if solution.evidence is None else solution.evidence.active
    return Design(
        ", ".join(f"{goal.label} = {value:.6g}{unit}" for goal, value, unit in pairs),
        f"optimum of {front.goals[point.program.optimised].label}",
        free_numbers(solution.nlp, solution.x),
        tuple(f"{side.name} {side.bound}" for side in sides if side.name in names),
        drawing,
    )
