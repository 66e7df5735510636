"""Arguments and options that several commands share, and checks of the files for results."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
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


def check_target(target: str | None) -> None:
    """Refuse a file that cannot be written, before the work begins.

    Raises:
        InputError: the file cannot be written.
    """
    from ..output.files import check_target as check

    if target is not None:
        check(target)


def check_picture(target: str | None) -> None:
    """Refuse a picture that cannot be drawn or written, before the work begins.

    Raises:
        InputError: the name's ending is no picture's, Matplotlib is not installed, or the file cannot be written.
    """
    if target is not None:
        from ..output.pictures.requirements import check_picture as check

        check(target)
        check_target(target)


def write_json(target: str, result: JsonObject) -> None:
    """Write a result as JSON, to standard output for ``-``.

    Raises:
        InputError: the file cannot be written.
    """
    import json

    from ..output.files import write_text
    from ..results.jsondata import json_data

    write_text(target, json.dumps(json_data(result), indent=2, allow_nan=False) + "\n")


def console() -> Console:
    """Return a console on standard output for lines and tables."""
    from rich.console import Console

    # In a file or a pipe, a table is as wide as its content.
    return Console(highlight=False, markup=False, emoji=False, width=None if sys.stdout.isatty() else 120)
