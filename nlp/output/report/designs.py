"""Page about a table of designs: picture, changes of active limits, drawings of designs, table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np

from ...errors import EvaluationError
from ...words.designs import ColumnKind, Designs, DrawnDesign, Join, Row, designs_table
from ...words.numbers import key_words, side_words
from ..pictures.designs import design_pictures, legend_of, page_figure
from ..pictures.drawing import Drawing, drawing_of
from ..pictures.figures import picture_of
from ..pictures.robots import robot_pictures
from .curves import curve_figures
from .markup import (
    Markup,
    answer_box,
    caption,
    contents_and_body,
    image_source,
    join_markup,
    paragraphs,
    picture_element,
    picture_figure,
    tag,
    whole_page,
)
from .tables import html_table

#: Largest number of drawn designs, and of table rows on a page: a browser is slow with many more.
_MOST, _ROWS = 12, 500
_WORDS = (
    "Robot at each design, with the same view and scale. Colours of limbs: blue for shortening, orange for lengthening."
)


def designs_page(designs: Designs[Row]) -> str:
    """Return a page about a table of designs, which opens without a network.

    The script only marks tables that scroll: all texts, charts, pictures and tables are complete without it.
    """
    page = designs.page
    sections = list(_list_sections(designs) if designs.join is Join.LIST else _sections(designs))
    contents, body = contents_and_body(sections)
    return whole_page(
        f"{designs.title} - {designs.word}",
        page.subtitle,
        answer_box([key_words(page.answer)], is_answer=page.is_answer),
        body,
        heading=designs.title,
        contents=contents,
    )


def _sections(table: Designs[Row]) -> Iterator[tuple[str, str, Markup]]:
    """Yield anchor, heading and content of the sections of a page about designs of one robot."""
    page, designs = table.page, table.drawn()
    aside = bend_lines(designs, page.bends) if page.bends else Markup("")
    if page.is_answer and (legend := legend_of(table)):
        aside = tag("ul", *(tag("li", line) for line in legend), class_="plain", tabindex="0")
    beside = tag("div", tag("div", _picture(table), class_="wide"), aside, class_="beside")
    yield (
        *page.picture,
        join_markup([paragraphs(map(_in_words, page.rules)), beside, paragraphs(map(_in_words, page.cautions))]),
    )
    yield "designs", page.designs, design_figures(designs)
    yield (*page.table, designs_rows(table))


def _picture(designs: Designs[Row]) -> Markup:
    """Return the picture of a page, or a sentence with the reason for the missing picture."""
    page = designs.page
    if designs.join is Join.CURVE and designs.of_kind(ColumnKind.VARIED):
        return curve_figures(designs)
    if not page.is_answer:
        return Markup("")
    try:
        wide, narrow = (picture_of(".svg", page_figure, designs, is_narrow=each) for each in (False, True))
    except EvaluationError as error:
        return paragraphs([f"{error}."])
    return picture_figure(wide, narrow, page.picture[1], page.below)


def _list_sections(designs: Designs[Row]) -> Iterator[tuple[str, str, Markup]]:
    """Yield anchor, heading and content of the sections of a page about several robots."""
    page = designs.page
    yield (*page.table, join_markup([paragraphs(map(_in_words, page.rules)), designs_rows(designs)]))
    with suppress(EvaluationError):  # if no robot has an optimum
        *robots, wide, narrow = robot_pictures(designs)
        alt = "Robot at its design; the values are in the table."
        images = [tag("img", src=image_source(each), alt=alt) for each in robots]
        legend = picture_element(wide, narrow, alt="Colour scale of the limb rates.")
        shown = [tag("div", *images, class_="designs robots"), legend]
        yield (*page.picture, tag("figure", *shown, caption("Robots", page.below)))
    details = []
    for each in designs.details:
        details += [tag("h3", each.name), paragraphs(map(_in_words, each.sentences))]
        details += [] if each.table is None else [html_table(each.table, f"Dimensions: {each.name}")]
    yield "details", "Robots in detail", join_markup(details)


def _in_words(sentence: str) -> str:
    """Return a sentence with limits in words; one with an option of a command keeps the keys."""
    words = sentence if "--" in sentence else key_words(sentence)
    return f"{words[:1].upper()}{words[1:]}"


def designs_rows(designs: Designs[Row]) -> Markup:
    """Return the table, and below it the bounds and limits that are active in all rows."""
    few = (
        "" if len(designs.rows) <= _ROWS else f"The first {_ROWS} of {len(designs.rows):,} rows; CSV and JSON have all."
    )
    throughout = ", ".join(map(side_words, designs.throughout.split(", ")))
    below = tag("p", f"Active in all rows: {throughout}.") if designs.throughout else None
    rows = html_table(designs_table(designs, _ROWS), designs.caption, id="swept" if designs.join is Join.GRID else None)
    return tag("div", tag("p", few) if few else None, rows, below)


def bends(active: Sequence[frozenset[str]]) -> list[int]:
    """Return the indices of the designs whose active bounds and limits differ from those of the previous design."""
    return [k for k in range(1, len(active)) if active[k] != active[k - 1]]


def chosen_designs(active: Sequence[frozenset[str]]) -> list[int]:
    """Return the indices of the drawn designs: both ends, both sides of changes of active limits, further designs."""
    count = len(active)
    sides = [each for k in bends(active) for each in (k - 1, k)]
    spread = np.rint(np.linspace(0, count - 1, min(count, _MOST))).astype(int).tolist()
    wanted = dict.fromkeys([*([0, count - 1] if count else []), *sides, *spread])
    return sorted(list(wanted)[:_MOST])


def changed_words(before: Sequence[str], after: Sequence[str]) -> str:
    """Return the names of bounds and limits that become active or inactive; empty without a change."""
    new = [each for each in after if each not in before]
    gone = [each for each in before if each not in after]
    parts = [f"{', '.join(new)} become{'s' * (len(new) == 1)} active"] if new else []
    parts += [f"{', '.join(gone)} become{'s' * (len(gone) == 1)} inactive"] if gone else []
    return "; ".join(parts)


def bend_lines(designs: Sequence[DrawnDesign], heading: str) -> Markup:
    """Return a heading, and a sentence for each pair of neighbours with different active limits."""
    found = bends([frozenset(each.active) for each in designs])
    lines = [
        f"Between {designs[k - 1].name} and {designs[k].name}: "
        f"{changed_words(*(list(map(side_words, each.active)) for each in designs[k - 1 : k + 1]))}."
        for k in found
    ]
    if not lines:
        return Markup("")
    return tag("div", tag("h3", heading), tag("ul", *(tag("li", line) for line in lines), id="bends", tabindex="0"))


def design_figures(designs: Sequence[DrawnDesign]) -> Markup:
    """Return figures of the chosen designs side by side, as the width allows."""
    chosen = chosen_designs([frozenset(each.active) for each in designs])
    shown = [(designs[k], drawing) for k in chosen if (drawing := _drawing(designs[k])) is not None]
    if not shown:
        return Markup("")
    pictures = design_pictures([drawing for _, drawing in shown])
    figures = [
        tag(
            "figure",
            tag("img", src=image_source(content), alt=f"Robot at {each.name}"),
            tag("figcaption", tag("b", each.name), f": {each.words}", _numbers(each.numbers)),
        )
        for (each, _), content in zip(shown, pictures, strict=True)
    ]
    few = [] if len(shown) == len(designs) else [f"{len(shown)} of {len(designs)} designs are shown."]
    return join_markup([paragraphs([_WORDS, *few]), tag("div", *figures, class_="designs")])


def _numbers(numbers: Sequence[str]) -> Markup:
    """Return the variables of a design, shown on request."""
    return tag("details", tag("summary", "Dimensions and pose"), tag("small", ", ".join(numbers)))


def _drawing(design: DrawnDesign) -> Drawing | None:
    """Return the drawing of the robot at a design; None if it cannot be drawn."""
    try:
        return drawing_of(design.nlp, design.x, design.state, design.task)
    except EvaluationError:
        return None
