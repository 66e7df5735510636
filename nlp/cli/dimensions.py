"""Dimensions of a robot from a result, as settings of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..case.overrides import Settings


def settings_of_result(file: str) -> Settings:
    """Return the dimensions that a result of ``solve`` or ``evaluate`` holds.

    Raises:
        InputError: the file cannot be read, is no result, or holds no dimensions.
    """
    from ..errors import InputError
    from ..results.data import CombinedResult, SolveResult
    from ..results.evaluation import EvaluationResult
    from ..results.reading import load_result

    result = load_result(file)
    robot = None
    if isinstance(result, SolveResult | EvaluationResult):
        robot = result.robot
    elif isinstance(result, CombinedResult) and result.combined.method_point is not None:
        robot = result.combined.method_point.robot
    if robot is None:
        raise InputError(f"--of {file}: holds no dimensions: it must be the result of a solve with an answer")
    return {name: value if isinstance(value, float | int) else list(value) for name, value in robot.parameters.items()}
