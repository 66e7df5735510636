"""Frequent slips in written numbers: a unit after a number, and a decimal comma."""

from __future__ import annotations

import re
from collections.abc import Iterator

_NUMBER = r"[+-]?\d[\d_]*(?:\.\d+)?(?:[eE][+-]?\d+)?"
#: Unit: letters and signs that occur in no number of a file.
_UNIT = r"(?:[A-Za-zµμΩ°²³%]+(?:(?:[/*^]|\s+)[A-Za-z0-9°²³]+)*)"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*({_UNIT})")
_WITH_COMMA = re.compile(r"([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)")
#: Number with a unit after an equals sign, a bracket or a comma of TOML, and before the allowed ends of a value. After
#: an equals sign, a comma ends a value of an inline table, whose next key is no number with another sign than "=".
_UNIT_IN_TOML = re.compile(rf"(?<=[=\[,\s])(?P<number>{_NUMBER})\s*(?P<unit>{_UNIT})\s*(?=[,\]}}#]|$)")
_COMMA_IN_TOML = re.compile(r"=\s*(?P<whole>[+-]?\d+),(?P<part>\d+)(?![\w.]|\s*=)")
_TEXT = re.compile(r'"(?:\\.|[^"\\])*"|\'[^\']*\'')
#: Largest number of slips in a message.
_MOST = 3
#: Words that may follow a number in a file without being a unit.
_WORDS = ("inf", "nan", "true", "false")


def hint_of(text: str) -> str:
    """Return the end of a message about a text that is not a number: a known slip, or an empty text."""
    if found := _WITH_COMMA.fullmatch(text.strip()):
        return f"; write {found[1]}.{found[2]}: a decimal number has a point"
    if (found := _WITH_UNIT.fullmatch(text.strip())) and found[2] not in _WORDS:
        return f"; write {found[1]}: a number is written without its unit"
    return ""


def toml_slips(text: str) -> Iterator[tuple[int, str]]:
    """Yield the slips in invalid TOML: line number, and clause with a correction."""
    for k, line in enumerate(text.splitlines(), start=1):
        # Texts keep their length, so that a sign within a text does not start a comment.
        plain = _TEXT.sub(lambda found: "." * len(found[0]), line).partition("#")[0]
        for found in _COMMA_IN_TOML.finditer(plain):
            shown = f"{found['whole']},{found['part']}"
            yield k, f"line {k}: {shown} has a decimal comma, write {found['whole']}.{found['part']}"
        for found in _UNIT_IN_TOML.finditer(plain):
            if found["unit"] not in _WORDS:
                yield k, f"line {k}: {found[0].strip()} has a unit, write {found['number']}"


def toml_fault(text: str, error: Exception) -> str:
    """Return the fault of invalid TOML as a clause.

    The fault lists the known slips if one of them is on the parser's line. Otherwise it is the parser's message.

    Args:
        text: text of the document.
        error: error of the TOML parser, which names the line.
    """
    at = re.search(r"at line (\d+)", str(error))
    slips = list(toml_slips(text))
    if at is None or int(at[1]) not in (line for line, _ in slips):
        return f"is not valid TOML: {error}"
    more = f"; and {len(slips) - _MOST} more" if len(slips) > _MOST else ""
    return f"is not valid TOML: {'; '.join(words for _, words in slips[:_MOST])}{more}"
