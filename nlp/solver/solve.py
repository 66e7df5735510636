"""Solve of a case with one task or several."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from ...models import FloatArray
from ..case.case import Case
from ..case.choices import catalogue_dimensions
from ..case.settings import Search
from ..errors import CaseError
from ..program.formulation import formulate_everywhere, formulate_tasks
from ..program.nlp import Nlp
from ..program.pairs import with_shared_pairs
from .compromise import combine, solution_of_one_task
from .interface import Solver
from .ipopt import ipopt
from .multistart import ProgramSolution, solve_program
from .solution import Solution
from .status import Phase, PhaseProgress, Status, no_phase

if TYPE_CHECKING:
    from .semi_infinite import SemiInfinite

    Everywhere: TypeAlias = Callable[[Case, Nlp], SemiInfinite]

#: Function to call after each start, with the name of the task or method, the number of starts done, the number of all,
#: and the best objective so far.
SolveProgress = Callable[[str, int, int, float | None], None]


def solve(
    case: Case,
    *,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    compiled: bool = False,
    progress: SolveProgress | None = None,
    solver: Solver = ipopt,
    phase: PhaseProgress = no_phase,
    gap: float | None = None,
) -> Solution:
    """Solve a case: its task, or each of several tasks and then their combination by the method of the case.

    For listed parameter values, the solve chooses the best combination: see :mod:`.choices`. If dimensions or the pose
    change from task to task, the same problem with each of them shared is solved too: see :mod:`.changes`.

    Args:
        case: the case.
        starts: number of starting points; the case's number if left out.
        seed: seed of the starting points; the case's seed if left out.
        jobs: number of threads; the result does not depend on it. If left out, as many as processors and starts allow.
        compiled: If true, Ipopt calls the objective as compiled C.
        progress: function to call after each start.
        solver: local solver that searches from each starting point.
        phase: function to call with the phase of the solve and its progress.
        gap: for a case whose settings change along its path, relative gap to which a bound of all schedules is proved;
            no bound if left out.

    Raises:
        CaseError: the case contradicts itself, or has several tasks and nothing free; or a gap is given without
            settings.
        InputError: the objective is to be compiled, and there is no C compiler or it fails; limits hold over a
            workspace or along a path, and the C kernel for their proof was not built; or the path cannot be read.
    """
    began = time.perf_counter()
    if case.over_path is not None:
        from .schedule.search import solve_schedule  # noqa: PLC0415 - few cases have settings

        own = None if progress is None else partial(progress, case.tasks[0].name)
        return solve_schedule(case, starts=starts, seed=seed, gap=gap, progress=own)
    if gap is not None:
        raise CaseError(
            "objective.as", "is missing: gap is for schedules along a path; use certify", source=case.source
        )
    solve_once = partial(
        _solve, starts=starts, seed=seed, jobs=jobs, compiled=compiled, progress=progress, solver=solver, phase=phase
    )
    if not case.changes:
        return solve_once(case)
    from .changes import with_each_shared  # noqa: PLC0415 - few cases have changes

    solution = with_each_shared(case, partial(solve_once, may_be_fixed=True))
    return replace(solution, seconds=time.perf_counter() - began)


def _solve(
    case: Case,
    *,
    starts: int | None,
    seed: int | None,
    jobs: int | None,
    compiled: bool,
    progress: SolveProgress | None,
    solver: Solver,
    phase: PhaseProgress,
    beside: Sequence[Sequence[FloatArray]] = (),
    may_be_fixed: bool = False,
) -> Solution:
    """Solve a case, without the answers to the same problem with one change fewer; see :func:`solve`."""
    began = time.perf_counter()
    if catalogue_dimensions(case):
        from .choices import solve_choices  # noqa: PLC0415 - few cases have listed values

        solve_fixed = partial(
            _solve,
            starts=starts,
            seed=seed,
            jobs=jobs,
            compiled=compiled,
            progress=progress,
            solver=solver,
            phase=phase,
            may_be_fixed=True,
        )
        return replace(solve_choices(case, solve_fixed), seconds=time.perf_counter() - began)
    search = case.search.but(starts, seed, compiled=compiled)
    phase(Phase.FORMULATING, 0, len(case.tasks))
    everywhere = None
    if case.limits_over:
        # Other solves start without workspaces.
        from .over_path import over_path  # noqa: PLC0415
        from .semi_infinite import check_exchange, over_workspace  # noqa: PLC0415

        check_exchange(case)
        everywhere = over_path if case.limits_over == "path" else over_workspace
    solution = solve_programs(
        case,
        [formulate_everywhere(case)] if case.worst_everywhere else formulate_tasks(case),
        search,
        jobs=jobs,
        progress=progress,
        solver=solver,
        phase=phase,
        everywhere=everywhere,
        beside=beside,
        may_be_fixed=may_be_fixed,
    )
    return replace(solution, seconds=time.perf_counter() - began)


def solve_programs(
    case: Case,
    nlps: Sequence[Nlp],
    search: Search,
    *,
    jobs: int | None = None,
    progress: SolveProgress | None = None,
    solver: Solver = ipopt,
    phase: PhaseProgress = no_phase,
    everywhere: Everywhere | None = None,
    beside: Sequence[Sequence[FloatArray]] = (),
    may_be_fixed: bool = False,
) -> Solution:
    """Solve a case from the formulated program of each of its tasks.

    Args:
        case: the case.
        nlps: nonlinear program of each task, in order.
        search: number of starts, seed and settings of the solver.
        jobs: number of threads; see :func:`solve`.
        progress: function to call after each start.
        solver: local solver that searches from each starting point.
        phase: function to call with the phase of the solve and its progress.
        everywhere: function that adds limits over a workspace or along a path to a program with limits at the stated
            poses; None without such limits.
        beside: further starting points of several tasks; see :func:`.combine`.
        may_be_fixed: If true, several tasks without a free variable are combined too, as for a choice of all values.

    Raises:
        CaseError: the case has several tasks and nothing free.
        InputError: same reasons as for :func:`solve`.
    """
    began = time.perf_counter()

    def solve_one(name: str, nlp: Nlp, first: Sequence[FloatArray] = ()) -> ProgramSolution:
        after_start = None if progress is None else partial(progress, name)
        return solve_program(nlp, search, first=first, jobs=jobs, progress=after_start, solver=solver, phase=phase)

    proof: dict[str, Any] = {}

    def solve_everywhere(case: Case, name: str, nlp: Nlp, first: Sequence[FloatArray] = ()) -> ProgramSolution:
        if everywhere is None:
            return solve_one(name, nlp, first)
        from .semi_infinite import exchanged  # noqa: PLC0415 - see solve

        found, proof[case.limits_over] = exchanged(everywhere(case, nlp), partial(solve_one, name), first)
        return found

    if len(nlps) > 1 and not may_be_fixed and all(nlp.is_fixed for nlp in nlps):
        raise CaseError("robot", "has no free variable, so several tasks cannot be combined", source=case.source)
    if len(nlps) == 1:
        found = solve_everywhere(case, case.tasks[0].name, nlps[0])
        return replace(solution_of_one_task(case, found), **proof)
    own: list[ProgramSolution] = []
    notices: list[str] = []
    for j, (nlp, task) in enumerate(zip(nlps, case.tasks, strict=True)):
        alone = case.of_task(j) if case.changes else replace(case, tasks=(task,))
        own.append(solve_everywhere(alone, task.name, nlp))
        if any(each is not None and not each.is_proved for each in proof.values()):
            notices.append(f"the optimum of {task.name!r} by itself is not proved {case.limits_where}")
    proof.clear()  # only the proof of the combined design counts
    if case.changes:
        nlps = [solution.nlp for solution in own]  # each with the pairs of its own poses
    else:
        nlps = with_shared_pairs(nlps, [place for solution in own for place in solution.nlp.pairs])
    polish = partial(solve_program, search=replace(search, starts=1), jobs=1, solver=solver)
    solve_combined = partial(solve_everywhere, case)
    if everywhere is None:
        solution = combine(case, nlps, own, solve_combined, polish, beside)
    else:
        stated = [_at_stated_poses(solution, nlp) for solution, nlp in zip(own, nlps, strict=True)]
        solution = _with_exchanged(combine(case, nlps, stated, solve_combined, polish), own, notices)
    return replace(solution, seconds=time.perf_counter() - began, **proof)


def _at_stated_poses(found: ProgramSolution, nlp: Nlp) -> ProgramSolution:
    """Return a solution found with the exchange's added poses as a solution of the program with stated poses only."""
    starts = tuple(replace(each, x=each.x[: nlp.n]) for each in found.starts)
    optima = tuple(replace(each, x=each.x[: nlp.n], nlp=nlp) for each in found.optima)
    # Only the combined design needs a proof: a separate optimum without proof is combined too, with a notice.
    status = Status.OPTIMAL if found.status is Status.NOT_PROVED else found.status
    return replace(found, status=status, nlp=nlp, x=found.x[: nlp.n], starts=starts, optima=optima)


def _with_exchanged(solution: Solution, own: Sequence[ProgramSolution], notices: Sequence[str]) -> Solution:
    """Return a solution of several tasks with each task's program after the exchange, and with further notices.

    Evidence for one task at the combined point is left out: its program would lack the poses of the exchange.
    """
    combination = solution.combination
    return replace(
        solution,
        outcomes=tuple(
            replace(outcome, exchanged=found, evidence=None)
            for outcome, found in zip(solution.outcomes, own, strict=True)
        ),
        combination=combination and replace(combination, notices=(*combination.notices, *notices)),
    )
