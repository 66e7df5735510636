"""Table of a sweep as a Parquet or CSV file, and the public function ``sweep``."""

from __future__ import annotations

import csv
import math
import tempfile
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from importlib.util import find_spec
from itertools import islice
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from ..case.case import Case
from ..case.varied import Over, axes_of
from ..errors import InputError, check_seconds
from ..interruption import one_call, within
from ..sweeps.columns import SweepColumns, columns_of, row_reader, sweep_columns
from ..sweeps.engines import EngineKind
from ..sweeps.journal import Row
from ..sweeps.points import CaseSource, Points, grid_of
from ..sweeps.sweep import Sweep, SweepProgress, run_sweep
from ..system.csvtext import csv_row, text_of_cell
from ..words.designs import Column
from .files import check_target, write_whole

#: Extensions of table files.
_PARQUET, _CSV = ".parquet", ".csv"
#: Number of rows in memory at once.
_GROUP = 20_000
#: Key of the sweep's fingerprint in a Parquet file, and name of its column in a CSV file.
_KEY = "screwsynth_sweep"


def check_table(target: str) -> None:
    """Refuse a table that cannot be written, before the work begins.

    Raises:
        InputError: the extension is unknown, pyarrow is not installed, or the file cannot be written.
    """
    ending = PurePath(target).suffix.lower()
    if ending not in (_PARQUET, _CSV):
        raise InputError(f"--out {target}: must end in {_PARQUET} or {_CSV}")
    if ending == _PARQUET and find_spec("pyarrow") is None:
        fault = "needs pyarrow, which is not installed: pip install 'screwsynth[sweep]', or write a .csv file"
        raise InputError(f"--out {target}: {fault}")
    check_target(target)


def is_written(target: str, sweep: Sweep) -> bool:
    """Return whether a file is the complete table of a sweep; false if the file is missing.

    Raises:
        InputError: the file exists and is not the table of this sweep.
    """
    path = Path(target)
    if not path.exists():
        return False
    found = None
    # A file that cannot be read is not the table of a sweep.
    with suppress(OSError, ValueError, IndexError, KeyError, TypeError, StopIteration):
        found = _fingerprint(path)
    if found != sweep.fingerprint:
        raise InputError(
            f"--out {target}: exists and is not the table of this sweep; choose another name, or remove it"
        )
    return True


def write_table(target: str, sweep: Sweep, rows: Iterable[Row]) -> None:
    """Write all rows of a sweep to a temporary file, which is renamed when complete.

    Args:
        target: path of the file, with the extension ``.parquet`` or ``.csv``.
        sweep: sweep of the rows.
        rows: rows of all points, in their order.

    Raises:
        InputError: the file cannot be written.
    """
    columns = list(sweep_columns(sweep))
    cells = ([column.cell(row) for column in columns] for row in rows)
    with write_whole(target) as path:
        if PurePath(target).suffix.lower() == _CSV:
            with path.open("w", encoding="utf-8", newline="") as file:
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(csv_row([*(column.name for column in columns), _KEY]))
                writer.writerows(csv_row([*row, sweep.fingerprint]) for row in cells)
        else:
            _write_parquet(path, sweep, columns, cells)


#: Fields of a row for the picture and the summary of a sweep.
_SHOWN = ("status", "F", "active", "note", "certificate")


class _ShownRows(Sequence[Row]):
    """Rows without design and evidence, a few bytes per row: a picture may have millions of rows."""

    def __init__(self, rows: Iterable[Row]) -> None:
        self._F, self._others = array("d"), list[Row]()
        shared: dict[Row, Row] = {}
        for row in rows:
            self._F.append(math.nan if row.F is None else row.F)
            other = row._replace(F=None)
            self._others.append(shared.setdefault(other, other))

    def __len__(self) -> int:
        return len(self._F)

    def __getitem__(self, k: int) -> Row:  # type: ignore[override]  # no slices
        F = self._F[k]
        return self._others[k]._replace(point=k, F=None if math.isnan(F) else F)


def table_rows(target: str, sweep: Sweep, *, shown: bool = False) -> Sequence[Row]:
    """Return the rows of the complete table of a sweep, in the order of its points.

    Args:
        target: path of the table.
        sweep: sweep of the table.
        shown: If true, read only the fields for the picture and the summary, without design and evidence.
    """
    read = row_reader(sweep, _SHOWN if shown else None)
    rows = map(read, _cells(target))
    return _ShownRows(rows) if shown else list(rows)


def _cells(target: str) -> Iterator[Sequence[Any]]:
    """Yield the cells of each row of a table, in the order of the columns; None for an empty cell."""
    if PurePath(target).suffix.lower() == _CSV:
        with Path(target).open(encoding="utf-8", newline="") as file:
            # A varied value and a design variable may have the same name.
            for cells in islice(csv.reader(file), 1, None):
                yield [text_of_cell(cell) or None for cell in cells]
        return
    import pyarrow.parquet as pq  # noqa: PLC0415 - only tables in this format need it

    with pq.ParquetFile(target) as file:
        for batch in file.iter_batches(_GROUP):
            yield from zip(*(column.to_pylist() for column in batch.columns), strict=True)


