"""Ipopt from many starting points.

Ipopt works on scaled variables and a scaled objective. Where it stops, the sides that it found active are held, and a
few Newton steps bring the point to rounding error; whether that point has converged is then judged by the program's own
first-order conditions and never by the solver's word. Ipopt's strings end in this module.
"""

from __future__ import annotations

import enum
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from queue import SimpleQueue
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from screwsynth.models import FloatArray, frozen_array
from screwsynth.nlp.case import Case, Search
from screwsynth.nlp.errors import EvaluationError
from screwsynth.nlp.evaluation import RobotState, evaluate
from screwsynth.nlp.formulation import formulate
from screwsynth.nlp.kkt import Linearisation, correct, linearise, multipliers
from screwsynth.nlp.optimality import FEASIBLE, STATIONARY, Evidence, Kind, examine
from screwsynth.nlp.program import Nlp
from screwsynth.nlp.sampling import starting_points

#: Ipopt's tolerance. The Newton correction behind it converges quadratically, so tighter would only cost iterations.
_IPOPT_TOLERANCE = 1e-8
#: A side farther than this, in half ranges, from where Ipopt stopped is not one that the optimum lies on.
_NEAR = 1e-2
#: Two optima are the same when their scaled objectives and points differ by less than these.
_SAME_VALUE = 1e-9
_SAME_POINT = 1e-4
#: A second thread is worth its own solver from this many starts on.
_STARTS_PER_JOB = 12


class StartStatus(enum.Enum):
    """How the search from one starting point ended; each value is a sentence for people."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "stopped at the iteration limit: raise solve.max_iterations"
    INFEASIBLE = "found no point within the limits"
    SADDLE = "ended where F is stationary but neither largest nor smallest"
    UNDEFINED = "met a point where the robot's equations have no finite value"
    STALLED = "stopped before it was stationary"


class Status(enum.Enum):
    """How a whole solve ended; each value is the word in results."""

    OPTIMAL = "optimal"
    EVALUATED = "evaluated"
    SADDLE = "saddle"
    NOT_CONVERGED = "not converged"
    INFEASIBLE = "infeasible"

    @property
    def is_answer(self) -> bool:
        """Whether the solve gave what was asked for."""
        return self in (Status.OPTIMAL, Status.EVALUATED)


@dataclass(frozen=True, eq=False)
class Start:
    """The search from one starting point.

    Attributes:
        status: how it ended.
        x: (n,) where it ended.
        F: objective there, NaN where it is undefined.
        stationarity: largest scaled derivative of the Lagrangian there.
        violation: largest distance outside a limit there, in half ranges.
        iterations: of Ipopt.
    """

    status: StartStatus
    x: FloatArray
    F: float
    stationarity: float
    violation: float
    iterations: int


@dataclass(frozen=True, eq=False)
class Optimum:
    """An optimum that starts converged to.

    Attributes:
        F: objective.
        count: number of starts that ended there.
        x: (n,) one of the points.
        spread: largest distance between its points along one variable, as a part of that variable's range: 0 for an
            isolated optimum, up to 1 for a set of them.
    """

    F: float
    count: int
    x: FloatArray
    spread: float


@dataclass(frozen=True, eq=False)
class Solution:
    """What a solve found.

    Attributes:
        status: how it ended; only :attr:`Status.OPTIMAL` is an optimum.
        nlp: the program that was solved.
        x: (n,) the best point: optimal, or merely reached when the status says so.
        state: the robot there, or None where its equations have no value.
        evidence: what holds there; None when nothing is free.
        starts: every start, in order.
        optima: distinct optima that converged starts found, best first.
        seed: of the starting points.
        seconds: wall time.
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

    @property
    def F(self) -> float:  # noqa: N802 - the objective's name
        """Objective at the optimum.

        Raises:
            EvaluationError: there is none, because the solve failed.
        """
        if not self.status.is_answer or self.state is None:
            raise EvaluationError(f"the solve gave no optimum: it is {self.status.value}")
        return self.state.F


Progress = Callable[[int, int, float | None], None]


