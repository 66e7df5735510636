"""The command ``new``."""

from __future__ import annotations

from typing import Annotated

import typer


def new(model: Annotated[str, typer.Argument(metavar="MODEL", help="Name of a robot.")]) -> None:
    """Print a commented case file to begin with.

    For example: screwsynth new stewart-gough > my-robot.toml.
    """
    from ..case.robots import build_model
    from ..case.starter import starter_case

    typer.echo(starter_case(build_model(model)), nl=False)
