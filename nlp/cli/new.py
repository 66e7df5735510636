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

    Save a case for a robot file in the folder of that file.
    """
    from pathlib import Path

    from ..case.robots import build_model
    from ..starter.text import starter_case

    if not model.endswith(".toml"):
        sys.stdout.write(starter_case(build_model(model)))
        return
    sys.stdout.write(starter_case(options.read_robot(model), Path(model).name))
