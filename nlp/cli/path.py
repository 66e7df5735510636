"""The command ``path``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from .options import (
    CaseName,
    JsonFile,
    Outputs,
    ResultFile,
    SettingTexts,
    Time,
    console,
    number_option,
    read_settings,
    write_json,
)
from .progress import spinner

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ..path.options import PathOptions
    from ..proof.workspace.path_judge import PathJudgement
    from ..proof.workspace.path_knots import Sampling
    from ..results.path import PathResult
    from ..results.workspace import WorkspacePose


def path(
    case: CaseName,
    along: Annotated[
        str | None,
        typer.Option(
            "--along", metavar="FILE", help="The path, poses in a .csv file or G-code, in place of the case's own."
        ),
    ] = None,
    ranges: Annotated[
        bool, typer.Option("--range", help="How far each coordinate can move from a pose, and each two.")
    ] = False,
    most: Annotated[
        str | None,
        typer.Option("--most", metavar="LENGTH,ANGLE", help="Largest motion to each side with --range."),
    ] = None,
    settings: SettingTexts = None,
    of: ResultFile = None,
    unit: Annotated[
        str | None, typer.Option("--unit", metavar="mm|in", help="Unit of a program before G20 or G21.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            "--start", metavar="X,Y,Z,A,B,C", help="Where the machine stands: before a program, or the pose of --range."
        ),
    ] = None,
    offset: Annotated[
        list[str] | None,
        typer.Option("--offset", metavar="G54=X,Y,Z,A,B,C", help="Origin of a program's coordinate system."),
    ] = None,
    angles: Annotated[
        str | None,
        typer.Option("--angles", metavar="rpy|xyz|...", help="Convention of a program's A, B, C; LinuxCNC's is rpy."),
    ] = None,
    between: Annotated[
        str | None,
        typer.Option("--between", metavar="angles|slerp", help="Turns between points: linear angles, or one axis."),
    ] = None,
    gap: Annotated[float, number_option("--gap", "PART", "Largest relative gap of a number without a limit.")] = 1e-3,
    time: Time = None,
    json_file: JsonFile = None,
    csv_file: Annotated[
        str | None, typer.Option("--csv", metavar="FILE", help="Write the actuators along the path; - is stdout.")
    ] = None,
    step: Annotated[
        float | None, number_option("--step", "LENGTH", "Length of the path between rows, at turns by 1 degree.")
    ] = None,
    within: Annotated[
        float | None,
        number_option("--within", "LENGTH", "Rows so that actuators linear between them stay this near the path."),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="Draw numbers along the path: a .png, .svg or .pdf file."),
    ] = None,
    page: Annotated[
        str | None,
        typer.Option("--html", metavar="FILE", help="Write a page: verdicts, curves, robot; - is stdout."),
    ] = None,
) -> None:
    """Prove regular poses and limits at every point of a path."""
    from pathlib import Path

    from ..errors import InputError
    from ..interruption import Milestone, answer_after
    from ..path.options import PathOptions
    from ..path.reader import options_of, path_of_case, read_path
    from ..proof.workspace.path_judge import TIME_LIMIT, judge_path
    from ..results.path import path_result
    from ..results.pathwording import path_summary
    from ..results.workspaceposes import evaluate_command
    from .paper import read_machine

    sampling = _sampling(step, within, is_written=csv_file is not None)
    if not 1e-9 <= gap < 1:
        raise InputError(f"--gap {gap:g}: must be at least 1e-9 and below 1")
    _refuse_elsewhere(
        {"--along": along, "--unit": unit, "--offset": offset, "--angles": angles, "--between": between}
        | {"--step": step, "--within": within, "--plot": plot, "--html": page},
        most,
        ranges=ranges,
    )
    answer_after(Milestone.BOUND)
    (loaded, text, inputs), chosen = read_machine(case, read_settings(settings), of)
    files = Outputs(json=json_file, csv=csv_file, plot=plot, html=page)
    own = PathOptions() if along is not None or ranges or loaded.path is None else options_of(loaded.path)
    options = _options(own, unit, start, offset or [], angles, between)
    if ranges:
        from .axisranges import show_ranges

        files.check(inputs)
        with spinner("the pose") as show:
            found = show_ranges(loaded, options.start, most, time, files, show)
        raise typer.Exit(0 if found.proved else 1)
    if page is not None:
        from ..output.pictures.requirements import check_library

        check_library("plotly", "pages with a robot")
    files.check(inputs if along is None else {**inputs, Path(along): "the path that is read"})
    with spinner("reading the path") as show:
        programmed = path_of_case(loaded, options) if along is None else read_path(along, loaded.units, options)
        limit = TIME_LIMIT if time is None else time
        judged = judge_path(loaded, programmed, gap=gap, time_limit=limit, sampling=sampling, progress=show)
    result = path_result(judged)

    def command(pose: WorkspacePose) -> str:
        """Return the command that shows a pose."""
        return evaluate_command(case, chosen, pose, loaded.pose_prefixes[0])

    write_json(json_file, result)
    _write(files, judged, result, text, command)
    if not files.is_piped:
        from ..output.terminal import show as show_on

        show_on(console(), path_summary(judged.case, result, command))
    raise typer.Exit(0 if result.proved else 1)


def _refuse_elsewhere(along: Mapping[str, object], most: str | None, *, ranges: bool) -> None:
    """Refuse options of paths beside ``--range``, and its own without it.

    Raises:
        InputError: one is given.
    """
    from ..errors import InputError

    for name, given in along.items() if ranges else [("--most", most)]:
        if given not in (None, []):
            raise InputError(f"{name}: is not for --range" if ranges else f"{name}: needs --range")


def _write(
    files: Outputs, judged: PathJudgement, result: PathResult, text: str, command: Callable[[WorkspacePose], str]
) -> None:
    """Write the table of actuators, the picture and the page."""
    from ..output.files import write_text

    if (target := files["csv"]) is not None and judged.knots is not None:
        from ..results.pathtable import knots_csv

        write_text(target, knots_csv(judged.case, judged.path, judged.knots))
    if files["plot"] is None and files["html"] is None:
        return
    from ..output.pictures.pathpanels import path_picture
    from ..output.pictures.paths import path_figure
    from ..output.report.path import path_page
    from ..proof.workspace.path_samples import samples_of

    picture = path_picture(judged, samples_of(judged), result)
    files.draw("plot", path_figure, picture)
    if (target := files["html"]) is not None:
        write_text(target, path_page(picture, text, command))


def _sampling(step: float | None, within: float | None, *, is_written: bool) -> Sampling | None:
    """Return what the rows of a table are to keep; None for no table.

    Raises:
        InputError: a length is not positive, or both are given.
    """
    from ..errors import InputError
    from ..proof.workspace.path_knots import Sampling

    for option, length in (("--step", step), ("--within", within)):
        if length is not None and not 0 < length < math.inf:
            raise InputError(f"{option} {length:g}: must be a length above 0")
    if step is not None and within is not None:
        raise InputError("--step and --within: give one; each states how far rows are from each other")
    return None if step is None and within is None and not is_written else Sampling(step, within)


def _options(
    own: PathOptions, unit: str | None, start: str | None, offsets: list[str], angles: str | None, between: str | None
) -> PathOptions:
    """Return the choices that a path's file leaves open: those of the case, but for what is given.

    Raises:
        InputError: one is not allowed.
    """
    from dataclasses import replace

    from ..errors import InputError
    from ..path.options import Between

    def numbers(option: str, text: str) -> list[float]:
        try:
            return [float(part) for part in text.split(",")]
        except ValueError:
            raise InputError(f"{option} {text}: must be six numbers with commas: X,Y,Z,A,B,C") from None

    found = dict(own.offsets)
    for each in offsets:
        name, equals, text = each.partition("=")
        if not equals:
            raise InputError(f"--offset {each}: must be a coordinate system and its origin: G54=X,Y,Z,A,B,C")
        found[name] = numbers("--offset", text)
    if between not in (None, *(each.value for each in Between)):
        raise InputError(f"--between {between}: must be angles or slerp")
    return replace(
        own,
        between=own.between if between is None else Between(between),
        angles=own.angles if angles is None else angles,
        unit=own.unit if unit is None else unit,
        start=own.start if start is None else numbers("--start", start),
        offsets=found,
    )
