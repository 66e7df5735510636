"""Common elements of pages about verdicts: the terminal's lines and tables, violations, case file and versions."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby

from ...case.case import Case
from ...case.pose import ends_of
from ...results.parts import VersionsData
from ...words.numbers import key_words, number, spaced
from ...words.tables import origin_table
from ...words.text import Line, TextTable
from .markup import Markup, beside, join_markup, paragraphs, tag
from .tables import html_table


def shown_verdicts(items: Iterable[Line | TextTable], key: str, words: str) -> Markup:
    """Return the lines and tables of the terminal without the title, and a sentence below them.

    Args:
        items: lines and tables of the terminal; the first item is the title.
        key: prefix of the identifiers of the tables.
        words: sentence below the tables.
    """
    _, *rest = items
    parts = []
    for is_line, group in groupby(rest, key=lambda each: isinstance(each, Line)):
        found = list(group)
        if is_line:
            parts.append(paragraphs(each for each in found if isinstance(each, Line)))
        else:
            tables = [each for each in found if isinstance(each, TextTable)]
            parts.append(beside(*(html_table(each, each.title, id=f"{key}-{each.name}") for each in tables)))
    return join_markup([*parts, tag("p", words)])


def dimensions_table(case: Case) -> Markup:
    """Return the table of the robot's dimensions: fixed values, and ranges of those that change along a path."""
    rows = []
    for item in case.model.parameters:
        ends = [
            [case.units.shown(end, item.dimension) for end in ends_of(value)] for value in case.components(item.name)
        ]
        largest, unit = max(abs(end) for pair in ends for end in pair), case.units.label(item.dimension)
        for name, pair in zip(case.component_names(item), ends, strict=True):
            rows.append((name, " .. ".join(number(end, largest) for end in dict.fromkeys(pair)), unit))
    table = TextTable(("", "value", "unit"), tuple(rows), "dimensions", with_unit=(1,))
    return html_table(table, "Dimensions", id="dimensions")


def refuting_place(claim: str, pose: str, command: str) -> Markup:
    """Return a violated claim with its pose, and the command that shows the pose if there is one."""
    shown = [shown_command(command)] if command else []
    return join_markup([tag("h3", in_words(claim)), tag("p", f"At {pose}."), *shown])


def in_words(claim: str) -> str:
    """Return a claim with its quantity and its limit in words, for a heading or a caption."""
    name, space, rest = key_words(claim).partition(" ")
    return f"{spaced(name)}{space}{rest}"


def shown_command(command: str) -> Markup:
    """Return a command as text to copy."""
    return tag("pre", tag("code", command), tabindex="0", aria_label="Command", class_="command")


def origin(versions: VersionsData, text: str) -> Markup:
    """Return versions and the case file."""
    table = html_table(origin_table(versions), "Versions", id="versions")
    shown = tag("pre", tag("code", text, id="case-text"), tabindex="0", aria_label="Case file")
    return beside(table, tag("div", tag("h3", "Case file"), shown, class_="fill"))
