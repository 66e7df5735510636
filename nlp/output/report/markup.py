"""HTML elements and pages from Python values.

All text that is not markup is escaped, so a text of a case cannot become markup.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from importlib.resources import files
from string import Template
from typing import Any, NamedTuple

from ...words.text import Line, TextTable


class Markup(str):
    """Text in HTML, which is not escaped again."""

    __slots__ = ()


class LiveView(NamedTuple):
    """Live view for the first screen of a page.

    Attributes:
        markup: elements of the view, with its data and script, or a sentence in their place; empty for none.
        is_live: True if the view has a solver, so that it replaces other pictures of the robot.
    """

    markup: Markup
    is_live: bool


#: Page without a live view.
NO_LIVE_VIEW = LiveView(Markup(""), is_live=False)
#: Length of a number below which its cell is not wrapped.
_SHORT = 24
#: Elements without an end tag.
_VOID = frozenset(["meta", "link", "input", "br", "img"])


def tag(name: str, *content: object, **attributes: object) -> Markup:
    """Return an HTML element.

    Args:
        name: name of the element.
        content: markup, or other values as escaped text; None is skipped.
        attributes: attributes by name, with ``_`` for ``-`` and after a Python keyword. True gives an attribute without
            a value; None and False give none.
    """
    parts = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        label = key.rstrip("_").replace("_", "-")
        parts.append(label if value is True else f'{label}="{escape(str(value))}"')
    opening = f"<{' '.join(parts)}>"
    return Markup(opening if name in _VOID else f"{opening}{join_markup(content)}</{name}>")


def join_markup(content: Iterable[object]) -> Markup:
    """Return several pieces of content as one piece; text is escaped."""
    return Markup(
        "".join(part if isinstance(part, Markup) else escape(str(part)) for part in content if part is not None)
    )


def paragraphs(lines: Iterable[Line | str]) -> Markup:
    """Return a paragraph for each line of text, with its label first."""
    return join_markup(tag("p", _line(line)) for line in lines)


def _line(line: Line | str) -> object:
    """Return the content of a paragraph: label and text of a line."""
    if isinstance(line, str):
        return line
    if not line.label:
        return line.words
    return join_markup([tag("span", f"{line.label}:", class_="label"), " ", line.words])


def html_table(table: TextTable, caption: str, **attributes: object) -> Markup:
    """Return an HTML table, whose first column names the rows; a wide table can be scrolled, also by keyboard.

    Args:
        table: table of texts.
        caption: caption of the table.
        attributes: attributes of the element, as for :func:`tag`.
    """
    headers = [header.replace("\n", ", ") for header in table.headers]
    # An empty header is an ordinary cell, since it names nothing.
    head = tag("tr", *(tag("th", header, scope="col") if header else tag("td") for header in headers))
    body = []
    for row in table.rows[: len(table.rows) - table.folded]:
        first, *others = (cell.words if isinstance(cell, Line) else cell for cell in row)
        body.append(tag("tr", tag("th", first, scope="row"), *(_cell(cell) for cell in others)))
    whole = tag("table", tag("caption", caption), tag("thead", head), tag("tbody", *body), **attributes)
    shown = tag("div", whole, class_="scroll", tabindex="0", role="region", aria_label=caption)
    if not table.folded:
        return shown
    words = f"{table.folded} {table.folded_words}"
    rest = replace(table, rows=table.rows[len(table.rows) - table.folded :], folded=0)
    anchor = f"{attributes['id']}-folded" if "id" in attributes else None
    folded = tag("details", tag("summary", words), html_table(rest, f"{caption}: {words}", id=anchor))
    return join_markup([shown, folded])


def script_frame(key: str, name: str, words: str) -> Markup:
    """Return the frame of a picture that a script draws, with a text that is shown until then.

    Args:
        key: identifier and class of the frame.
        name: kind of picture for the text, such as ``"map"``.
        words: text alternative of the picture.
    """
    waiting = tag("p", f"The {name} appears when the script has started.", class_="waiting script")
    return tag("div", waiting, id=key, class_=key, role="img", aria_label=words)


def view_buttons() -> Markup:
    """Return the buttons that turn a 3-D view."""
    turns = [("left", "Turn left"), ("right", "Turn right"), ("up", "Tilt up"), ("down", "Tilt down")]
    turns += [("in", "Zoom in"), ("out", "Zoom out"), ("reset", "Reset view")]
    return tag(
        "div",
        *(tag("button", words, type="button", data_turn=key) for key, words in turns),
        class_="controls buttons script",
        role="group",
        aria_label="View",
    )


def packed_plotly() -> str:
    """Return the Plotly library, compressed to two fifths of its size and encoded for a script element."""
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - only some pages need it

    # Without a time stamp, the same text always gives the same bytes.
    return base64.b64encode(gzip.compress(get_plotlyjs().encode("utf-8"), mtime=0)).decode("ascii")


def script_json(data: Any) -> Markup:  # noqa: ANN401 - whatever JSON can hold
    """Return JSON for a script element, with ``<``, ``>`` and ``&`` escaped: no text can end the element."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)


