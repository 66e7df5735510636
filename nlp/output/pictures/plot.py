"""Picture files of solutions and robots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....models import Model
from ...solver.solution import Solution
from ..files import check_target, write_bytes
from .drawing import drawing_of_model
from .requirements import check_picture, ending_of
from .solutions import drawings_of


def plot(found: Solution | Model | Sequence[Model], file: str | Path, *, pose: int = 1) -> None:
    """Draw a solution's robot with its tasks, or robots at their typical values, into a file.

    Args:
        found: a solution, a robot, or several robots, which stand side by side.
        file: name that ends in ``.png``, ``.svg`` or ``.pdf``.
        pose: number of the pose that is drawn, 1 for the first, where the case has several.

    Raises:
        InputError: the ending is another one, Matplotlib is not installed, the file cannot be written, or the case has
            no such pose.
        EvaluationError: the robot does not exist at the point reached, or at its typical values.
    """
    target = str(file)
    check_picture(target)
    check_target(target)
    from .figures import picture  # noqa: PLC0415 - needs Matplotlib, whose absence is reported above

    if isinstance(found, Solution):
        drawings = drawings_of(found, pose)
    else:
        drawings = [drawing_of_model(model) for model in ([found] if isinstance(found, Model) else found)]
    write_bytes(target, picture(drawings, ending_of(target)))
