"""The command ``inverse``."""

from __future__ import annotations

from typing import Annotated

from . import contents, options


def inverse(
    case: options.CaseName,
    poses: Annotated[str, options.file("--poses", "CSV file of poses, as a case names it")],
    csv_file: Annotated[str | None, options.table("the positions of all joints")] = None,
    derivatives: Annotated[bool, options.flag("--derivatives", "Write the rates of the actuators and J too")] = False,
    previous: Annotated[
        bool, options.flag("--previous", "Follow the joints from pose to pose, not each from home")
    ] = False,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Compute positions of actuators and joints at many poses.

    The exit status is 1 where a pose is not closed: out of reach, or not one that the robot can take.
    """
    from pathlib import Path

    from ..case.reader import read_poses
    from ..errors import InputError
    from ..evidence.inverse import inverse as inverse_at

    if derivatives and csv_file is None:
        raise InputError("--derivatives: needs --csv FILE")
    files = options.Outputs(csv=csv_file)
    loaded, _, inputs = options.read_machine(case, settings, of).file
    files.check({**inputs, Path(poses): "the file of the poses"})
    given = read_poses(poses, loaded.units, "--poses")
    found = inverse_at(loaded, given.positions, given.rotations, follow="previous" if previous else "home")
    files.deliver(
        lambda: contents.inverse_summary(loaded, found, poses, given.rows),
        whole=whole,
        done=bool(found.closed.all()),
        csv=lambda: contents.inverse_csv(loaded, found, given.rows, derivatives=derivatives),
    )
