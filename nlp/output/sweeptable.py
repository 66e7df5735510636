"""The table of a sweep as a file: Parquet or CSV by its ending, written row group by row group."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from itertools import islice
from pathlib import Path, PurePath
from sys import intern
from typing import Any, NamedTuple

from ..errors import InputError
from ..sweeps.journal import Row
from ..sweeps.sweep import Sweep
from .files import check_target, write_whole

#: Endings of a table's file.
_PARQUET, _CSV = ".parquet", ".csv"
#: Rows that are in memory at once.
_GROUP = 20_000
#: Key of the sweep's fingerprint in a Parquet file, and name of its column in a CSV file.
_KEY = "screwsynth_sweep"
_SEPARATOR = "; "
_TEXTS = ("status", "active", "multipliers", "verdict", "engine", "note", "certificate")
_WHOLE = ("index", "starts", "converged")


class TablePoint(NamedTuple):
    """What a picture shows of a row: objective, NaN where there is no answer, and the active sides as one text."""

    F: float
    active: str


def check_table(target: str) -> None:
    """Refuse a table that cannot be written, before the work begins.

    Raises:
        InputError: its ending is another one, pyarrow is not installed, or the file cannot be written.
    """
    ending = PurePath(target).suffix.lower()
    if ending not in (_PARQUET, _CSV):
        raise InputError(f"--out {target}: must end in {_PARQUET} or {_CSV}")
    if ending == _PARQUET and find_spec("pyarrow") is None:
        fault = "needs pyarrow, which is not installed: pip install 'screwsynth[sweep]', or write a .csv file"
        raise InputError(f"--out {target}: {fault}")
    check_target(target)


def is_written(target: str, sweep: Sweep) -> bool:
    """Return whether a file is the whole table of a sweep already; false where there is no file.

    Raises:
        InputError: the file is there and is something else.
    """
    path = Path(target)
    if not path.exists():
        return False
    found = None
    # Whatever cannot be read is no table of a sweep.
    with suppress(OSError, ValueError, IndexError, KeyError, TypeError, StopIteration):
        found = _fingerprint(path)
    if found != sweep.fingerprint:
        raise InputError(
            f"--out {target}: exists and is not the table of this sweep; choose another name, or remove it"
        )
    return True


def write_table(target: str, sweep: Sweep, rows: Iterable[Row]) -> None:
    """Write the rows of a whole sweep; the file appears under its name when it is complete.

    Args:
        target: the file, whose ending is ``.parquet`` or ``.csv``.
        sweep: the sweep.
        rows: in the order of the points.

    Raises:
        InputError: the file cannot be written.
    """
    columns = column_names(sweep)
    cells = (_cells(sweep, row) for row in rows)
    with write_whole(target) as path:
        if PurePath(target).suffix.lower() == _CSV:
            with path.open("w", encoding="utf-8", newline="") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow([*columns, _KEY])
                writer.writerows([*row, sweep.fingerprint] for row in cells)
        else:
            _write_parquet(path, sweep, columns, cells)


def table_points(target: str) -> list[TablePoint]:
    """Return what a picture shows of the rows of a table, in the order of the points.

    Rows with the same active sides share one text: a million rows have a few dozen of them.
    """
    if PurePath(target).suffix.lower() == _CSV:
        with Path(target).open(encoding="utf-8", newline="") as file:
            return [TablePoint(float(row["F"] or "nan"), intern(row["active"])) for row in csv.DictReader(file)]
    import pyarrow.parquet as pq  # noqa: PLC0415 - only tables in this format need it

    found: list[TablePoint] = []
    with pq.ParquetFile(target) as file:
        for batch in file.iter_batches(_GROUP, columns=["F", "active"]):
            F, active = (column.to_pylist() for column in batch.columns)
            found += [
                TablePoint(float("nan") if value is None else value, intern(each))
                for value, each in zip(F, active, strict=True)
            ]
    return found


def column_names(sweep: Sweep) -> list[str]:
    """Return the columns of a sweep's table: the numbers that change, the answer, its evidence."""
    middle = ["status", "F", *sweep.variables, "active", "multipliers", "verdict", "stationarity", "feasibility"]
    last = ["curvature", "starts", "converged", "engine", "seconds", "note"]
    proof = [] if not sweep.certified else ["certificate", "bound", "gap"]
    return ["index", *sweep.points.names, *middle, *last, *proof]


