"""Arguments and options that several commands share, and the checks of where results go."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from rich.console import Console

    from ..results.jsondata import JsonObject

CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case file, or the bare name of a shipped case.")]
PlotFile = Annotated[
    str | None, typer.Option("--plot", metavar="FILE", help="Draw the robot: a .png, .svg or .pdf file.")
]
JsonFile = Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; - is stdout.")]
Starts = Annotated[int | None, typer.Option(min=1, max=100_000, help="Starting points instead of the case's.")]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed instead of the case's.")]
Jobs = Annotated[int | None, typer.Option(min=1, max=256, help="Threads; the result does not depend on it.")]


def check_outputs(cases: Iterable[str], outputs: Mapping[str, str | None]) -> None:
    """Refuse outputs that cannot be written, that are a case file, or that are each other, before the work begins.

    Args:
        cases: names of the cases that are read.
        outputs: files to write, by the option that names them; None where it is not given.

    Raises:
        InputError: an output is refused.
    """
    from ..case.reader import find_case
    from ..output.files import check_outputs as check

    check([find_case(each) for each in cases], outputs)


def check_picture(target: str | None) -> None:
    """Refuse a picture that cannot be drawn, before the work begins.

    Raises:
        InputError: its ending is no picture's, or Matplotlib is not installed.
    """
    if target is not None:
        from ..output.pictures.requirements import check_picture as check

        check(target)


def write_json(target: str, result: JsonObject) -> None:
    """Write a result as JSON, to standard output for ``-``.

    Raises:
        InputError: it cannot be written.
    """
    import json

    from ..output.files import write_text
    from ..results.jsondata import json_data

    write_text(target, json.dumps(json_data(result), indent=2, allow_nan=False) + "\n")


def console() -> Console:
    """Return standard output for tables."""
    from rich.console import Console

    # Into a file or a pipe, tables are as wide as they need to be.
    return Console(highlight=False, markup=False, emoji=False, width=None if sys.stdout.isatty() else 120)
