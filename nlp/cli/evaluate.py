"""Command ``evaluate``."""

from __future__ import annotations

from typing import Annotated

from . import contents, options
from .commandline import print_notice


def evaluate(
    case: options.CaseName,
    settings: options.SettingTexts = None,
    of: Annotated[
        str | None, options.text("--of", "RESULT", "Take dimensions and pose from a result of solve --json")
    ] = None,
    claim: Annotated[
        str | None,
        options.text(
            "--set-from", "RESULT#N", "Take the pose of violation N in a result of workspace --json or path --json"
        ),
    ] = None,
    json_file: options.JsonFile = None,
    csv_file: options.CsvFile = None,
    table: options.CsvTable = None,
    whole: options.ShowAll = False,
) -> None:
    """Show F, limits, rank and rates at one design and pose.

    Nothing is optimised. A variable has its start value, or else the middle of its bounds. Actuator coordinates that
    the pose does not determine are 0 (home), or those of the result of --of.
    """
    from functools import partial

    from ..evidence.evaluation import without_speeds
    from ..results.evaluation import evaluation_at

    given = options.read_changed_case(case, settings, of, at_pose=True, claim=claim).file
    loaded = given.case
    if left_out := loaded.without_motion:  # a pose of a path: its speeds come from the motion of the path
        loaded = without_speeds(loaded)
        names = ", ".join(f"limits.{each.name}" for each in left_out)
        print_notice(f"{names}: left out, as the case has no [motion]")
    files = options.Outputs(json=json_file, csv=csv_file)
    files.check(given.inputs)
    options.check_csv(csv_file, table, loaded, at_point=True)
    if of is not None and loaded.model.free_joints:
        from ..program.free_joints import begun_at
        from ..results.settings import joints_of, load_answer, robots_of

        joints = joints_of(robots_of(load_answer(of), f"--of {of}", loaded), loaded)
        result = evaluation_at(loaded, partial(begun_at, joints=joints))
    else:
        result = evaluation_at(loaded)
    files.deliver(
        lambda: contents.evaluation_summary(loaded, result),
        whole=whole,
        done=not result.violated,
        json=lambda: result,
        csv=lambda: contents.tables_as_csv(contents.evaluation_tables(loaded, result), table),
    )
