"""Picture files of solutions and robots."""

from __future__ import annotations

from pathlib import Path

from ....models import Model
from ...solver.solution import Solution
from ..files import check_target, write_bytes
from .drawing import drawing_of_model
from .requirements import check_picture, ending_of
from .solutions import drawings_of


def plot(found: Solution | Model, file: str | Path) -> None:
    """Draw a solution's robot with its tasks, or a robot at its typical values, into a file.

    Args:
        found: a solution, or a robot.
        file: name that ends in ``.png``, ``.svg`` or ``.pdf``.

    Raises:
        InputError: the ending is another one, Matplotlib is not installed, or the file cannot be written.
        EvaluationError: the robot does not exist at the point reached, or at its typical values.
    """
    target = str(file)
    check_picture(target)
    check_target(target)
    from .figures import picture  # noqa: PLC0415 - needs Matplotlib, whose absence is reported above

    drawings = [drawing_of_model(found)] if isinstance(found, Model) else drawings_of(found)
    write_bytes(target, picture(drawings, ending_of(target)))
