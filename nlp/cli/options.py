"""Arguments and options that several commands share, and the checks of where results go."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from ..case.overrides import Settings
    from ..results.jsondata import JsonObject

CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case file, or the bare name of a shipped case.")]
PlotFile = Annotated[
    str | None, typer.Option("--plot", metavar="FILE", help="Draw the robot: a .png, .svg or .pdf file.")
]
JsonFile = Annotated[str | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; - is stdout.")]
Starts = Annotated[int | None, typer.Option(min=1, max=100_000, help="Starting points instead of the case's.")]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed instead of the case's.")]
Jobs = Annotated[int | None, typer.Option(min=1, max=256, help="Threads; the result does not depend on it.")]
SettingTexts = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="A number instead of the case's: x4=20, p_z=40, axis=0,0,1."),
]


def read_settings(texts: list[str] | None) -> Settings:
    """Return the numbers that ``--set`` gives, by name; the last counts where one is given twice.

    Raises:
        InputError: a text is neither ``NAME=NUMBER`` nor ``NAME=X,Y,Z``.
    """
    return dict(_read_setting(text) for text in texts or [])


def _read_setting(text: str) -> tuple[str, float | list[float]]:
    """Return the name and the number or numbers of one setting; the error is that of :func:`read_settings`."""
    from ..errors import InputError

    name, equals, value = (part.strip() for part in text.partition("="))
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        numbers = []
    if not (name and equals and numbers):
        raise InputError(f"--set {text}: must be NAME=NUMBER, or axis=X,Y,Z")
    return name, numbers[0] if len(numbers) == 1 else numbers


def check_target(target: str | None) -> None:
    """Refuse a file that cannot be written, before the work begins.

    Raises:
        InputError: it cannot be written.
    """
    from ..output.files import check_target as check

    if target is not None:
        check(target)


def check_picture(target: str | None) -> None:
    """Refuse a picture that cannot be drawn or written, before the work begins.

    Raises:
        InputError: its ending is no picture's, Matplotlib is not installed, or the file cannot be written.
    """
    if target is not None:
        from ..output.pictures.requirements import check_picture as check

        check(target)
        check_target(target)


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
