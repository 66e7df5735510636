"""The result of a solve, of one task or of several."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..solver.solution import Solution
from .combined import combined_result
from .data import CaseResult
from .solution import task_result

if TYPE_CHECKING:
    from ..solver.certified import Certified


def result_of(found: Solution | Certified) -> CaseResult:
    """Return the whole result of a solve, with its certificates where there are any."""
    solution = found if isinstance(found, Solution) else found.solution
    certificates = () if isinstance(found, Solution) else found.tasks
    if solution.combination is None:
        certificate = certificates[0] if certificates else None
        return task_result(solution.outcomes[0].own, 0, certificate, solution.workspace)
    combined = None if isinstance(found, Solution) else found.combined
    return combined_result(solution, solution.combination, certificates, combined)
