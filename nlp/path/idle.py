"""Words of a program that move nothing."""

from collections.abc import Mapping, Sequence

from ..system.jsonvalues import JsonObject


class Idle(JsonObject):
    """A word of a program that moves nothing, or a line that is no part of the path.

    Attributes:
        word: the word, or what is left out.
        line: the first line that has it.
        lines: number of lines that have it.
    """

    word: str
    line: int
    lines: int


def idle_words(counts: Mapping[str, Sequence[int]]) -> tuple[Idle, ...]:
    """Return what moves nothing, in the order of the first lines, from first line and count of each word."""
    found = sorted((line, word, lines) for word, (line, lines) in counts.items())
    return tuple(Idle(word=word, line=line, lines=lines) for line, word, lines in found)
