"""Writer of TOML: values on one line, tables, and whole documents."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from ..errors import CaseError, one_line

#: A value of a TOML document; a None in a table is left out.
TomlValue: TypeAlias = "bool | int | float | str | Sequence[TomlValue] | Mapping[str, TomlValue | None]"

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
#: Largest float that is written as an integer: up to here, both are equal without loss.
_LARGEST_INTEGER = 2**53


def plain_value(value: object) -> TomlValue:
    """Return a value of a robot's option as a TOML value; a tuple becomes a list.

    Raises:
        CaseError: TOML has no such value.
    """
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain_value(part) for key, part in value.items()}
    if isinstance(value, Sequence):
        return [plain_value(part) for part in value]
    fault = "has an option that TOML cannot state: use numbers, texts, truth values, lists and tables, got"
    raise CaseError("robot", f"{fault} {one_line(repr(value))[:60]}")


def _short_number(value: float) -> str:
    """Return a number with all its digits."""
    number = int(value) if isinstance(value, int) else float(value)
    whole = isinstance(number, float) and number.is_integer() and abs(number) <= _LARGEST_INTEGER
    is_minus_zero = number == 0 and str(number).startswith("-")
    return str(int(number)) if whole and not is_minus_zero else repr(number)


def toml_text(value: TomlValue, number_text: Callable[[float], str] = _short_number) -> str:
    """Return a value as TOML on one line, from which ``tomllib`` reads an equal value.

    Args:
        value: the value.
        number_text: formatter of numbers; by default, whole floats are written without a point.

    Raises:
        TypeError: the value is not a number, text, truth value, list or table.
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes all but one of the characters that TOML wants escaped.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int | float):
        return number_text(value)
    if isinstance(value, Mapping):
        inner = ", ".join(toml_lines(value, number_text))
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, Sequence):
        return f"[{', '.join(toml_text(part, number_text) for part in value)}]"
    raise TypeError(f"expected a number, text, truth value, list or table for TOML, got {value!r}")


def option_text(value: object) -> str:
    """Return the value of a robot's option as TOML writes it."""
    return repr(value) if isinstance(value, float) else json.dumps(value, default=str)


def toml_key(key: str) -> str:
    """Return a key, in quotes if TOML needs them."""
    return key if _BARE_KEY.fullmatch(key) else toml_text(key)


def toml_lines(table: Mapping[str, TomlValue | None], number_text: Callable[[float], str] = _short_number) -> list[str]:
    """Return one line for each key of a table; keys with the value None are left out."""
    given = ((key, value) for key, value in table.items() if value is not None)
    return [f"{toml_key(key)} = {toml_text(value, number_text)}" for key, value in given]


def toml_table(header: str, table: Mapping[str, TomlValue | None]) -> list[str]:
    """Return the lines of a table: an empty line, the header, such as ``[limits]``, and its keys; none if empty."""
    lines = toml_lines(table)
    return ["", header, *lines] if lines else []


def toml_tables(header: str, tables: Iterable[Mapping[str, TomlValue | None]]) -> list[str]:
    """Return the lines of several tables with the same header, such as ``[[task]]``."""
    return [line for table in tables for line in toml_table(header, table)]


def toml_document(tables: Mapping[str, Any]) -> str:
    """Return a whole document as TOML, from which ``tomllib`` reads equal tables; each number keeps its type.

    Args:
        tables: the document, as ``tomllib`` returns it, without dates and times.

    Raises:
        TypeError: a value is not a number, text, truth value, list or table.
    """
    plain = {key: value for key, value in tables.items() if not _is_table(value)}
    parts = ["\n".join(toml_lines(plain, repr))] if plain else []
    for key, value in tables.items():
        if _is_table(value):
            written = value if isinstance(value, list) else [value]
            header = f"[[{toml_key(key)}]]" if isinstance(value, list) else f"[{toml_key(key)}]"
            parts += ["\n".join([header, *toml_lines(each, repr)]) for each in written]
    return "\n\n".join(parts) + "\n"


def _is_table(value: object) -> bool:
    """Return whether a value is written below a header: a table, or a list of tables only."""
    if isinstance(value, list):
        return bool(value) and all(isinstance(each, dict) for each in value)
    return isinstance(value, dict)
