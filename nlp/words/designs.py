"""Tables of designs: filled by sweeps, trade-offs, fronts and comparisons, read by every output."""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterator, Sequence
from typing import Generic, NamedTuple, TypeAlias, TypeVar

from ...models import FloatArray
from ...models.values import dataclass
from ..case.case import Case
from ..evidence.state import RobotState
from ..program.nlp import Nlp
from ..program.program import design_indices
from ..results.data import CertificateData
from ..results.rounding import FLAT
from ..system.csvtext import csv_text
from .numbers import key_words, number
from .text import Line, TextTable

#: Separator of several values in a cell of CSV.
SEPARATOR = "; "
Row = TypeVar("Row")
Cell: TypeAlias = "float | str | bool | None"


class ColumnKind(enum.Enum):
    """Meaning of the cells of a column."""

    VARIED = "varied limit or parameter"
    OBJECTIVE = "objective or goal"
    VARIABLE = "design variable"
    ACTIVE = "active bounds and limits"
    EVIDENCE = "evidence"
    PROOF = "proved bound"
    OTHER = "name, status or note"


class Join(enum.Enum):
    """Relation of the rows, as pictures show it."""

    CURVE = "neighbours along a varied value, or along a front of two goals"
    GRID = "points of a grid over one or more varied values"
    CLOUD = "points without an order"
    LIST = "independent rows"


@dataclass(frozen=True)
class Column(Generic[Row]):
    """Column of a table of designs.

    Attributes:
        name: name in CSV; empty for a column that CSV does not have.
        cell: returns the exact value of a row.
        kind: meaning of the cells.
        holds: type of the cells: ``float``, ``int`` or ``str``.
        label: name in tables of text, pages and pictures; empty for a column that only CSV has.
        unit: unit of the values; empty for a plain number.
        text: returns the text of a row in tables.
        series: name of the line in pictures; if empty, the line has the label as name.
    """

    name: str
    cell: Callable[[Row], Cell]
    kind: ColumnKind = ColumnKind.OTHER
    holds: type[float | str] = float
    label: str = ""
    unit: str = ""
    text: Callable[[Row], str] = lambda _row: ""
    series: str = ""

    @property
    def axis(self) -> str:
        """Label in words, with unit, for an axis of a picture."""
        words = key_words(self.label)
        return f"{words}, {self.unit}" if self.unit else words


class DrawnDesign(NamedTuple):
    """Design for a drawing.

    Attributes:
        name: name of the robot, or the varied value or the goals of the design.
        words: result of the design, as a sentence.
        numbers: variables of the design, each as a text with name, value and unit.
        active: active bounds and limits.
        nlp: nonlinear program whose solution is the design.
        x: (n,) variables of the nonlinear program at the design.
        state: robot of the design at the first pose; None if the loop equations have no solution.
        task: index of the task that is drawn.
    """

    name: str
    words: str
    numbers: tuple[str, ...]
    active: tuple[str, ...]
    nlp: Nlp
    x: FloatArray
    state: RobotState | None
    task: int = 0


class DesignDetails(NamedTuple):
    """Part of a page about one design: name, sentences, and a table of dimensions or None."""

    name: str
    sentences: Sequence[str]
    table: TextTable | None


class PageWords(NamedTuple):
    """Words of the page about a table of designs.

    Attributes:
        subtitle: line below the title.
        answer: sentence with the answer.
        picture: anchor and heading of the section with the picture.
        table: anchor and heading of the section with the table.
        rules: sentences above the picture.
        cautions: sentences of caution below the picture.
        below: text below the picture.
        designs: heading of the section with the designs.
        bends: heading of the sentences about changes of active limits; empty for none.
        is_answer: If true, there is an answer.
    """

    subtitle: str
    answer: str
    picture: tuple[str, str]
    table: tuple[str, str]
    rules: Sequence[str] = ()
    cautions: Sequence[str] = ()
    below: str = ""
    designs: str = ""
    bends: str = ""
    is_answer: bool = True


