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
        str, typer.Option("--along", metavar="FILE", help="The path: poses in a .csv file, or a program of G-code.")
    ],
    settings: SettingTexts = None,
    of: ResultFile = None,
    unit: Annotated[
        str | None, typer.Option("--unit", metavar="mm|in", help="Unit of a program before G20 or G21.")
    ] = None,
    start: Annotated[
        str | None,
        typer.Option("--start", metavar="X,Y,Z,A,B,C", help="Where the machine stands before a program."),
    ] = None,
    offset: Annotated[
        list[str] | None,
        typer.Option("--offset", metavar="G54=X,Y,Z,A,B,C", help="Origin of a program's coordinate system."),
    ] = None,
    angles: Annotated[
        str,
        typer.Option("--angles", metavar="rpy|xyz|...", help="Convention of a program's A, B, C; LinuxCNC's is rpy."),
    ] = "rpy",
    between: Annotated[
        str | None,
        typer.Option("--between", metavar="angles|slerp", help="Turns between points: linear angles, or one axis."),
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
    answer_after(Milestone.BOUND)
    (loaded, _, inputs), chosen = read_machine(case, read_settings(settings), of)
    files = Outputs(json=json_file, csv=csv_file)
    files.check({**inputs, Path(along): "the path that is read"})
    with spinner("reading the path") as show:
        programmed = read_path(along, loaded.units, _options(unit, start, offset or [], angles, between))
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


def _options(unit: str | None, start: str | None, offsets: list[str], angles: str, between: str | None) -> PathOptions:
    """Return the choices that a path's file leaves open.

    Raises:
        InputError: one is not allowed.
    """
    from ..errors import InputError
    from ..path.options import Between, PathOptions

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
    if between not in (None, *(each.value for each in Between)):
        raise InputError(f"--between {between}: must be angles or slerp")
    return PathOptions(
        between=None if between is None else Between(between),
        angles=angles,
        unit=unit,
        start=None if start is None else numbers("--start", start),
        offsets=found,
    )
