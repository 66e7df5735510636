"""Command ``tradeoff``."""

from __future__ import annotations

from typing import Annotated

from . import designs, options
from .commandline import print_notice
from .progress import counting_line

#: Largest number of values.
_MOST = 200


def tradeoff(
    case: options.CaseName,
    over: Annotated[
        str,
        options.text(
            "--over",
            "NAME=FIRST:LAST:COUNT",
            "Limit or parameter to vary, such as limits.leg_length.max=28:40:13, or NAME=V1,V2,...",
        ),
    ],
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
    certify: options.Certify = False,
    resume: options.ResumeFile = None,
    json_file: options.JsonFile = None,
    csv_file: Annotated[str | None, options.table("the curve")] = None,
    markdown: options.MarkdownFile = None,
    plot: options.CurveFile = None,
    html: options.PageFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Re-solve for a range of values of one limit or parameter.

    The table, curve or page shows F against the value, with its slope and the active limits.
    """
    from ..case.reader import read_case
    from ..errors import InputError, UncoveredError
    from ..interruption import Milestone, answer_after, is_requested, why_stopped
    from ..results.tradeoff import tradeoff_result
    from ..solver.status import Status
    from ..solver.tradeoff import solve_along
    from ..sweeps.points import grid
    from ..words.tradeoff import tradeoff_designs

    answer_after(Milestone.VALUE)
    points = grid([over])
    name, values = points.names[0], points.values[:, 0].tolist()
    if not 2 <= len(values) <= _MOST:
        raise InputError(f"--over {over}: must have from 2 to {_MOST} values")
    files = options.Outputs(resume=resume, json=json_file, csv=csv_file, markdown=markdown, html=html, plot=plot)
    fixed = options.read_changed_case(case, settings, of).settings
    read = {value: read_case(case, {**fixed, name: value}) for value in values}
    files.check(read[values[0]].inputs)
    with designs.resumed(resume):
        try:
            with counting_line() as write:
                found = solve_along(
                    lambda value: read[value].case,
                    values,
                    name=name,
                    starts=starts,
                    seed=seed,
                    jobs=jobs,
                    certified=certify,
                    progress=lambda done, total: write(f"{done} of {total} values solved"),
                )
        except UncoveredError as error:
            raise InputError(f"--certify: {error}") from None
        if is_requested() and not found.unsolved:
            print_notice(
                f"{why_stopped()}: all values are solved, but not all again from the optima of neighbouring values"
            )
        result = tradeoff_result(found)
        is_proved = all(point.certified is None or point.certified.is_proved for point in found.points)
        statuses = [point.status for point in result.points]
        is_done = all(status.is_answer or status is Status.INFEASIBLE for status in statuses)
        designs.deliver(
            files,
            tradeoff_designs(result, found.points[0].solution.case, found),
            lambda: result,
            whole=whole,
            done=is_done and is_proved and any(status.is_answer for status in statuses),
        )
