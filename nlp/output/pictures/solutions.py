"""Drawings of a solution: one for each task."""

from __future__ import annotations

from ....models import frozen_array
from ...case.task import Sense
from ...results.objective import unit_of_objective
from ...solver.solution import Solution, TaskOutcome
from ...solver.status import Status
from ...units import objective_unit
from .drawing import Drawing, drawing_of
from .posture import pose_index, states_at_poses, worst_pose


def drawings_of(solution: Solution, pose: int = 1) -> list[Drawing]:
    """Return the drawings of the robot at one pose: with its task, or at the combined point with each of several tasks.

    Args:
        solution: solution of a case.
        pose: number of the pose, 1 for the first.

    Raises:
        EvaluationError: the robot does not exist at the final point of the solve.
        InputError: the case has no such pose.
    """
    index = pose_index(solution.outcomes[0].own.nlp, pose)
    return [
        drawing_of(
            outcome.own.nlp,
            outcome.at,
            states_at_poses(outcome)[index],
            0 if solution.case.changes else task,
            pose=index,
            headline=_headline_of(solution, outcome) + _pose_words(outcome, index),
            is_answer=solution.status.is_answer,
        )
        for task, outcome in enumerate(solution.outcomes)
    ]


def _headline_of(solution: Solution, outcome: TaskOutcome) -> str:
    """Return the result for one task in one line."""
    if solution.combination is None:
        return _headline(outcome)
    if not solution.all_solved:
        return f"{solution.status.value}: this is not an optimum"
    method, count = solution.combination.method.value, len(solution.outcomes)
    return f"{outcome.task.name}: F = {outcome.F:.7g} {_unit(outcome)}, {method} of {count} tasks"


def _pose_words(outcome: TaskOutcome, index: int) -> str:
    """Return the combination of F over several poses, the shown pose and its F; empty for a single pose."""
    states = states_at_poses(outcome)
    if len(states) == 1:
        return ""
    state, case = states[index], outcome.own.nlp.case
    if outcome.task.measure:
        return f" (largest over {len(states)} poses). Shown: pose {index + 1}"
    own = "" if state is None else f", F = {state.F:.7g}"
    worst = ", worst pose" if worst_pose(states, outcome.task.sense) == index else ""
    return f" ({case.over_poses.value} over {len(states)} poses). Shown: pose {index + 1}{own}{worst}"


def _headline(outcome: TaskOutcome) -> str:
    """Return the result in one line."""
    solution = outcome.own
    if not solution.status.is_answer:
        return f"{solution.status.value}: this is not an optimum"
    value = 0.0 if solution.state is not None and solution.state.is_zero else solution.F
    words = f"F = {value:.7g} {_unit(outcome)}"
    if solution.status is not Status.OPTIMAL:
        return words
    return f"{'largest' if solution.nlp.sense is Sense.MAX else 'smallest'} {words}"


def _unit(outcome: TaskOutcome) -> str:
    """Return the unit of F of a task."""
    case = outcome.own.nlp.case
    if outcome.task.measure:
        return unit_of_objective(case)
    return objective_unit([frozen_array(outcome.task.twist, (6,))], case.units)
