"""Rows of a sweep as a table of designs, as typed columns, and as a result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..errors import InputError
from ..program.formulation import formulate_whole
from ..program.nlp import Nlp
from ..results.design import limits_data, margins_data
from ..results.explorations import Numbers, SweepResult
from ..results.objective import unit_of_objective
from ..results.point import head_data, stated_pose_notice, versions
from ..results.rounding import FLAT
from ..results.tradeoff import unit_of_number
from ..system.journal import fields_of
from ..system.jsonvalues import finite_or_none, vector
from ..words.designs import SEPARATOR, Cell, Column, ColumnKind, Designs, Join, PageWords
from ..words.numbers import key_words, number
from ..words.tables import sizes_of_variables
from ..words.text import Line
from .journal import Row
from .points import Points
from .sweep import Sweep


@dataclass(frozen=True, eq=False)
class SweepColumns:
    """Results of a sweep as columns, in the order of its N points; NaN for missing numbers.

    Attributes:
        numbers: (N,) values of each varied parameter, bound or limit, by name.
        status: status of each solve; ``refused`` if the case contradicts itself.
        F: (N,) objective; for several tasks the value of their combination.
        design: (N,) values of each design variable by name, in the case's units.
        active: active sides of bounds and limits of each design.
        multipliers: multipliers of the active sides.
        verdict: kind of each point, such as a strict local maximum.
        stationarity: (N,) largest scaled derivative of the Lagrangian.
        feasibility: (N,) largest scaled violation of a bound or limit.
        curvature: (N,) smallest eigenvalue of the reduced Hessian.
        starts: (N,) number of searches.
        converged: (N,) number of converged searches.
        engine: engine that found each point, ``compiled`` or ``ipopt``.
        seconds: (N,) wall time.
        note: reason of a refusal, or note on limits over a workspace that are only checked at the stated pose.
        certificate: status of each certificate; empty texts without ``certified``.
        bound: (N,) proved bound of F.
        gap: (N,) absolute difference of F and the bound.
    """

    numbers: Mapping[str, FloatArray]
    status: tuple[str, ...]
    F: FloatArray
    design: Mapping[str, FloatArray]
    active: tuple[tuple[str, ...], ...]
    multipliers: tuple[tuple[float, ...], ...]
    verdict: tuple[str, ...]
    stationarity: FloatArray
    feasibility: FloatArray
    curvature: FloatArray
    starts: NDArray[np.int64]
    converged: NDArray[np.int64]
    engine: tuple[str, ...]
    seconds: FloatArray
    note: tuple[str, ...]
    certificate: tuple[str, ...]
    bound: FloatArray
    gap: FloatArray

    def __len__(self) -> int:
        return len(self.status)

    def __repr__(self) -> str:
        answers = int(np.isfinite(self.F).sum())
        return f"<SweepColumns of {len(self):,} points over {', '.join(self.numbers)}: {answers:,} with an optimum>"


def columns_of(sweep: Sweep, rows: Sequence[Row]) -> SweepColumns:
    """Return the rows of a complete sweep as columns, in the order of its points."""

    def numbers(values: Sequence[float | None]) -> FloatArray:
        return frozen_array(np.array(values, dtype=np.float64), (len(rows),))

    def column(name: str, kind: object) -> Any:  # noqa: ANN401 - as the fields of SweepColumns
        values = [getattr(row, name) for row in rows]
        if kind is int:
            return np.array(values, dtype=np.int64)
        return numbers(values) if kind in (float, float | None) else tuple(values)

    points, variables = sweep.points, sweep.variables
    values = zip(points.names, points.values.T, strict=True)
    design = {name: numbers([row.x[k] if k < len(row.x) else None for row in rows]) for k, name in enumerate(variables)}
    return SweepColumns(
        numbers=MappingProxyType({name: frozen_array(each, (len(points),)) for name, each in values}),
        design=MappingProxyType(design),
        **{name: column(name, kind) for name, kind in fields_of(Row) if name not in ("point", "x")},
    )


def sweep_designs(sweep: Sweep, rows: Sequence[Row]) -> Designs[Row]:
    """Return rows of a sweep as a table of designs."""
    case = sweep.case
    values = [row.F for row in rows if row.F is not None]
    words = f"{len(values):,} of {len(rows):,} points have an optimum"
    proved = sum(row.certificate == "proved" for row in rows)
    notice = stated_pose_note(case, (row.note for row in rows)) if case.limits_over else None
    line = words
    if values:
        regions = len({row.active for row in rows if row.F is not None})
        line += f", F from {min(values):.7g} to {max(values):.7g}, {regions} sets of active limits"
    return Designs(
        "sweep",
        case,
        "points: F and active limits",
        tuple(sweep_columns(sweep, case)),
        rows,
        Join.GRID if is_drawn(sweep.points) else Join.CLOUD,
        PageWords(
            f"Sweep: {case.name}, robot {case.model.name}, over {', '.join(map(key_words, sweep.points.names))}",
            f"{words}, {proved:,} of them with a certificate." if any(row.certificate for row in rows) else f"{words}.",
            ("curve", "F over the points"),
            ("values", "All points"),
            rules=() if notice is None else (f"Note: {notice}.",),
            below="values at the points; numbers are regions with the same active limits.",
            is_answer=bool(values),
        ),
        before=[Line(line + f", {proved:,} are proved" if sweep.certified else line)],
        after=() if notice is None else [Line(f"note: {notice}")],
    )


def is_drawn(points: Points) -> bool:
    """Return whether points are a grid over one or two varied quantities, over which F can be drawn."""
    return 1 <= sum(len(axis) > 1 for axis in points.axes) <= 2


def check_drawn(points: Points) -> None:
    """Refuse a picture of a sweep that is not a grid over one or two varied quantities.

    Raises:
        InputError: the points are not such a grid.
    """
    if not is_drawn(points):
        count = sum(len(axis) > 1 for axis in points.axes)
        fault = f"a grid over {count} names" if points.axes else "the rows of a file"
        raise InputError(f"--plot: needs a grid of --over over one or two names, got {fault}")


def sweep_columns(sweep: Sweep, case: Case | None = None) -> Iterator[Column[Row]]:
    """Yield the columns of the table of a sweep: varied values, result, evidence.

    Args:
        sweep: sweep of the table.
        case: case at one of the points, for labels and units; None for a table without labels and units.
    """
    nlp = None if case is None else formulate_whole(case)
    yield Column("index", lambda row: row.point, holds=int, label="point", text=lambda row: str(row.point))
    for j, name in enumerate(sweep.points.names):
        yield _varied(sweep, j, name, "" if nlp is None else _unit_of(nlp, name))
    yield Column("status", lambda row: row.status, holds=str, label="status", text=lambda row: row.status)
    yield Column(
        "F",
        lambda row: row.F,
        ColumnKind.OBJECTIVE,
        label="F",
        unit="" if case is None else unit_of_objective(case),
        text=lambda row: "" if row.F is None else number(row.F),
    )
    sizes = (
        {}
        if nlp is None
        else dict(zip((each.name for each in nlp.program.variables), sizes_of_variables(nlp), strict=True))
    )
    kinds = {} if nlp is None else {each.name: each.dimension for each in nlp.program.variables}
    for k, name in enumerate(sweep.variables):
        unit = "" if case is None or name not in kinds else case.units.label(kinds[name])
        yield _variable(k, name, sizes.get(name, 0.0), unit)
    for name, kind in fields_of(Row):
        if name in _LAST and (sweep.certified or name not in _PROOF):
            yield _column_of(name, kind)


def _varied(sweep: Sweep, j: int, name: str, unit: str) -> Column[Row]:
    values = sweep.points.values
    return Column(
        name,
        lambda row: float(values[row.point, j]),
        ColumnKind.VARIED,
        label=name,
        unit=unit,
        text=lambda row: number(float(values[row.point, j])),
    )


def _variable(k: int, name: str, size: float, unit: str) -> Column[Row]:
    return Column(
        name,
        lambda row: row.x[k] if k < len(row.x) else None,
        ColumnKind.VARIABLE,
        label=name,
        unit=unit,
        text=lambda row: number(row.x[k], size, part=FLAT) if k < len(row.x) else "",
    )


def _unit_of(nlp: Nlp, name: str) -> str:
    """Return the unit of a parameter, bound or limit of the case by its name."""
    limits = limits_data(margins_data(nlp, nlp.start, optimal=False)) if name.startswith("limits.") else ()
    return unit_of_number(name, nlp.case, limits)


#: Fields of a row for the last columns, and fields of its certificate.
_PROOF = ("certificate", "bound", "gap")
_LAST = {name for name, _ in fields_of(Row)} - {"point", "status", "F", "x"}
#: Texts of fields on a page; ``None`` for a missing number.
_SHOWN: Mapping[str, Callable[[Row], str]] = {
    "active": lambda row: ", ".join(row.active) or row.note,
    "certificate": lambda row: row.certificate,
    "gap": lambda row: "" if row.gap is None else number(row.gap),
}
_KINDS = {"active": ColumnKind.ACTIVE} | dict.fromkeys(_PROOF, ColumnKind.PROOF)
_TEXTS = (tuple[str, ...], tuple[float, ...], str)


def _column_of(name: str, kind: object) -> Column[Row]:
    """Return the column of a field of a row with its type; several values share a cell."""

    def cell(row: Row) -> Cell:
        value = getattr(row, name)
        if isinstance(value, tuple):
            return SEPARATOR.join(each if isinstance(each, str) else repr(each) for each in value)
        return value  # type: ignore[no-any-return]

    holds = str if kind in _TEXTS else int if kind is int else float
    shown = _SHOWN.get(name)
    meaning = _KINDS.get(name, ColumnKind.EVIDENCE)
    return Column(name, cell, meaning, holds, name, text=shown) if shown else Column(name, cell, meaning, holds)


def row_reader(sweep: Sweep, names: Sequence[str] | None = None) -> Callable[[Sequence[Any]], Row]:
    """Return the function that converts the cells of a table file to a row; an empty cell is None.

    Equal texts share one object: a million rows have a few dozen sets of active sides.

    Args:
        sweep: sweep of the table.
        names: names of the needed fields, by default all; other fields get their defaults.
    """
    first = 1 + len(sweep.points.names)
    design = slice(first + 2, first + 2 + len(sweep.variables))
    last = [name for name, _ in fields_of(Row) if name in _LAST and (sweep.certified or name not in _PROOF)]
    places = {"point": 0, "status": first, "F": first + 1} | {name: design.stop + k for k, name in enumerate(last)}
    readers: dict[object, Callable[[Any], Any]] = {
        tuple[str, ...]: cache(lambda cell: tuple(cell.split(SEPARATOR)) if cell else ()),
        tuple[float, ...]: lambda cell: tuple(map(float, cell.split(SEPARATOR))) if cell else (),
        str: cache(lambda cell: cell or ""),
        int: int,
        float: float,
        float | None: lambda cell: None if cell is None else float(cell),
    }
    wanted = [
        (k, places[name], readers[kind])
        for k, (name, kind) in enumerate(fields_of(Row))
        if name in places and (names is None or name in names)
    ]
    empty = [0, "", None, *Row._field_defaults.values()]

    def read(cells: Sequence[Any]) -> Row:
        values = list(empty)
        for k, place, reader in wanted:
            values[k] = reader(cells[place])
        x = cells[design] if names is None else ()
        values[3] = () if None in x else tuple(map(float, x))
        return Row._make(values)

    return read


def stated_pose_note(case: Case, notes: Iterable[str]) -> str | None:
    """Return the note that limits over the workspace are only checked at the stated pose, if a row has this note.

    Args:
        case: case at one of the points.
        notes: notes of the rows.
    """
    notice = stated_pose_notice(case)
    return notice if notice is not None and notice in notes else None


def sweep_result(case: Case, columns: SweepColumns) -> SweepResult:
    """Return the columns of a sweep as a result.

    Args:
        case: case at one of the points.
        columns: columns of the sweep.
    """
    is_proved = any(columns.certificate)
    return SweepResult.of(
        columns,
        head=head_data(case),
        notice=stated_pose_note(case, columns.note),
        unit=unit_of_objective(case),
        numbers=MappingProxyType({name: vector(values) for name, values in columns.numbers.items()}),
        statuses=columns.status,
        F=_numbers(columns.F),
        design=MappingProxyType({name: _numbers(values) for name, values in columns.design.items()}),
        actives=columns.active,
        verdicts=columns.verdict,
        stationarity=_numbers(columns.stationarity),
        feasibility=_numbers(columns.feasibility),
        curvature=_numbers(columns.curvature),
        starts=tuple(columns.starts.tolist()),
        converged=tuple(columns.converged.tolist()),
        engines=columns.engine,
        times=_numbers(columns.seconds),
        notes=columns.note,
        certificates=columns.certificate if is_proved else None,
        bounds=_numbers(columns.bound) if is_proved else None,
        gaps=_numbers(columns.gap) if is_proved else None,
        versions=versions(),
    )


def _numbers(values: FloatArray) -> Numbers:
    """Return numbers (N,); infinite and undefined numbers become None."""
    return tuple(finite_or_none(value) for value in values.tolist())
