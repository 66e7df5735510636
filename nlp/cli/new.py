"""The command ``new``."""

from __future__ import annotations

from typing import Annotated

import typer


def new(
    model: Annotated[str, typer.Argument(metavar="MODEL", help="Name of a robot, or a robot file (.toml).")],
) -> None:
    """Print a commented starter case.

    For example: screwsynth new stewart-gough > my-robot.toml. A case of a robot file belongs in the same folder.
    """
    from pathlib import Path

    from ..case.robots import build_model
    from ..case.starter import starter_case

    if not model.endswith(".toml"):
        typer.echo(starter_case(build_model(model)), nl=False)
        return
    from ..case.robotfile import model_of_definition, read_definition

    built = model_of_definition(read_definition(model, Path()), model)
    typer.echo(starter_case(built, Path(model).name), nl=False)
