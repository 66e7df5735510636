"""The command ``tradeoff``."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import typer

from .options import (
    CaseName,
    CurveFile,
    Jobs,
    JsonFile,
    Outputs,
    Seed,
    SettingTexts,
    Starts,
    Time,
    console,
    read_settings,
    write_json,
)
from .progress import counting_line

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
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..output.files import write_text
    from ..results.tradeoff import tradeoff_csv, tradeoff_result, tradeoff_summary
    from ..solver.status import Status
    from ..solver.tradeoff import tradeoff as solve_along

    answer_after(Milestone.VALUE)
    name, values = _read_range(over)
    fixed = read_settings(settings)
    files = Outputs(json=json_file, csv=csv_file, page=page, plot=plot)
    read = {value: read_case(case, {**fixed, name: value}) for value in values}
    files.check(read[values[0]].inputs)
    with counting_line() as write:
        found = solve_along(
            lambda value: read[value].case,
            values,
            name=name,
            starts=starts,
            seed=seed,
            jobs=jobs,
            progress=lambda done, total: write(f"{done} of {total} values solved"),
        )
    if is_requested() and not found.unsolved:
        typer.echo(f"{why_stopped()}: every value is solved, but not all from the optima beside it", err=True)
    loaded, result = found.points[0].solution.case, tradeoff_result(found)
    write_json(json_file, result)
    if csv_file is not None:
        write_text(csv_file, tradeoff_csv(result))
    if page is not None:
        from ..output.report.curves import tradeoff_page

        write_text(page, tradeoff_page(loaded, result))
    if plot is not None:
        from ..output.pictures.curves import tradeoff_figure

        files.draw("plot", tradeoff_figure, loaded, result)
    if not files.is_piped:
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
