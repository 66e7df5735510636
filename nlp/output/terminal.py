"""Lines and tables of text on a terminal, and in a file or a pipe."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

from rich.cells import cell_len

from ..errors import one_line
from ..results.text import Line, TextTable, Tone

if TYPE_CHECKING:
    from rich.console import Console

#: A line as its parts, each with its style.
_Styled: TypeAlias = "list[tuple[str, str]]"

#: Columns of a file or a pipe, where a table is as wide as its content.
PLAIN_WIDTH = 120

_LABEL = "dim"
_STYLES = {
    Tone.PLAIN: "",
    Tone.TITLE: "bold",
    Tone.ANSWER: "bold green",
    Tone.NO_ANSWER: "bold red",
    Tone.HOLDS: "green",
    Tone.FAULT: "red",
    Tone.CAUTION: "yellow",
}
#: Spaces between columns, where they fit; else the smaller number.
_GAP, _NARROW_GAP = 3, 2
#: Words in a column wrap at this width or a larger one, so that a column never becomes a word a line.
_WRAPPED = 14
#: The same where a table goes on below itself, and has room for longer lines.
_COMFORTABLE = 28


def show(console: Console | None, items: Iterable[Line | TextTable]) -> None:
    """Print lines and tables; no word or number of them is split unless it is wider than the terminal by itself.

    Args:
        console: terminal; None for a standard output without styles.
        items: lines and tables.
    """
    width = PLAIN_WIDTH if console is None else console.width
    for item in items:
        is_command = isinstance(item, Line) and item.is_command
        for line in [_text(item)] if isinstance(item, Line) else _table_lines(item, width):
            _print(console, line, is_command=is_command)


def _print(console: Console | None, line: _Styled, *, is_command: bool) -> None:
    """Print a line; a command is not broken into several."""
    if console is None:
        text = "".join(part for part, _ in line)
        if "\t" not in text and (is_command or cell_len(text) <= PLAIN_WIDTH):
            sys.stdout.write(f"{text}\n")
            return
    # Loading the console takes as long as a tenth of a short command: a text that needs none goes without it.
    from rich.console import Console  # noqa: PLC0415
    from rich.text import Text  # noqa: PLC0415

    if console is None:
        console = Console(highlight=False, markup=False, emoji=False, width=PLAIN_WIDTH)
    styled = Text(line[0][0], style=line[0][1]) if len(line) == 1 else Text.assemble(*line)
    console.print(styled, soft_wrap=is_command)


def _header(text: str) -> str:
    """Return a header with its second line, the unit; line breaks within either are escaped."""
    name, line_break, unit = text.partition("\n")
    return f"{one_line(name)}{line_break}{one_line(unit)}"


def _text(line: Line) -> _Styled:
    """Return a line; the words of a case are escaped, so that they cannot control the terminal."""
    style = _STYLES[line.tone]
    if not (line.label or line.before or line.after):
        return [(one_line(line.text), style)]
    label = [(f"{one_line(line.label)}  ", _LABEL)] if line.label else []
    return [*label, (one_line(line.before), ""), (one_line(line.text), style), (one_line(line.after), "")]


def _table_lines(table: TextTable, width: int) -> Iterator[_Styled]:
    """Yield the lines of a table in a width: in several tables below each other where one would be too wide.

    Each of these begins with the first column, which names the rows.
    """
    shown = table.rows[: len(table.rows) - table.folded]
    columns = [
        _Column(_header(header), [_plain(row[k]) for row in shown], [_style(row[k]) for row in shown])
        for k, header in enumerate(table.headers)
    ]
    if table.title:
        yield [(one_line(table.title), _LABEL)]
    for part in _parts(columns, width):
        yield from _part_lines(part, len(shown), width)
    if table.folded:
        yield [(f"and {table.folded} {table.folded_words}; --csv FILE lists them", _LABEL)]


class _Column:
    """A column of a table: header, cells, and the widths that it can have."""

    def __init__(self, header: str, cells: Sequence[str], styles: Sequence[str]) -> None:
        self.header, self.cells, self.styles = header, cells, styles
        inside = max(map(cell_len, cells), default=0)
        words = max((cell_len(word) for text in (header, *cells) for word in text.split()), default=0)
        #: Width without a break.
        self.natural = max(inside, *map(cell_len, header.split("\n")))
        #: Width with breaks between the words of the header only.
        self.narrow = max(inside, *(cell_len(word) for word in header.split()), 0)
        #: Least width.
        self.least = min(self.narrow, max(words, _WRAPPED))
        #: Width in a table that goes on below itself.
        self.comfortable = min(self.narrow, max(words, _COMFORTABLE))


def _parts(columns: Sequence[_Column], width: int) -> Iterator[Sequence[_Column]]:
    """Yield the columns of each of the tables that a table becomes, so that each fits a width."""
    first, *others = columns
    if not others or _fits([column.least for column in columns], width):
        yield columns
        return
    part = [first]
    for column in others:
        if len(part) > 1 and not _fits([each.comfortable for each in (*part, column)], width):
            yield part
            part = [first]
        part.append(column)
    yield part


def _fits(widths: Sequence[int], width: int) -> bool:
    return sum(widths) + _NARROW_GAP * (len(widths) - 1) <= width


def _part_lines(columns: Sequence[_Column], rows: int, width: int) -> Iterator[_Styled]:
    """Yield the lines of a table whose columns fit a width."""
    naturals = [column.natural for column in columns]
    between = _GAP if sum(naturals) + _GAP * (len(columns) - 1) <= width else _NARROW_GAP
    widths = _widths(columns, width - between * (len(columns) - 1))
    headers = [_wrapped(column.header, size) for column, size in zip(columns, widths, strict=True)]
    tall = max(map(len, headers))
    raised = [[""] * (tall - len(lines)) + lines for lines in headers]
    yield from _row_lines(raised, [_LABEL] * len(columns), widths, between)
    for k in range(rows):
        cells = [_wrapped(column.cells[k], size) for column, size in zip(columns, widths, strict=True)]
        yield from _row_lines(cells, [column.styles[k] for column in columns], widths, between)


def _widths(columns: Sequence[_Column], width: int) -> list[int]:
    """Return a width for each column: headers wrap first, then the words of the widest columns."""
    widths = [column.natural for column in columns]
    for floors in ([column.narrow for column in columns], [column.least for column in columns]):
        while sum(widths) > width:
            wide = [k for k, floor in enumerate(floors) if widths[k] > floor]
            if not wide:
                break
            widths[max(wide, key=widths.__getitem__)] -= 1
    while sum(widths) > max(width, len(widths)):
        # A word by itself is wider than the terminal.
        widths[widths.index(max(widths))] -= 1
    return widths


def _row_lines(
    cells: Sequence[Sequence[str]], styles: Sequence[str], widths: Sequence[int], between: int
) -> Iterator[_Styled]:
    """Yield the lines of one row, each cell as its lines."""
    for k in range(max(map(len, cells))):
        line: _Styled = []
        for lines, style, size in zip(cells, styles, widths, strict=True):
            text = lines[k] if k < len(lines) else ""
            line += [(text, style), (" " * (size - cell_len(text) + between), "")]
        while line and not line[-1][0].strip():
            line.pop()
        yield [*line[:-1], *((text.rstrip(), style) for text, style in line[-1:])]


def _wrapped(text: str, width: int) -> list[str]:
    """Return the lines of a text in a width, broken between words."""
    lines: list[str] = []
    for paragraph in text.split("\n"):
        if cell_len(paragraph) <= width:
            lines.append(paragraph)
            continue
        line = ""
        for word in paragraph.split():
            pieces = list(_pieces(word, width))
            if line and cell_len(line) + 1 + cell_len(pieces[0]) <= width and len(pieces) == 1:
                line += f" {word}"
                continue
            lines += [line] if line else []
            *full, line = pieces
            lines += full
        lines.append(line)
    return lines


def _pieces(word: str, width: int) -> Iterator[str]:
    """Yield the pieces of a word, one where it fits a width."""
    piece = ""
    for sign in word:
        if piece and cell_len(piece + sign) > width:
            yield piece
            piece = ""
        piece += sign
    yield piece


def _plain(cell: str | Line) -> str:
    return one_line(cell.words if isinstance(cell, Line) else str(cell))


def _style(cell: str | Line) -> str:
    return _STYLES[cell.tone] if isinstance(cell, Line) else ""
