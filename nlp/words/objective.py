"""Objective in words."""

from __future__ import annotations

from ..case.case import Case
from ..case.task import LEG_LENGTH, SMALLEST, Sense
from ..results.objective import unit_of_objective


def objective_words(case: Case) -> str:
    """Return the objective in words; empty for F at the stated poses."""
    measure = case.tasks[0].measure
    if not measure:
        is_least = case.tasks[0].sense is Sense.MAX
        worst = f"the {'smallest' if is_least else 'largest'} value {case.limits_where}"
        return f"{worst} ({'maximised' if is_least else 'minimised'})" if case.worst_everywhere else ""
    if measure == LEG_LENGTH:
        return "the length of the longest leg (minimised)"
    if measure == SMALLEST:
        length = f"{case.tasks[0].length:g} {case.units.length}"
        return f"the smallest singular value of J, with moments divided by {length} (maximised)"
    over = "actuators" if measure == "actuator_speed" else "actuators and loads"
    return f"the largest {measure.replace('_', ' ')} over all {over} (minimised)"


def objective_label(case: Case, task: int | None = None) -> str:
    """Return the label of an axis: F with its unit. The arguments are those of :func:`unit_of_objective`."""
    unit = unit_of_objective(case, task)
    return f"F, {unit}" if unit else "F"
