"""Live view as the first screen of another page, and the page about a solved case with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...case.case import Case
from ...errors import CaseError, InputError
from ...results.checks import CaseCheck
from ...results.result import result_of
from ...results.tradeoff import TradeoffResult
from ...solver.certified import Certified
from ...solver.solution import Solution
from ...view.source import view_or_drawing
from ..files import check_target, write_bytes
from ..pictures.requirements import check_library
from ..report.markup import LiveView, Markup, join_markup, no_live_view, tag
from ..report.report import report_of
from ..report.webpage import page_of
from .page import SCRIPTS, LiveParts, live_parts, script_text
from .schedule import schedule_parts

_WRITTEN = "# Case file written by Case.to_toml().\n"
_NO_CASE_FILE = "No case file can represent this case: "


def embedded(parts: LiveParts) -> LiveView:
    """Return the live view for another page; without a module, only the reason."""
    if parts.fault:
        return no_live_view(parts.fault)
    headline = tag("div", parts.answer, id="answer", class_="answer", role="status", aria_live="polite")
    content = [tag("style", parts.style), parts.task, headline, tag("div", parts.body, class_="live-main")]
    script = script_text(("embed.js", *SCRIPTS))
    return LiveView(
        join_markup(
            [
                tag("template", *content, tag("footer", parts.footer), id="live-markup"),
                tag("script", parts.data, type="application/json", id="live-data"),
                tag("script", Markup(parts.module), type="text/plain", id="live-module"),
                tag("script", Markup(script), type="module"),
            ]
        ),
        is_live=True,
    )


def live_view_of(solution: Solution, command: str) -> LiveView:
    """Return the live view of a solved case.

    Args:
        solution: solution of the case.
        command: name of the case on the command line.
    """
    case = solution.chosen_case
    try:
        if solution.case.over_path is not None:
            return embedded(schedule_parts(solution, command))
        return embedded(live_parts(view_or_drawing(case), solution, command))
    except InputError as error:
        return no_live_view(str(error))


def report(
    solved: Solution | Certified,
    *,
    text: str | None = None,
    check: CaseCheck | None = None,
    curves: Sequence[TradeoffResult] = (),
    file: str | Path | None = None,
) -> str:
    """Return a page about a solved case as one HTML text, which opens without a network.

    Args:
        solved: solution, or solution with certificates.
        text: text of the case file; by default the text of :meth:`.Case.to_toml`.
        check: published and expected values with the computed ones, for a section of the page.
        curves: results of trade-offs, shown instead of slices.
        file: path of the output file; None for no file.

    Raises:
        InputError: Plotly or Matplotlib is not installed, or the file cannot be written.
    """
    check_library("plotly", "reports")
    check_library("matplotlib", "reports")
    solution = solved if isinstance(solved, Solution) else solved.solution
    if file is not None:
        check_target(str(file))
    shown = _written(solution.case) if text is None else text
    content = replace(report_of(shown, solution, result_of(solved), check), curves=tuple(curves))
    page = page_of(content, live_view_of(solution, solution.case.name))
    if file is not None:
        write_bytes(str(file), page.encode("utf-8"))
    return page


def _written(case: Case) -> str:
    """Return the case file of a case, or a sentence if no case file can represent it."""
    try:
        return _WRITTEN + case.to_toml()
    except CaseError as error:
        return f"{_NO_CASE_FILE}{error}"