def _cells(sweep: Sweep, row: Row) -> list[Any]:
    """Return the cells of a row; None for those that are empty."""
    x = [*row.x[: len(sweep.variables)], *[None] * (len(sweep.variables) - len(row.x))]
    sides = [_SEPARATOR.join(row.active), _SEPARATOR.join(map(repr, row.multipliers))]
    evidence = [row.verdict, row.stationarity, row.feasibility, row.curvature]
    run = [row.starts, row.converged, row.engine, row.seconds, row.note]
    proof = [] if not sweep.certified else [row.certificate, row.bound, row.gap]
    return [row.point, *sweep.points.values[row.point].tolist(), row.status, row.F, *x, *sides, *evidence, *run, *proof]


def table_rows(target: str, sweep: Sweep) -> list[Row]:
    """Return the rows of the whole table of a sweep, in the order of its points."""
    if PurePath(target).suffix.lower() == _CSV:
        with Path(target).open(encoding="utf-8", newline="") as file:
            # Columns by their place: a number that changes and a free number may have one name.
            return [_row(sweep, [cell or None for cell in cells]) for cells in islice(csv.reader(file), 1, None)]
    import pyarrow.parquet as pq  # noqa: PLC0415 - only tables in this format need it

    found: list[Row] = []
    with pq.ParquetFile(target) as file:
        for batch in file.iter_batches(_GROUP):
            columns = [column.to_pylist() for column in batch.columns]
            found += [_row(sweep, cells) for cells in zip(*columns, strict=True)]
    return found


def _row(sweep: Sweep, cells: Sequence[Any]) -> Row:
    """Return the row of cells that :func:`_cells` made, as they are read from a file; None for an empty one."""
    first = 1 + len(sweep.points.names)
    status, F, *rest = cells[first:]
    x, (active, multipliers, verdict, *evidence), run = (
        rest[: len(sweep.variables)],
        rest[len(sweep.variables) : len(sweep.variables) + 6],
        rest[len(sweep.variables) + 6 :],
    )
    starts, converged, engine, seconds, note = run[:5]
    certificate, bound, gap = run[5:8] if sweep.certified else (None, None, None)
    return Row(
        int(cells[0]),
        status,
        _number(F),
        x=() if None in x else tuple(map(float, x)),
        active=tuple((active or "").split(_SEPARATOR)) if active else (),
        multipliers=tuple(float(each) for each in multipliers.split(_SEPARATOR)) if multipliers else (),
        verdict=verdict or "",
        stationarity=_number(evidence[0]),
        feasibility=_number(evidence[1]),
        curvature=_number(evidence[2]),
        starts=int(starts),
        converged=int(converged),
        engine=engine or "",
        seconds=float(seconds),
        note=note or "",
        certificate=certificate or "",
        bound=_number(bound),
        gap=_number(gap),
    )


def _number(cell: Any) -> float | None:  # noqa: ANN401 - a text or a number
    return None if cell is None else float(cell)


def _write_parquet(path: Path, sweep: Sweep, columns: list[str], cells: Iterator[list[Any]]) -> None:
    """Write cells as a Parquet file, a group of rows at a time."""
    import pyarrow as pa  # noqa: PLC0415 - only tables in this format need it
    import pyarrow.parquet as pq  # noqa: PLC0415

    def kind(name: str) -> Any:  # noqa: ANN401 - pyarrow has no types
        return pa.string() if name in _TEXTS else pa.int64() if name in _WHOLE else pa.float64()

    schema = pa.schema([(name, kind(name)) for name in columns], metadata={_KEY: sweep.fingerprint})
    with pq.ParquetWriter(path, schema) as writer:
        while group := list(islice(cells, _GROUP)):
            by_column = zip(schema, zip(*group, strict=True), strict=True)
            arrays = [pa.array(column, type=field.type) for field, column in by_column]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def _fingerprint(path: Path) -> str | None:
    """Return the fingerprint in a table's file, or raise any error of a file that is something else."""
    if path.suffix.lower() == _CSV:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.reader(file)
            head, first = next(rows), next(rows)
            return first[head.index(_KEY)]
    import pyarrow.parquet as pq  # noqa: PLC0415 - only tables in this format need it

    found: bytes = (pq.read_schema(path).metadata or {})[_KEY.encode()]
    return found.decode()
