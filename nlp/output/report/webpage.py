"""A report as one page of HTML that needs no network and no other file."""

from __future__ import annotations

import gzip
from base64 import b64encode

from .pages import contents_and_body, whole_page
from .report import Report
from .sections import answer, sections


def page_of(report: Report) -> str:
    """Return the whole page.

    Words and tables come first and need no script. The library for the 3-D view is at the end, compressed, and starts
    after the page is first painted.
    """
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - only a report needs it

    contents, body = contents_and_body(sections(report))
    return whole_page(
        report.case.title or report.case.name,
        f"{report.case.name}, robot {report.case.model.name}",
        answer(report),
        body,
        contents=contents,
        scripts=("tools.js", "joints.js", "page.js"),
        data=report.as_data(),
        plotly=_packed(get_plotlyjs()),
    )


def _packed(text: str) -> str:
    """Return a text compressed for a script element: the library, most of a page, shrinks to two fifths."""
    # Without a time in its head, the same text is always the same bytes.
    return b64encode(gzip.compress(text.encode("utf-8"), mtime=0)).decode("ascii")
