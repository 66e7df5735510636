"""The page about a solved case as HTML text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...results.regression import CaseCheck
from ...results.result import result_of
from ...results.tradeoff import TradeoffResult
from ...solver.certified import Certified
from ...solver.solution import Solution
from ..pictures.requirements import check_library
from .report import report_of
from .webpage import page_of

_NO_CASE_FILE = "This case was built in Python: it has no case file."


def report(
    found: Solution | Certified,
    *,
    text: str = _NO_CASE_FILE,
    check: CaseCheck | None = None,
    curves: Sequence[TradeoffResult] = (),
) -> str:
    """Return a page about a solved case as one text of HTML, which opens without a network.

    Args:
        found: a solution, or a solution with certificates.
        text: text of the case file.
        check: published and expected numbers beside the computed ones; left out, the page does not show them.
        curves: results of trade-offs, which stand in the place of the slices.

    Raises:
        InputError: Plotly or Matplotlib is not installed.
    """
    check_library("plotly", "reports")
    check_library("matplotlib", "reports")
    solution = found if isinstance(found, Solution) else found.solution
    return page_of(replace(report_of(text, solution, result_of(found), check), curves=tuple(curves)))
