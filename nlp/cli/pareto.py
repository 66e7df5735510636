"""The command ``pareto``."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

from .numbers import WholeNumber
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

if TYPE_CHECKING:
    from ..front.front import Front


def pareto(
    case: CaseName,
    goals: Annotated[
        list[str],
        typer.Option(metavar="GOAL", help="Twice or more: max or min, then F:TASK or limits.KEY, as in 'max F:drive'."),
    ],
    points: Annotated[
        int, typer.Option(parser=WholeNumber("--points", 2, 1000), metavar="N", help="Points of the front.")
    ] = 16,
    settings: SettingTexts = None,
    starts: Starts = None,
    seed: Seed = None,
    jobs: Jobs = None,
    _time: Time = None,
    certify: Annotated[bool, typer.Option("--certify", help="Prove each point's optimum too.")] = False,
    csv_file: Annotated[str | None, typer.Option("--csv", metavar="FILE", help="Write the front as CSV.")] = None,
    json_file: JsonFile = None,
    html: Annotated[str | None, typer.Option("--html", metavar="FILE", help="Write a page of HTML.")] = None,
    plot: CurveFile = None,
) -> None:
    """Find the front of two or more goals of a case."""
    from ..case.reader import read_case
    from ..errors import InputError, UncoveredError
    from ..front.front import pareto as find_front
    from ..front.goals import read_goals
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..output.files import check_outputs

    if [json_file, csv_file, html].count("-") > 1:
        raise InputError("standard output can take one of --json -, --csv - and --html - only")
    check_picture(plot)
    if html is not None:
        from ..output.pictures.requirements import check_library

        check_library("matplotlib", "pages")
    read = read_case(case, read_settings(settings))
    read_goals(goals, read.case)  # before the files are looked at
    check_outputs(read.inputs, {"--json": json_file, "--csv": csv_file, "--html": html, "--plot": plot})
    show = sys.stderr.isatty()

    def show_progress(done: int, total: int) -> None:
        sys.stderr.write(f"{CLEAR_LINE}{done} of {total} points")
        sys.stderr.flush()

    answer_after(Milestone.POINT)
    try:
        found = find_front(
            read.case,
            goals,
            points=points,
            starts=starts,
            seed=seed,
            jobs=jobs,
            certified=certify,
            progress=show_progress if show else None,
        )
    except UncoveredError as error:
        raise InputError(f"--certify: {error}") from None
    finally:
        if show:
            sys.stderr.write(CLEAR_LINE)
    is_stopped = is_requested()
    if is_stopped:
        typer.echo(f"{why_stopped()}: {len(found.points)} of {points} points are found", err=True)
    _write(found, json_file=json_file, csv_file=csv_file, html=html, plot=plot)
    is_proved = all(each.certificate is None or each.certificate.status.value == "proved" for each in found.points)
    raise typer.Exit(0 if is_proved and not is_stopped else 1)


def _write(found: Front, *, json_file: str | None, csv_file: str | None, html: str | None, plot: str | None) -> None:
    """Write a front into its files, and onto the terminal where standard output takes no file."""
    from ..front.data import front_result
    from ..output.files import write_bytes, write_text
    from ..output.fronttable import front_csv, front_table, front_words
    from ..output.terminal import show

    if json_file is not None:
        write_json(json_file, front_result(found))
    if csv_file is not None:
        write_text(csv_file, front_csv(found))
    if html is not None:
        from ..output.report.front import front_page

        write_text(html, front_page(found))
    if plot is not None:
        from ..output.pictures.fronts import front_picture
        from ..output.pictures.requirements import ending_of

        write_bytes(plot, front_picture(found, ending_of(plot)))
    if "-" not in (json_file, csv_file, html):
        for line in front_words(found):
            typer.echo(line)
        show(console(), [front_table(found)])
