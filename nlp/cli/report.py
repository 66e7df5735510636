"""The command ``report``."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from .options import CaseName, Jobs, Seed, Starts, check_outputs


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
    from ..case.reader import case_text, load_case
    from ..errors import UncoveredError, one_line
    from ..output.files import write_text
    from ..output.pictures.requirements import check_library
    from .progress import solve_with_progress

    loaded = load_case(case)
    text = case_text(case)
    loaded = replace(loaded, search=loaded.search.but(starts, seed))
    check_outputs([case], {"--out": out})
    check_library("plotly", "reports")
    from ..output.report.report import report_of
    from ..output.report.webpage import page_of
    from ..results.regression import check_case
    from ..results.result import result_of

    refusal = ""
    try:
        solution, found, is_proved = solve_with_progress(loaded, jobs, certify=certify)
    except UncoveredError as error:
        # The answer stands without a proof, and the page says why there is none.
        refusal = str(error)
        solution, found, _ = solve_with_progress(loaded, jobs)
        is_proved = False
    result = result_of(found)
    check = check_case(case, {case: result}) if loaded.published else None
    write_text(out, page_of(report_of(text, solution, result, check, refusal)))
    if out != "-":
        typer.echo(f"{one_line(out)}: {solution.status.value}{f'; {refusal}' if refusal else ''}")
    raise typer.Exit(0 if solution.status.is_answer and is_proved else 1)
