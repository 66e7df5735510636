"""Construction of the result of a solve, from a solution of one task or of several."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

from ..evidence.sensitivity import Sensitivity, sensitivities
from ..program.relaxation import RelaxedLimit
from ..proof.certificate.certificate import Certificate
from ..solver.multistart import ProgramSolution
from ..solver.solution import Combination, SharedInstead, Solution, TaskOutcome
from ..solver.starts import Optimum, StartStatus
from ..system.jsonvalues import finite_or_none, vector
from .choices import ChoiceData, RoundingData, choice_data, rounding_data
from .data import (
    CaseResult,
    ChangeData,
    CombinedData,
    CombinedPointData,
    CombinedResult,
    OptimumData,
    OutcomeData,
    ReachedData,
    SolveResult,
    StartsData,
)
from .design import limits_data, margins_data, tolerance_loss_of
from .evidence import certificate_data, optimality_of
from .objective import objective_data, over_workspace
from .parts import RobotData
from .point import head_data, objective, robot_data, versions, violations

if TYPE_CHECKING:
    from ..solver.certified import Certified
    from ..solver.scheduled import Schedule
    from ..solver.semi_infinite import ExchangeProof
    from .path import PathProofData
    from .schedule import ScheduleData
    from .workspace import WorkspaceProofData


def task_result(
    solution: ProgramSolution,
    task: int = 0,
    certificate: Certificate | None = None,
    workspace: ExchangeProof | None = None,
    path: ExchangeProof | None = None,
    choice: ChoiceData | None = None,
    rounding: RoundingData | None = None,
    schedule: Schedule | None = None,
) -> SolveResult:
    """Return the result of the program of one task.

    Args:
        solution: solution of the program.
        task: index of the task in the case.
        certificate: proved bound of the program; None without a proof.
        workspace: proof over the workspace; None without a proof.
        path: proof along the path; None without a proof.
        choice: choice among listed values; None without listed values.
        rounding: rounding of the dimensions; None if they are not rounded.
        schedule: values that change along the path; None without such values.
    """
    nlp, x, state = solution.nlp, solution.x, solution.state
    answer = solution.status.is_answer
    margins = () if state is None else margins_data(nlp, x, optimal=answer)
    solved = answer and state is not None
    value = objective(nlp, x, state) if solved else math.nan
    proof = workspace or path
    if solved and proof is not None and nlp.case.is_optimised_everywhere:
        value = over_workspace(nlp.case, proof.judgement)
    return SolveResult.of(
        solution,
        head=head_data(nlp.case),
        sense=nlp.sense,
        F=schedule.value if schedule is not None else objective(nlp, x, state) if solved else None,
        objective=objective_data(nlp.case, value if solved else None, certificate),
        reached=None if answer else ReachedData(F=finite_or_none(nlp.evaluate(x)[0]), violated=violations(nlp, x)),
        relaxation=RelaxedLimit.of_each(solution.relaxation, nlp.case.units) or None,
        robot=None if state is None else robot_data(nlp, x, state, task),
        optimality=optimality_of(nlp, solution.evidence),
        margins=margins,
        limits=limits_data(margins),
        sensitivity=Sensitivity.of_each(sensitivities(nlp, x), nlp.case.units) if solved else None,
        tolerance=tolerance_loss_of(nlp, x) if solved else None,
        starts=starts_data(solution),
        certificate=certificate_data(certificate),
        workspace=None if workspace is None else _proof_data(workspace),
        path=None if path is None else _path_data(path),
        choice=choice,
        rounding=rounding,
        schedule=None if schedule is None else _schedule_data(schedule),
        versions=versions(),
    )


def _schedule_data(schedule: Schedule) -> ScheduleData:
    """Return the schedule of a solve."""
    from .schedule import schedule_data  # noqa: PLC0415 - few cases have one

    return schedule_data(schedule)


def _proof_data(workspace: ExchangeProof) -> WorkspaceProofData | None:
    """Return the proof over the workspace."""
    from .workspace import proof_data  # noqa: PLC0415 - few cases have one, and it loads the room of proofs

    return proof_data(workspace)


def _path_data(path: ExchangeProof) -> PathProofData:
    """Return the proof along the path."""
    from .path import path_proof_data  # noqa: PLC0415 - few cases have one, and it loads the room of proofs

    return path_proof_data(path)


def starts_data(solution: ProgramSolution) -> StartsData:
    """Return the outcomes of the starts of a solve, and the distinct optima."""
    ended = Counter(start.status for start in solution.starts)
    reasons = [status for status in StartStatus if status is not StartStatus.CONVERGED and ended[status]]
    return StartsData(
        run=len(solution.starts),
        converged=ended[StartStatus.CONVERGED],
        failed=MappingProxyType({status.value: ended[status] for status in reasons}),
        optima=tuple(_optimum_data(found) for found in solution.optima),
        better=solution.better,
    )


def _optimum_data(found: Optimum) -> OptimumData:
    """Return a distinct optimum."""
    return OptimumData.of(found, assembly=None if found.assembly is None else found.assembly.brief)


def combined_result(
    solution: Solution,
    combination: Combination,
    certificates: Sequence[Certificate] = (),
    combined_certificate: Certificate | None = None,
) -> CombinedResult:
    """Return the result of several tasks.

    Args:
        solution: solution of the case.
        combination: combination of the tasks.
        certificates: proved bounds of the separate tasks; empty without certification.
        combined_certificate: proved bound of the combined program; None without a proof.
    """
    combined, point = combination.combined, _point(solution, combination)
    return CombinedResult(
        head=head_data(solution.case),
        status=solution.status,
        tasks=tuple(
            task_result(
                outcome.exchanged or outcome.own,
                0 if solution.case.changes else j,
                certificates[j] if certificates else None,
            )
            for j, outcome in enumerate(solution.outcomes)
        ),
        combined=CombinedData.of(
            combination,
            value=combination.value if solution.all_solved else None,
            method_point=point if solution.all_solved else None,
            reached=None if solution.all_solved else point,
            tasks=tuple(_outcome(outcome, is_answer=solution.all_solved) for outcome in solution.outcomes),
            optimality=None if combined is None else optimality_of(combined.nlp, combined.evidence),
            starts=None if combined is None else starts_data(combined),
            certificate=certificate_data(combined_certificate),
            settings=_settings(solution) or None,
            changes=tuple(map(_change, solution.changes)) or None,
        ),
        choice=choice_data(solution),
        rounding=rounding_data(solution),
        workspace=None if solution.workspace is None else _proof_data(solution.workspace),
        path=None if solution.path is None else _path_data(solution.path),
        versions=versions(),
        seconds=solution.seconds,
    )


def _point(solution: Solution, combination: Combination) -> CombinedPointData:
    """Return the combined point; without the robot if the loop equations have no solution."""
    own, combined = solution.outcomes[0], combination.combined
    if own.state is None:
        return CombinedPointData(robot=None, margins=None, limits=None)
    # Only a combined program has derivatives of its value with respect to the limits.
    nlp, x = (combination.whole, solution.x) if combined is None else (combined.nlp, combined.x)
    margins = margins_data(nlp, x, optimal=combined is not None and solution.all_solved)
    robot = robot_data(own.own.nlp, own.at, own.state, None)
    return CombinedPointData(robot=robot, margins=margins, limits=limits_data(margins))


def _settings(solution: Solution) -> tuple[RobotData, ...]:
    """Return the robot of each task, if dimensions or the pose change from task to task and all robots exist."""
    states = [outcome.state for outcome in solution.outcomes]
    if not solution.case.changes or any(state is None for state in states):
        return ()
    return tuple(
        robot_data(outcome.own.nlp, outcome.at, outcome.state, 0)
        for outcome in solution.outcomes
        if outcome.state is not None
    )


def _change(shared: SharedInstead) -> ChangeData:
    """Return the gain by a change from task to task."""
    answer = shared.solution if shared.solution is not None and shared.solution.all_solved else None
    combination = None if answer is None else answer.combination
    return ChangeData(
        name=shared.name,
        gain=shared.gain,
        value_shared=None if combination is None else combination.value,
        F_shared=None if answer is None else tuple(outcome.F for outcome in answer.outcomes),
        reason=shared.reason or None,
    )


def _outcome(outcome: TaskOutcome, *, is_answer: bool) -> OutcomeData:
    """Return a task at the combined point; ``F`` is null without an answer, ``best`` without a separate optimum."""
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


def result_of(found: Solution | Certified) -> CaseResult:
    """Return the result of a solve; with certificates if a proof was requested."""
    solution = found if isinstance(found, Solution) else found.solution
    certificates = () if isinstance(found, Solution) else found.tasks
    if solution.combination is None:
        certificate = certificates[0] if certificates else None
        return task_result(
            solution.outcomes[0].own,
            0,
            certificate,
            solution.workspace,
            solution.path,
            choice_data(solution),
            rounding_data(solution),
            solution.schedule,
        )
    combined = None if isinstance(found, Solution) else found.combined
    return combined_result(solution, solution.combination, certificates, combined)