@dataclass(frozen=True, eq=False)
class Designs(Generic[Row]):
    """Table of designs.

    Attributes:
        word: kind of the table, such as ``trade-off``.
        case: the case, or the case of the first row.
        caption: description of the rows.
        columns: columns in order.
        rows: rows, one per design.
        join: relation of the rows: a curve, a grid, a cloud or a list.
        page: words of the page.
        before, after: lines above and below the table on a terminal.
        drawn: function that returns the designs for drawings.
        gaps: indices of rows after which the curve is interrupted.
        missing: sentences about rows without an answer.
        throughout: names of the bounds and limits that are active in every row with an answer.
        details: texts of a page about the designs.
    """

    word: str
    case: Case
    caption: str
    columns: tuple[Column[Row], ...]
    rows: Sequence[Row]
    join: Join
    page: PageWords
    before: Sequence[Line] = ()
    after: Sequence[Line] = ()
    drawn: Callable[[], Sequence[DrawnDesign]] = lambda: ()
    gaps: tuple[int, ...] = ()
    missing: Sequence[str] = ()
    throughout: str = ""
    details: tuple[DesignDetails, ...] = ()

    def of_kind(self, kind: ColumnKind) -> list[Column[Row]]:
        """Return the columns of a kind."""
        return [each for each in self.columns if each.kind is kind]

    @property
    def title(self) -> str:
        """Title of the case."""
        return self.case.title or self.case.name


def designs_csv(found: Designs[Row]) -> str:
    """Return a table of designs as CSV, one row for each design; a missing value is an empty cell."""
    columns = [each for each in found.columns if each.name]
    return csv_text([each.name for each in columns], [[each.cell(row) for each in columns] for row in found.rows])


def designs_table(found: Designs[Row], most: int | None = None) -> TextTable:
    """Return a table of designs as text, with at most the given number of rows."""
    columns = [each for each in found.columns if each.label]
    is_curve = found.join in (Join.CURVE, Join.CLOUD)
    return TextTable(
        tuple(f"{each.label}\n{each.unit}" if each.unit else each.label for each in columns),
        tuple(tuple(each.text(row) for each in columns) for row in found.rows[:most]),
        name=found.word if found.join is Join.LIST else "",
        extra=1 if is_curve else 0,
        is_curve=is_curve,
    )


def designs_summary(found: Designs[Row]) -> Iterator[Line | TextTable]:
    """Yield a table of designs with the lines around it."""
    yield from found.before
    yield designs_table(found)
    yield from found.after


def certificate_columns(certificate_of: Callable[[Row], CertificateData | None]) -> Iterator[Column[Row]]:
    """Yield the columns of certificates: status, bound and gap."""

    def number_of(name: str) -> Callable[[Row], float | None]:
        return lambda row: None if (proof := certificate_of(row)) is None else getattr(proof, name)

    def status(row: Row) -> str:
        return "" if (proof := certificate_of(row)) is None else proof.status.value

    yield Column("certificate", status, ColumnKind.PROOF, holds=str, label="certificate", text=status)
    yield Column("proven_bound", number_of("bound"), ColumnKind.PROOF)
    yield Column("gap", number_of("gap"), ColumnKind.PROOF)


def drawn_task(case: Case) -> str:
    """Return a clause with the task whose robot is drawn, if dimensions or the pose change from task to task."""
    return f", robot of {case.tasks[0].name}" if case.changes else ""


def design_values(nlp: Nlp, x: FloatArray) -> tuple[str, ...]:
    """Return the free dimensions and pose coordinates of a design, each as a text with name, value and unit."""
    units, variables = nlp.case.units, nlp.program.variables
    found = []
    for k in design_indices(nlp.program):
        width = units.shown(float(nlp.scale[k]), variables[k].dimension)
        shown = number(units.shown(float(x[k]), variables[k].dimension), width, digits=5, part=FLAT)
        found.append(f"{variables[k].name} = {shown} {units.label(variables[k].dimension)}".rstrip())
    return tuple(found)
