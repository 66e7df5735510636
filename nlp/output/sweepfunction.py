"""A sweep as a function of Python, with its table as a file where one is asked for."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...models import FloatArray
from ..case.case import Case
from ..errors import InputError, check_seconds
from ..interruption import one_call, within
from ..sweeps.columns import SweepColumns, columns_of
from ..sweeps.engines import EngineKind
from ..sweeps.points import CaseSource, Points, grid_of
from ..sweeps.sweep import Sweep, SweepProgress, run_sweep
from .sweeptable import check_table, is_written, table_rows, write_table


@one_call
def sweep(
    case: Case,
    over: Mapping[str, Iterable[float]] | None = None,
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
    """Solve a case at many values of its fixed numbers, and return the answers as columns.

    Args:
        case: the case, which a case file must be able to state.
        over: values of each number by name, as ``--set`` names it; several numbers make a grid, whose last number
            changes fastest.
        points: the points instead: values of each number by name, all of one length.
        out: file of the table, ``.parquet`` or ``.csv``; an interrupted run is taken up from the journal beside it, and
            a table that is whole already is read. None for no file.
        starts: number of starting points at each point, 8 if left out.
        seed: seed instead of the case's.
        jobs: threads of the compiled engine, or processes of Ipopt.
        engine: ``"compiled"`` or ``"ipopt"``; left out, the compiled one where it covers the sweep.
        certified: whether the optimum at each point is proved too, which Ipopt's engine alone does.
        time_limit: seconds for the whole call; where they are over before all points are done, there is no table. The
            proof of a point takes an equal part of the time left, and 60 s at most; it then has the bound reached.
        dask: address of a Dask cluster that does the work.
        progress: called after each block of points.
        notice: called with the reason where Ipopt does the work of the compiled engine.

    Raises:
        CaseError: the case has no number of a name, does not allow its smallest or largest value, or cannot be written.
        InputError: there are no points, an option is not allowed, the file cannot be written or is something else, or
            the time is over before all points are done.
    """
    if engine is not None and engine not in {kind.value for kind in EngineKind}:
        raise InputError(f"--engine {engine}: must be compiled or ipopt")
    check_seconds(time_limit)
    source = CaseSource(case.to_toml(), case.name, case.source or case.name)
    chosen = _points(over, points)
    found = Sweep.of(source, chosen, starts, seed, certified=certified)
    kind = None if engine is None else EngineKind(engine)

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


def _points(over: Mapping[str, Iterable[float]] | None, points: Mapping[str, Sequence[float]] | None) -> Points:
    """Return the points that the arguments state.

    Raises:
        InputError: there are none, both arguments are given, a value is not finite or given twice in a grid, or columns
            have different lengths.
    """
    if (not over) == (not points):
        raise InputError("a sweep needs points: either over or points, a mapping from names to values")
    given = over or points or {}
    axes = [_values(name, values) for name, values in given.items()]
    if over:
        for name, values in zip(given, axes, strict=True):
            if len(np.unique(values)) < len(values):
                raise InputError(f"over {name}: has a value twice; each point must be another one")
        return grid_of(tuple(given), axes)
    lengths = {len(values) for values in axes}
    if len(lengths) > 1:
        counts = ", ".join(f"{name} {len(values)}" for name, values in zip(given, axes, strict=True))
        raise InputError(f"points: every number needs the same count of values, and the counts are {counts}")
    return Points(tuple(given), np.stack(axes, axis=1))


def _values(name: str, values: Iterable[float]) -> FloatArray:
    """Return the values of a number as an array (k,).

    Raises:
        InputError: there are none, or one is no finite number.
    """
    found = list(values)
    for value in found:
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
            raise InputError(f"{name} = {value}: must be a finite number")
    if not found:
        raise InputError(f"{name}: has no values")
    return np.array(found, dtype=np.float64)
