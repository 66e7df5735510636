"""Comma-separated values as text, safe from formulas.

A spreadsheet evaluates a cell that begins with ``=``, ``+``, ``-`` or ``@`` as a formula, which may call programs.
Names of robots, joints and tasks may be anything. Such a cell gets a leading apostrophe, unless it is numbers and a
unit.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence

#: First characters of formulas; some spreadsheets skip the last two.
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:inf|nan)"
#: Numbers, as in a vector or a range, followed by a unit of letters and signs that form no formula.
_NUMBERS = re.compile(rf"(?:{_NUMBER})(?:(?:[,;]? +|, ?| \.\. | to )(?:{_NUMBER}))*(?: [A-Za-z0-9%°²³/·^()\[\] ]+)?")


def csv_text(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as comma-separated values, with empty cells for None, and without formulas."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(csv_row(head))
    writer.writerows(map(csv_row, rows))
    return text.getvalue()


def csv_row(cells: Sequence[object]) -> list[object]:
    """Return the cells of a row, with texts quoted that a spreadsheet would evaluate."""
    return [f"'{cell}" if isinstance(cell, str) and _is_formula(cell) else cell for cell in cells]


def text_of_cell(cell: str) -> str:
    """Return the text of a cell that :func:`csv_row` wrote."""
    return cell[1:] if cell.startswith("'") and _is_formula(cell[1:]) else cell


def _is_formula(cell: str) -> bool:
    """Return True if a spreadsheet may read a text as a formula; single signs and numbers with a unit are safe."""
    return len(cell) > 1 and cell.startswith(_FORMULA) and not _NUMBERS.fullmatch(cell)
