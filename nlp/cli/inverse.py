"""The command ``inverse``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import CaseName, Outputs, ResultFile, SettingTexts, console, read_settings


def inverse(
    case: CaseName,
    poses: Annotated[str, typer.Option("--poses", metavar="FILE", help="CSV file of poses, as a case names it.")],
    csv_file: Annotated[
        str | None, typer.Option("--csv", metavar="FILE", help="Write the positions of all joints; - is stdout.")
    ] = None,
    derivatives: Annotated[
        bool, typer.Option("--derivatives", help="Write the rates of the actuators and J too.")
    ] = False,
    previous: Annotated[
        bool, typer.Option("--previous", help="Follow the joints from pose to pose, not each from home.")
    ] = False,
    settings: SettingTexts = None,
    of: ResultFile = None,
) -> None:
    """Compute positions of actuators and joints at many poses.

    The exit status is 1 where a pose is not closed: out of reach, or not one that the robot can take.
    """
    from pathlib import Path

    from ..case.reader import read_poses
    from ..errors import InputError
    from ..evidence.inverse import inverse as inverse_at
    from ..results.inverse import inverse_csv, inverse_summary
    from .paper import read_machine

    if derivatives and csv_file is None:
        raise InputError("--derivatives: needs --csv FILE")
    files = Outputs(csv=csv_file)
    (loaded, _, inputs), _ = read_machine(case, read_settings(settings), of)
    files.check({**inputs, Path(poses): "the file of the poses"})
    given = read_poses(poses, loaded.units, "--poses")
    found = inverse_at(loaded, given.positions, given.rotations, follow="previous" if previous else "home")
    if csv_file is not None:
        from ..output.files import write_text

        write_text(csv_file, inverse_csv(loaded, found, given.rows, derivatives=derivatives))
    if not files.is_piped:
        from ..output.terminal import show

        show(console(), inverse_summary(loaded, found, poses, given.rows))
    raise typer.Exit(0 if found.closed.all() else 1)
