"""HTML from Python values: whatever is not markup already is escaped, so nothing of a case can become any."""

from __future__ import annotations

import json
from collections.abc import Iterable
from html import escape
from typing import Any

from rich.table import Table
from rich.text import Text


class Markup(str):
    """Text that is HTML already, and is not escaped again."""

    __slots__ = ()


#: A cell with a number shorter than this is not broken.
_SHORT = 24
#: Elements without an end tag.
_VOID = frozenset(["meta", "link", "input", "br", "img"])


def tag(name: str, *content: object, **attributes: object) -> Markup:
    """An element.

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
    """Several pieces of content as one."""
    return Markup(
        "".join(part if isinstance(part, Markup) else escape(str(part)) for part in content if part is not None)
    )


def paragraphs(lines: Iterable[object]) -> Markup:
    """A paragraph for each line of text; a dim label before it stays one."""
    return joined(tag("p", _labelled(line)) for line in lines)


def _labelled(line: object) -> object:
    if not (isinstance(line, Text) and line.spans and line.spans[0].start == 0 and line.spans[0].style == "dim"):
        return _plain(line)
    end = line.spans[0].end
    return joined([tag("span", f"{line.plain[:end].strip()}:", class_="label"), " ", line.plain[end:]])


def html_table(table: Table, caption: str, **attributes: object) -> Markup:
    """A table for the terminal as one of HTML, its first column naming the rows."""
    headers = [_plain(column.header).replace("\n", ", ") for column in table.columns]
    rows = zip(*(map(_plain, column.cells) for column in table.columns), strict=True)
    return grid(headers, rows, caption, **attributes)


def grid(headers: Iterable[object], rows: Iterable[Iterable[object]], caption: str, **attributes: object) -> Markup:
    """A table of HTML, its first column naming the rows; a wide one scrolls by itself, also by keyboard."""
    # A heading without words names nothing: it is a mere cell.
    head = tag("tr", *(tag("th", header, scope="col") if header else tag("td") for header in headers))
    body = []
    for row in rows:
        first, *others = row
        body.append(tag("tr", tag("th", first, scope="row"), *(_cell(cell) for cell in others)))
    whole = tag("table", tag("caption", caption), tag("thead", head), tag("tbody", *body), **attributes)
    return tag("div", whole, class_="scroll", tabindex="0", role="region", aria_label=caption)


def script_json(data: Any) -> Markup:  # noqa: ANN401 - whatever JSON can hold
    """JSON that can stand in a script element: no ``<`` is left, so nothing in it can end the element."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    for sign in "<>&":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return Markup(text)


def _cell(value: object) -> Markup:
    if isinstance(value, Markup):
        return tag("td", value)
    text = str(value)
    return tag("td", text, class_="number" if _is_short_number(text) else None)


def _is_short_number(text: str) -> bool:
    return len(text) < _SHORT and (text[:1].isdigit() or text[:1] in {"+", "-"})


def _plain(value: object) -> str:
    return value.plain if isinstance(value, Text) else str(value)


def paragraphs_of(lines: Any) -> list[Markup]:  # noqa: ANN401 - any lines of text
    """A paragraph for each line of text."""
    return [paragraphs([line]) for line in lines]
