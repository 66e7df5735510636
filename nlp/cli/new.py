"""The command ``new``."""

from __future__ import annotations

from typing import Annotated

import typer

from . import options


def new(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="Name of a robot, or a robot file (.toml).")],
) -> None:
    """Print a commented starter case.

    A case of a robot file belongs in the same folder.
    """
    from pathlib import Path

    from ..case.robots import build_model
    from ..starter.text import starter_case

    if not model.endswith(".toml"):
        typer.echo(starter_case(build_model(model)), nl=False)
        return
    typer.echo(starter_case(options.read_robot(model), Path(model).name), nl=False)
