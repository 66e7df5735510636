"""A solution of one program as a result."""

from __future__ import annotations

from collections import Counter
from types import MappingProxyType
from typing import TYPE_CHECKING

from ..proof.certificate.certificate import Certificate
from ..solver.multistart import ProgramSolution
from ..solver.starts import Optimum, StartStatus
from .data import OptimumData, ReachedData, SolveResult, StartsData
from .design import limits_data, margins_data, relaxation_data, sensitivity_data, tolerance_data
from .evidence import certificate_data, optimality_data
from .jsondata import finite_or_none
from .point import head_data, objective, robot_data, versions, violations

if TYPE_CHECKING:
    from ..solver.semi_infinite import WorkspaceProof
    from .workspace import WorkspaceProofData


def task_result(
    solution: ProgramSolution,
    task: int = 0,
    certificate: Certificate | None = None,
    workspace: WorkspaceProof | None = None,
) -> SolveResult:
    """Return the whole result of the program of one task.

    Args:
        solution: of the program.
        task: index of that task in the case.
        certificate: of the same program.
        workspace: proof over the workspace.
    """
    nlp, x, state = solution.nlp, solution.x, solution.state
    answer = solution.status.is_answer
    margins = () if state is None else margins_data(nlp, x, optimal=answer)
    solved = answer and state is not None
    return SolveResult.of(
        solution,
        head=head_data(nlp.case),
        sense=nlp.sense,
        F=objective(nlp, x, state) if solved else None,
        reached=None if answer else ReachedData(F=finite_or_none(nlp.evaluate(x)[0]), violated=violations(nlp, x)),
        relaxation=relaxation_data(nlp, solution.relaxation),
        robot=None if state is None else robot_data(nlp, x, state, task),
        optimality=optimality_data(nlp, solution.evidence),
        margins=margins,
        limits=limits_data(margins),
        sensitivity=sensitivity_data(nlp, x) if solved else None,
        tolerance=tolerance_data(nlp, x) if solved else None,
        starts=starts_data(solution),
        certificate=certificate_data(certificate),
        workspace=None if workspace is None else _proof_data(workspace),
        versions=versions(),
    )


def _proof_data(workspace: WorkspaceProof) -> WorkspaceProofData | None:
    """Return the proof over the workspace."""
    from .workspace import proof_data  # noqa: PLC0415 - few cases have one, and it loads the room of proofs

    return proof_data(workspace)


def starts_data(solution: ProgramSolution) -> StartsData:
    """Return how the starts of a solve ended, and the distinct optima."""
    ended = Counter(start.status for start in solution.starts)
    reasons = [status for status in StartStatus if status is not StartStatus.CONVERGED and ended[status]]
    return StartsData(
        run=len(solution.starts),
        converged=ended[StartStatus.CONVERGED],
        failed=MappingProxyType({status.value: ended[status] for status in reasons}),
        optima=tuple(_optimum_data(found) for found in solution.optima),
    )


def _optimum_data(found: Optimum) -> OptimumData:
    """Return a distinct optimum."""
    return OptimumData.of(found, assembly=None if found.assembly is None else found.assembly.brief)
