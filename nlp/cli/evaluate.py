"""The command ``evaluate``."""

from __future__ import annotations

import typer

from .options import (
    CaseName,
    CsvFile,
    CsvTable,
    JsonFile,
    Outputs,
    SettingTexts,
    check_csv,
    console,
    read_settings,
    write_csv,
    write_json,
)


def evaluate(
    case: CaseName,
    settings: SettingTexts = None,
    json_file: JsonFile = None,
    csv_file: CsvFile = None,
    table: CsvTable = None,
) -> None:
    """Show F, J, rank and rates at one point.

    Nothing is optimised. Free numbers are at their starts, or in the middle of their ranges.
    """
    from ..case.reader import read_case
    from ..evidence import state
    from ..evidence.closing import closed_start
    from ..program.epigraph import with_exact_level
    from ..program.formulation import formulate_each
    from ..results.evaluation import evaluation_of

    given = read_case(case, read_settings(settings))
    loaded = given.case
    files = Outputs(json=json_file, csv=csv_file)
    files.check(given.inputs)
    check_csv(csv_file, table, loaded, at_point=True)
    nlps = formulate_each(loaded)
    x = with_exact_level(nlps[0], closed_start(nlps[0]))
    result = evaluation_of(nlps, x, [state.evaluate(nlp, x) for nlp in nlps])
    write_json(json_file, result)
    if csv_file is not None:
        from ..results.summary import evaluation_tables

        write_csv(csv_file, evaluation_tables(loaded, result), table)
    if not files.is_piped:
        from ..output.terminal import show
        from ..results.summary import evaluation_summary

        show(console(), evaluation_summary(loaded, result))
    raise typer.Exit(1 if result.violated else 0)
