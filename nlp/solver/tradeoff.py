"""Trade-off curves: the optimum of a case as a function of one of its values, with one solve for each value.

The search at each value starts from the optimum at the previous value and from the case's starting points. A second
pass, backwards, tries the optimum at the next value. So a better optimum that one solve reaches is followed along the
whole curve.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, wraps
from typing import Any, ParamSpec

from ...models import FloatArray
from ..case.case import Case
from ..case.settings import Search
from ..case.varied import Over, axes_of
from ..case.writer import with_settings
from ..errors import InputError, listing
from ..interruption import Milestone, is_requested, reached, seconds_left, why_stopped, within
from ..program.formulation import formulate_tasks
from ..proof.enclosure.engine import kernel
from ..system.deprecated import warn_deprecated
from .certified import Certified, certify
from .compromise import solution_of_one_task
from .multistart import ProgramSolution, solve_program
from .solution import Solution
from .solve import solve_programs

#: Smallest improvement by a neighbour's optimum, relative to the scale of the objective, that is more than rounding.
_BETTER = 1e-9

Given = ParamSpec("Given")


@dataclass(frozen=True, eq=False)
class TradeoffPoint:
    """Optimum at one value.

    Attributes:
        value: value, in the case's unit.
        solution: solution of the case with this value; its status says whether it is an answer.
        certified: certificates of an answer; None if not requested.
    """

    value: float
    solution: Solution
    certified: Certified | None = None


@dataclass(frozen=True, eq=False)
class Tradeoff:
    """Optima of a case as a function of one parameter, bound or limit.

    Attributes:
        name: name of the varied parameter, bound or limit, such as ``limits.leg_length.max``.
        points: optimum at each solved value, in order.
        seconds: wall time.
        unsolved: values that an interrupted command did not solve; empty otherwise.
    """

    name: str
    points: tuple[TradeoffPoint, ...]
    seconds: float
    unsolved: tuple[float, ...] = ()


def _with_earlier_form(tradeoff: Callable[Given, Tradeoff]) -> Callable[Given, Tradeoff]:
    """Decorate a function so that it also takes the arguments of version 0.1.0: ``case_at``, ``values``, ``name``."""

    @wraps(tradeoff)
    def with_both(*args: Given.args, **given: Given.kwargs) -> Tradeoff:
        options: dict[str, Any] = dict(given)
        is_earlier = len(args) > 1 and callable(args[0]) and not isinstance(args[1], Mapping)
        if not (is_earlier or "case_at" in options or "values" in options):
            return tradeoff(*args, **given)
        options |= zip(("case_at", "values"), args, strict=False)
        now = "tradeoff(case, {name: values}), where case is a case or a function from a value to one"
        warn_deprecated("tradeoff(case_at, values, name=...)", now)
        return solve_along(**options)

    return with_both


@_with_earlier_form
def tradeoff(
    case: Case | Callable[[float], Case],
    over: Over,
    *,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    first: Sequence[FloatArray] = (),
    certified: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Tradeoff:
    """Solve a case again for each value of one parameter, bound or limit.

    Args:
        case: the case; or a function from a value to a case, if ``--set`` has no name for the varied quantity. All
            cases have the same free variables.
        over: name of the varied parameter, bound or limit, with its values in the case's unit, as for :func:`sweep`:
            ``{"limits.leg_length.max": [50, 55, 60]}``.
        starts: number of starting points; the case's number if left out.
        seed: seed of the starting points; the case's seed if left out.
        jobs: number of threads; the result does not depend on it.
        first: points (n,) to start from at every value.
        certified: If true, also prove the optimum at each value, in an equal share of the remaining time.
        progress: function to call after each solve of the first pass, with the number of solves done and of all.

    Raises:
        CaseError: the case has nothing of this name, or a value is not allowed; nothing has been solved by then.
        InputError: ``over`` has not exactly one name with values, or the C kernel for a proof was not built.
        UncoveredError: an optimum is to be proved, and an expression has an operation without an interval rule.
    """
    axes = axes_of(over)
    if len(axes) != 1:
        fault = f"over: must name exactly one parameter, bound or limit, got {listing(axes)}"
        raise InputError(f"{fault}; use sweep for several" if axes else fault)
    ((name, values),) = axes.items()
    case_at = case if not isinstance(case, Case) else lambda value: with_settings(case, {name: value})
    return solve_along(
        case_at,
        values.tolist(),
        name=name,
        starts=starts,
        seed=seed,
        jobs=jobs,
        first=first,
        certified=certified,
        progress=progress,
    )


def solve_along(
    case_at: Callable[[float], Case],
    values: Sequence[float],
    *,
    name: str = "number",
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    first: Sequence[FloatArray] = (),
    certified: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Tradeoff:
    """Solve a case again for each value of one parameter, bound or limit.

    Args:
        case_at: function that returns the case with a given value; all of its cases have the same free variables.
        values: values in the case's unit, at least one.
        name: name of the varied parameter, bound or limit.
        starts: number of starting points; the case's number if left out.
        seed: seed of the starting points; the case's seed if left out.
        jobs: number of threads; the result does not depend on it.
        first: points (n,) to start from at every value.
        certified: If true, also prove the optimum at each value, in an equal share of the remaining time.
        progress: function to call after each solve of the first pass, with the number of solves done and of all.

    Raises:
        CaseError: a value is not allowed; nothing has been solved by then.
        InputError: there is no value, or the C kernel for a proof was not built.
        UncoveredError: an optimum is to be proved, and an expression has an operation without an interval rule.
    """
    began = time.perf_counter()
    if certified:
        kernel()  # a missing kernel is reported before any solve
    if not values:
        raise InputError(f"{name}: a trade-off needs one value or more, got none")
    cases = [case_at(value) for value in values]
    solutions: list[Solution] = []
    for done, case in enumerate(cases, 1):
        before = solutions[-1:] and _start_from(solutions[-1])
        found = _whole(partial(_solve, case, case.search.but(starts, seed), [*first, *before], jobs))
        if found is None:
            break
        solutions.append(found)
        reached(Milestone.VALUE)
        if progress is not None:
            progress(done, len(cases))
    if not solutions:
        raise InputError(f"{name}: {why_stopped()} before the first value is solved")
    for k in range(len(solutions) - 2, -1, -1):
        better = _whole(partial(_improved, solutions[k], solutions[k + 1], cases[k].search.but(starts, seed), jobs))
        if better is None:
            break
        solutions[k] = better
    solved, unsolved = values[: len(solutions)], values[len(solutions) :]
    points = tuple(TradeoffPoint(float(value), found) for value, found in zip(solved, solutions, strict=True))
    if certified:
        points = tuple(_certified(point, len(points) - k, jobs) for k, point in enumerate(points))
    return Tradeoff(name, points, time.perf_counter() - began, tuple(map(float, unsolved)))


def _certified(point: TradeoffPoint, left: int, jobs: int | None) -> TradeoffPoint:
    """Certify the answer at a value; the time is an equal share of the remaining time for ``left`` values."""
    if not point.solution.status.is_answer:
        return point
    with within(seconds_left() / left):
        found = certify(point.solution, jobs=jobs)
    # The search of the whole box may find a better design.
    return replace(point, solution=found.solution, certified=found)


def _whole(solve: Callable[[], Solution]) -> Solution | None:
    """Return the solution of a solve; None if a stop is requested before or during the solve.

    An interrupted search has only some of its starts, and its best point is not the optimum of its value.
    """
    found = None if is_requested() else solve()
    return None if is_requested() else found


def _solve(case: Case, search: Search, first: Sequence[FloatArray], jobs: int | None) -> Solution:
    """Solve a case; with a single task, start also from the first points that fit its program."""
    nlps = formulate_tasks(case)
    if len(nlps) > 1:
        return solve_programs(case, nlps, search, jobs=jobs, may_be_fixed=bool(case.changes))
    fitting = [x for x in first if x.size == nlps[0].n]
    return solution_of_one_task(case, solve_program(nlps[0], search, first=fitting, jobs=jobs))


def _start_from(solution: Solution) -> list[FloatArray]:
    """Return the point of an answer as a starting point for the neighbouring values; empty without variables."""
    return [solution.x] if solution.status.is_answer and solution.x.size else []


def _improved(solution: Solution, neighbour: Solution, search: Search, jobs: int | None) -> Solution:
    """Return a solution, or a better one from a search that starts at its neighbour's point."""
    own = solution.outcomes[0].own
    first = [x for x in _start_from(neighbour) if x.size == own.nlp.n]
    if solution.combination is not None or not first:
        return solution
    tried = solve_program(own.nlp, replace(search, starts=1), first=first, jobs=1)
    if not tried.status.is_answer or (solution.status.is_answer and not _is_better(tried, own)):
        return solution
    again = solve_program(own.nlp, search, first=[*first, tried.x], jobs=jobs)
    return solution_of_one_task(solution.case, again)


def _is_better(one: ProgramSolution, other: ProgramSolution) -> bool:
    return one.nlp.sign * (other.F - one.F) > _BETTER * one.nlp.objective_scale
