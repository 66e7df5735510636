"""Lines and tables of text for a terminal, a file or a pipe."""

from __future__ import annotations

import itertools
import shlex
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from rich.cells import cell_len

from ..errors import one_line
from ..words.text import Line, TextTable, Tone

if TYPE_CHECKING:
    from rich.console import Console

#: Line as a list of texts with their styles.
_Styled: TypeAlias = "list[tuple[str, str]]"

#: Width of a file or a pipe, in columns.
PLAIN_WIDTH = 80
#: Number of lines of a short view.
ROOM = 25
#: Indent of the continuation lines of a wrapped line or cell, so that a continuation does not look like a row.
_INDENT = "  "

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
#: Spaces between columns; the smaller number where a table would be too wide.
_GAP, _NARROW_GAP = 3, 2
#: Least width of a column with wrapped words: it never becomes one word per line.
_WRAPPED = 14
#: The same for a table in several parts, which has room for longer lines.
_COMFORTABLE = 28


def show(console: Console | None, items: Iterable[Line | TextTable], *, whole: bool = True) -> None:
    """Print lines and tables; no word or number is split unless it is wider than the terminal.

    Args:
        console: terminal; None for standard output without styles.
        items: lines and tables of the answer, then those of further parts.
        whole: If true, print everything; otherwise the answer, the parts that fit, and the names of the other parts.
    """
    width = PLAIN_WIDTH if console is None else console.width
    lines = (each for item in items for each in _item_lines(item, width, whole=True)) if whole else _short(items, width)
    for line in lines:
        if console is None:
            sys.stdout.write("".join(text for text, _ in line) + "\n")
            continue
        # Loading rich takes a tenth of the time of a short command: a text without styles does not need it.
        from rich.text import Text  # noqa: PLC0415

        styled = Text(line[0][0], style=line[0][1]) if len(line) == 1 else Text.assemble(*line)
        console.print(styled, soft_wrap=True)


def _item_lines(item: Line | TextTable, width: int, *, whole: bool = False) -> Iterator[_Styled]:
    """Yield a line or a table as lines of at most a width."""
    if isinstance(item, TextTable):
        yield from _table_lines(replace(item, folded=0) if whole else item, width)
    elif item.is_command:
        yield from _command_lines(item, width)
    else:
        yield from _broken(_text(item), width)


def _short(items: Iterable[Line | TextTable], width: int) -> list[_Styled]:
    """Return the shortened answer, the parts that fit in the short view, and the names of the other parts."""
    answer: list[Line | TextTable] = []
    parts: dict[str, list[_Styled]] = {}
    for item in items:
        if item.part:
            parts.setdefault(item.part, []).extend(_item_lines(item, width))
        else:
            answer.append(item)
    last = _more_lines(parts, width)
    shown = _answer_lines(answer, width, ROOM - len(last))
    room = ROOM - len(shown)
    if sum(map(len, parts.values())) > room:
        room -= len(last)
    left = []
    for name, lines in parts.items():
        if len(lines) <= room:
            shown += lines
            room -= len(lines)
        else:
            left.append(name)
    return [*shown, *_more_lines(left, width)]


def _more_lines(names: Iterable[str], width: int) -> list[_Styled]:
    """Return the line with the names of the hidden parts; nothing without a name."""
    words = ", ".join(names)
    return list(_broken([("more  ", _LABEL), (f"{words}: --all", "")], width)) if words else []


def _answer_lines(items: Sequence[Line | TextTable], width: int, room: int) -> list[_Styled]:
    """Return the lines of an answer; without room, tables are shortened, beginning with the last."""
    blocks = [list(_item_lines(item, width)) for item in items]
    over = sum(map(len, blocks)) - room
    for k in reversed(range(len(items))):
        item = items[k]
        if over > 0 and isinstance(item, TextTable):
            short = _shortened(item, width, len(blocks[k]) - over)
            over -= len(blocks[k]) - len(short)
            blocks[k] = short
    return [line for block in blocks for line in block]


