"""What is optimised, in words."""

from __future__ import annotations

from ..case.case import Case
from ..case.task import Sense
from ..results.objective import unit_of_objective


def objective_words(case: Case) -> str:
    """Return what is optimised instead of F of the stated poses, in words; empty for that."""
    measure = case.tasks[0].measure
    if not measure:
        is_least = case.tasks[0].sense is Sense.MAX
        worst = f"the {'smallest' if is_least else 'largest'} {case.limits_where}, to be as"
        return f"{worst} {'large' if is_least else 'small'} as possible" if case.worst_everywhere else ""
    over = "actuators" if measure == "actuator_speed" else "actuators and loads"
    return f"the largest {measure.replace('_', ' ')} over all {over}, to be as small as possible"


def objective_label(case: Case, task: int | None = None) -> str:
    """Return F with its unit, for an axis; arguments are those of :func:`unit_of_objective`."""
    unit = unit_of_objective(case, task)
    return f"F, {unit}" if unit else "F"
