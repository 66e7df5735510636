"""HTML from Python values: everything but markup is escaped, so that no text of a case becomes markup."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from html import escape
from typing import Any

from ...results.text import Line, TextTable


class Markup(str):
    """Text that is HTML already, and is not escaped again."""

    __slots__ = ()


#: A cell with a number shorter than this is not broken.
_SHORT = 24
#: Elements without an end tag.
_VOID = frozenset(["meta", "link", "input", "br", "img"])


def tag(name: str, *content: object, **attributes: object) -> Markup:
    """Return an element.

    Args:
        name: of the element.
        content: markup, or anything else, whose text is escaped; None is left out.
        attributes: by name, ``_`` for ``-`` and at the end of Python's own words; True for one without a value, None
            or False for none.
    """
    parts = [name]
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        label = key.rstrip("_").replace("_", "-")
        parts.append(label if value is True else f'{label}="{escape(str(value))}"')
    opening = f"<{' '.join(parts)}>"
    return Markup(opening if name in _VOID else f"{opening}{joined(content)}</{name}>")


def joined(content: Iterable[object]) -> Markup:
    """Return several pieces of content as one."""
    return Markup(
        "".join(part if isinstance(part, Markup) else escape(str(part)) for part in content if part is not None)
    )


def paragraphs(lines: Iterable[Line | str]) -> Markup:
    """Return a paragraph for each line of text; its label stands before it."""
    return joined(tag("p", _line(line)) for line in lines)


def _line(line: Line | str) -> object:
    if isinstance(line, str):
        return line
    if not line.label:
        return line.words
    return joined([tag("span", f"{line.label}:", class_="label"), " ", line.words])


def html_table(table: TextTable, caption: str, **attributes: object) -> Markup:
    """Return a table of HTML, its first column naming the rows; a wide one scrolls by itself, also by keyboard.

    Args:
        table: of text.
        caption: of the table.
        attributes: of the element, as for :func:`tag`.
    """
    headers = [header.replace("\n", ", ") for header in table.headers]
    # A heading without words names nothing: it is a mere cell.
    head = tag("tr", *(tag("th", header, scope="col") if header else tag("td") for header in headers))
    body = []
    for row in table.rows[: len(table.rows) - table.folded]:
        first, *others = (cell.words if isinstance(cell, Line) else cell for cell in row)
        body.append(tag("tr", tag("th", first, scope="row"), *(_cell(cell) for cell in others)))
    whole = tag("table", tag("caption", caption), tag("thead", head), tag("tbody", *body), **attributes)
    shown = tag("div", whole, class_="scroll", tabindex="0", role="region", aria_label=caption)
    if not table.folded:
        return shown
    words = f"{table.folded} {table.folded_words}"
    rest = replace(table, rows=table.rows[len(table.rows) - table.folded :], folded=0)
    anchor = f"{attributes['id']}-folded" if "id" in attributes else None
    return joined([shown, tag("details", tag("summary", words), html_table(rest, f"{caption}: {words}", id=anchor))])


def script_json(data: Any) -> Markup:  # noqa: ANN401 - whatever JSON can hold
    """Return JSON that can stand in a script element: no ``<`` is left that could end the element."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)


def _cell(text: str) -> Markup:
    return tag("td", text, class_="number" if _is_short_number(text) else None)


def _is_short_number(text: str) -> bool:
    return len(text) < _SHORT and (text[:1].isdigit() or text[:1] in {"+", "-"})
