"""The command ``solve``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from .options import (
    CaseName,
    CsvFile,
    CsvTable,
    Jobs,
    JsonFile,
    Outputs,
    PlotFile,
    Seed,
    SettingTexts,
    Starts,
    Time,
    check_csv,
    console,
    read_settings,
    whole_option,
    write_csv,
    write_json,
)


def solve(
    case: CaseName,
    settings: SettingTexts = None,
    starts: Starts = None,
    seed: Seed = None,
    jobs: Jobs = None,
    _time: Time = None,
    compiled: Annotated[
        bool, typer.Option("--compiled", help="Call the objective as compiled C; needs a C compiler.")
    ] = False,
    json_file: JsonFile = None,
    csv_file: CsvFile = None,
    table: CsvTable = None,
    plot: PlotFile = None,
    pose: Annotated[int, whole_option("--pose", "Pose that --plot draws, where the case has several.", 1)] = 1,
    certify: Annotated[
        bool, typer.Option("--certify", help="Prove the optimum too, to a gap of 1e-4; see certify.")
    ] = False,
) -> None:
    """Maximise or minimise F, and show the evidence."""
    from ..case.reader import read_case
    from ..errors import InputError
    from ..interruption import Milestone, answer_after
    from ..results.result import result_of
    from .progress import solve_with_progress

    answer_after(Milestone.START)
    given = read_case(case, read_settings(settings))
    loaded = replace(given.case, search=given.case.search.but(starts, seed, compiled=compiled))
    files = Outputs(json=json_file, plot=plot, csv=csv_file)
    check_csv(csv_file, table, loaded, at_point=False)
    files.check(given.inputs)
    if pose > loaded.pose_count:
        raise InputError(f"--pose {pose}: the case has {loaded.pose_count} pose{'s' * (loaded.pose_count > 1)}")
    solution, found, is_proved = solve_with_progress(loaded, jobs, certify=certify)
    result = result_of(found)
    write_json(json_file, result)
    if csv_file is not None:
        from ..results.summary import case_tables

        write_csv(csv_file, case_tables(loaded, result), table)
    if plot is not None:
        from ..output.pictures.plot import plot as draw

        draw(solution, plot, pose=pose)
    if not files.is_piped:
        from ..output.terminal import show
        from ..results.summary import case_summary

        show(console(), case_summary(loaded, result))
    raise typer.Exit(0 if solution.status.is_answer and is_proved and solution.keeps_limits else 1)
