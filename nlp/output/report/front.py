"""A front of several goals as a page of HTML."""

from __future__ import annotations

from ...front.front import Front
from ..fronttable import front_table, front_words
from ..pictures.curves import front_figure
from ..pictures.figures import picture_of
from .markup import answer_box, html_table, join_markup, paragraphs, picture_figure, tag, whole_page


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
    body = join_markup(
        [
            tag("h2", "The front"),
            paragraphs([rule, *(f"{line}." for line in words[1:])]),
            picture_figure(picture_of(".svg", front_figure, front), picture),
            html_table(front_table(front), "points of the front"),
        ]
    )
    return whole_page(
        f"{title} - front",
        f"{front.case.name}, robot {front.case.model.name}",
        answer_box([f"{words[0]}."]),
        tag("section", body),
    )
