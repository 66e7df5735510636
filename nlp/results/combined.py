"""A solution of several tasks as a result."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..proof.certificate.certificate import Certificate
from ..solver.solution import Combination, Solution, TaskOutcome
from .data import CombinedData, CombinedPointData, CombinedResult, OutcomeData
from .design import limits_data, margins_data
from .evidence import certificate_data, optimality_data
from .jsondata import finite_or_none, vector
from .point import head_data, robot_data, versions
from .solution import starts_data, task_result


def combined_result(
    solution: Solution,
    combination: Combination,
    certificates: Sequence[Certificate] = (),
    combined_certificate: Certificate | None = None,
) -> CombinedResult:
    """Return the whole result of several tasks.

    Args:
        solution: of the case.
        combination: the combination of the tasks.
        certificates: of each task by itself; empty without certification.
        combined_certificate: of the combined program.
    """
    combined, point = combination.combined, _point(solution, combination)
    return CombinedResult(
        head=head_data(solution.case),
        status=solution.status,
        tasks=tuple(
            task_result(outcome.own, j, certificates[j] if certificates else None)
            for j, outcome in enumerate(solution.outcomes)
        ),
        combined=CombinedData.of(
            combination,
            method_point=point if solution.all_solved else None,
            reached=None if solution.all_solved else point,
            tasks=tuple(_outcome(outcome, is_answer=solution.all_solved) for outcome in solution.outcomes),
            optimality=None if combined is None else optimality_data(combined.nlp, combined.evidence),
            starts=None if combined is None else starts_data(combined),
            certificate=certificate_data(combined_certificate),
        ),
        versions=versions(),
        seconds=solution.seconds,
    )


def _point(solution: Solution, combination: Combination) -> CombinedPointData:
    """Return the combined point; without the robot, where its equations have no value there."""
    own, combined = solution.outcomes[0], combination.combined
    if own.state is None:
        return CombinedPointData(robot=None, margins=None, limits=None)
    # Only a combined program gives a limit a cost, which is that of the program's value.
    nlp, x = (own.own.nlp, solution.x) if combined is None else (combined.nlp, combined.x)
    margins = margins_data(nlp, x, optimal=combined is not None and solution.all_solved)
    robot = robot_data(own.own.nlp, solution.x, own.state, None)
    return CombinedPointData(robot=robot, margins=margins, limits=limits_data(margins))


def _outcome(outcome: TaskOutcome, *, is_answer: bool) -> OutcomeData:
    """Return a task at the combined point; ``F`` is absent without an answer, ``best`` without an own optimum."""
    best = outcome.own.F if outcome.own.status.is_answer else None
    state = outcome.state if is_answer else None
    loss = outcome.loss if state is not None and best is not None else math.nan
    return OutcomeData.of(
        outcome.task,
        F=None if state is None else outcome.F,
        best=best,
        loss=finite_or_none(loss),
        relative_loss=finite_or_none(loss / best) if best else None,
        unique=outcome.unique,
        verdict=None if outcome.evidence is None else outcome.evidence.kind,
        rates=None if state is None else vector(state.rates),
    )
