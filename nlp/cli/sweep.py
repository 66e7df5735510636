"""The command ``sweep``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, NoReturn

from . import contents, options
from .commandline import print_notice
from .progress import counting_line

if TYPE_CHECKING:
    from ..sweeps.points import Points
    from ..sweeps.sweep import Sweep


def sweep(
    case: options.CaseName,
    out: Annotated[str, options.file("--out", "The table: a .parquet or .csv file; a stopped run is resumed")],
    over: Annotated[
        list[str],
        options.several(
            "--over",
            "NAME=FIRST:LAST:COUNT",
            "A number to vary, or NAME=V1,V2,..., or one CSV file of points, names in its first row",
        ),
    ],
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: Annotated[int | None, options.starts("Starting points at each point; 8 if left out")] = None,
    seed: options.Seed = None,
    jobs: Annotated[int | None, options.jobs("Threads, or processes of Ipopt; all cores if left out")] = None,
    engine: Annotated[
        str | None, options.text("--engine", "WORD", "compiled or ipopt; chosen by the case if left out")
    ] = None,
    dask: Annotated[
        str | None, options.text("--dask", "ADDRESS", "Run on a Dask cluster, such as tcp://10.0.0.1:8786")
    ] = None,
    certified: options.Certify = False,
    _time: Annotated[float | None, options.time("no limit if left out", "goes on when it is called again")] = None,
    json_file: options.JsonFile = None,
    html: options.PageFile = None,
    plot: Annotated[str | None, options.plot("Draw F over one or two numbers")] = None,
) -> None:
    """Solve at thousands of values of fixed numbers."""
    from ..interruption import say_on_leaving
    from ..output.files import read_text
    from ..output.sweeptable import check_table, is_written, write_table
    from ..sweeps.engines import EngineKind
    from ..sweeps.points import CaseSource, grid, points_of_csv
    from ..sweeps.sweep import Sweep, run_sweep

    kind = EngineKind.of(engine)
    points = _points_file(over)
    chosen = grid(over) if points is None else points_of_csv(read_text(points), points)
    files = options.Outputs(out=out, json=json_file, html=html, plot=plot)
    if plot is not None:
        from ..output.pictures.sweeps import check_axes

        check_axes(chosen)
    check_table(out)
    read = options.read_machine(case, settings, of).file
    inputs = dict(read.inputs)
    if points is not None:
        from pathlib import Path

        inputs[Path(points)] = "the file of the points"
    files.check(inputs)
    with _named_points(chosen, points):
        found = Sweep.of(CaseSource.from_file(read), chosen, starts, seed, certified=certified)
    if is_written(out, found):
        print_notice(f"{out}: holds all {len(chosen):,} points already")
    else:
        with found.journal_of(out) as journal:
            before = len(chosen) - len(journal.missing)
            if before:
                print_notice(f"{before:,} of {len(chosen):,} points are in {journal.path} already")
            say_on_leaving(lambda: journal.words)
            with counting_line() as show:
                run_sweep(
                    found,
                    journal,
                    engine=kind,
                    jobs=jobs,
                    dask=dask,
                    progress=lambda *counts: show(_progress_words(*counts)),
                    notice=print_notice,
                )
            if len(journal.missing):
                print_notice(f"the time is over: {journal.words}")
                raise SystemExit(1)
            write_table(out, found, journal.rows())
            journal.remove()
    _deliver(found, out, files)


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


def _points_file(over: list[str]) -> str | None:
    """Return the file of points that ``--over`` names; None where it states a grid.

    Raises:
        InputError: a range, a list or a file stands beside it.
    """
    from pathlib import Path

    from ..errors import InputError

    file = next((text for text in over if text.endswith(".csv") or Path(text).is_file()), None)
    if file is not None and len(over) > 1:
        raise InputError(f"--over {file}: a file of points stands alone, without ranges or lists beside it")
    return file


def _deliver(found: Sweep, out: str, files: options.Outputs) -> NoReturn:
    """Write a sweep as JSON, as a page and as a picture, print a line about its table, and exit."""
    import math
    from functools import cache

    from ..output.sweeptable import table_points, table_rows
    from ..results.text import Line
    from ..sweeps.columns import columns_of, stated_pose_note, sweep_result

    case = found.source.case_at(found.points.settings(0))
    rows = cache(lambda: table_rows(out, found))
    columns = cache(lambda: columns_of(found, rows()))
    points = table_points(out)
    answered = [row for row in points if not math.isnan(row.F)]

    def shown() -> Iterator[Line]:
        values = [row.F for row in answered]
        regions = len({row.active for row in answered})
        ends = f", F from {min(values):.7g} to {max(values):.7g}, {regions} sets of active limits" if values else ""
        if found.certified:
            ends += f", {sum(row.certificate == 'proved' for row in rows()):,} are proved"
        yield Line(f"{len(values):,} of {len(found.points):,} points have an answer{ends}: {out}")
        notice = stated_pose_note(case, [row.note for row in rows()]) if case.limits_over else None
        if notice is not None:
            yield Line(f"note: {notice}")

    files.deliver(
        shown,
        whole=True,
        done=bool(answered),
        json=lambda: sweep_result(case, columns()),
        html=lambda: contents.sweep_page(case, found.points, columns()),
        plot=lambda: contents.sweep_figure(case, found.points, points),
    )


def _progress_words(before: int, done: int, total: int, seconds: float) -> str:
    """Return how far the sweep is, and the time left."""
    left = seconds * (total - done) / done
    words = f"{left / 3600:.1f} h" if left >= 3600 else f"{left / 60:.0f} min" if left >= 100 else f"{left:.0f} s"
    return f"{before + done:,} of {before + total:,} points, {words} left"
