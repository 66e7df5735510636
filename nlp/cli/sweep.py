"""The command ``sweep``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from .options import (
    CaseName,
    JsonFile,
    Outputs,
    PageFile,
    Seed,
    SettingTexts,
    jobs_option,
    read_settings,
    starts_option,
    time_option,
    write_json,
)
from .progress import counting_line

if TYPE_CHECKING:
    from ..sweeps.points import Points
    from ..sweeps.sweep import Sweep


def sweep(
    case: CaseName,
    out: Annotated[
        str, typer.Option("--out", metavar="FILE", help="The table: a .parquet or .csv file; a stopped run is resumed.")
    ],
    over: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=FIRST:LAST:COUNT", help="A number to vary, or NAME=V1,V2,...; several make a grid."),
    ] = None,
    points: Annotated[
        str | None,
        typer.Option("--points", metavar="FILE", help="A CSV file of points instead, names in its first row."),
    ] = None,
    settings: SettingTexts = None,
    starts: Annotated[int | None, starts_option("Starting points at each point; 8 if left out.")] = None,
    seed: Seed = None,
    jobs: Annotated[int | None, jobs_option("Threads, or processes of Ipopt.")] = None,
    engine: Annotated[
        str | None,
        typer.Option("--engine", metavar="WORD", help="compiled or ipopt; chosen by the case if left out."),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option("--dask", metavar="ADDRESS", help="Run on a Dask cluster, such as tcp://10.0.0.1:8786."),
    ] = None,
    certified: Annotated[bool, typer.Option("--certify", help="Prove the optimum at each point too.")] = False,
    _time: Annotated[float | None, time_option("Seconds for the whole command; the same command resumes it.")] = None,
    json_file: JsonFile = None,
    html: PageFile = None,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="FILE", help="Draw F over one or two numbers: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Solve at thousands of values of fixed numbers."""
    from ..case.reader import read_case
    from ..interruption import say_on_leaving
    from ..output.sweeptable import check_table, is_written, write_table
    from ..sweeps.engines import EngineKind
    from ..sweeps.points import CaseSource
    from ..sweeps.sweep import Sweep, run_sweep

    kind = EngineKind.of(engine)
    chosen = _read_points(over, points)
    files = Outputs(out=out, json=json_file, html=html, plot=plot)
    if plot is not None:
        from ..output.pictures.sweeps import check_axes

        check_axes(chosen)
    check_table(out)
    read = read_case(case, read_settings(settings))
    inputs = dict(read.inputs)
    if points is not None:
        from pathlib import Path

        inputs[Path(points)] = "the file of the points"
    files.check(inputs)
    with _named_points(chosen, points):
        found = Sweep.of(CaseSource.from_file(read), chosen, starts, seed, certified=certified)
    if is_written(out, found):
        typer.echo(f"{out}: holds all {len(chosen):,} points already", err=True)
    else:
        with found.journal_of(out) as journal:
            before = len(chosen) - len(journal.missing)
            if before:
                typer.echo(f"{before:,} of {len(chosen):,} points are in {journal.path} already", err=True)
            say_on_leaving(lambda: journal.words)
            with counting_line() as show:
                run_sweep(
                    found,
                    journal,
                    engine=kind,
                    jobs=jobs,
                    dask=dask,
                    progress=lambda *counts: show(_progress_words(*counts)),
                    notice=lambda text: typer.echo(text, err=True),
                )
            if len(journal.missing):
                typer.echo(f"the time is over: {journal.words}", err=True)
                raise typer.Exit(1)
            write_table(out, found, journal.rows())
            journal.remove()
    if json_file is not None or html is not None:
        _write(found, out, json_file, html)
    raise typer.Exit(_show(found, out, files))


def _write(found: Sweep, out: str, json_file: str | None, html: str | None) -> None:
    """Write a sweep as JSON and as a page."""
    from ..output.files import write_text
    from ..output.sweeptable import table_rows
    from ..sweeps.columns import columns_of, sweep_result

    case, columns = found.source.case_at(found.points.settings(0)), columns_of(found, table_rows(out, found))
    write_json(json_file, sweep_result(case, columns))
    if html is not None:
        from ..output.report.sweep import sweep_page

        write_text(html, sweep_page(case, found.points, columns))


@contextmanager
def _named_points(chosen: Points, file: str | None) -> Iterator[None]:
    """Report a wrong column of the file of the points with the name of this file.

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


def _read_points(over: list[str] | None, file: str | None) -> Points:
    """Return the points that the options state.

    Raises:
        InputError: there are none, or both options are given.
    """
    from ..errors import InputError
    from ..output.files import read_text
    from ..sweeps.points import grid, points_of_csv

    if bool(over) == (file is not None):
        raise InputError("a sweep needs points: either --over NAME=FIRST:LAST:COUNT, once or more, or --points FILE")
    return points_of_csv(read_text(file), file) if file is not None else grid(over or [])


def _show(found: Sweep, out: str, files: Outputs) -> int:
    """Draw the picture, print a line about the table, and return the exit status."""
    import math

    from ..output.sweeptable import table_points

    rows = table_points(out)
    if files["plot"] is not None:
        from ..output.pictures.sweeps import sweep_figure

        files.draw("plot", sweep_figure, found.source.case_at(found.points.settings(0)), found.points, rows)
    values = [row.F for row in rows if not math.isnan(row.F)]
    regions = len({row.active for row in rows if not math.isnan(row.F)})
    ends = f", F from {min(values):.7g} to {max(values):.7g}, {regions} sets of active limits" if values else ""
    if found.certified:
        from ..output.sweeptable import table_rows

        proved = sum(row.certificate == "proved" for row in table_rows(out, found))
        ends += f", {proved:,} are proved"
    if not files.is_piped:
        typer.echo(f"{len(values):,} of {len(rows):,} points have an answer{ends}: {out}")
        notice = _notice(found, out)
        if notice is not None:
            typer.echo(f"note: {notice}")
    return 0 if values else 1


def _notice(found: Sweep, out: str) -> str | None:
    """Return the notice that limits elsewhere are taken at the stated pose alone; None where they are not."""
    from ..output.sweeptable import table_rows
    from ..sweeps.columns import stated_pose_note

    case = found.source.case_at(found.points.settings(0))
    if not case.limits_over:
        return None
    return stated_pose_note(case, [row.note for row in table_rows(out, found)])


def _progress_words(before: int, done: int, total: int, seconds: float) -> str:
    """Return how far the sweep is, and the time left."""
    left = seconds * (total - done) / done
    words = f"{left / 3600:.1f} h" if left >= 3600 else f"{left / 60:.0f} min" if left >= 100 else f"{left:.0f} s"
    return f"{before + done:,} of {before + total:,} points, {words} left"
