"""Command ``inverse``."""

from __future__ import annotations

from typing import Annotated

from . import contents, options


def inverse(
    case: options.CaseName,
    poses: Annotated[str, options.file("--poses", "CSV file of poses, in the format of a case's file of poses")],
    csv_file: Annotated[str | None, options.table("the coordinates of all joints")] = None,
    derivatives: Annotated[bool, options.flag("--derivatives", "Also write actuator rates and J")] = False,
    previous: Annotated[
        bool, options.flag("--previous", "Start each pose from the joints of the previous pose, not from home")
    ] = False,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Compute actuator and joint coordinates at many poses.

    The exit status is 1 if a pose has no solution: a limb cannot reach it, or the robot lacks the degrees of freedom.
    """
    from pathlib import Path

    from ..case.reader import read_poses
    from ..errors import InputError
    from ..evidence.inverse import inverse as inverse_at

    if derivatives and csv_file is None:
        raise InputError("--derivatives: needs --csv FILE")
    files = options.Outputs(csv=csv_file)
    loaded, _, inputs = options.read_changed_case(case, settings, of).file
    files.check({**inputs, Path(poses): "the file of the poses"})
    given = read_poses(poses, loaded.units, "--poses")
    found = inverse_at(loaded, given.positions, given.rotations, follow="previous" if previous else "home")
    files.deliver(
        lambda: contents.inverse_summary(loaded, found, poses, given.rows),
        whole=whole,
        done=bool(found.closed.all()),
        csv=lambda: contents.inverse_csv(loaded, found, given.rows, derivatives=derivatives),
    )
