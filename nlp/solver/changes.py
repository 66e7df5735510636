"""Gain by each dimension or pose that changes from task to task.

The same problem is solved with the dimension or the pose shared by all tasks, and the combined objectives are compared.
Only this comparison shows if a drive, a row of holes or a further fixture is worth its price.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..case.case import Case
from ..errors import CaseError, EvaluationError
from ..interruption import is_requested
from .solution import SharedInstead, Solution
from .status import Status


def with_each_shared(case: Case, solve_once: Callable[[Case], Solution]) -> Solution:
    """Solve a case with changes from task to task; then solve it with each of them shared, one at a time.

    Args:
        case: the case.
        solve_once: function that solves a case.
    """
    solution = solve_once(case)
    changes: list[SharedInstead] = []
    for name in case.changes:
        if is_requested() or solution.status is Status.INTERRUPTED:
            break
        changes.append(_shared(solution, name, solve_once))
    return replace(solution, changes=tuple(changes))


def _shared(solution: Solution, name: str, solve_once: Callable[[Case], Solution]) -> SharedInstead:
    """Return the answer to the problem of a solution with one change fewer."""
    try:
        shared = solve_once(solution.case.sharing(name))
    except (CaseError, EvaluationError) as error:
        return SharedInstead(name, None, None, str(error))
    if not shared.status.is_answer:
        return SharedInstead(name, shared, None, f"no answer with {name} shared: {shared.status.value}")
    return SharedInstead(name, shared, _gain(solution, shared))


def _gain(solution: Solution, shared: Solution) -> float | None:
    """Return the relative gain of the combined objective; None without a combined objective."""
    if solution.combination is None or shared.combination is None or not solution.status.is_answer:
        return None
    value, other, decided = solution.combination.value, shared.combination.value, solution.decided_by
    if value is None or other is None or decided is None or other == 0:
        return None
    return -decided.nlp.sign * (value - other) / abs(other)
