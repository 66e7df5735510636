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


def plot(subject: Solution | Model | Sequence[Model], file: str | Path, *, pose: int = 1) -> None:
    """Draw the robot of a solution with its tasks, or robots at their typical dimensions, into a file.

    Args:
        subject: solution, robot, or several robots for a picture side by side.
        file: path with the extension ``.png``, ``.svg`` or ``.pdf``.
        pose: number of the drawn pose of a case with several poses, 1 for the first.

    Raises:
        InputError: the extension is unknown, Matplotlib is not installed, the file cannot be written, or the case has
            no such pose.
        EvaluationError: the robot does not exist at the final point of the solve, or at its typical dimensions.
    """
    target = str(file)
    check_picture(target)
    check_target(target)
    from .figures import picture  # noqa: PLC0415 - needs Matplotlib, whose absence is reported above

    if isinstance(subject, Solution):
        drawings = drawings_of(subject, pose)
    else:
        drawings = [drawing_of_model(model) for model in ([subject] if isinstance(subject, Model) else subject)]
    write_bytes(target, picture(drawings, ending_of(target)))
