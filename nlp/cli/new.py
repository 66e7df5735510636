"""Command ``new``."""

from __future__ import annotations

import sys
from typing import Annotated

from . import options
from .commandline import Argument


def new(
    model: Annotated[str, Argument("MODEL", "Name of a robot, or a robot file (.toml).")],
) -> None:
    """Print a commented starter case.

    A case for a robot file names the file without its folder: save the case in the folder of the robot file.
    """
    from pathlib import Path

    from ..case.robots import build_model
    from ..starter.text import starter_case

    if not model.endswith(".toml"):
        sys.stdout.write(starter_case(build_model(model)))
        return
    sys.stdout.write(starter_case(options.read_robot(model), Path(model).name))
