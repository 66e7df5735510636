"""Gain by each dimension or pose that changes from task to task.

The same problem is solved with the dimension or the pose shared by all tasks, and the combined objectives are compared.
Only this comparison shows if a drive, a row of holes or a further fixture is worth its price.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from ...models import FloatArray
from ..case.case import Case
from ..errors import CaseError, EvaluationError
from ..interruption import is_requested
from .solution import SharedInstead, Solution

#: Relative loss of the combined objective by a change, above which the search missed a better point.
_WORSE = 1e-7


class SolveOnce(Protocol):
    """A function that solves a case with the settings of the whole solve."""

    def __call__(self, case: Case, *, beside: Sequence[Sequence[FloatArray]] = ()) -> Solution:
        """Solve a case, also from the points ``beside``, each as the point (n,) of every task's program."""
        ...


def with_each_shared(case: Case, solve_once: SolveOnce) -> Solution:
    """Solve a case; then solve it with each change from task to task left out, one at a time.

    An answer with less freedom cannot be better. If a search found a better one, the case is solved again from there.

    Args:
        case: the case.
        solve_once: function that solves a case.
    """
    solution = solve_once(case)
    shared = [_compared(solution, _shared(case, name, solve_once)) for name in case.changes]
    better = [each.solution for each in shared if each.solution and each.gain is not None and each.gain < -_WORSE]
    if better and not is_requested():
        again = solve_once(case, beside=[[outcome.at for outcome in each.outcomes] for each in better])
        if again.status.is_answer:
            solution = again
            shared = [_compared(solution, each) for each in shared]
    return replace(solution, changes=tuple(shared))


def _shared(case: Case, name: str, solve_once: SolveOnce) -> SharedInstead:
    """Return the answer to the problem of a case with one change fewer; its gain is not set."""
    if is_requested():
        return SharedInstead(name, None, None, "the solve was stopped")
    try:
        shared = solve_once(case.sharing(name))
    except (CaseError, EvaluationError) as error:
        return SharedInstead(name, None, None, str(error))
    reason = "" if shared.status.is_answer else f"the solve with {name} shared is {shared.status.value}"
    return SharedInstead(name, shared, None, reason)


def _compared(solution: Solution, shared: SharedInstead) -> SharedInstead:
    """Return an answer with one change fewer, with the gain by this change."""
    return replace(shared, gain=_gain(solution, shared))


def _gain(solution: Solution, shared: SharedInstead) -> float | None:
    """Return the relative gain of the combined objective; None without a combined objective."""
    answer = shared.solution
    if answer is None or shared.reason or not solution.status.is_answer:
        return None
    combination, other, decided = solution.combination, answer.combination, solution.decided_by
    if combination is None or other is None or decided is None or combination.value is None or not other.value:
        return None
    return -decided.nlp.sign * (combination.value - other.value) / abs(other.value)
