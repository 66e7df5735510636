"""Several tasks brought together as a result."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..certificate.certificate import Certificate
from ..solve.compromise import Compromise, TaskOutcome
from .data import CombinedData, CombinedPointData, CombinedResult, OutcomeData
from .design import limits_data, margins_data
from .evidence import certificate_data, optimality_data
from .jsondata import vector
from .point import finite, head_data, robot_data, versions
from .solution import result_of, starts_data


def compromise_of(
    compromise: Compromise, certificates: Sequence[Certificate] = (), combined_certificate: Certificate | None = None
) -> CombinedResult:
    """Return the whole result of bringing several tasks together.

    Args:
        compromise: the tasks brought together.
        certificates: of each task by itself, where they were asked for.
        combined_certificate: of the combined program.
    """
    combined, point = compromise.combined, _point(compromise)
    return CombinedResult(
        head=head_data(compromise.case),
        status=compromise.status,
        tasks=tuple(
            result_of(outcome.own, j, certificates[j] if certificates else None)
            for j, outcome in enumerate(compromise.outcomes)
        ),
        combined=CombinedData(
            method=compromise.method,
            value=compromise.value,
            made=point if compromise.is_made else None,
            reached=None if compromise.is_made else point,
            tasks=tuple(_outcome(outcome, answered=compromise.is_made) for outcome in compromise.outcomes),
            violated=compromise.violated,
            notices=compromise.notices,
            optimality=None if combined is None else optimality_data(combined.nlp, combined.evidence),
            starts=None if combined is None else starts_data(combined),
            certificate=certificate_data(combined_certificate),
        ),
        versions=versions(),
        seconds=compromise.seconds,
    )


def _point(compromise: Compromise) -> CombinedPointData:
    """Return the combined point; without the robot, where its equations have no value there."""
    own, combined = compromise.outcomes[0], compromise.combined
    if own.state is None:
        return CombinedPointData(robot=None, margins=None, limits=None)
    # Where one program brought the tasks together, a limit has a cost: of that program's value.
    nlp, x = (own.own.nlp, compromise.x) if combined is None else (combined.nlp, combined.x)
    margins = margins_data(nlp, x, optimal=combined is not None and compromise.is_made)
    robot = robot_data(own.own.nlp, compromise.x, own.state, None)
    return CombinedPointData(robot=robot, margins=margins, limits=limits_data(margins))


def _outcome(outcome: TaskOutcome, *, answered: bool) -> OutcomeData:
    """Return a task at the combined point; without an answer there is no F, without an own optimum no best."""
    best = outcome.own.F if outcome.own.status.is_answer else None
    state = outcome.state if answered else None
    loss = outcome.loss if state is not None and best is not None else math.nan
    return OutcomeData(
        name=outcome.task.name,
        sense=outcome.task.sense,
        weight=outcome.task.weight,
        F=None if state is None else outcome.F,
        best=best,
        loss=finite(loss),
        relative_loss=finite(loss / best) if best else None,
        unique=outcome.unique,
        verdict=outcome.evidence.kind,
        rates=None if state is None else vector(state.rates),
    )
