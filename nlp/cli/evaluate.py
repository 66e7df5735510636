"""The command ``evaluate``."""

from __future__ import annotations

from typing import Annotated

import typer

from .options import CaseName, JsonFile, check_target, console, write_json


def evaluate(
    case: CaseName,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="A number instead of the case's: x4=20, p_z=40, axis=0,0,1."),
    ] = None,
    json_file: JsonFile = None,
) -> None:
    """Show F, J, rank and rates at one point; nothing is optimised.

    What is free stands at its start, or in the middle of its range.
    """
    from ..case.reader import load_case
    from ..evidence import state
    from ..evidence.kkt import close_equations
    from ..program.epigraph import with_exact_level
    from ..program.formulation import formulate_each
    from ..results.evaluation import evaluation_of

    loaded = load_case(case, dict(_parse_setting(text) for text in settings or []))
    check_target(json_file)
    nlps = formulate_each(loaded)
    x = with_exact_level(nlps[0], close_equations(nlps[0], nlps[0].start))
    result = evaluation_of(nlps, x, [state.evaluate(nlp, x) for nlp in nlps])
    if json_file is not None:
        write_json(json_file, result)
    if json_file != "-":
        from ..output.terminal import show
        from ..results.summary import evaluation_summary

        show(console(), evaluation_summary(loaded, result))
    raise typer.Exit(1 if result.violated else 0)


def _parse_setting(text: str) -> tuple[str, float | list[float]]:
    """Read ``NAME=NUMBER`` or ``NAME=X,Y,Z``.

    Raises:
        InputError: the text is neither.
    """
    from ..errors import InputError

    name, equals, value = (part.strip() for part in text.partition("="))
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if not (name and equals and numbers):
        raise InputError(f"--set {text}: must be NAME=NUMBER, or axis=X,Y,Z")
    return name, numbers[0] if len(numbers) == 1 else numbers
