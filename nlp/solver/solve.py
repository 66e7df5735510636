"""The solve of a case, with one task or several."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from ...models import FloatArray
from ..case.case import Case
from ..case.settings import Search
from ..errors import CaseError
from ..program.formulation import formulate_each
from ..program.nlp import Nlp
from ..program.pairs import with_shared_pairs
from .compromise import combine, solution_of_one_task
from .interface import Solver
from .ipopt import ipopt
from .multistart import ProgramSolution, solve_program
from .solution import Solution
from .status import Phase, PhaseProgress, no_phase

#: Called after each start with the task or method that is being solved, the number of starts done, the number of all,
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
) -> Solution:
    """Solve a case: its task, or each of several and then all of them by the method that the case names.

    Args:
        case: the case.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads; the result does not depend on it. Left out, as many as there are processors and work.
        compiled: whether Ipopt calls the objective as compiled C.
        progress: called after each start.
        solver: the local solver that searches from each starting point.
        phase: called with the phase of the solve, and how far it is.

    Raises:
        CaseError: the case contradicts itself, or has several tasks and nothing free.
        InputError: the objective is to be compiled, and there is no C compiler or it fails; or limits hold over a
            workspace or along a path, which needs a proof, and the C kernel was not built; or the path cannot be read.
    """
    began = time.perf_counter()
    search = case.search.but(starts, seed, compiled=compiled)
    phase(Phase.FORMULATING, 0, len(case.tasks))
    if case.limits_over:
        # Other solves start without workspaces.
        from .over_path import solve_over_path  # noqa: PLC0415
        from .semi_infinite import solve_over_workspace  # noqa: PLC0415

        after_start = None if progress is None else partial(progress, case.tasks[0].name)

        def solve_one(nlp: Nlp, first: Sequence[FloatArray]) -> ProgramSolution:
            return solve_program(nlp, search, first=first, jobs=jobs, progress=after_start, solver=solver, phase=phase)

        if case.limits_over == "path":
            own, along = solve_over_path(case, solve_one)
            solution = replace(solution_of_one_task(case, own), path=along)
        else:
            own, proof = solve_over_workspace(case, solve_one)
            solution = replace(solution_of_one_task(case, own), workspace=proof)
    else:
        nlps = formulate_each(case)
        solution = solve_programs(case, nlps, search, jobs=jobs, progress=progress, solver=solver, phase=phase)
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
) -> Solution:
    """Solve a case whose programs, one for each task, are formulated already.

    Args:
        case: the case.
        nlps: the program of each task, in order.
        search: number of starts, seed and the solver's settings.
        jobs: as for :func:`solve`.
        progress: as for :func:`solve`.
        solver: as for :func:`solve`.
        phase: as for :func:`solve`.

    Raises:
        CaseError: the case has several tasks and nothing free.
        InputError: as for :func:`solve`.
    """
    began = time.perf_counter()

    def solve_one(name: str, nlp: Nlp, first: Sequence[FloatArray] = ()) -> ProgramSolution:
        after_start = None if progress is None else partial(progress, name)
        return solve_program(nlp, search, first=first, jobs=jobs, progress=after_start, solver=solver, phase=phase)

    if len(nlps) > 1 and nlps[0].is_fixed:
        raise CaseError("robot", "has nothing free, so that several tasks cannot be combined", source=case.source)
    own = [solve_one(task.name, nlp) for nlp, task in zip(nlps, case.tasks, strict=True)]
    if len(nlps) > 1:
        pairs = [place for solution in own for place in solution.nlp.pairs]
        nlps = with_shared_pairs(nlps, pairs)
        polish = partial(solve_program, search=replace(search, starts=1), jobs=1, solver=solver)
        return replace(combine(case, nlps, own, solve_one, polish), seconds=time.perf_counter() - began)
    return solution_of_one_task(case, own[0])
