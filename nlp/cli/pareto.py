"""Command ``pareto``."""

from __future__ import annotations

from typing import Annotated

from . import designs, options
from .commandline import print_notice
from .progress import counting_line


def pareto(
    case: options.CaseName,
    goals: Annotated[
        list[str],
        options.several(
            "--goal", "GOAL", "Goal: max or min, then F, F:TASK or limits.KEY, as in 'max F:drive'; 2 to 6 goals"
        ),
    ],
    points: Annotated[int, options.whole("--points", "Number of points of the front", 2, 1000)] = 16,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
    certify: options.Certify = False,
    resume: options.ResumeFile = None,
    csv_file: Annotated[str | None, options.table("the front")] = None,
    json_file: options.JsonFile = None,
    markdown: options.MarkdownFile = None,
    html: options.PageFile = None,
    plot: options.CurveFile = None,
    whole: options.ShowAll = False,
) -> None:
    """Compute the Pareto front of two or more goals.

    Each point optimises one goal, with bounds on all other goals.
    """
    from ..errors import InputError, UncoveredError
    from ..front.data import front_designs, front_result
    from ..front.front import pareto as find_front
    from ..front.goals import read_goals
    from ..interruption import Milestone, answer_after, is_requested, why_stopped

    files = options.Outputs(resume=resume, json=json_file, csv=csv_file, markdown=markdown, html=html, plot=plot)
    read = options.read_changed_case(case, settings, of).file
    read_goals(goals, read.case)  # before the files are looked at
    files.check(read.inputs)
    answer_after(Milestone.POINT)
    with designs.resumed(resume):
        try:
            with counting_line() as show:
                found = find_front(
                    read.case,
                    goals,
                    points=points,
                    starts=starts,
                    seed=seed,
                    jobs=jobs,
                    certified=certify,
                    progress=lambda done, total: show(f"{done} of {total} points"),
                )
        except UncoveredError as error:
            raise InputError(f"--certify: {error}") from None
        is_stopped = is_requested()
        if is_stopped:
            print_notice(f"{why_stopped()}: {len(found.points)} of {points} points are complete")
        is_proved = all(each.certificate is None or each.certificate.status.value == "proved" for each in found.points)
        result = front_result(found)
        designs.deliver(
            files, front_designs(found, result), lambda: result, whole=whole, done=is_proved and not is_stopped
        )
