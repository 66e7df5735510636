"""Words of a G-code program without motion, counted."""

from collections.abc import Mapping, Sequence

from ..system.jsonvalues import JsonObject

#: Entries for motions whose start is unknown: before the path, and after homing, macros or motors off within a program.
BEFORE_PATH, UNKNOWN_START = "motion before the path", "motion from an unknown position"


class Idle(JsonObject):
    """Word of a G-code program without motion, or line that does not belong to the path.

    Attributes:
        word: the word, or the reason why a line is left out.
        line: first line with the word.
        lines: number of lines with the word.
    """

    word: str
    line: int
    lines: int

    @property
    def is_motion(self) -> bool:
        """True for motions that are not part of the path, because their start is unknown."""
        return self.word in (BEFORE_PATH, UNKNOWN_START)


def idle_words(counts: Mapping[str, Sequence[int]]) -> tuple[Idle, ...]:
    """Return the words without motion, sorted by first line; ``counts`` has first line and number of lines by word."""
    found = sorted((line, word, lines) for word, (line, lines) in counts.items())
    return tuple(Idle(word=word, line=line, lines=lines) for line, word, lines in found)
