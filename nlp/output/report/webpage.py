"""Page about a solved case as one HTML text, which needs no network and no other file."""

from __future__ import annotations

from .markup import NO_LIVE_VIEW, LiveView, Markup, contents_and_body, packed_plotly, whole_page
from .report import Report
from .sections import answer, first_screen, sections


def page_of(report: Report, live: LiveView = NO_LIVE_VIEW) -> str:
    """Return the page of a report.

    Text and tables come first and need no script. The compressed library of maps, and of the 3-D view if there is no
    live view, is at the end and starts after the page is first painted.

    Args:
        report: content of the page.
        live: live view, the first screen of the page.
    """
    contents, body = contents_and_body(sections(report, is_live=live.is_live))
    has_maps = any(part.planes for part in report.parts)
    return whole_page(
        report.case.title or report.case.name,
        f"Report: {report.case.name}, robot {report.case.model.name}",
        answer(report),
        body,
        contents=contents,
        scripts=("tools.js", "joints.js", "robot.js", "page.js"),
        data=report.as_data(is_live=live.is_live),
        plotly=packed_plotly() if has_maps or not live.is_live else "",
        live=live.shown(first_screen(report) if live.is_live else Markup("")),
    )
