"""The page about a case as HTML text, from the case, its solution or its certificates."""

from __future__ import annotations

from ...case.case import Case
from ...case.reader import find_case
from ...results.data import result_of
from ...solve.certified import Certified
from ...solve.solution import Solution
from ...solve.solve import solve
from ..files import read_text
from ..pictures.extras import check_library
from .report import report_of
from .webpage import page_of

_NO_CASE_FILE = "This case was built in Python: it has no case file."


def report(found: Case | Solution | Certified, name: str | None = None) -> str:
    """Return a page about a case as one text of HTML, which opens without a network.

    Args:
        found: a case, which is solved first, its solution, or its solution with certificates.
        name: path of the case file, or the bare name of a shipped case, for its text and its published values; left
            out, the page has neither.

    Raises:
        InputError: Plotly is not installed, or a case file cannot be read.
        CaseError: the case contradicts itself.
    """
    check_library("plotly", "reports")
    text = _NO_CASE_FILE if name is None else read_text(str(find_case(name)))
    solved = solve(found) if isinstance(found, Case) else found
    solution = solved if isinstance(solved, Solution) else solved.solution
    return page_of(report_of(name or "", text, solution, result_of(solved)))
