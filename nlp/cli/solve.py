"""Command ``solve``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from . import contents, options


def solve(
    case: options.CaseName,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
    compiled: Annotated[
        bool, options.flag("--compiled", "Compile the objective as C for speed; needs a C compiler")
    ] = False,
    json_file: options.JsonFile = None,
    csv_file: options.CsvFile = None,
    table: options.CsvTable = None,
    plot: options.PlotFile = None,
    pose: options.PoseNumber = 1,
    step: Annotated[
        float | None,
        options.number("--round", "STEP", "Round free dimensions to multiples of this, in the length unit and degrees"),
    ] = None,
    certify: options.Certify = False,
    gap: options.OptimumGap = 1e-4,
    schedule: Annotated[
        str | None,
        options.file(
            "--schedule", "Write the values that change along the path to this file, or - for standard output"
        ),
    ] = None,
    whole: options.ShowAll = False,
) -> None:
    """Optimise F, and show the evidence of the optimum.

    F is the sum of the squared work rates of legs and constraints in the task: a large F resists the motion of the
    task, F = 0 leaves it free.
    """
    from ..errors import InputError
    from ..interruption import Milestone, answer_after
    from ..results.result import result_of
    from .progress import solve_with_progress

    answer_after(Milestone.START)
    given = options.read_changed_case(case, settings, of).file
    loaded = replace(given.case, search=given.case.search.but(starts, seed, compiled=compiled))
    if schedule is not None and loaded.over_path is None:
        raise InputError("--schedule: the case optimises nothing along a path; it needs over and as in [objective]")
    files = options.Outputs(json=json_file, plot=plot, csv=csv_file, schedule=schedule)
    options.check_csv(csv_file, table, loaded, at_point=False)
    files.check(given.inputs)
    if step is not None:
        from ..solver.rounding import check_rounding

        check_rounding(loaded, step)
    poses = loaded.poses_per_task  # each picture shows its task
    if pose > poses:
        whose = "every task" if loaded.changes else "the case"
        raise InputError(f"--pose {pose}: no such pose; {whose} has {poses} pose{'s' * (poses > 1)}")
    solution, found, is_proved = solve_with_progress(loaded, jobs, certify=certify, gap=gap, step=step)
    result = result_of(found)
    files.deliver(
        lambda: contents.case_summary(loaded, result),
        whole=whole,
        done=solution.status.is_answer and is_proved and solution.keeps_limits,
        json=lambda: result,
        csv=lambda: contents.tables_as_csv(contents.case_tables(loaded, result), table),
        plot=lambda: (
            contents.schedule_figure(loaded, solution)
            if solution.schedule is not None
            else contents.figure_of(contents.drawings_of(solution, pose))
        ),
        schedule=lambda: None if solution.schedule is None else solution.schedule.to_csv(),
    )
