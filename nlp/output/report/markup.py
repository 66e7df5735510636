"""HTML elements and pages from Python values.

All text that is not markup is escaped, so a text of a case cannot become markup.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from string import Template
from typing import Any, NamedTuple

from ...words.numbers import key_words
from ...words.text import Line


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

    def shown(self, still: Markup) -> Markup:
        """Return the elements for a page, which has a picture and a table until the script has started.

        Args:
            still: picture and table; an element with a shadow tree does not show its content, so no script hides it.
        """
        if not self.is_live:
            return self.markup
        words = "The sliders need JavaScript; this picture and the tables below are complete without it."
        note = tag("noscript", tag("p", words, class_="note"))
        return join_markup([tag("div", still, note, id="live"), self.markup])


#: Page without a live view.
NO_LIVE_VIEW = LiveView(Markup(""), is_live=False)


def no_live_view(reason: str) -> LiveView:
    """Return the sentence in the place of a live view."""
    return LiveView(tag("p", f"This page has no sliders: {reason}.", class_="note"), is_live=False)


#: Elements without an end tag.
_VOID = frozenset(["meta", "link", "input", "br", "img", "source"])
#: Elements whose text is copied into a shell or a file, character by character.
_EXACT = frozenset(["code", "title"])
#: Attributes that are read to people.
_READ = frozenset(["aria_label", "aria_valuetext", "alt"])
#: Hyphen that is the sign of a number or of an exponent, not part of a name such as limb 1- or 6-PUS.
_SIGN = re.compile(r"(?<![\w.)\]\"'-])-(?=\.?\d)|(?<=\de)-(?=\d)")
#: Signs of inequalities as a case file has them, and as a page has them.
_RELATIONS = {"<=": "\N{LESS-THAN OR EQUAL TO}", ">=": "\N{GREATER-THAN OR EQUAL TO}"}


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
        text = with_signs(str(value)) if key in _READ else str(value)
        parts.append(label if value is True else f'{label}="{escape(text)}"')
    opening = f"<{' '.join(parts)}>"
    if name in _VOID:
        return Markup(opening)
    return Markup(f"{opening}{_exact_markup(content) if name in _EXACT else join_markup(content)}</{name}>")


def with_signs(text: str) -> str:
    """Return a text with the minus sign, U+2212, at its negative numbers, and with the signs of its inequalities."""
    for written, sign in _RELATIONS.items():
        text = text.replace(written, sign)
    return _SIGN.sub("\N{MINUS SIGN}", text)


def join_markup(content: Iterable[object]) -> Markup:
    """Return several pieces of content as one piece; text is escaped and gets the signs of :func:`with_signs`."""
    return _exact_markup(
        part if part is None or isinstance(part, Markup) else with_signs(str(part)) for part in content
    )


def _exact_markup(content: Iterable[object]) -> Markup:
    """Return several pieces of content as one piece; text is escaped and has its own characters."""
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
    words = tag("code", line.words) if line.is_command else line.words
    return join_markup([tag("span", f"{line.label}:", class_="label"), " ", words])


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
    found = [(anchor, key_words(heading), content) for anchor, heading, content in sections if content]
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


def picture_figure(svg: bytes, narrow: bytes, name: str, words: str) -> Markup:
    """Return a picture as a figure of a page.

    Args:
        svg: content of the SVG file.
        narrow: content of the SVG file for a narrow window.
        name: name of the picture.
        words: content of the picture.
    """
    return tag("figure", picture_element(svg, narrow, alt=f"{name}: {words}"), caption(name, words))


def caption(name: str, *words: object, **attributes: object) -> Markup:
    """Return the caption of a figure: its name, then its content and notes, as in the captions of tables."""
    head = key_words(name)
    return tag("figcaption", tag("b", f"{head[:1].upper()}{head[1:]}:"), " ", *words, **attributes)


def beside(*parts: Markup) -> Markup:
    """Return figures and tables side by side where the window is wide enough for them, else below each other."""
    return tag("div", *parts, class_="row")


def picture_element(svg: bytes, narrow: bytes, **attributes: object) -> Markup:
    """Return an SVG picture with another one for narrow windows; the attributes are those of the image."""
    source = tag("source", media="(max-width: 34rem)", srcset=image_source(narrow))
    return tag("picture", source, tag("img", src=image_source(svg), **attributes))


def image_source(content: bytes, kind: str = "svg+xml") -> str:
    """Return an image as a data URL."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _file(name: str) -> str:
    return (files("screwsynth.nlp.output.report") / "page" / name).read_text(encoding="utf-8")
