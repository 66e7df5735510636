"""The robot at each of a case's poses, and the worst of them."""

from __future__ import annotations

from collections.abc import Sequence

from ....models import FloatArray
from ...case.task import Sense
from ...errors import EvaluationError, InputError
from ...evidence.state import RobotState, evaluate
from ...program.epigraph import worst_value
from ...program.nlp import Nlp
from ...solver.solution import TaskOutcome


def pose_index(nlp: Nlp, pose: int) -> int:
    """Return the index of a pose from its number, 1 for the first.

    Raises:
        InputError: the case has no such pose.
    """
    count = len(nlp.program.robots)
    if not 1 <= pose <= count:
        allowed = "the only pose is 1" if count == 1 else f"it must be 1 to {count}"
        raise InputError(f"{nlp.case.source or nlp.case.name}: pose {pose} does not exist: {allowed}")
    return pose - 1


def states_at_poses(outcome: TaskOutcome) -> list[RobotState | None]:
    """Return the robot of a task's outcome at every pose; None where it does not exist."""
    nlp, x = outcome.own.nlp, outcome.x
    return [outcome.state, *(state_at_pose(nlp, x, k) for k in range(1, len(nlp.program.robots)))]


def worst_pose(states: Sequence[RobotState | None], sense: Sense) -> int | None:
    """Return the index of the pose with the worst F; None where there is one pose, or no F at some pose."""
    values = [state.F for state in states if state is not None]
    if len(values) < max(2, len(states)):
        return None
    return values.index(worst_value(values, sense))


def state_at_pose(nlp: Nlp, x: FloatArray, pose: int) -> RobotState | None:
    """Return the robot at a point (n,) and one of its poses; None where it does not exist."""
    try:
        return evaluate(nlp, x, pose)
    except EvaluationError:
        return None