def solve(
    case: Case,
    *,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Solve a case.

    Args:
        case: the case.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads; the result does not depend on it. Left out, as many as there are processors and work.
        progress: called after each start with the number done, the number of all, and the best F so far.
    """
    search = case.search
    search = replace(
        search, starts=search.starts if starts is None else starts, seed=search.seed if seed is None else seed
    )
    return solve_nlp(formulate(case), search, jobs=jobs, progress=progress)


def solve_nlp(nlp: Nlp, search: Search, *, jobs: int | None = None, progress: Progress | None = None) -> Solution:
    """Solve a program; see :func:`solve`."""
    began = time.perf_counter()
    if nlp.n == 0:
        x = frozen_array(nlp.start, (0,))
        at = linearise(nlp, x)
        status = Status.EVALUATED if at.violation <= FEASIBLE else Status.INFEASIBLE
        evidence = None if status is Status.EVALUATED else examine(nlp, x)
        return Solution(status, nlp, x, evaluate(nlp, x), evidence, (), (), search.seed, time.perf_counter() - began)
    points = starting_points(nlp, search.starts, search.seed)
    done: list[Start] = []
    best: float | None = None
    for start in _run(nlp, points, search.max_iterations, jobs):
        done.append(start)
        if start.status is StartStatus.CONVERGED and (best is None or nlp.sign * start.F < nlp.sign * best):
            best = start.F
        if progress is not None:
            progress(len(done), len(points), best)
    done, optima = _sorted_out(nlp, done)
    x = optima[0].x if optima else min(done, key=lambda start: (start.violation, start.stationarity)).x
    evidence = examine(nlp, x)
    return Solution(
        status=_status(evidence, bool(optima)),
        nlp=nlp,
        x=frozen_array(x, (nlp.n,)),
        state=_state(nlp, x),
        evidence=evidence,
        starts=tuple(done),
        optima=tuple(optima),
        seed=search.seed,
        seconds=time.perf_counter() - began,
    )


def _status(evidence: Evidence, converged: bool) -> Status:
    if converged and evidence.kind.is_optimum:
        return Status.OPTIMAL
    if evidence.kind is Kind.INFEASIBLE:
        return Status.INFEASIBLE
    return Status.SADDLE if evidence.kind is Kind.SADDLE else Status.NOT_CONVERGED


def _state(nlp: Nlp, x: FloatArray) -> RobotState | None:
    try:
        return evaluate(nlp, x)
    except EvaluationError:
        return None


def _run(nlp: Nlp, points: FloatArray, max_iterations: int, jobs: int | None) -> Iterator[Start]:
    """One :class:`Start` for each point, in their order."""
    threads = jobs or min(os.cpu_count() or 1, max(1, len(points) // _STARTS_PER_JOB))
    # CasADi's symbols are not safe to share between threads: the solvers are all built here, and only run there.
    solvers: SimpleQueue[ca.Function] = SimpleQueue()
    for _ in range(min(threads, len(points))):
        solvers.put(_solver(nlp, max_iterations))
    parameters = np.concatenate([nlp.arguments, nlp.centre, nlp.scale, [nlp.sign / nlp.objective_scale]])

    def search(point: FloatArray) -> tuple[dict[str, FloatArray], str, int]:
        solver = solvers.get()
        try:
            result = solver(
                x0=(point - nlp.centre) / nlp.scale, p=parameters, lbx=-1, ubx=1, lbg=nlp.g_lower, ubg=nlp.g_upper
            )
            stats = solver.stats()
        finally:
            solvers.put(solver)
        found = {key: result[key].full().ravel() for key in ("x", "lam_x", "lam_g")}
        return found, str(stats["return_status"]), int(stats.get("iter_count", 0))

    if threads == 1:
        for point in points:
            yield _judged(nlp, *search(point))
        return
    with ThreadPoolExecutor(threads) as pool:
        for outcome in pool.map(search, points):
            yield _judged(nlp, *outcome)


def _solver(nlp: Nlp, max_iterations: int) -> ca.Function:
    """Ipopt for the program's structure, over scaled variables and a scaled objective to be minimised."""
    program = nlp.program
    s, centre, scale, weight = SX.sym("s", nlp.n), SX.sym("centre", nlp.n), SX.sym("scale", nlp.n), SX.sym("weight")
    F, g = program.values.call([centre + scale * s, program.p])
    options: dict[str, Any] = {
        "print_time": False,
        "show_eval_warnings": False,
        "error_on_fail": False,
        "calc_multipliers": False,
        "calc_lam_p": False,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": _IPOPT_TOLERANCE,
            "max_iter": max_iterations,
            # Ipopt would otherwise widen every bound by 1e-8 and return values that no feasible point has.
            "bound_relax_factor": 0.0,
            # The objective and variables are scaled already, by the same numbers for every start.
            "nlp_scaling_method": "none",
        },
    }
    problem = {"x": s, "p": ca.vertcat(program.p, centre, scale, weight), "f": weight * F, "g": g}
    return ca.nlpsol("solver", "ipopt", problem, options)


