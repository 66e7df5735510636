"""Text without a format: lines and tables, which terminal, Markdown and page render, each in its own way."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator
from dataclasses import replace

from ...models.values import dataclass

#: Fewer rows than these are not worth folding.
FEWEST_FOLDED = 3


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
        is_command: whether the text is a command to be copied: it is broken so that a shell still reads it.
        part: name of the part of the result that the line belongs to; empty for the answer.
    """

    text: str
    label: str = ""
    tone: Tone = Tone.PLAIN
    before: str = ""
    after: str = ""
    is_command: bool = False
    part: str = ""

    @property
    def words(self) -> str:
        """Everything but the label."""
        return f"{self.before}{self.text}{self.after}"


class Figure(str):
    """Text of a number, with the number for outputs that keep every digit.

    Attributes:
        value: the number; 0 where it is below its error bound.
    """

    __slots__ = ("value",)
    value: float

    def __new__(cls, text: str, value: float) -> Figure:
        """Return the text with its number."""
        made = super().__new__(cls, text)
        made.value = value
        return made


@dataclass(frozen=True)
class TextTable:
    """A table of text.

    Attributes:
        headers: of the columns; a second line is the unit.
        rows: a cell for each column; a line where its tone matters, a figure for a number with all its digits.
        name: one word, by which a table is asked for; empty for a table that nobody asks for.
        title: line above the table on a terminal; empty where the table needs none.
        folded: number of the last rows that are of less interest: a terminal counts them, a page opens them.
        folded_words: name of these rows in the plural.
        named: number of the last rows that this name is for; None for all rows.
        part: name of the part of the result that the table belongs to; empty for the answer.
        extra: number of the last columns that a short view leaves out where the table is too long for it.
        is_curve: whether the rows are points of a curve: a short view takes some in equal steps, not the first ones.
    """

    headers: tuple[str, ...]
    rows: tuple[tuple[str | Line, ...], ...]
    name: str = ""
    title: str = ""
    folded: int = 0
    folded_words: str = "more rows"
    named: int | None = None
    part: str = ""
    extra: int = 0
    is_curve: bool = False


def in_part(name: str, items: Iterable[Line | TextTable]) -> Iterator[Line | TextTable]:
    """Yield lines and tables as a part of a result that stands behind the answer."""
    for item in items:
        yield replace(item, part=name)
