"""Command ``report``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

from . import options
from .commandline import print_line


def report(
    case: options.CaseName,
    out: Annotated[str, options.file("--out", "HTML file to write, such as report.html; - is stdout")],
    settings: options.SettingTexts = None,
    of: options.ResultFile = None,
    certify: options.Certify = False,
    gap: options.OptimumGap = 1e-4,
    starts: options.Starts = None,
    seed: options.Seed = None,
    jobs: options.Jobs = None,
    _time: options.Time = None,
) -> None:
    """Solve a case, and write an HTML report.

    The report is one file, which opens without a network.
    """
    from ..case.choices import chosen_settings
    from ..case.reader import load_case
    from ..errors import UncoveredError, one_line
    from ..interruption import Milestone, answer_after, is_requested
    from ..output.files import check_outputs, write_text
    from ..output.pictures.requirements import check_library
    from .progress import solve_with_progress

    (loaded, text, inputs), fixed = options.read_changed_case(case, settings, of)
    loaded = replace(loaded, search=loaded.search.but(starts, seed))
    check_outputs(inputs, {"--out": out})
    check_library("plotly", "reports")
    check_library("matplotlib", "reports")
    from ..output.live.embed import live_view_of
    from ..output.report.report import report_of
    from ..output.report.webpage import page_of
    from ..results.checks import check_case
    from ..results.result import result_of
    from ..results.tradeoff import limit_curves

    answer_after(Milestone.START)
    refusal = ""
    try:
        solution, found, is_proved = solve_with_progress(loaded, jobs, certify=certify, gap=gap)
    except UncoveredError as error:
        # The answer is valid without a proof, and the page gives the reason for the missing proof.
        refusal = str(error)
        solution, found, _ = solve_with_progress(loaded, jobs)
        is_proved = False
    result = result_of(found)
    # Published values belong to the case as its file states it.
    is_checked = loaded.published and not fixed and not is_requested()
    check = check_case(case, {case: result}) if is_checked else None
    page = report_of(text, solution, result, check, refusal)
    if page.is_enclosed:
        chosen = chosen_settings(loaded, solution.chosen_case)
        curves = limit_curves(
            solution, result, lambda name, value: load_case(case, {**fixed, **chosen, name: value}), jobs
        )
        page = replace(page, curves=curves)
    write_text(out, page_of(page, live_view_of(solution, case)))
    if out != "-":
        print_line(f"{one_line(out)}: {solution.status.value}{f'; {refusal}' if refusal else ''}")
    raise SystemExit(0 if solution.status.is_answer and is_proved else 1)
