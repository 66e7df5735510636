"""Drawings of a solution: one for a single task, one for each task of a compromise."""

from __future__ import annotations

from ...case.task import Sense
from ...solver.multistart import ProgramSolution
from ...solver.solution import Solution
from ...solver.status import Status
from .drawing import Drawing, drawing_of


def drawings_of(found: Solution) -> list[Drawing]:
    """Return the robot with its task, or at the combined point with each of several tasks; at the first of its poses.

    Raises:
        EvaluationError: the robot does not exist at the point reached.
    """
    if found.combination is None:
        headline = _headline(found.outcomes[0].own)
        return [drawing_of(found.nlp, found.x, found.state, headline=headline, is_answer=found.status.is_answer)]
    method = found.combination.method.value
    drawings = []
    for task, outcome in enumerate(found.outcomes):
        if found.all_solved:
            headline = f"{outcome.task.name}: F = {outcome.F:.7g}, {method} of {len(found.outcomes)} tasks"
        else:
            headline = f"{found.status.value}: this is not what was asked for"
        drawing = drawing_of(
            outcome.own.nlp, found.x, outcome.state, task, headline=headline, is_answer=found.status.is_answer
        )
        drawings.append(drawing)
    return drawings


def _headline(solution: ProgramSolution) -> str:
    """Return the result in one line."""
    if not solution.status.is_answer:
        return f"{solution.status.value}: this is not an optimum"
    value = 0.0 if solution.state is not None and solution.state.is_zero else solution.F
    if solution.status is not Status.OPTIMAL:
        return f"F = {value:.7g}"
    word = "largest" if solution.nlp.sense is Sense.MAX else "smallest"
    return f"{word} F = {value:.7g}"
