"""Whole pages of HTML that open without a network, their sections, and pictures within them."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from importlib.resources import files
from string import Template
from typing import Any

from .markup import Markup, join_markup, paragraphs, script_json, tag


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
) -> str:
    """Return a whole page. Without further scripts, its own only says which tables scroll.

    Args:
        title: of the window, with the package's name.
        subtitle: line below the heading.
        answer: element that says the answer.
        body: sections.
        heading: left out, the title.
        contents: list of the sections.
        styles: names of further style sheets.
        scripts: names of further scripts.
        data: of these scripts.
        plotly: the packed library.
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
    }
    return Template(_file("report.html.in")).substitute(parts)


def answer_box(lines: Iterable[str], *, is_answer: bool = True) -> Markup:
    """Return the element that says the answer of a page, or that there is none."""
    return tag("div", paragraphs(lines), class_="answer" if is_answer else "answer none", id="answer")


def contents_and_body(sections: Iterable[tuple[str, str, Markup]]) -> tuple[Markup, Markup]:
    """Return the list of the sections of a page that have content, and these: anchor, heading and content of each."""
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
        svg: content of the picture's file.
        words: below the picture, and for readers who do not see it.
    """
    image = tag("img", src=image_source(svg), alt=words, style="max-width: 100%")
    return tag("figure", image, tag("figcaption", words))


def image_source(content: bytes, kind: str = "svg+xml") -> str:
    """Return an image as the address of a page's element."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


def _file(name: str) -> str:
    return (files("screwsynth.nlp.output.report") / "page" / name).read_text(encoding="utf-8")
