"""Command ``sweep``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, NoReturn

from . import designs, options
from .commandline import print_notice
from .progress import counting_line

if TYPE_CHECKING:
    from pathlib import Path

    from ..sweeps.engines import EngineKind
    from ..sweeps.points import Points
    from ..sweeps.sweep import Sweep
    from ..words.text import Line


def sweep(
    case: options.CaseName,
    over: Annotated[
        list[str],
        options.several(
            "--over",
            "NAME=FIRST:LAST:COUNT",
            "Parameter to vary, or NAME=V1,V2,..., or one CSV file of points with names in its first row",
        ),
    ],
    out: Annotated[
        str | None, options.file("--out", "Table to write, a .parquet or .csv file; a stopped run is resumed")
    ] = None,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: Annotated[int | None, options.starts("Starts of the solve at each point; 8 if left out")] = None,
    seed: options.Seed = None,
    jobs: Annotated[int | None, options.jobs("Threads, or processes with Ipopt; all cores if left out")] = None,
    engine: Annotated[
        str | None, options.text("--engine", "WORD", "Solver, compiled or ipopt; chosen for the case if left out")
    ] = None,
    dask: Annotated[
        str | None, options.text("--dask", "ADDRESS", "Run on a Dask cluster, such as tcp://10.0.0.1:8786")
    ] = None,
    certified: options.Certify = False,
    _time: Annotated[float | None, options.time("no limit if left out", "continues when it is called again")] = None,
    resume: options.ResumeFile = None,
    json_file: options.JsonFile = None,
    csv_file: Annotated[str | None, options.table("the table")] = None,
    markdown: options.MarkdownFile = None,
    html: options.PageFile = None,
    plot: Annotated[str | None, options.plot("Draw F over one or two parameters")] = None,
) -> None:
    """Solve for thousands of values of fixed parameters."""
    from ..output.files import read_text
    from ..output.sweeptable import check_table
    from ..sweeps.columns import check_drawn
    from ..sweeps.engines import EngineKind
    from ..sweeps.points import CaseSource, grid, points_of_csv
    from ..sweeps.sweep import Sweep

    kind = EngineKind.of(engine)
    points = _points_file(over)
    chosen = grid(over) if points is None else points_of_csv(read_text(points), points)
    files = options.Outputs(
        out=out, resume=resume, json=json_file, csv=csv_file, markdown=markdown, html=html, plot=plot
    )
    if plot is not None:
        check_drawn(chosen)
    if out is not None:
        check_table(out)
    read = options.read_changed_case(case, settings, of).file
    inputs = dict(read.inputs)
    if points is not None:
        from pathlib import Path

        inputs[Path(points)] = "the file of the points"
    files.check(inputs)
    with _named_points(chosen, points):
        found = Sweep.of(CaseSource.from_file(read), chosen, starts, seed, certified=certified)
    with _table_file(out) as table:
        _run(found, table, resume, is_kept=out is not None, engine=kind, jobs=jobs, dask=dask)
        _deliver(found, table, out, files)


@contextmanager
def _table_file(out: str | None) -> Iterator[Path]:
    """Give the file of the table; without a name for it, a temporary file."""
    from pathlib import Path
    from tempfile import TemporaryDirectory

    if out is not None:
        yield Path(out)
        return
    with TemporaryDirectory(prefix="screwsynth.") as folder:
        yield Path(folder) / "sweep.csv"


def _run(
    found: Sweep,
    table: Path,
    resume: str | None,
    *,
    is_kept: bool,
    engine: EngineKind | None,
    jobs: int | None,
    dask: str | None,
) -> None:
    """Solve the points that are missing in the table and the journal, and write the table.

    Args:
        found: the sweep.
        table: file of the table.
        resume: file of the journal; None for a file next to the table.
        is_kept: If true, the table and its journal are kept after the command.
        engine: solver, as for :func:`.run_sweep`.
        jobs: number of threads or processes, as for :func:`.run_sweep`.
        dask: address of a cluster, as for :func:`.run_sweep`.

    Raises:
        InputError: a file belongs to another sweep, or cannot be written.
        SystemExit: the time is over before all points are solved.
    """
    from ..interruption import say_on_leaving
    from ..output.sweeptable import is_written, write_table
    from ..sweeps.sweep import run_sweep

    if is_written(str(table), found):
        print_notice(f"{table}: already has all {len(found.points):,} points")
        return
    with found.journal_of(str(table), resume) as journal:
        before = len(found.points) - len(journal.missing)
        if before:
            print_notice(f"{journal.path}: already has {before:,} of {len(found.points):,} points")

        def words() -> str:
            return journal.words if is_kept or resume else "no point is kept without --out or --resume"

        say_on_leaving(words)
        with counting_line() as show:
            run_sweep(
                found,
                journal,
                engine=engine,
                jobs=jobs,
                dask=dask,
                progress=lambda *counts: show(_progress_words(*counts)),
                notice=print_notice,
            )
        if len(journal.missing):
            print_notice(f"the time is over: {words()}")
            raise SystemExit(1)
        write_table(str(table), found, journal.rows())
        journal.remove()


@contextmanager
def _named_points(chosen: Points, file: str | None) -> Iterator[None]:
    """Add the name of the file of points to the message about a wrong column.

    Raises:
        InputError: a column is wrong.
    """
    from ..errors import CaseError, InputError

    try:
        yield
    except CaseError as error:
        if file is None or error.key not in chosen.names:
            raise
        raise InputError(f"{file}: column {error.key}: {error.fault}") from None


def _points_file(over: list[str]) -> str | None:
    """Return the file of points that ``--over`` names; None for a grid.

    Raises:
        InputError: a range, a list or another file is given as well.
    """
    from pathlib import Path

    from ..errors import InputError

    file = next((text for text in over if text.endswith(".csv") or Path(text).is_file()), None)
    if file is not None and len(over) > 1:
        raise InputError(f"--over {file}: a file of points cannot be combined with ranges or lists")
    return file


def _deliver(found: Sweep, table: Path, out: str | None, files: options.Outputs) -> NoReturn:
    """Write the outputs of a sweep, print a line about its table, and exit."""
    from ..output.sweeptable import table_rows
    from ..sweeps.columns import columns_of, sweep_designs, sweep_result

    rows = table_rows(str(table), found, shown=not any(files[name] for name in ("json", "csv", "markdown", "html")))
    table_of_designs = sweep_designs(found, rows)

    def shown() -> Iterator[Line]:
        line, *others = table_of_designs.before
        yield line if out is None else replace(line, text=f"{line.text}: {out}")
        yield from others
        yield from table_of_designs.after

    designs.deliver(
        files,
        table_of_designs,
        lambda: sweep_result(table_of_designs.case, columns_of(found, rows)),
        whole=True,
        done=any(row.F is not None for row in rows),
        shown=shown,
    )


def _progress_words(before: int, done: int, total: int, seconds: float) -> str:
    """Return the progress of the sweep, and the remaining time."""
    left = seconds * (total - done) / done
    words = f"{left / 3600:.1f} h" if left >= 3600 else f"{left / 60:.0f} min" if left >= 100 else f"{left:.0f} s"
    return f"{before + done:,} of {before + total:,} points, {words} left"
