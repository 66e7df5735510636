"""Text without a format: lines and tables, which terminal, Markdown and page render, each in its own way."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Tone(enum.Enum):
    """Meaning of a text beside its words."""

    PLAIN = "plain"
    TITLE = "title"
    ANSWER = "answer"
    NO_ANSWER = "no answer"
    HOLDS = "holds"
    FAULT = "fault"
    CAUTION = "caution"


@dataclass(frozen=True)
class Line:
    """A line of text.

    Attributes:
        text: the words that the tone belongs to.
        label: name of the text; empty without one.
        tone: of the text.
        before, after: words around the text, without a tone.
    """

    text: str
    label: str = ""
    tone: Tone = Tone.PLAIN
    before: str = ""
    after: str = ""

    @property
    def words(self) -> str:
        """Everything but the label."""
        return f"{self.before}{self.text}{self.after}"


@dataclass(frozen=True)
class TextTable:
    """A table of text.

    Attributes:
        headers: of the columns; a second line is the unit.
        rows: a cell for each column; a line where its tone matters.
    """

    headers: tuple[str, ...]
    rows: tuple[tuple[str | Line, ...], ...]
