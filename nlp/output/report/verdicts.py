"""Common elements of pages about verdicts: the terminal's lines and tables, violations, case file and versions."""

from __future__ import annotations

from collections.abc import Iterable

from ...results.parts import VersionsData
from ...words.tables import origin_table
from ...words.text import Line, TextTable
from .markup import Markup, join_markup, paragraphs, tag
from .tables import html_table


def shown_verdicts(items: Iterable[Line | TextTable], key: str, words: str) -> Markup:
    """Return the lines and tables of the terminal without the title, and a sentence below them.

    Args:
        items: lines and tables of the terminal; the first item is the title.
        key: prefix of the identifiers of the tables.
        words: sentence below the tables.
    """
    _, *rest = items
    parts = [
        paragraphs([each]) if isinstance(each, Line) else html_table(each, each.title, id=f"{key}-{each.name}")
        for each in rest
    ]
    return join_markup([*parts, tag("p", words)])


def refuting_place(claim: str, pose: str, command: str) -> Markup:
    """Return a violated claim with its pose, and the command that shows the pose."""
    return join_markup([tag("h3", claim), tag("p", f"At {pose}."), shown_command(command)])


def shown_command(command: str) -> Markup:
    """Return a command as text to copy."""
    return tag("pre", tag("code", command), tabindex="0", aria_label="Command", class_="command")


def origin(versions: VersionsData, text: str) -> Markup:
    """Return versions and the case file."""
    table = html_table(origin_table(versions), "Versions", id="versions")
    shown = tag("pre", tag("code", text, id="case-text"), tabindex="0", aria_label="Case file")
    return join_markup([table, tag("h3", "Case file"), shown])
