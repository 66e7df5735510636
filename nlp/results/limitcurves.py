"""Trade-off curves over the active limits of a solution."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..case.case import Case
from ..errors import CaseError
from ..interruption import is_requested
from ..solver.solution import Solution
from ..solver.tradeoff import tradeoff
from .data import CaseResult, SolveResult
from .rounding import ordered
from .tradeoff import TradeoffResult, tradeoff_result

#: Range of a curve to each side of the limit, as a part of it; number of values, odd so that the limit is among them.
_REACH, _VALUES = 0.1, 7
#: Curves of one solution at most, those of the costliest limits; starting points of each solve beside its neighbours'.
_CURVES, _STARTS = 3, 4


def limit_curves(
    solution: Solution, result: CaseResult, case_at: Callable[[str, float], Case], jobs: int | None = None
) -> tuple[TradeoffResult, ...]:
    """Solve again along the costliest active limits of an answer to a case with one task.

    Args:
        solution: the answer.
        result: of the same solve.
        case_at: returns the case with a number by name, such as ``limits.leg_length.max``, and its value.
        jobs: number of threads; the result does not depend on it.

    Returns:
        A curve for each of these limits; none where there is no answer, or where there are several tasks.
    """
    if not isinstance(result, SolveResult) or not solution.status.is_answer:
        return ()
    active = [row for row in result.limits if row.active and row.cost]
    active.sort(key=lambda row: -ordered(abs((row.cost or 0.0) * row.limit)))
    curves = []
    for row in active[:_CURVES]:
        name = f"limits.{row.key}"

        def at(value: float, name: str = name) -> Case:
            return case_at(name, value)

        values = [value for value in _values_about(row.limit) if _is_allowed(at, value)]
        if len(values) > 1:
            starts = min(_STARTS, solution.case.search.starts)
            found = tradeoff(at, values, name=name, starts=starts, jobs=jobs, first=[solution.x])
            if is_requested():  # only whole curves are shown
                break
            curves.append(tradeoff_result(found))
    return tuple(curves)


def _values_about(limit: float) -> list[float]:
    """Return values about a limit, the limit itself among them and without its rounding."""
    steps = np.linspace(-_REACH, _REACH, _VALUES)
    return [limit if k == _VALUES // 2 else float(limit * (1 + step)) for k, step in enumerate(steps)]


def _is_allowed(case_at: Callable[[float], Case], value: float) -> bool:
    """Return whether there is a case with a value: some limits cannot be this large, or cross others."""
    try:
        case_at(value)
    except CaseError:
        return False
    return True
