"""Rounding of a design to multiples of a step, with the best objective among the multiples near each free dimension.

Free lengths and angles of the robot are rounded: lengths in the case's unit, angles in degrees. Plain numbers such as
ratios, directions and the pose stay free, and are solved again with the rounded dimensions. The multiples below and
above each value form a search over listed values (:mod:`.choices`). Where no combination satisfies the limits, the next
multiples on both sides are added.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from decimal import Decimal
from functools import partial
from typing import NamedTuple

import numpy as np

from ...models import Dimension
from ..case.case import Case
from ..case.choices import (
    ChosenDimension,
    catalogue_dimensions,
    values_of_component,
    with_values,
    within_ranges,
)
from ..case.pose import Free, Value
from ..case.task import Method
from ..errors import InputError
from ..evidence.state import RobotState
from .choices import cost_of, solve_choices
from .solution import Rounding, Solution
from .solve import solve
from .status import Status

#: Numbers of additional multiples on each side of the nearest multiples, in the order of the attempts.
_FARTHEST = 3
#: Largest number of solves for each of these: with many dimensions not every combination can be searched.
_MOST = 200
#: Distance from a multiple, in steps, below which it is rounding error.
_EXACT = 1e-9
#: Largest number of steps in a value: beyond it, multiples are not exact.
_STEPS = 1e12


class _Place(NamedTuple):
    """A dimension to round: parameter, component, name, dimension, bounds, value at the solution, index of its task.

    The task is None for a dimension that is the same for all tasks.
    """

    parameter: str
    component: int
    name: str
    dimension: Dimension
    bounds: Free
    value: float
    task: int | None


def round_design(
    solution: Solution,
    step: float,
    *,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    compiled: bool = False,
) -> Solution:
    """Return a solution with rounded lengths and angles of the robot; all other variables are solved again.

    Args:
        solution: answer to a case; a solution without an answer is returned unchanged.
        step: step of the multiples, in the case's unit of length, and in degrees for angles.
        starts: number of starting points of each solve; the case's number if left out.
        seed: seed of the starting points; the case's seed if left out.
        jobs: number of threads; the result does not depend on it.
        compiled: If true, Ipopt calls the objective as compiled C.

    Returns:
        The best known combination of rounded values, with the evidence of any other solution. It has no answer if no
        combination that was tried satisfies the limits.

    Raises:
        InputError: the step is not positive and finite, there is nothing to round, a range has no multiple, or tasks
            are combined by their average.
    """
    case, option = solution.case, f"--round {step:g}"
    check_rounding(case, step)
    if not solution.status.is_answer:
        return solution
    chosen = (
        case if solution.choice is None else within_ranges(case, catalogue_dimensions(case), solution.choice.chosen)
    )
    places = list(_places(chosen, solution))
    solve_fixed = partial(solve, starts=starts, seed=seed, jobs=jobs, compiled=compiled)
    found, farther = solution, 0
    for farther in range(_FARTHEST + 1):
        listed = {
            (each.parameter, each.component, each.task): _multiples(each, step, farther, case, option)
            for each in places
        }
        near = with_values(chosen, listed)
        found = solve_choices(near, solve_fixed, _MOST) if catalogue_dimensions(near) else solve_fixed(near)
        if found.status.is_answer or found.status is Status.INTERRUPTED:
            break
    states = [outcome.state for outcome in found.outcomes]
    numbers = tuple(
        ChosenDimension(
            name=each.name,
            value=_value(states[each.task or 0], each.parameter, each.component, math.nan),
            unit=case.units.label(each.dimension),
            values=None,
            before=each.value,
            dimension=each.dimension,
        )
        for each in places
    )
    rounding = Rounding(step, cost_of(solution), cost_of(found), farther, numbers, found.choice)
    return replace(found, case=case, choice=solution.choice, rounding=rounding, changes=solution.changes)


def check_rounding(case: Case, step: float) -> None:
    """Refuse a step, or a case, for which rounding has no meaning; for errors see :func:`round_design`."""
    option = f"--round {step:g}"
    if not 0 < step < math.inf:
        raise InputError(f"{option}: must be positive and finite")
    if len(case.tasks) > 1 and case.method is Method.AVERAGE:
        raise InputError(
            f"{option}: combine.method must be weighted-sum or worst-case: an average has no best rounding"
        )
    values = [
        (item.dimension, value)
        for item in case.model.parameters
        if not item.is_direction
        for k in range(len(item.components))
        for _, _, value in values_of_component(case, item, k)
    ]
    if not any(_is_rounded(dimension, value) for dimension, value in values):
        raise InputError(f"{option}: the case has no free length or angle of the robot to round")


def _is_rounded(dimension: Dimension, value: Value) -> bool:
    """Return whether a value is rounded: a free length or angle without listed values."""
    return isinstance(value, Free) and not value.values and dimension in (Dimension.LENGTH, Dimension.ANGLE)


def _places(case: Case, solution: Solution) -> Iterator[_Place]:
    """Yield the dimensions to round, with their values at a solution."""
    for item in case.model.parameters:
        for k in range(len(item.components)):
            for task, name, value in values_of_component(case, item, k):
                if not item.is_direction and _is_rounded(item.dimension, value) and isinstance(value, Free):
                    at = _value(solution.outcomes[task or 0].state, item.name, k, value.first)
                    yield _Place(item.name, k, name, item.dimension, value, at, task)


def _value(state: RobotState | None, parameter: str, component: int, otherwise: float) -> float:
    """Return the value of a component of a parameter in a state of the robot; another value without a state."""
    return otherwise if state is None else float(np.ravel(state.parameters[parameter])[component])


def _multiples(place: _Place, step: float, farther: int, case: Case, option: str) -> Value:
    """Return the multiples of a step nearest to a value, and ``farther`` more multiples on each side.

    Raises:
        InputError: there is no multiple within the bounds of the value.
    """
    is_angle = place.dimension is Dimension.ANGLE
    ends = (place.bounds.lower, place.bounds.upper, place.value)
    lower, upper, at = (math.degrees(each) if is_angle else each for each in ends)
    if max(abs(lower), abs(upper)) > _STEPS * step:
        raise InputError(f"{option}: is too small compared with robot.parameters.{place.name}")
    low, high = math.ceil(lower / step - _EXACT), math.floor(upper / step + _EXACT)
    if low > high:
        unit = "deg" if is_angle else case.units.label(place.dimension)
        fault = f"robot.parameters.{place.name} has no multiple of the step between {lower:g} and {upper:g} {unit}"
        raise InputError(f"{option}: {fault}")
    first = min(max(math.floor(at / step + _EXACT), low), high)
    last = min(max(math.ceil(at / step - _EXACT), low), high)
    # A multiple has the decimals of the step: 3 times 0.1 is 0.3.
    shown = [float(k * Decimal(repr(step))) for k in range(max(first - farther, low), min(last + farther, high) + 1)]
    # A bound in degrees may differ from the same multiple by rounding.
    inside = [
        min(max(math.radians(each) if is_angle else each, place.bounds.lower), place.bounds.upper) for each in shown
    ]
    return inside[0] if len(inside) == 1 else Free.among(inside)
