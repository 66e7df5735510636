"""Text of a document's tables as TOML: for a case that is not what its file alone states."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

#: A key that needs no quotes.
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return a document as TOML, which reads as the same tables.

    Args:
        tables: the document, as ``tomllib`` returns it, without dates and times.

    Raises:
        TypeError: TOML has no form for a value here.
    """
    plain = [f"{_key(key)} = {_value(value)}" for key, value in tables.items() if not _is_table(value)]
    parts = ["\n".join(plain)] if plain else []
    for key, value in tables.items():
        if _is_table(value):
            written = value if isinstance(value, list) else [value]
            header = f"[[{_key(key)}]]" if isinstance(value, list) else f"[{_key(key)}]"
            parts += ["\n".join([header, *(f"{_key(k)} = {_value(v)}" for k, v in each.items())]) for each in written]
    return "\n\n".join(parts) + "\n"


def _is_table(value: object) -> bool:
    """Return whether a value gets a header of its own: a table, or a list of nothing but tables."""
    if isinstance(value, list):
        return bool(value) and all(isinstance(each, dict) for each in value)
    return isinstance(value, dict)


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _quoted(key)


def _quoted(text: str) -> str:
    # JSON's escapes are TOML's, but for the delete character, which JSON leaves as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: object) -> str:
    """Return a value within a line; the errors are those of :func:`toml_text`."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list):
        return f"[{', '.join(_value(each) for each in value)}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(k)} = {_value(v)}' for k, v in value.items())} }}" if value else "{}"
    raise TypeError(f"TOML has no form for {value!r} here")
