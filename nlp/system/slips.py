"""Slips in numbers that people write: a unit behind a number, and a decimal comma."""

from __future__ import annotations

import re
from collections.abc import Iterator

_NUMBER = r"[+-]?\d[\d_]*(?:\.\d+)?(?:[eE][+-]?\d+)?"
#: A unit: letters and signs that stand in no number of a file.
_UNIT = r"(?:[A-Za-zµμΩ°²³%]+(?:(?:[/*^]|\s+)[A-Za-z0-9°²³]+)*)"
_WITH_UNIT = re.compile(rf"({_NUMBER})\s*({_UNIT})")
_WITH_COMMA = re.compile(r"([+-]?\d+),(\d+(?:[eE][+-]?\d+)?)")
#: The same behind an equals sign, a bracket or a comma of TOML, and before what may stand behind a value. Behind an
#: equals sign a comma ends a value of an inline table, whose next key is no number with another sign than "=".
_UNIT_IN_TOML = re.compile(rf"(?<=[=\[,\s])(?P<number>{_NUMBER})\s*(?P<unit>{_UNIT})\s*(?=[,\]}}#]|$)")
_COMMA_IN_TOML = re.compile(r"=\s*(?P<whole>[+-]?\d+),(?P<part>\d+)(?![\w.]|\s*=)")
_TEXT = re.compile(r'"(?:\\.|[^"\\])*"|\'[^\']*\'')
#: Slips that a message lists.
_MOST = 3
#: What stands in a file behind a number without being a unit: nothing, but for these words.
_WORDS = ("inf", "nan", "true", "false")


def hint_of(text: str) -> str:
    """Return the end of a sentence about a text that is no number: the slip in it; empty where it is another one."""
    if found := _WITH_COMMA.fullmatch(text.strip()):
        return f"; write {found[1]}.{found[2]}: a decimal number has a point"
    if (found := _WITH_UNIT.fullmatch(text.strip())) and found[2] not in _WORDS:
        return f"; write {found[1]}: a number stands without its unit"
    return ""


def toml_slips(text: str) -> Iterator[tuple[int, str]]:
    """Yield the slips in a document that is no valid TOML: the number of the line, and a clause with what to write."""
    for k, line in enumerate(text.splitlines(), start=1):
        # Texts stay as long as they are, so that a sign within one is no comment.
        plain = _TEXT.sub(lambda found: "." * len(found[0]), line).partition("#")[0]
        for found in _COMMA_IN_TOML.finditer(plain):
            shown = f"{found['whole']},{found['part']}"
            yield k, f"line {k}: {shown} has a decimal comma, write {found['whole']}.{found['part']}"
        for found in _UNIT_IN_TOML.finditer(plain):
            if found["unit"] not in _WORDS:
                yield k, f"line {k}: {found[0].strip()} has a unit, write {found['number']}"


def toml_fault(text: str, error: Exception) -> str:
    """Return the fault of a document that is no valid TOML as a clause: the slips in it, else the words of the reader.

    Args:
        text: the document.
        error: of the reader of TOML, which names the line.
    """
    at = re.search(r"at line (\d+)", str(error))
    slips = list(toml_slips(text))
    if at is None or int(at[1]) not in (line for line, _ in slips):
        return f"is not valid TOML: {error}"
    more = f"; and {len(slips) - _MOST} more" if len(slips) > _MOST else ""
    return f"is not valid TOML: {'; '.join(words for _, words in slips[:_MOST])}{more}"
