"""Lines and tables of text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from ..errors import one_line
from ..results.text import Line, TextTable, Tone

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


def show(console: Console, items: Iterable[Line | TextTable]) -> None:
    """Print lines and tables."""
    for item in items:
        console.print(_rendered(item))


def _rendered(item: Line | TextTable) -> RenderableType:
    return _text(item) if isinstance(item, Line) else _table(item)


def _header(text: str) -> str:
    """Return a header with its second line, the unit; line breaks within either are escaped."""
    name, line_break, unit = text.partition("\n")
    return f"{one_line(name)}{line_break}{one_line(unit)}"


def _text(line: Line) -> Text:
    """Return a line; the words of a case are escaped, so that they cannot control the terminal."""
    style = _STYLES[line.tone]
    if not (line.label or line.before or line.after):
        return Text(one_line(line.text), style=style)
    label = [(f"{one_line(line.label)}  ", _LABEL)] if line.label else []
    return Text.assemble(*label, one_line(line.before), (one_line(line.text), style), one_line(line.after))


def _table(table: TextTable) -> Table:
    found = Table(box=None, pad_edge=False, header_style=_LABEL, padding=(0, 3, 0, 0))
    for header in table.headers:
        found.add_column(_header(header), overflow="fold")
    for row in table.rows:
        found.add_row(*(_text(cell) if isinstance(cell, Line) else one_line(cell) for cell in row))
    return found
