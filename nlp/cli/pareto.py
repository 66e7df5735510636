"""The command ``pareto``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from .options import (
    CaseName,
    CurveFile,
    Jobs,
    JsonFile,
    Outputs,
    PageFile,
    Seed,
    SettingTexts,
    Starts,
    Time,
    console,
    read_settings,
    whole_option,
    write_json,
)
from .progress import counting_line

if TYPE_CHECKING:
    from ..front.front import Front


def pareto(
    case: CaseName,
    goals: Annotated[
        list[str],
        typer.Option(metavar="GOAL", help="Twice or more: max or min, then F:TASK or limits.KEY, as in 'max F:drive'."),
    ],
    points: Annotated[int, whole_option("--points", "Points of the front.", 2, 1000)] = 16,
    settings: SettingTexts = None,
    starts: Starts = None,
    seed: Seed = None,
    jobs: Jobs = None,
    _time: Time = None,
    certify: Annotated[bool, typer.Option("--certify", help="Prove each point's optimum too.")] = False,
    csv_file: Annotated[str | None, typer.Option("--csv", metavar="FILE", help="Write the front as CSV.")] = None,
    json_file: JsonFile = None,
    html: PageFile = None,
    plot: CurveFile = None,
) -> None:
    """Find the front of two or more goals of a case."""
    from ..case.reader import read_case
    from ..errors import InputError, UncoveredError
    from ..front.front import pareto as find_front
    from ..front.goals import read_goals
    from ..interruption import Milestone, answer_after, is_requested, why_stopped

    files = Outputs(json=json_file, csv=csv_file, html=html, plot=plot)
    read = read_case(case, read_settings(settings))
    read_goals(goals, read.case)  # before the files are looked at
    files.check(read.inputs)
    answer_after(Milestone.POINT)
    try:
        with counting_line() as show:
            found = find_front(
                read.case,
                goals,
                points=points,
                starts=starts,
                seed=seed,
                jobs=jobs,
                certified=certify,
                progress=lambda done, total: show(f"{done} of {total} points"),
            )
    except UncoveredError as error:
        raise InputError(f"--certify: {error}") from None
    is_stopped = is_requested()
    if is_stopped:
        typer.echo(f"{why_stopped()}: {len(found.points)} of {points} points are found", err=True)
    _write(found, files)
    is_proved = all(each.certificate is None or each.certificate.status.value == "proved" for each in found.points)
    raise typer.Exit(0 if is_proved and not is_stopped else 1)


def _write(found: Front, files: Outputs) -> None:
    """Write a front into its files, and onto the terminal where standard output takes no file."""
    from ..front.data import front_result
    from ..output.files import write_text
    from ..output.fronttable import front_csv, front_table, front_words
    from ..output.terminal import show

    write_json(files["json"], front_result(found))
    if (csv_file := files["csv"]) is not None:
        write_text(csv_file, front_csv(found))
    if (html := files["html"]) is not None:
        from ..output.report.front import front_page

        write_text(html, front_page(found))
    if files["plot"] is not None:
        from ..output.pictures.curves import front_figure

        files.draw("plot", front_figure, found)
    if not files.is_piped:
        for line in front_words(found):
            typer.echo(line)
        show(console(), [front_table(found)])
