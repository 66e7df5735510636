"""Lines and tables of text, independent of the output: terminal, Markdown or page."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator
from dataclasses import replace

from ...models.values import dataclass

#: Smallest number of rows that a table folds.
FEWEST_FOLDED = 3


class Tone(enum.Enum):
    """Meaning of a text, which outputs show as colour."""

    PLAIN = "plain"
    TITLE = "title"
    ANSWER = "answer"
    NO_ANSWER = "no answer"
    HOLDS = "holds"
    FAULT = "fault"
    CAUTION = "caution"


@dataclass(frozen=True)
class Line:
    """Line of text.

    Attributes:
        text: words with the tone.
        label: name of the text; empty without a name.
        tone: tone of the text.
        before, after: words around the text, without a tone.
        is_command: If true, the text is a command: it is broken into lines so that a shell still reads it.
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
        """Text with the words around it, without the label."""
        return f"{self.before}{self.text}{self.after}"


class Figure(str):
    """Text of a number, with its value for outputs that keep every digit.

    Attributes:
        value: the number; 0 if it is below its error bound.
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
    """Table of text.

    Attributes:
        headers: heads of the columns; a second line is the unit.
        rows: rows with a cell for each column: text, a line with a tone, or a figure with all digits of a number.
        name: name in CSV and for ``--table``, one word; empty for a table that is shown only.
        title: line above the table on a terminal; empty without a title.
        folded: number of less important rows at the end: a terminal shows their count, a page shows them on request.
        folded_words: plural name of the folded rows.
        named: number of folded rows to which ``folded_words`` applies; None for all.
        part: name of the part of the result that the table belongs to; empty for the answer.
        extra: number of the last columns that a short view leaves out where the table is too long for it.
        is_curve: If true, the rows are points of a curve: a short view shows rows in equal steps, not the first rows.
        with_unit: indices of the columns whose numbers have the unit in the column ``unit``; a page writes the unit
            beside each of these numbers.
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
    with_unit: tuple[int, ...] = ()


def in_part(name: str, items: Iterable[Line | TextTable]) -> Iterator[Line | TextTable]:
    """Yield lines and tables as one section of a result, after the answer."""
    for item in items:
        yield replace(item, part=name)
