"""The page about a solved case as one text of HTML that needs no network and no other file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...case.case import Case
from ...errors import CaseError
from ...results.checks import CaseCheck
from ...results.result import result_of
from ...results.tradeoff import TradeoffResult
from ...solver.certified import Certified
from ...solver.solution import Solution
from ..files import check_target, write_bytes
from ..pictures.requirements import check_library
from .markup import contents_and_body, packed_plotly, whole_page
from .report import Report, report_of
from .sections import answer, sections


def page_of(report: Report) -> str:
    """Return the whole page.

    Words and tables come first and need no script. The library for the 3-D view is at the end, compressed, and starts
    after the page is first painted.
    """
    contents, body = contents_and_body(sections(report))
    return whole_page(
        report.case.title or report.case.name,
        f"{report.case.name}, robot {report.case.model.name}",
        answer(report),
        body,
        contents=contents,
        scripts=("tools.js", "joints.js", "robot.js", "page.js"),
        data=report.as_data(),
        plotly=packed_plotly(),
    )


_WRITTEN = "# The case as Case.to_toml() writes it.\n"
_NO_CASE_FILE = "This case has no case file: "


def report(
    found: Solution | Certified,
    *,
    text: str | None = None,
    check: CaseCheck | None = None,
    curves: Sequence[TradeoffResult] = (),
    file: str | Path | None = None,
) -> str:
    """Return a page about a solved case as one text of HTML, which opens without a network.

    Args:
        found: a solution, or a solution with certificates.
        text: text of the case file; left out, as :meth:`.Case.to_toml` writes it.
        check: published and expected numbers beside the computed ones; left out, the page does not show them.
        curves: results of trade-offs, which stand in the place of the slices.
        file: file that the page is written to; None for none.

    Raises:
        InputError: Plotly or Matplotlib is not installed, or the file cannot be written.
    """
    check_library("plotly", "reports")
    check_library("matplotlib", "reports")
    solution = found if isinstance(found, Solution) else found.solution
    if file is not None:
        check_target(str(file))
    shown = _written(solution.case) if text is None else text
    page = page_of(replace(report_of(shown, solution, result_of(found), check), curves=tuple(curves)))
    if file is not None:
        write_bytes(str(file), page.encode("utf-8"))
    return page


def _written(case: Case) -> str:
    """Return a case as a case file; a sentence where no file can state it."""
    try:
        return _WRITTEN + case.to_toml()
    except CaseError as error:
        return f"{_NO_CASE_FILE}{error}"
