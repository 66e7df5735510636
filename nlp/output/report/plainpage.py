"""Pages of words, pictures and tables, without a script of their own, that open without a network."""

from __future__ import annotations

import base64
from importlib.resources import files
from string import Template

from .markup import Markup, tag


def plain_page(title: str, subtitle: str, answer: Markup, body: Markup) -> str:
    """Return a whole page; its script only says which tables scroll.

    Args:
        title: heading, and with the package's name the title of the window.
        subtitle: line below the heading.
        answer: element that says the answer.
        body: sections.
    """
    parts = {
        "title": tag("title", f"{title} - screwsynth"),
        "heading": tag("h1", title),
        "subtitle": tag("p", subtitle, class_="subtitle"),
        "answer": answer,
        "contents": "",
        "body": body,
        "style": Markup(_file("style.css")),
        "script": Markup(_file("tables.js")),
        "data": "{}",
        "plotly": "",
    }
    return Template(_file("report.html.in")).substitute(parts)


def picture_figure(svg: bytes, words: str) -> Markup:
    """Return a picture as a figure of a page.

    Args:
        svg: content of the picture's file.
        words: below the picture, and for readers who do not see it.
    """
    image = base64.b64encode(svg).decode("ascii")
    source = f"data:image/svg+xml;base64,{image}"
    return tag("figure", tag("img", src=source, alt=words, style="max-width: 100%"), tag("figcaption", words))


def _file(name: str) -> str:
    return (files("screwsynth.nlp.output.report") / "page" / name).read_text(encoding="utf-8")
