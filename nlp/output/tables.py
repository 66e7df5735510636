"""Tables as comma-separated values, with all digits, and in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..errors import InputError, listing
from ..system.csvtext import csv_text
from ..system.markdown import markdown_text
from ..words.designs import Designs, Row, designs_table
from ..words.text import Figure, Line, TextTable


def tables_as_csv(items: Iterable[Line | TextTable], name: str | None = None) -> str:
    """Return tables as comma-separated values.

    Args:
        items: tables of a result; lines are ignored.
        name: name of the table to write; None for all tables, each below its name, separated by empty lines.

    Raises:
        InputError: no table has this name.
    """
    named = [item for item in items if isinstance(item, TextTable) and item.name]
    if name is None:
        return "\n".join(f"{table.name}\n{_as_csv(table)}" for table in named)
    for table in named:
        if table.name == name:
            return _as_csv(table)
    raise InputError(f"--table {name}: must be one of {listing([table.name for table in named])}")


def _as_csv(table: TextTable) -> str:
    """Return one table, with its headers in the first line."""
    head = [header.replace("\n", ", ") or ("note" if k else "name") for k, header in enumerate(table.headers)]
    return csv_text(head, ([_cell(cell) for cell in row] for row in table.rows))


def _cell(cell: str | Line) -> str:
    if isinstance(cell, Figure):
        return repr(float(cell.value))
    return cell.words if isinstance(cell, Line) else cell


def designs_markdown(designs: Designs[Row]) -> str:
    """Return a table of designs in Markdown, with the lines above and below it."""
    lines = [f"{line.label}: {line.words}" if line.label else line.words for line in designs.before]
    return "\n".join([*(f"{markdown_text(line)}\n" for line in lines), markdown(designs_table(designs))])


def markdown(table: TextTable) -> str:
    """Return a table in Markdown; texts of a case are escaped in its cells."""
    rows = ([_words(cell) for cell in row] for row in table.rows)
    lines = [
        _markdown_row([header.replace("\n", ", ") for header in table.headers]),
        f"|{'---|' * len(table.headers)}",
        *map(_markdown_row, rows),
    ]
    return "\n".join(lines) + "\n"


def _words(cell: str | Line) -> str:
    return cell.words if isinstance(cell, Line) else cell


def _markdown_row(cells: Sequence[str]) -> str:
    """Return a row of a table in Markdown."""
    return "| " + " | ".join(markdown_text(text) for text in cells) + " |"