def _shortened(table: TextTable, width: int, room: int) -> list[_Styled]:
    """Return the lines of a table without its extra columns, with as many rows as fit, at least one."""
    lines: list[_Styled] = []
    note: list[_Styled] = []
    if table.extra:
        names = " and ".join(header.replace("\n", ", ") for header in table.headers[-table.extra :])
        note = list(_broken([(f"--all shows the column {names}", _LABEL)], width))
        kept = len(table.headers) - table.extra
        rows = tuple(row[:kept] for row in table.rows)
        table = replace(table, headers=table.headers[:kept], rows=rows, extra=0)
        lines = [*_table_lines(table, width), *note]
        if len(lines) <= room:
            return lines
    every = len(table.rows)
    for count in range(min(every - table.folded, max(room, 2)), 0, -1):
        if table.is_curve:
            places = [round(k * (every - 1) / max(count - 1, 1)) for k in range(count)]
            words = f"{count} of {every} rows shown: --all shows all"
            last: list[_Styled] = [[(words, _LABEL)]] if count < every else []
            lines = [*_table_lines(replace(table, rows=tuple(table.rows[k] for k in places)), width), *last, *note]
        else:
            is_named = table.named is None or every - count <= table.named
            words = table.folded_words if is_named else "more rows"
            lines = [*_table_lines(replace(table, folded=every - count, folded_words=words), width), *note]
        if len(lines) <= room:
            break
    return lines


def _command_lines(item: Line, width: int) -> Iterator[_Styled]:
    """Yield a command, wrapped between its options, so that a shell reads it as one command."""
    units: list[str] = []
    for word in map(shlex.quote, shlex.split(item.text)):
        if units and units[-1].startswith("--") and " " not in units[-1] and not word.startswith("--"):
            units[-1] += f" {word}"
        else:
            units.append(word)
    label, line = f"{item.label}  " if item.label else "", units[0]
    lines: list[str] = []
    for unit in units[1:]:
        beside = cell_len(label) if not lines else len(_INDENT)
        # Two columns for the backslash.
        if beside + cell_len(line) + 1 + cell_len(unit) + 2 <= width:
            line += f" {unit}"
        else:
            lines.append(f"{line} \\")
            line = unit
    first, *others = [*lines, line]
    yield [(one_line(label), _LABEL), (one_line(first), "")] if label else [(one_line(first), "")]
    yield from ([(f"{_INDENT}{one_line(each)}", "")] for each in others)


def _broken(line: _Styled, width: int) -> Iterator[_Styled]:
    """Yield a line; a line that is too wide is wrapped between words, with indented continuation lines."""
    text = "".join(part for part, _ in line)
    if cell_len(text) <= width:
        yield line
        return
    signs = [(sign, style) for part, style in line for sign in part]
    indent = " " * (len(text) - len(text.lstrip(" "))) + _INDENT
    indent = indent if len(indent) < width // 2 else ""
    begin, start = 0, ""
    while begin < len(signs):
        room, end, size = width - len(start), begin, 0
        while end < len(signs) and size + cell_len(signs[end][0]) <= room:
            size += cell_len(signs[end][0])
            end += 1
        if end < len(signs) and signs[end][0] != " ":
            # The last space in the line, unless the line would be empty before it.
            space = next((k for k in range(end - 1, begin, -1) if signs[k][0] == " "), None)
            if space is not None and text[begin:space].strip():
                end = space
        end = max(end, begin + 1)
        taken = list(signs[begin:end])
        while taken and taken[-1][0] == " ":
            taken.pop()
        grouped = itertools.groupby(taken, key=lambda each: each[1])
        yield [(start, "")] * bool(start) + [("".join(sign for sign, _ in group), style) for style, group in grouped]
        begin, start = end, indent
        while begin < len(signs) and signs[begin][0] == " ":
            begin += 1


def _header(text: str) -> str:
    """Return a column header: the name, and the unit on a second line. All other line breaks are escaped."""
    name, line_break, unit = text.partition("\n")
    return f"{one_line(name)}{line_break}{one_line(unit)}"


def _text(line: Line) -> _Styled:
    """Return a line; texts of a case are escaped, so that they cannot control the terminal."""
    style = _STYLES[line.tone]
    if not (line.label or line.before or line.after):
        return [(one_line(line.text), style)]
    label = [(f"{one_line(line.label)}  ", _LABEL)] if line.label else []
    return [*label, (one_line(line.before), ""), (one_line(line.text), style), (one_line(line.after), "")]