def _cell(text: str) -> Markup:
    """Return a cell of a table, with a class for a short number."""
    return tag("td", text, class_="number" if _is_short_number(text) else None)


def _is_short_number(text: str) -> bool:
    """Return whether a text is a number that is too short to be wrapped."""
    return len(text) < _SHORT and (text[:1].isdigit() or text[:1] in {"+", "-"})


def whole_page(
    title: str,
    subtitle: str,
    answer: Markup,
    body: Markup,
    *,
    heading: str | None = None,
    contents: Markup | str = "",
    styles: Sequence[str] = (),
    scripts: Sequence[str] = (),
    data: Any = None,  # noqa: ANN401 - whatever JSON can hold
    plotly: str = "",
    live: Markup | str = "",
) -> str:
    """Return a page. Without further scripts, its script only marks tables that scroll.

    Args:
        title: title of the window, without the package's name.
        subtitle: line below the heading.
        answer: element with the main result.
        body: sections of the page.
        heading: main heading; by default the title.
        contents: list of links to the sections.
        styles: names of further style sheets.
        scripts: names of further scripts.
        data: data for the scripts.
        plotly: packed Plotly library, or an empty text.
        live: live view, between the main result and the contents.
    """
    parts = {
        "title": tag("title", f"{title} - screwsynth"),
        "heading": tag("h1", title if heading is None else heading),
        "subtitle": tag("p", subtitle, class_="subtitle"),
        "answer": answer,
        "contents": contents,
        "body": body,
        "style": Markup("".join(map(_file, ("style.css", *styles)))),
        "script": Markup("".join(map(_file, ("tables.js", *scripts)))),
        "data": script_json({} if data is None else data),
        "plotly": plotly,
        "live": live,
    }
    return Template(_file("report.html.in")).substitute(parts)


def answer_box(lines: Iterable[str], *, is_answer: bool = True) -> Markup:
    """Return the element with the main result of a page, or with the reason for a missing result."""
    return tag("div", paragraphs(lines), class_="answer" if is_answer else "answer none", id="answer")


def contents_and_body(sections: Iterable[tuple[str, str, Markup]]) -> tuple[Markup, Markup]:
    """Return the list of links to the sections with content, and these sections.

    Args:
        sections: anchor, heading and content of each section.
    """
    found = [each for each in sections if each[2]]
    contents = tag("ul", *(tag("li", tag("a", heading, href=f"#{anchor}")) for anchor, heading, _ in found))
    body = join_markup(
        tag(
            "section",
            tag("h2", heading, id=f"{anchor}-heading"),
            content,
            id=anchor,
            aria_labelledby=f"{anchor}-heading",
        )
        for anchor, heading, content in found
    )
    return contents, body


def picture_figure(svg: bytes, words: str) -> Markup:
    """Return a picture as a figure of a page.

    Args:
        svg: content of the SVG file.
        words: caption and text alternative of the picture.
    """
    image = tag("img", src=image_source(svg), alt=words)
    return tag("figure", image, tag("figcaption", words))


def image_source(content: bytes, kind: str = "svg+xml") -> str:
    """Return an image as a data URL."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _file(name: str) -> str:
    return (files("screwsynth.nlp.output.report") / "page" / name).read_text(encoding="utf-8")
