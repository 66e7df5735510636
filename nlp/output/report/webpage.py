"""A report as one page of HTML that needs no network and no other file."""

from __future__ import annotations

import gzip
from base64 import b64encode
from importlib.resources import files
from string import Template

from .markup import Markup, join_markup, script_json, tag
from .report import Report
from .sections import answer, sections


def page_of(report: Report) -> str:
    """Return the whole page.

    Words and tables come first and need no script. The library for the 3-D view is at the end, compressed, and starts
    after the page is first painted.
    """
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - only a report needs it

    found = sections(report)
    title = report.case.title or report.case.name
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
    parts = {
        "title": tag("title", f"{title} - screwsynth"),
        "heading": tag("h1", title),
        "subtitle": tag("p", f"{report.case.name}, robot {report.case.model.name}", class_="subtitle"),
        "answer": answer(report),
        "contents": contents,
        "body": body,
        "style": Markup(_file("style.css")),
        "script": Markup(_file("tables.js") + _file("tools.js") + _file("joints.js") + _file("page.js")),
        "data": script_json(report.as_data()),
        "plotly": _packed(get_plotlyjs()),
    }
    return Template(_file("report.html.in")).substitute(parts)


def _packed(text: str) -> Markup:
    """Return a text compressed for a script element: the library, most of a page, shrinks to two fifths."""
    # Without a time in its head, the same text is always the same bytes.
    return Markup(b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii"))


def _file(name: str) -> str:
    return (files("screwsynth.nlp.output.report") / "page" / name).read_text(encoding="utf-8")