def _judged(nlp: Nlp, found: dict[str, FloatArray], ipopt_status: str, iterations: int) -> Start:
    """Correct the point that Ipopt stopped at, and say by the program's own conditions what it is."""
    stopped = np.clip(nlp.centre + nlp.scale * found["x"], nlp.lower, nlp.upper)
    at = linearise(nlp, stopped)
    if np.isfinite(at.violation):
        corrected = correct(nlp, stopped, _held(nlp, at, found["lam_x"], found["lam_g"]))
        # A correction that makes F worse has gone to another stationary point.
        if corrected.phi <= at.phi + _IPOPT_TOLERANCE or at.violation > FEASIBLE:
            at = corrected
    stationarity = multipliers(at, at.active())[1]
    if at.violation <= FEASIBLE and stationarity <= STATIONARY:
        status = StartStatus.CONVERGED
    else:
        status = {
            "Maximum_Iterations_Exceeded": StartStatus.ITERATION_LIMIT,
            "Infeasible_Problem_Detected": StartStatus.INFEASIBLE,
            "Invalid_Number_Detected": StartStatus.UNDEFINED,
        }.get(ipopt_status, StartStatus.STALLED)
    return Start(status, at.x, at.F, stationarity, at.violation, iterations)


def _held(nlp: Nlp, at: Linearisation, bound_multipliers: FloatArray, multipliers_of_g: FloatArray) -> list[int]:
    """Sides that an interior-point solution may lie on: near, with a multiplier that is not small beside the slack.

    An interior-point method ends with multiplier * slack about equal on all sides. The choice is generous, because a
    side that does not belong gets a multiplier of the wrong sign and is let go by the correction.
    """
    table = nlp.sides
    reported = np.concatenate([bound_multipliers, multipliers_of_g])[table.place]
    # Ipopt's variables are scaled already, its constraints are not.
    strength = table.sign * reported * np.where(table.place < nlp.n, 1.0, 1 / at.per_unit)
    near = (at.slack < _NEAR) & (strength > _NEAR**2 * np.maximum(at.slack, 0.0))
    return [int(j) for j in np.flatnonzero(table.equal | near)]


def _sorted_out(nlp: Nlp, done: list[Start]) -> tuple[list[Start], list[Optimum]]:
    """The starts, with those that ended at a saddle marked, and the distinct optima among the others, best first.

    A connected set of optima counts as one.
    """
    optima: list[Optimum] = []
    saddles: list[Start] = []
    converged = [start for start in done if start.status is StartStatus.CONVERGED]
    remaining = sorted(converged, key=lambda start: nlp.sign * start.F)
    while remaining:
        lead = remaining[0]
        level = [s for s in remaining if abs(s.F - lead.F) <= _SAME_VALUE * nlp.objective_scale]
        groups: list[list[Start]] = []
        for start in level:
            near = next((group for group in groups if _distance(nlp, group[0].x, start.x) <= _SAME_POINT), None)
            if near is None:
                groups.append([start])
            else:
                near.append(start)
        kinds = [examine(nlp, group[0].x).kind for group in groups]
        saddles += [start for kind, group in zip(kinds, groups, strict=True) if not kind.is_optimum for start in group]
        groups = [group for kind, group in zip(kinds, groups, strict=True) if kind.is_optimum]
        if Kind.NOT_ISOLATED in kinds:
            groups = [[start for group in groups for start in group]]
        for group in groups:
            x = np.array([start.x for start in group])
            spread = float(np.max(np.ptp(x, axis=0) / (2 * nlp.scale)))
            optima.append(Optimum(group[0].F, len(group), group[0].x, spread))
        remaining = [start for start in remaining if start not in level]
    return [replace(start, status=StartStatus.SADDLE) if start in saddles else start for start in done], optima


def _distance(nlp: Nlp, one: FloatArray, other: FloatArray) -> float:
    return float(np.max(np.abs(one - other) / nlp.scale))
