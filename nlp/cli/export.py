"""Command ``export``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from . import options
from .commandline import print_notice


def export(
    case: options.CaseName,
    out: options.Folder,
    formats: Annotated[list[str], options.several("--format", "NAME", "Format: mjcf, urdf, csv, dxf or all")],
    settings: options.SettingTexts = None,
    of: Annotated[
        str | None, options.text("--of", "RESULT", "Write the robot of a result of solve --json, without a solve")
    ] = None,
    pose: options.PoseNumber = 1,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
    force: options.Force = False,
) -> None:
    """Write the solved robot as MJCF, URDF, CSV or DXF.

    A case without variables is not solved. With --of, the dimensions and the pose are those of the result.
    """
    from ..case.reader import read_case
    from ..errors import one_line
    from ..evidence.state import loops_are_closed
    from ..formats.export import check_formats, check_pose, check_same_robot, files_at, fixed_point
    from ..output.files import check_folder, check_outputs, write_folder
    from ..words.text import Line
    from .progress import solve_with_progress

    chosen = check_formats(formats)
    if not force:
        check_folder(out)
    fixings = options.read_settings(settings)
    loaded, _, inputs = read_case(case, fixings)
    jacobian, joints = None, dict[str, float]()
    if of is not None:
        import numpy as np

        from ..results.settings import joints_of, load_answer, robots_of, settings_of

        robots = robots_of(load_answer(of), f"--of {of}", loaded)
        jacobian = np.array(robots[0].jacobian)
        joints |= joints_of(robots, loaded)
        loaded, _, inputs = read_case(case, {**fixings, **settings_of(robots, loaded)})
    loaded = replace(loaded, search=loaded.search.but(starts, seed))
    check_pose(loaded, pose)
    fixed = fixed_point(loaded, joints)
    if fixed is None:
        solution = solve_with_progress(loaded, jobs).solution
        nlp, x, index = solution.at_pose(pose - 1)
        fault = "" if solution.status.is_answer else f"the solve is {solution.status.value}"
    else:
        (nlp, x), index = fixed, pose - 1
        fault = "" if loops_are_closed(nlp, x) else "the loops of the robot do not close at this point"
        if jacobian is not None and not fault:
            check_same_robot(nlp, x, jacobian)
    if fault:
        print_notice(f"screwsynth: {one_line(case)}: {fault}: nothing is exported")
        raise SystemExit(1)
    files = files_at(nlp, x, chosen, index + 1)
    for name in files if Path(out).is_dir() else ():
        check_outputs(inputs, {"--out": str(Path(out) / name)})
    write_folder(out, files, force=force)
    options.show([Line(f"{len(files)} files in {out}: {', '.join(files)}")], whole=True)