def _table_lines(table: TextTable, width: int) -> Iterator[_Styled]:
    """Yield the lines of a table; a table that is too wide is divided into several tables below each other.

    Each part begins with the first column, which names the rows.
    """
    shown = table.rows[: len(table.rows) - table.folded]
    columns = [
        _Column(_header(header), [_plain(row[k]) for row in shown], [_style(row[k]) for row in shown])
        for k, header in enumerate(table.headers)
    ]
    if table.title:
        yield from _broken([(one_line(table.title), _LABEL)], width)
    for part in _parts(columns, width):
        yield from _part_lines(part, len(shown), width)
    if table.folded:
        yield [(f"and {table.folded} {table.folded_words}: --all", _LABEL)]


class _Column:
    """Column of a table: header, cells, and possible widths."""

    def __init__(self, header: str, cells: Sequence[str], styles: Sequence[str]) -> None:
        self.header, self.cells, self.styles = header, cells, styles
        inside = max(map(cell_len, cells), default=0)
        starts = [cell_len(word) for text in (header, *cells) for word in text.split()]
        continued = [len(_INDENT) + cell_len(word) for text in cells for word in text.split()[1:]]
        words = max([*starts, *continued], default=0)
        #: Width without wrapping.
        self.natural = max(inside, *map(cell_len, header.split("\n")))
        #: Width with wrapping of the header only.
        self.narrow = max(inside, *(cell_len(word) for word in header.split()), 0)
        #: Least width.
        self.least = min(self.narrow, max(words, _WRAPPED))
        #: Width in a table in several parts.
        self.comfortable = min(self.narrow, max(words, _COMFORTABLE))


def _parts(columns: Sequence[_Column], width: int) -> Iterator[Sequence[_Column]]:
    """Yield the columns of each part of a table, so that each part fits a width."""
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
        cells = [_wrapped(column.cells[k], size, _INDENT) for column, size in zip(columns, widths, strict=True)]
        yield from _row_lines(cells, [column.styles[k] for column in columns], widths, between)


def _widths(columns: Sequence[_Column], width: int) -> list[int]:
    """Return the width of each column: headers wrap first, then the words of the widest columns."""
    widths = [column.natural for column in columns]
    for floors in ([column.narrow for column in columns], [column.least for column in columns]):
        while sum(widths) > width:
            wide = [k for k, floor in enumerate(floors) if widths[k] > floor]
            if not wide:
                break
            widths[max(wide, key=widths.__getitem__)] -= 1
    while sum(widths) > max(width, len(widths)):
        # A single word is wider than the terminal.
        widths[widths.index(max(widths))] -= 1
    return widths


def _row_lines(
    cells: Sequence[Sequence[str]], styles: Sequence[str], widths: Sequence[int], between: int
) -> Iterator[_Styled]:
    """Yield the lines of one row from the lines of its cells."""
    for k in range(max(map(len, cells))):
        line: _Styled = []
        for lines, style, size in zip(cells, styles, widths, strict=True):
            text = lines[k] if k < len(lines) else ""
            line += [(text, style), (" " * (size - cell_len(text) + between), "")]
        while line and not line[-1][0].strip():
            line.pop()
        yield [*line[:-1], *((text.rstrip(), style) for text, style in line[-1:])]


def _wrapped(text: str, width: int, indent: str = "") -> list[str]:
    """Return the lines of a text, wrapped between words to a width; a narrow column has no indent.

    Args:
        text: text with line breaks between paragraphs.
        width: width of the column.
        indent: indent of the continuation lines of each paragraph.
    """
    indent = indent if len(indent) < width // 2 else ""
    lines: list[str] = []
    for paragraph in text.split("\n"):
        if cell_len(paragraph) <= width:
            lines.append(paragraph)
            continue
        line, start = "", ""
        for word in paragraph.split():
            if line and cell_len(f"{line} {word}") <= width:
                line += f" {word}"
                continue
            if line:
                lines.append(line)
                start = indent
            *full, last = _pieces(word, width, start, indent)
            lines += full
            line = last
        lines.append(line)
    return lines


def _pieces(word: str, width: int, start: str, indent: str) -> Iterator[str]:
    """Yield the lines of a word, one line if it fits a width.

    Args:
        word: the word.
        width: width of the column.
        start: indent of the first line.
        indent: indent of the other lines.
    """
    piece, begin = start, start
    for sign in word:
        if piece != begin and cell_len(piece + sign) > width:
            yield piece
            piece = begin = indent
        piece += sign
    yield piece


def _plain(cell: str | Line) -> str:
    return one_line(cell.words if isinstance(cell, Line) else str(cell))


def _style(cell: str | Line) -> str:
    return _STYLES[cell.tone] if isinstance(cell, Line) else ""
