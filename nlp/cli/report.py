"""The command ``report``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from .options import CaseName, Jobs, Seed, Starts, check_target


def report(
    case: CaseName,
    out: Annotated[str, typer.Option(metavar="FILE", help="Page to write, such as report.html; - is stdout.")],
    certify: Annotated[
        bool, typer.Option("--certify", help="Prove the optimum too, and show the proof's way.")
    ] = False,
    starts: Starts = None,
    seed: Seed = None,
    jobs: Jobs = None,
) -> None:
    """Solve a case and write a page about it: one file that opens without a network."""
    from ..case.reader import find_case, load_case
    from ..output.files import read_text, write_text
    from ..output.pictures.requirements import check_library
    from .progress import solve_with_progress

    loaded = load_case(case)
    text = read_text(str(find_case(case)))
    loaded = replace(loaded, search=loaded.search.but(starts, seed))
    check_target(out)
    check_library("plotly", "reports")
    check_library("matplotlib", "reports")
    from ..output.report.report import report_of
    from ..output.report.webpage import page_of
    from ..results.regression import check_case
    from ..results.result import result_of

    solution, found, is_proved = solve_with_progress(loaded, jobs, certify=certify)
    result = result_of(found)
    check = check_case(case, {case: result}) if loaded.published else None
    write_text(out, page_of(report_of(text, solution, result, check)))
    if out != "-":
        typer.echo(f"{out}: {solution.status.value}")
    raise typer.Exit(0 if solution.status.is_answer and is_proved else 1)
