"""Trade-off curves: the optimum of a case as a function of one of its numbers, one solve for each value.

The search at each value starts from the optimum at the value before it as well as from the case's starting points; a
second pass, backwards, tries the optimum at the value behind it. So a better family of optima that one solve found is
followed to the others.
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
from ..program.formulation import formulate_each
from ..proof.enclosure.engine import kernel
from ..system.deprecated import warn_deprecated
from .certified import Certified, certify
from .compromise import solution_of_one_task
from .multistart import ProgramSolution, solve_program
from .solution import Solution
from .solve import solve_programs

#: A neighbour's optimum counts as better from this part of the objective's scale on: less is rounding.
_BETTER = 1e-9

Given = ParamSpec("Given")


@dataclass(frozen=True, eq=False)
class TradeoffPoint:
    """The optimum at one value.

    Attributes:
        value: of the number, in the case's unit.
        solution: of the case with this value; its status says whether it is an answer.
        certified: certificates of an answer; None where none were asked for.
    """

    value: float
    solution: Solution
    certified: Certified | None = None


@dataclass(frozen=True, eq=False)
class Tradeoff:
    """Optima of a case over values of one of its numbers.

    Attributes:
        name: of the number, such as ``limits.leg_length.max``.
        points: one for each value that is solved, in order.
        seconds: wall time.
        unsolved: the values after these, which an interrupted command has not solved; none otherwise.
    """

    name: str
    points: tuple[TradeoffPoint, ...]
    seconds: float
    unsolved: tuple[float, ...] = ()


def _with_earlier_form(tradeoff: Callable[Given, Tradeoff]) -> Callable[Given, Tradeoff]:
    """Return the function, which takes its arguments of version 0.1.0 too: ``case_at``, ``values`` and ``name``."""

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
    """Solve a case again for each value of one of its numbers.

    Args:
        case: the case; or a function from a value to a case, for a number that ``--set`` cannot name. All of its cases
            have the same free numbers.
        over: values of the number, in the case's unit, by its name, as for :func:`sweep`:
            ``{"limits.leg_length.max": [50, 55, 60]}``.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads; the result does not depend on it.
        first: points (n,) to start from at every value.
        certified: whether the optimum at each value is proved too, in an equal part of the time left.
        progress: called after each solve of the first pass with the numbers of solves done and of all.

    Raises:
        CaseError: the case has no number of this name, or a value is not allowed; nothing has been solved by then.
        InputError: there is not one number, it has no values, or the C kernel was not built, which a proof needs.
        UncoveredError: an optimum is to be proved, and an expression has an operation without a rule.
    """
    axes = axes_of(over)
    if len(axes) != 1:
        fault = f"over: must have one number for a trade-off curve, got {listing(axes)}"
        raise InputError(f"{fault}; sweep takes several" if axes else fault)
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
    """Solve a case again for each value of one of its numbers.

    Args:
        case_at: returns the case with a value of the number; all of its cases have the same free numbers.
        values: values of the number, in the case's unit, at least one.
        name: name of the number.
        starts: as for :func:`tradeoff`, like all others.
        seed: likewise.
        jobs: likewise.
        first: likewise.
        certified: likewise.
        progress: likewise.

    Raises:
        CaseError: a value is not allowed; nothing has been solved by then.
        InputError: there is no value, or the C kernel was not built, which a proof needs.
        UncoveredError: an optimum is to be proved, and an expression has an operation without a rule.
    """
    began = time.perf_counter()
    if certified:
        kernel()  # before any solve where it is missing
    if not values:
        raise InputError("a trade-off needs at least one value")
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
    """Return an answer with its certificates, in an equal part of the time that so many values share."""
    if not point.solution.status.is_answer:
        return point
    with within(seconds_left() / left):
        found = certify(point.solution, jobs=jobs)
    # The search of the whole box may find a better design.
    return replace(point, solution=found.solution, certified=found)


def _whole(solve: Callable[[], Solution]) -> Solution | None:
    """Return the outcome of a solve; None where the work is requested to stop, before the solve or during it.

    An interrupted search has some of its starts only, and its best point is not the optimum of its value.
    """
    found = None if is_requested() else solve()
    return None if is_requested() else found


def _solve(case: Case, search: Search, first: Sequence[FloatArray], jobs: int | None) -> Solution:
    """Solve a case; one with a single task also from the first points that fit its program."""
    nlps = formulate_each(case)
    if len(nlps) > 1:
        return solve_programs(case, nlps, search, jobs=jobs)
    fitting = [x for x in first if x.size == nlps[0].n]
    return solution_of_one_task(case, solve_program(nlps[0], search, first=fitting, jobs=jobs))


def _start_from(solution: Solution) -> list[FloatArray]:
    """Return the point of an answer with variables, for its neighbours to start from."""
    return [solution.x] if solution.status.is_answer and solution.x.size else []


def _improved(solution: Solution, neighbour: Solution, search: Search, jobs: int | None) -> Solution:
    """Return a solution, or a better one that a search from its neighbour's point finds."""
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
