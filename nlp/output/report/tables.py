"""Tables of a page: one line a row, numbers aligned at the decimal point, and a text of all rows said once.

A long table scrolls in a box below its sticky heading. A long text is cut to one line, and its row shows all of it on
request.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from ...words.numbers import key_words
from ...words.text import Line, TextTable
from .markup import Markup, join_markup, tag

#: Smallest number of rows of a table whose rows are one line each, and of a table in a box with a height.
_ONE_LINE, _TALL = 8, 16
#: Largest number of characters of a text that is not cut in such a table.
_LONG = 30
#: Largest number of characters of a text in one line on a telephone, where its table scrolls.
_ONE_SCREEN = 90
#: Length of a header above which it is broken into lines.
_LONG_HEAD = 14
#: Length of a number with its unit below which its cell is not wrapped.
_SHORT = 24
#: Number at the start of a text: sign and digits before the point, and everything after them.
_NUMBER = re.compile(r"([+-]?)(\d+)((?:\.\d*)?(?:e[+-]?\d+)?(?: .*)?)", re.DOTALL)
#: Widest sign of common fonts, in widths of a digit.
_SIGN = 1.35


class _Content(NamedTuple):
    """Content of a table: headers in one line each, rows of texts, and sentences for the place above the table."""

    headers: list[str]
    rows: list[list[str]]
    above: list[str]


def html_table(table: TextTable, caption: str, **attributes: object) -> Markup:
    """Return an HTML table, whose first column names the rows; a wide table can be scrolled, also by keyboard.

    Keys of limits in caption and headers become words; cells keep the keys, because users copy them into commands.

    Args:
        table: table of texts.
        caption: caption of the table.
        attributes: attributes of the element, as for :func:`tag`.
    """
    caption = key_words(caption)
    caption = f"{caption[:1].upper()}{caption[1:]}"
    kept = len(table.rows) - table.folded
    shown = _table_element(_content(replace(table, rows=table.rows[:kept])), caption, **attributes)
    if not table.folded:
        return shown if shown.startswith("<div") else tag("div", shown, class_="table")
    words = f"{table.folded} {table.folded_words}"
    rest = replace(table, rows=table.rows[kept:], folded=0)
    anchor = f"{attributes['id']}-folded" if "id" in attributes else None
    folded = tag("details", tag("summary", words), html_table(rest, f"{caption}: {words}", id=anchor))
    return tag("div", shown, folded, class_="table")


def _table_element(content: _Content, caption: str, **attributes: object) -> Markup:
    """Return the element of a table with its box, and above it the texts of all rows."""
    headers, rows, above = content
    # An empty header is an ordinary cell, since it names nothing.
    columns = [[row[k] for row in rows] for k in range(len(headers))]
    heads = zip(headers, columns, strict=True)
    head = tag("tr", *(_head(header, texts) if header else tag("td") for header, texts in heads))
    is_long = len(rows) >= _ONE_LINE
    cells_of = [aligned(texts) for texts in columns]
    body = []
    for place, row in enumerate(rows):
        first, *others = (column[place] for column in cells_of)
        cells = [_cell(text, content, is_long=is_long) for text, content in zip(row[1:], others, strict=True)]
        kind = "long" if len(row[0]) > _LONG else None
        body.append(tag("tr", tag("th", first, scope="row", class_=kind), *cells))
    kind = "long" if is_long else None
    whole = tag("table", tag("caption", caption), tag("thead", head), tag("tbody", *body), class_=kind, **attributes)
    box = "scroll tall" if len(rows) >= _TALL else "scroll"
    shown = tag("div", whole, class_=box, tabindex="0", role="region", aria_label=caption)
    return join_markup([*(tag("p", each, class_="above") for each in above), shown])


def _content(table: TextTable) -> _Content:
    """Return headers and rows, with units at their numbers and without columns that are equal in all rows."""
    headers = [key_words(header).replace("\n", ", ") for header in table.headers]
    rows = [[_related(cell.words if isinstance(cell, Line) else str(cell)) for cell in row] for row in table.rows]
    above: list[str] = []
    at = headers.index("unit") if table.with_unit and "unit" in headers else None
    # A unit without a number in its row would be lost.
    if at is not None and all(not row[at] or any(is_number(row[k]) for k in table.with_unit) for row in rows):
        for row in rows:
            for k in table.with_unit:
                row[k] = f"{row[k]} {row[at]}".rstrip() if is_number(row[k]) else row[k]
        headers, rows = _without(headers, rows, {at})
    if len(rows) >= _ONE_LINE:
        texts = [{row[k] for row in rows} for k in range(len(headers))]
        equal = [k for k in range(1, len(headers)) if len(texts[k]) == 1 and headers[k]]
        words = [_equal_words(headers[k], rows[0][k]) for k in equal if rows[0][k]]
        above += [f"In all rows: {', '.join(words)}."] if words else []
        headers, rows = _without(headers, rows, set(equal))
    return _Content(headers, rows, above)


def _without(headers: list[str], rows: list[list[str]], places: set[int]) -> tuple[list[str], list[list[str]]]:
    """Return headers and rows without some columns."""

    def kept(cells: list[str]) -> list[str]:
        return [cell for k, cell in enumerate(cells) if k not in places]

    return kept(headers), [kept(row) for row in rows]


def _equal_words(header: str, text: str) -> str:
    """Return the common text of a column, such as ``x2 = 12.5 in`` for the header ``x2, in``."""
    name, _, unit = header.partition(", ")
    return f"{name} = {text} {unit}".rstrip() if is_number(text) else f"{header}: {text}"


def is_number(text: str) -> bool:
    """Return whether a text begins with a number, and has at most a unit after it."""
    return (
        _NUMBER.fullmatch(text.removeprefix("\N{LESS-THAN OR EQUAL TO} ").removeprefix("\N{GREATER-THAN OR EQUAL TO} "))
        is not None
    )


def _related(text: str) -> str:
    """Return a text with the signs of its inequalities."""
    return text.replace("<= ", "\N{LESS-THAN OR EQUAL TO} ").replace(">= ", "\N{GREATER-THAN OR EQUAL TO} ")


def aligned(texts: Sequence[str]) -> list[object]:
    """Return the cells of a column; digits before the point have the same width in all of them, so points align."""
    found = [_NUMBER.fullmatch(text) for text in texts]
    numbers = [each for each in found if each is not None]
    heads = {(each[1], len(each[2])) for each in numbers}
    # A column with other texts, such as names that begin with digits, is no column of numbers.
    if len(heads) < 2 or any(text and each is None and text != "none" for text, each in zip(texts, found, strict=True)):
        return list(texts)
    width = max(len(each[2]) for each in numbers) + (_SIGN if any(each[1] for each in numbers) else 0)
    style = f"--w:{width:g}"
    return [
        text if each is None else join_markup([tag("span", each[1] + each[2], class_="w", style=style), each[3]])
        for text, each in zip(texts, found, strict=True)
    ]


def _head(header: str, texts: Sequence[str]) -> Markup:
    """Return the header of a column; a long header of numbers is broken into lines of the numbers' width."""
    is_wide = len(header) > _LONG_HEAD and all(not text or is_number(text) for text in texts)
    return tag("th", header, scope="col", class_="wide" if is_wide else None)


def _cell(text: str, content: object, *, is_long: bool) -> Markup:
    """Return a cell of a table, with a class for a short number; a long text of a long table is cut to one line."""
    if is_long and len(text) > _LONG:
        return tag("td", tag("details", tag("summary", content), class_="cell"))
    long = "long line" if len(text) <= _ONE_SCREEN else "long"
    kind = long if len(text) > _LONG else "number" if len(text) < _SHORT and is_number(text) else None
    return tag("td", content, class_=kind)
