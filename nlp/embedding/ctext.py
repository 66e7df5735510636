"""C text: constant tables, string literals, comments and identifiers that no name of a case can break."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ...models import FloatArray


def identifier(name: str) -> str:
    """The prefix of a case's C names: valid in C whatever the case is called.

    What is added behind it is one word, has a capital letter, or for files a hyphen: two cases with different prefixes
    have no name in common.
    """
    plain = re.sub(r"[^0-9a-z]+", "_", name.lower(), flags=re.ASCII).strip("_")
    return f"screwsynth_{plain or 'case'}"


def texts(name: str, size: str, values: Iterable[str]) -> str:
    """A constant table of strings, ended by a null so that none is empty."""
    quoted = ", ".join([*(_quoted(text) for text in values), "0"])
    return f"static const char *const {name}[{size} + 1] = {{{quoted}}};"


def numbers(name: str, size: str, values: Iterable[float]) -> str:
    """A constant table of numbers, ended by a zero so that none is empty."""
    listed = ", ".join([*(repr(float(value)) for value in values), "0.0"])
    return f"static const double {name}[{size} + 1] = {{{listed}}};"


def integers(name: str, size: str, values: Iterable[int]) -> str:
    """A constant table of whole numbers, ended by a zero so that none is empty."""
    return f"static const int {name}[{size} + 1] = {{{', '.join(map(str, [*values, 0]))}}};"


def matrix(declared: str, rows: Iterable[FloatArray]) -> str:
    """A constant table of rows of numbers, each row ended by a zero."""
    cells = (", ".join(repr(float(value)) for value in [*row, 0.0]) for row in rows)
    body = ",\n    ".join(f"{{{cell}}}" for cell in cells)
    return f"static const double {declared} = {{\n    {body}}};\n"


def comment(text: str) -> str:
    """A text that cannot end a C comment or begin another line."""
    return re.sub(r"\s+", " ", text).replace("*/", "* /").replace("/*", "/ *")


def _quoted(text: str) -> str:
    """A C string literal: UTF-8 bytes outside of ASCII as octal escapes, which end after three digits."""
    plain = (chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in text.encode())
    return f'"{"".join(plain)}"'
