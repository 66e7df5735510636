"""Lines and tables of text on a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

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
        console.print(_render(item))


def _render(item: Line | TextTable) -> RenderableType:
    """Return a line or a table for a console."""
    return _text(item) if isinstance(item, Line) else _table(item)


def _text(line: Line) -> Text:
    """Return a line with its label dim and its text in the style of its tone."""
    style = _STYLES[line.tone]
    if not (line.label or line.before or line.after):
        return Text(line.text, style=style)
    label = [(f"{line.label}  ", _LABEL)] if line.label else []
    return Text.assemble(*label, line.before, (line.text, style), line.after)


def _table(table: TextTable) -> Table:
    found = Table(box=None, pad_edge=False, header_style=_LABEL, padding=(0, 3, 0, 0))
    for header in table.headers:
        found.add_column(header, overflow="fold")
    for row in table.rows:
        found.add_row(*(_text(cell) if isinstance(cell, Line) else cell for cell in row))
    return found