def _write_parquet(path: Path, sweep: Sweep, columns: Sequence[Column[Row]], cells: Iterator[list[Any]]) -> None:
    """Write cells as a Parquet file in groups of rows."""
    import pyarrow as pa  # noqa: PLC0415 - only tables in this format need it
    import pyarrow.parquet as pq  # noqa: PLC0415

    kinds = {str: pa.string(), int: pa.int64(), float: pa.float64()}
    fields = [(column.name, kinds[column.holds]) for column in columns]
    schema = pa.schema(fields, metadata={_KEY: sweep.fingerprint})
    with pq.ParquetWriter(path, schema) as writer:
        while group := list(islice(cells, _GROUP)):
            by_column = zip(schema, zip(*group, strict=True), strict=True)
            arrays = [pa.array(column, type=field.type) for field, column in by_column]
            writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def _fingerprint(path: Path) -> str | None:
    """Return the fingerprint in a table; a file of another kind may raise any error."""
    if path.suffix.lower() == _CSV:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.reader(file)
            head, first = next(rows), next(rows)
            return first[head.index(_KEY)]
    import pyarrow.parquet as pq  # noqa: PLC0415 - only tables in this format need it

    found: bytes = (pq.read_schema(path).metadata or {})[_KEY.encode()]
    return found.decode()


@one_call
def sweep(
    case: Case,
    over: Over | None = None,
    *,
    points: Mapping[str, Sequence[float]] | None = None,
    out: str | Path | None = None,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    engine: str | None = None,
    certified: bool = False,
    time_limit: float | None = None,
    dask: str | None = None,
    progress: SweepProgress | None = None,
    notice: Callable[[str], None] | None = None,
) -> SweepColumns:
    """Solve a case at many values of its fixed parameters, bounds or limits, and return the results as columns.

    Args:
        case: case to solve; a case file must be able to represent it.
        over: values of each varied parameter, bound or limit by name, as for ``--set``; several names make a grid,
            whose last name varies fastest.
        points: list of points instead of a grid: values by name, all of the same length.
        out: path of the table, ``.parquet`` or ``.csv``, or None for no file. An interrupted run continues from the
            journal beside the table; a complete table is read instead of solving again.
        starts: number of starts per point, 8 by default.
        seed: seed that replaces the seed of the case.
        jobs: number of threads of the compiled engine, or of processes of Ipopt.
        engine: ``"compiled"`` or ``"ipopt"``; by default the compiled engine if it covers the sweep.
        certified: If true, also compute a certificate for each point, which needs the engine ``"ipopt"``.
        time_limit: seconds for the whole call; if they end before all points are solved, there is no table. The
            certificate of a point takes an equal part of the remaining time, at most 60 s, and has the best bound that
            it reaches in this time.
        dask: address of a Dask cluster for the computation.
        progress: function called after each block of points.
        notice: function called with the reason if Ipopt replaces the compiled engine.

    Raises:
        CaseError: a name is unknown in the case, the smallest or largest value of a name is not allowed, or no case
            file can represent the case.
        InputError: there are no points, an option is not allowed, the file cannot be written or has another origin, or
            the time ends before all points are solved.
    """
    kind = EngineKind.of(engine)
    check_seconds(time_limit)
    source = CaseSource(case.to_toml(), case.name, case.source or case.name)
    chosen = _points(over, points)
    found = Sweep.of(source, chosen, starts, seed, certified=certified)

    def run(target: str) -> None:
        with found.journal_of(target) as journal:
            with within(time_limit):
                run_sweep(found, journal, engine=kind, jobs=jobs, dask=dask, progress=progress, notice=notice)
            if len(journal.missing):
                raise InputError(f"time_limit {time_limit}: is over; {journal.words}")
            write_table(target, found, journal.rows())
            journal.remove()

    if out is not None:
        check_table(str(out))
        if not is_written(str(out), found):
            run(str(out))
        return columns_of(found, table_rows(str(out), found))
    with tempfile.TemporaryDirectory(prefix="screwsynth.") as folder:
        target = str(Path(folder) / "sweep.csv")
        run(target)
        return columns_of(found, table_rows(target, found))


def _points(over: Over | None, points: Mapping[str, Sequence[float]] | None) -> Points:
    """Return the points of the arguments ``over`` and ``points``.

    Raises:
        InputError: there are no points, both arguments are given, a value is not finite or occurs twice in a grid, or
            the columns have different lengths.
    """
    if (not over) == (not points):
        raise InputError("a sweep needs exactly one of over and points: a mapping from names to values")
    axes = axes_of(over) if over else axes_of(points or {}, "points", repeated=True)
    if over:
        return grid_of(tuple(axes), list(axes.values()))
    lengths = {len(values) for values in axes.values()}
    if len(lengths) > 1:
        counts = ", ".join(f"{name} {len(values)}" for name, values in axes.items())
        raise InputError(f"points: all names need the same number of values, got {counts}")
    return Points(tuple(axes), np.stack(list(axes.values()), axis=1))
