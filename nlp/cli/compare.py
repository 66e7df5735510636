"""Command ``compare``."""

from __future__ import annotations

from typing import Annotated

from . import designs, options
from .commandline import Argument, print_notice
from .progress import counting_line


def compare(
    case: options.CaseName,
    robots: Annotated[
        list[str],
        Argument("ROBOT...", "Names of robots, robot files, or 'case' for the robot of the case."),
    ],
    size: Annotated[
        float | None,
        options.number("--size", "LENGTH", "Common size of the robots; the size of the case's robot if left out"),
    ] = None,
    no_scale: Annotated[bool, options.flag("--no-scale", "Do not scale robots to a common size")] = False,
    part: Annotated[
        float,
        options.number("--part", "FRACTION", "Bounds of dimensions, as a fraction of typical values; 0 fixes them"),
    ] = 0.25,
    certified: options.Certify = False,
    time: Annotated[float | None, options.time("60 for each proof if left out")] = None,
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    resume: options.ResumeFile = None,
    json_file: options.JsonFile = None,
    csv_file: Annotated[str | None, options.table("a row for each robot")] = None,
    markdown: options.MarkdownFile = None,
    html: options.PageFile = None,
    plot: Annotated[str | None, options.plot("Draw the designs at the same scale")] = None,
    whole: options.ShowAll = False,
) -> None:
    """Compare robots on the task of a case, and order them by F.

    Robots are scaled to a common size, and their dimensions are optimised near typical values.
    """
    from pathlib import Path

    from ..comparison.compare import compare as compare_robots
    from ..comparison.data import comparison_designs, comparison_result
    from ..comparison.robots import read_robots
    from ..interruption import Milestone, answer_after, is_requested, why_stopped

    files = options.Outputs(resume=resume, json=json_file, csv=csv_file, markdown=markdown, html=html, plot=plot)
    read = options.read_changed_case(case, settings, of).file
    inputs = dict(read.inputs)
    for each in read_robots(robots, read.case):
        if each.file is not None:
            inputs[Path(each.file)] = "a robot file"
    files.check(inputs)
    answer_after(Milestone.ROBOT)
    with designs.resumed(resume):
        with counting_line() as show:
            found = compare_robots(
                read.case,
                robots,
                size=size,
                scale=not no_scale,
                part=part,
                certified=certified,
                time_limit=time,
                starts=starts,
                seed=seed,
                jobs=jobs,
                progress=lambda label, done, total: show(f"{done} of {total} robots done: {label}"),
            )
        is_stopped = is_requested()
        if is_stopped:
            begun = f"{len(found.entries)} of {len(robots)} robots are complete or begun; the last robot is incomplete"
            print_notice(f"{why_stopped()}: {begun}")
        is_proved = not certified or all(
            each.certified is not None and each.certified.is_proved for each in found.ranked
        )
        result = comparison_result(found)
        done = bool(found.ranked) and is_proved and not is_stopped
        designs.deliver(files, comparison_designs(found, result), lambda: result, whole=whole, done=done)
