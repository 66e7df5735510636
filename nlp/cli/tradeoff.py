"""The command ``tradeoff``."""

from __future__ import annotations

import sys
from typing import Annotated, NamedTuple

import typer

from .options import (
    CLEAR_LINE,
    CaseName,
    CurveFile,
    Jobs,
    JsonFile,
    Seed,
    SettingTexts,
    Starts,
    Time,
    check_picture,
    console,
    read_settings,
    write_json,
)

#: Largest number of values.
_MOST = 200


def tradeoff(
    case: CaseName,
    over: Annotated[
        str,
        typer.Option(
            metavar="NAME=FIRST:LAST:COUNT", help="The number to vary, such as limits.leg_length.max=28:40:13."
        ),
    ],
    settings: SettingTexts = None,
    starts: Starts = None,
    seed: Seed = None,
    jobs: Jobs = None,
    _time: Time = None,
    json_file: JsonFile = None,
    csv_file: Annotated[str | None, typer.Option("--csv", metavar="FILE", help="Write the curve as CSV.")] = None,
    plot: CurveFile = None,
    page: Annotated[str | None, typer.Option("--page", metavar="FILE", help="Write the curve as an HTML page.")] = None,
) -> None:
    """Solve along one limit or number, and show F against it."""
    from ..case.reader import read_case
    from ..errors import InputError
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..output.files import check_outputs, write_bytes, write_text
    from ..results.tradeoff import tradeoff_result
    from ..results.tradeoffwording import tradeoff_csv, tradeoff_summary
    from ..solver.status import Status
    from ..solver.tradeoff import tradeoff as solve_along

    answer_after(Milestone.VALUE)
    name, values = _read_range(over)
    fixed = read_settings(settings)
    if [json_file, csv_file, page].count("-") > 1:
        raise InputError("standard output can take one of --json -, --csv - and --page - only")
    check_picture(plot)
    read = {value: read_case(case, {**fixed, name: value}) for value in values}
    check_outputs(read[values[0]].inputs, {"--json": json_file, "--csv": csv_file, "--page": page, "--plot": plot})
    show_progress = sys.stderr.isatty()
    found = solve_along(
        lambda value: read[value].case,
        values,
        name=name,
        starts=starts,
        seed=seed,
        jobs=jobs,
        progress=_write_progress if show_progress else None,
    )
    if show_progress:
        sys.stderr.write(CLEAR_LINE)
    if is_requested() and not found.unsolved:
        typer.echo(f"{why_stopped()}: every value is solved, but not all from the optima beside it", err=True)
    loaded, result = found.points[0].solution.case, tradeoff_result(found)
    if json_file is not None:
        write_json(json_file, result)
    if csv_file is not None:
        write_text(csv_file, tradeoff_csv(result))
    if page is not None:
        from ..output.report.curves import tradeoff_page

        write_text(page, tradeoff_page(loaded, result))
    if plot is not None:
        from ..output.pictures.curves import tradeoff_picture
        from ..output.pictures.requirements import ending_of

        write_bytes(plot, tradeoff_picture(loaded, result, ending_of(plot)))
    if "-" not in (json_file, csv_file, page):
        from ..output.terminal import show

        show(console(), tradeoff_summary(loaded, result))
    statuses = [point.status for point in result.points]
    is_done = all(status.is_answer or status is Status.INFEASIBLE for status in statuses)
    raise typer.Exit(0 if is_done and any(status.is_answer for status in statuses) else 1)


class _Range(NamedTuple):
    """Name of a number, and its values."""

    name: str
    values: list[float]


def _read_range(text: str) -> _Range:
    """Read ``NAME=FIRST:LAST:COUNT``.

    Raises:
        InputError: it is something else, the ends are equal or not finite, or there are too few or too many values.
    """
    import math

    from ..errors import InputError

    name, _, ends = (part.strip() for part in text.partition("="))
    parts = ends.split(":")
    try:
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
    except (ValueError, IndexError):
        count = 0
    if not (name and len(parts) == 3 and count):
        raise InputError(f"--over {text}: must be NAME=FIRST:LAST:COUNT, such as limits.leg_length.max=28:40:13")
    if not (math.isfinite(first) and math.isfinite(last) and first != last):
        raise InputError(f"--over {text}: FIRST and LAST must be finite and differ")
    if not 2 <= count <= _MOST:
        raise InputError(f"--over {text}: COUNT must be between 2 and {_MOST}")
    # Exact at both ends.
    values = [(first * (count - 1 - k) + last * k) / (count - 1) for k in range(count)]
    return _Range(name, [first, *values[1:-1], last])


def _write_progress(done: int, total: int) -> None:
    """Write how far the solves are, on one line of standard error."""
    sys.stderr.write(f"\r{done} of {total} values solved")
    sys.stderr.flush()
