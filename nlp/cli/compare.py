"""The command ``compare``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from .numbers import Number
from .options import (
    CLEAR_LINE,
    CaseName,
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

if TYPE_CHECKING:
    from ..comparison.compare import Comparison


def compare(
    case: CaseName,
    robots: Annotated[
        list[str],
        typer.Argument(metavar="ROBOT...", help="Names of robots, robot files, or 'case' for the case's own robot."),
    ],
    size: Annotated[
        float | None,
        typer.Option(parser=Number("--size"), metavar="LENGTH", help="Common size; that of the case's robot."),
    ] = None,
    no_scale: Annotated[bool, typer.Option("--no-scale", help="Take typical lengths as they are.")] = False,
    part: Annotated[
        float,
        typer.Option(
            "--range", parser=Number("--range"), metavar="PART", help="Part by which dimensions are free; 0: fixed."
        ),
    ] = 0.25,
    certified: Annotated[bool, typer.Option("--certify", help="Prove each optimum too.")] = False,
    time: Time = None,
    settings: SettingTexts = None,
    starts: Starts = None,
    seed: Seed = None,
    jobs: Jobs = None,
    json_file: JsonFile = None,
    csv_file: Annotated[str | None, typer.Option("--csv", metavar="FILE", help="Write a row for each robot.")] = None,
    html: Annotated[str | None, typer.Option("--html", metavar="FILE", help="Write a page of HTML.")] = None,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="FILE", help="Draw the designs in one scale: .png, .svg or .pdf.")
    ] = None,
) -> None:
    """Compare several robots on the task of a case."""
    from pathlib import Path

    from ..case.reader import read_case
    from ..comparison.compare import compare as compare_robots
    from ..comparison.robots import read_robots
    from ..errors import InputError
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..output.files import check_outputs

    if [json_file, csv_file, html].count("-") > 1:
        raise InputError("standard output can take one of --json -, --csv - and --html - only")
    check_picture(plot)
    if html is not None:
        from ..output.pictures.requirements import check_library

        check_library("matplotlib", "pages")
    read = read_case(case, read_settings(settings))
    inputs = dict(read.inputs)
    for each in read_robots(robots, read.case):
        if each.file is not None:
            inputs[Path(each.file)] = "a robot file"
    check_outputs(inputs, {"--json": json_file, "--csv": csv_file, "--html": html, "--plot": plot})
    show_progress = sys.stderr.isatty()

    def write_progress(label: str, done: int, total: int) -> None:
        sys.stderr.write(f"{CLEAR_LINE}{done} of {total} robots done: {label}")
        sys.stderr.flush()

    answer_after(Milestone.ROBOT)
    try:
        found = compare_robots(
            read.case,
            robots,
            size=size,
            scale=not no_scale,
            part=part,
            certified=certified,
            time_limit=time,
            starts=starts,
            seed=seed,
            jobs=jobs,
            progress=write_progress if show_progress else None,
        )
    finally:
        if show_progress:
            sys.stderr.write(CLEAR_LINE)
    is_stopped = is_requested()
    if is_stopped:
        begun = f"{len(found.entries)} of {len(robots)} robots are begun, the last one not to its end"
        typer.echo(f"{why_stopped()}: {begun}", err=True)
    _write(found, json_file=json_file, csv_file=csv_file, html=html, plot=plot)
    is_proved = not certified or all(each.certified is not None and each.certified.is_proved for each in found.ranked)
    raise typer.Exit(0 if found.ranked and is_proved and not is_stopped else 1)


def _write(
    found: Comparison, *, json_file: str | None, csv_file: str | None, html: str | None, plot: str | None
) -> None:
    """Write a comparison into its files, and onto the terminal where standard output takes no file."""
    from ..comparison.data import comparison_result
    from ..output.files import write_bytes, write_text
    from ..results.comparisonwording import comparison_csv, comparison_summary

    result = comparison_result(found)
    if json_file is not None:
        write_json(json_file, result)
    if csv_file is not None:
        write_text(csv_file, comparison_csv(result))
    if html is not None:
        from ..output.report.comparison import comparison_page

        write_text(html, comparison_page(found, result))
    if plot is not None:
        from ..output.pictures.comparisons import comparison_picture
        from ..output.pictures.requirements import ending_of

        write_bytes(plot, comparison_picture(found, ending_of(plot)))
    if "-" not in (json_file, csv_file, html):
        from ..output.terminal import show

        show(console(), comparison_summary(result))
