"""The command ``pareto``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from . import options
from .commandline import print_notice
from .progress import counting_line

if TYPE_CHECKING:
    from ..front.front import Front


def pareto(
    case: options.CaseName,
    goals: Annotated[
        list[str],
        options.several("--goal", "GOAL", "max or min, then F:TASK or limits.KEY, as in 'max F:drive'; 2 to 6 goals"),
    ],
    points: Annotated[int, options.whole("--points", "Points of the front", 2, 1000)] = 16,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
    certify: options.Certify = False,
    csv_file: Annotated[str | None, options.table("the front")] = None,
    json_file: options.JsonFile = None,
    html: options.PageFile = None,
    plot: options.CurveFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Find the front of two or more goals of a case."""
    from ..errors import InputError, UncoveredError
    from ..front.front import pareto as find_front
    from ..front.goals import read_goals
    from ..interruption import Milestone, answer_after, is_requested, why_stopped

    files = options.Outputs(json=json_file, csv=csv_file, html=html, plot=plot)
    read = options.read_machine(case, settings, of).file
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
        print_notice(f"{why_stopped()}: {len(found.points)} of {points} points are found")
    _write(found, files, whole=whole)
    is_proved = all(each.certificate is None or each.certificate.status.value == "proved" for each in found.points)
    raise SystemExit(0 if is_proved and not is_stopped else 1)


def _write(found: Front, files: options.Outputs, *, whole: bool) -> None:
    """Write a front into its files, and onto the terminal where standard output takes no file."""
    from ..front.data import front_result
    from ..output.fronttable import front_csv, front_table, front_words
    from ..results.text import Line

    options.write_json(files["json"], front_result(found))
    files.write("csv", front_csv, found)
    if files["html"] is not None:
        from ..output.report.front import front_page

        files.write("html", front_page, found)
    if files["plot"] is not None:
        from ..output.pictures.curves import front_figure

        files.draw("plot", front_figure, found)
    if not files.is_piped:
        options.show([*map(Line, front_words(found)), front_table(found)], whole=whole)
