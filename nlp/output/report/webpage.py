"""Page about a solved case as one HTML text, which needs no network and no other file."""

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
    """Return the page of a report.

    Text and tables come first and need no script. The compressed library of the 3-D view is at the end and starts after
    the page is first painted.
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


_WRITTEN = "# Case file written by Case.to_toml().\n"
_NO_CASE_FILE = "No case file can represent this case: "


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
    page = page_of(replace(report_of(shown, solution, result_of(solved), check), curves=tuple(curves)))
    if file is not None:
        write_bytes(str(file), page.encode("utf-8"))
    return page


def _written(case: Case) -> str:
    """Return the case file of a case, or a sentence if no case file can represent it."""
    try:
        return _WRITTEN + case.to_toml()
    except CaseError as error:
        return f"{_NO_CASE_FILE}{error}"
