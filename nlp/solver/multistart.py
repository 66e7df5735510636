"""Search of one program from many starting points, with the distinct optima.

A case without free dimensions and with a fixed pose has only the robot's internal unknowns as variables, as many as the
loops have independent equations: Newton's method closes the loops, without a local solver. Where it fails, dependent
equations cannot be recognised: an interior-point method refuses a program with more equations than variables.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...models import FloatArray, frozen_array
from ...models.values import dataclass
from ...models.whole import Whole
from ..case.settings import Search
from ..errors import EvaluationError
from ..evidence.closing import close_near, closed_start, closed_starts
from ..evidence.kkt import FEASIBLE, close_equations, linearise
from ..evidence.margins import measured_violation
from ..evidence.optimality import Evidence, PointKind, examine
from ..evidence.state import RobotState, loops_are_closed, state_or_none
from ..interruption import Milestone, is_requested, reached
from ..program.blocks import Blocks
from ..program.epigraph import with_exact_level, with_wider_level
from ..program.nlp import Nlp, PairPlace
from ..program.pairs import violated_pairs, with_pairs, with_pairs_at
from ..program.relaxation import (
    RelaxedLimit,
    formulate_relaxation,
    relaxation_point,
    relaxed_limits,
    unrelaxed_pairs,
)
from ..program.sampling import starting_points
from .by_blocks import from_best_blocks, searched_starts
from .interface import LocalSearch, Solver, SolverResult, StopReason
from .ipopt import ipopt
from .kept import journal_in_force
from .screened import search_each
from .starts import Optimum, Start, StartStatus, distinct_optima
from .status import Phase, PhaseProgress, Status, no_phase

#: Smallest improvement over the best optimum, relative to the scale of F, that is more than rounding.
_BETTER = 1e-6
#: Number of starting points of the search for the smallest relaxation.
_ELASTIC_STARTS = 8
#: Status of a search whose best point is stationary, but no optimum.
_REFUSED = {
    PointKind.SADDLE: Status.SADDLE,
    PointKind.LIMB_SINGULAR: Status.LIMB_SINGULAR,
    PointKind.SINGULAR: Status.SINGULAR,
}


@dataclass(frozen=True, eq=False)
class ProgramSolution(Whole):
    """Outcome of a search of one program.

    Attributes:
        status: outcome of the search; only with :attr:`Status.OPTIMAL` is ``x`` the best known point.
        nlp: the nonlinear program.
        x: (n,) the best point; the status says whether the point is optimal.
        state: state of the robot at ``x``; None if its loop equations have no solution.
        evidence: evidence of optimality at ``x``; None without free variables.
        starts: result of the search from each starting point, in order.
        optima: distinct optima of converged starts, best first.
        seed: seed of the starting points.
        seconds: wall time.
        relaxation: smallest known relaxation of the limits that makes an infeasible program feasible; empty if none
            is known.
        better: objective of a feasible point that is better than every optimum, but at which no search converged; None
            without such a point.
    """

    status: Status
    nlp: Nlp
    x: FloatArray
    state: RobotState | None
    evidence: Evidence | None
    starts: tuple[Start, ...]
    optima: tuple[Optimum, ...]
    seed: int
    seconds: float
    relaxation: tuple[RelaxedLimit, ...] = ()
    better: float | None = None

    def __repr__(self) -> str:
        found = f", F = {self.F:.7g}" if self.status.is_answer else ""
        return f"<ProgramSolution of {self.nlp.case.name!r}: {self.status.value}{found}, {len(self.starts)} starts>"

    @property
    def F(self) -> float:  # noqa: N802 - the objective's name
        """Objective at the optimum.

        Raises:
            EvaluationError: the search failed, so there is no optimum.
        """
        if not self.status.is_answer:
            raise EvaluationError(f"no optimum: the solve ended with status {self.status.value!r}")
        return self.nlp.evaluate(self.x)[0]


#: Function to call after each start, with the number of starts done, the number of all, and the best objective so far.
Progress = Callable[[int, int, float | None], None]


def solve_program(
    nlp: Nlp,
    search: Search,
    *,
    first: Sequence[FloatArray] = (),
    jobs: int | None = None,
    progress: Progress | None = None,
    solver: Solver = ipopt,
    phase: PhaseProgress = no_phase,
) -> ProgramSolution:
    """Solve a nonlinear program; if its limits seem to conflict, search for the smallest relaxation.

    Args:
        nlp: the nonlinear program.
        search: number of starts, seed and settings of the solver.
        first: points (n,) to start from before the sampled ones.
        jobs: number of threads; the result does not depend on it. If left out, as many as processors and starts allow.
        progress: function to call after each start.
        solver: local solver that searches from each starting point.
        phase: function to call with the phase of the solve and its progress.

    Raises:
        InputError: the objective is to be compiled, and there is no C compiler or it fails.
    """

    def solve() -> ProgramSolution:
        return _solved(nlp, search, first, jobs, progress, solver, phase)

    journal = journal_in_force()
    found: ProgramSolution = solve() if journal is None else journal.search(nlp, search, first, solve, ProgramSolution)
    return found


def _solved(
    nlp: Nlp,
    search: Search,
    first: Sequence[FloatArray],
    jobs: int | None,
    progress: Progress | None,
    solver: Solver,
    phase: PhaseProgress,
) -> ProgramSolution:
    """Solve a program; for arguments see :func:`solve_program`."""
    began = time.perf_counter()
    solution = _search(nlp, search, first, jobs, progress, solver, phase)
    nlp = solution.nlp
    limited = any(any(constraint.keys) for constraint in nlp.program.constraints)
    if solution.status is not Status.INFEASIBLE or not limited:
        return solution
    few = replace(search, starts=min(search.starts, _ELASTIC_STARTS))
    missing: Sequence[PairPlace] = ()
    while True:
        nlp = with_pairs(nlp, missing)
        phase(Phase.RELAXATION, 0, few.starts)
        elastic = formulate_relaxation(nlp)
        points = [relaxation_point(nlp, x) for x in (solution.x, nlp.start)]
        relaxed = _search(
            elastic, few, points, jobs, lambda done, total, _: phase(Phase.RELAXATION, done, total), solver, no_phase
        )
        # An optimum of the relaxed program is often degenerate, with more active limits than variables, so that it
        # need not count as converged: a feasible point is enough.
        feasible = [start for start in relaxed.starts if start.violation <= FEASIBLE]
        if is_requested():
            return replace(solution, status=Status.INTERRUPTED, seconds=time.perf_counter() - began)
        if not feasible:
            return replace(solution, seconds=time.perf_counter() - began)
        least = min(feasible, key=lambda start: start.F)
        missing = unrelaxed_pairs(nlp, least.x)
        if not missing:
            break
    moved = relaxed_limits(nlp, least.x)
    if not moved:
        # All limits can hold at once: the first search missed the feasible set, in which this point lies.
        solution = _search(nlp, search, [*first, least.x[: nlp.n]], jobs, None, solver, phase)
    return replace(solution, relaxation=moved, seconds=time.perf_counter() - began)


def _search(
    nlp: Nlp,
    search: Search,
    first: Sequence[FloatArray],
    jobs: int | None,
    progress: Progress | None,
    solver: Solver,
    phase: PhaseProgress,
) -> ProgramSolution:
    """Search a program from first and sampled points; repeat while bounds of the epigraph variable are active."""
    solution = _search_within(nlp, search, first, jobs, progress, solver, phase)
    while (wider := with_wider_level(solution.nlp, solution.x)) is not None and not is_requested():
        solution = _search_within(wider, search, [*first, solution.x], jobs, progress, solver, phase)
    # A level on its bound is not an answer.
    return solution if wider is None else replace(solution, status=Status.INTERRUPTED)


def _search_within(
    nlp: Nlp,
    search: Search,
    first: Sequence[FloatArray],
    jobs: int | None,
    progress: Progress | None,
    solver: Solver,
    phase: PhaseProgress,
) -> ProgramSolution:
    """Search a program from the first points and from sampled points.

    Of limits on many pairs of values, the program has only the pairs that the starting points violate. Limits that the
    results violate are added, and the affected starts are repeated until no limit is violated.
    """
    began = time.perf_counter()
    if nlp.is_fixed:
        return _evaluate_fixed(nlp, search, began)
    if nlp.is_overdetermined:
        solver = closing
    blocks = Blocks(nlp)
    points = np.vstack([*first, starting_points(nlp, search.starts, search.seed)])
    if nlp.program.model.unknowns:
        # From open loops, many searches end far from every closed point, or where the robot is folded over.
        points = closed_starts(nlp, points)
    points, found = searched_starts(nlp, blocks, points, search, solver, jobs)
    nlp = with_pairs_at(nlp, points)
    nlp, found = _searched(nlp, points, found, search, jobs, progress, solver, phase)
    interrupted = is_requested()
    if not found:  # interrupted before the first start was done
        return _outcome(Status.INTERRUPTED, nlp, nlp.start, examine(nlp, nlp.start), search, began)
    done = [found[k] for k in sorted(found)]
    together = from_best_blocks(nlp, blocks, [start.x for start in done], _best_value(nlp, done), _BETTER)
    if together is not None and not interrupted:
        done += search_each(nlp, together[None], search, 1, solver)
        interrupted = is_requested()
    starts, optima = distinct_optima(nlp, done, phase)
    better = _find_better_start(nlp, starts, optima)
    if optima and not (interrupted and better):
        x, evidence = optima[0].x, optima[0].evidence
    else:
        x = (better or min(starts, key=lambda start: (start.violation, start.stationarity))).x
        evidence = examine(nlp, x)
    status = Status.INTERRUPTED if interrupted else _status(nlp, x, evidence, bool(optima), better)
    return replace(
        _outcome(status, nlp, x, evidence, search, began),
        starts=tuple(starts),
        optima=tuple(optima),
        better=None if better is None else better.F,
    )


def _searched(
    nlp: Nlp,
    points: FloatArray,
    known: Mapping[int, Start],
    search: Search,
    jobs: int | None,
    progress: Progress | None,
    solver: Solver,
    phase: PhaseProgress,
) -> tuple[Nlp, dict[int, Start]]:
    """Search from the points (k, n) that have no known result.

    Return the program with constraints on its active pairs, and the results by index of the point.

    If interrupted, the searches end before the last point.
    """
    found, left = dict(known), [k for k in range(len(points)) if k not in known]
    if found:
        reached(Milestone.START)
    while left and not is_requested():
        phase(Phase.STARTS, len(found), len(points))
        for k, start in zip(left, search_each(nlp, points[left], search, jobs, solver), strict=False):
            if not found and start.status is StartStatus.CONVERGED:
                _ = nlp.program.kernels.hessian  # the evidence needs it, also when the search is interrupted
            found[k] = start
            reached(Milestone.START)
            if progress is not None:
                progress(len(found), len(points), _best_value(nlp, found.values()))
        missing = {k: violated_pairs(nlp, start.x) for k, start in found.items()}
        nlp = with_pairs(nlp, [place for places in missing.values() for place in places])
        left = [k for k, places in sorted(missing.items()) if places]
        found = {k: start for k, start in found.items() if k not in left}
    return nlp, found


def _outcome(
    status: Status, nlp: Nlp, x: FloatArray, evidence: Evidence | None, search: Search, began: float
) -> ProgramSolution:
    """Return the outcome of a search at its best point (n,), without the results of single starts."""
    state, own = state_or_none(nlp, x), frozen_array(x, (nlp.n,))
    return ProgramSolution(status, nlp, own, state, evidence, (), (), search.seed, time.perf_counter() - began)


def _best_value(nlp: Nlp, starts: Iterable[Start]) -> float | None:
    """Return the best objective of converged starts, or None without one."""
    values = [nlp.sign * start.F for start in starts if start.status is StartStatus.CONVERGED]
    return nlp.sign * min(values) if values else None


def _evaluate_fixed(nlp: Nlp, search: Search, began: float) -> ProgramSolution:
    """Evaluate a program without free variables, after closing the loops of the robot."""
    x = closed_point(nlp, search)
    status = Status.EVALUATED if measured_violation(nlp, x) <= FEASIBLE else Status.INFEASIBLE
    evidence = None if status is Status.EVALUATED else examine(nlp, x)
    return _outcome(status, nlp, x, evidence, search, began)


def _find_better_start(nlp: Nlp, starts: Sequence[Start], optima: Sequence[Optimum]) -> Start | None:
    """Return a feasible start that did not converge and is better than every optimum, or None.

    With such a start, the best optimum is not the global one, and must not be reported as such.
    """
    others = (StartStatus.CONVERGED, StartStatus.OPEN)  # open loops are no point of the case
    feasible = [start for start in starts if start.status not in others and start.violation <= FEASIBLE]
    if not (feasible and optima):
        return None
    best = min(feasible, key=lambda start: nlp.sign * start.F)
    gain = nlp.sign * (optima[0].F - best.F)
    return best if gain > _BETTER * nlp.objective_scale else None


def _status(nlp: Nlp, x: FloatArray, evidence: Evidence, converged: bool, better: Start | None) -> Status:
    """Return the status of a search from the evidence at its best point (n,), and a better unconverged start."""
    if converged and evidence.kind.is_optimum:
        return Status.OPTIMAL if better is None else Status.LOCAL
    if evidence.kind is PointKind.INFEASIBLE:
        # A point that only a conservative estimate refuses shows that the program is feasible.
        return Status.INFEASIBLE if measured_violation(nlp, x) > FEASIBLE else Status.NOT_CONVERGED
    return _REFUSED.get(evidence.kind, Status.NOT_CONVERGED)


def closed_point(nlp: Nlp, search: Search) -> FloatArray:
    """Return the point (n,) of a case without free variables, with closed loops.

    The assembly mode is the home assembly mode. Where the path from home does not reach the pose, loops are closed from
    sampled unknowns. Where this fails too, the result is the last iterate of Newton's method from home.

    Args:
        nlp: the nonlinear program.
        search: number of starts and seed.
    """
    first = with_exact_level(nlp, closed_start(nlp))
    if _is_closed(nlp, first) or not nlp.n:
        return first
    for start in starting_points(nlp, search.starts, search.seed):
        x = with_exact_level(nlp, close_near(nlp, start, start))
        if _is_closed(nlp, x):
            return x
    return first


def closing(nlp: Nlp, search: Search, points: FloatArray, count: int) -> list[LocalSearch]:
    """Return searches that only close a program's equations; see :class:`screwsynth.nlp.solver.interface.Solver`."""
    del search, points

    def close(point: FloatArray) -> SolverResult:
        x = close_equations(nlp, point)
        reason = StopReason.SUCCEEDED if linearise(nlp, x).violation <= FEASIBLE else StopReason.INFEASIBLE
        zeros = np.zeros(nlp.n), np.zeros(len(nlp.program.constraints))
        return SolverResult(
            x=x, bound_multipliers=zeros[0], constraint_multipliers=zeros[1], reason=reason, iterations=0
        )

    return [close for _ in range(count)]


def _is_closed(nlp: Nlp, x: FloatArray) -> bool:
    """Return whether the robot's loops are closed at a point (n,)."""
    at = linearise(nlp, x)
    equations = np.abs(at.residual[nlp.sides.equal])
    return bool(equations.max(initial=0.0) <= FEASIBLE) and loops_are_closed(nlp, x)
