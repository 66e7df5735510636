"""TOML text of plain values."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

#: A value of a TOML document; a None in a table is left out.
TomlValue: TypeAlias = "bool | int | float | str | Sequence[TomlValue] | Mapping[str, TomlValue | None]"

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
#: Integers up to this size are floats without loss, and are written without a point.
_LARGEST_INTEGER = 2**53


def toml_text(value: TomlValue) -> str:
    """Return a value on one line, from which ``tomllib`` reads the same value; whole floats lose their point."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes all but one of the characters that TOML wants escaped.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int | float):
        return _number_text(value)
    if isinstance(value, Mapping):
        inner = ", ".join(f"{toml_key(key)} = {toml_text(part)}" for key, part in value.items() if part is not None)
        return f"{{ {inner} }}" if inner else "{}"
    return f"[{', '.join(map(toml_text, value))}]"


def toml_key(key: str) -> str:
    """Return a key, in quotes where it needs them."""
    return key if _BARE_KEY.fullmatch(key) else toml_text(key)


def toml_lines(table: Mapping[str, TomlValue | None]) -> list[str]:
    """Return a line for each key of a table."""
    return [f"{toml_key(key)} = {toml_text(value)}" for key, value in table.items() if value is not None]


def toml_table(header: str, table: Mapping[str, TomlValue | None]) -> list[str]:
    """Return a table behind an empty line and its header, such as ``[limits]``; nothing for an empty table."""
    lines = toml_lines(table)
    return ["", header, *lines] if lines else []


def toml_tables(header: str, tables: Iterable[Mapping[str, TomlValue | None]]) -> list[str]:
    """Return the tables of a list, each behind a header such as ``[[task]]``."""
    return [line for table in tables for line in toml_table(header, table)]


def _number_text(value: float) -> str:
    """Return a number with all its digits."""
    number = int(value) if isinstance(value, int) else float(value)
    whole = isinstance(number, float) and number.is_integer() and abs(number) <= _LARGEST_INTEGER
    is_minus_zero = number == 0 and str(number).startswith("-")
    return str(int(number)) if whole and not is_minus_zero else repr(number)
