"""The command ``path``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from .options import (
    CaseName,
    CsvFile,
    JsonFile,
    Outputs,
    ResultFile,
    SettingTexts,
    Time,
    console,
    number_option,
    read_settings,
    write_csv,
    write_json,
)
from .progress import spinner

if TYPE_CHECKING:
    from ..path.options import PathOptions
    from ..results.workspace import WorkspacePose


def path(
    case: CaseName,
    along: Annotated[
        str | None,
        typer.Option("--along", metavar="FILE", help="The path: poses in a .csv file, or a program of G-code."),
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
    gap: Annotated[float, number_option("--gap", "PART", "Largest relative gap of a number without a limit.")] = 1e-3,
    time: Time = None,
    json_file: JsonFile = None,
    csv_file: CsvFile = None,
) -> None:
    """Prove regular poses and limits at every point of a path."""
    from pathlib import Path

    from ..errors import InputError
    from ..interruption import Milestone, answer_after
    from ..path.reader import read_path
    from ..proof.workspace.path_judge import TIME_LIMIT, judge_path
    from ..results.path import path_result
    from ..results.pathwording import path_summary
    from ..results.text import TextTable
    from ..results.workspaceposes import evaluate_command
    from .paper import read_machine

    if not 1e-9 <= gap < 1:
        raise InputError(f"--gap {gap:g}: must be at least 1e-9 and below 1")
    if (along is None) != ranges:
        raise InputError("path: needs --along FILE or --range" + (", not both" if ranges else ""))
    for name, given, needed in (
        ("--most", most, ranges),
        ("--unit", unit, not ranges),
        ("--offset", offset, not ranges),
    ):
        if given and not needed:
            raise InputError(f"{name}: needs {'--along FILE' if ranges else '--range'}")
    options = _options(unit, start, offset or [])
    answer_after(Milestone.BOUND)
    (loaded, _, inputs), chosen = read_machine(case, read_settings(settings), of)
    files = Outputs(json=json_file, csv=csv_file)
    if along is None:
        from .axisranges import show_ranges

        files.check(inputs)
        with spinner("the pose") as show:
            found = show_ranges(loaded, options.start, most, time, files, show)
        raise typer.Exit(0 if found.proved else 1)
    files.check({**inputs, Path(along): "the path that is read"})
    with spinner("reading the path") as show:
        programmed = read_path(along, loaded.units, options)
        limit = TIME_LIMIT if time is None else time
        judged = judge_path(loaded, programmed, gap=gap, time_limit=limit, progress=show)
    result = path_result(judged)

    def command(pose: WorkspacePose) -> str:
        """Return the command that shows a pose."""
        return evaluate_command(case, chosen, pose, loaded.pose_prefixes[0])

    write_json(json_file, result)
    summary = list(path_summary(judged.case, result, command))
    if csv_file is not None:
        write_csv(csv_file, [each for each in summary if isinstance(each, TextTable)], None)
    if not files.is_piped:
        from ..output.terminal import show as show_on

        show_on(console(), summary)
    raise typer.Exit(0 if result.proved else 1)


def _options(unit: str | None, start: str | None, offsets: list[str]) -> PathOptions:
    """Return the choices that a path's file leaves open.

    Raises:
        InputError: one is not a list of six numbers.
    """
    from ..errors import InputError
    from ..path.options import PathOptions

    def numbers(option: str, text: str) -> list[float]:
        try:
            return [float(part) for part in text.split(",")]
        except ValueError:
            raise InputError(f"{option} {text}: must be six numbers with commas: X,Y,Z,A,B,C") from None

    found = {}
    for each in offsets:
        name, equals, text = each.partition("=")
        if not equals:
            raise InputError(f"--offset {each}: must be a coordinate system and its origin: G54=X,Y,Z,A,B,C")
        found[name] = numbers("--offset", text)
    return PathOptions(unit=unit, start=None if start is None else numbers("--start", start), offsets=found)
