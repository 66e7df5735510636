"""One search by Ipopt from each starting point, judged by the program's own conditions.

Ipopt works on scaled variables and a scaled objective. Where it stops, the sides that it found active are held, and a
few Newton steps bring the point to rounding error; whether that point has converged is then judged by the program's own
first-order conditions and never by the solver's word. Ipopt's strings end in this module.
"""

from __future__ import annotations

import enum
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from queue import SimpleQueue
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from ...models import FloatArray
from ..case.settings import Search
from ..evidence.kkt import FEASIBLE, STATIONARY, Linearisation, correct, linearise, multipliers
from ..program.nlp import Nlp
from .compiled import shared_library

#: Ipopt's tolerance. The Newton correction behind it converges quadratically, so tighter would only cost iterations.
_IPOPT_TOLERANCE = 1e-8
#: A side farther than this, in half ranges, from where Ipopt stopped is not one that the optimum lies on.
_NEAR = 1e-2
#: What part of its slack the multiplier of a side must exceed for the side to be held. The generous choice is tried
#: first; where it does not lead to a point this stationary, because it holds sides that the optimum does not lie on,
#: stricter ones follow.
_SHARES = (1e-4, 1.0, 1e2)
_POLISHED = 1e-10
#: Two optima are the same when their points differ by less than this, in half ranges.
SAME_POINT = 1e-4
#: How far F where Ipopt stopped may be from the optimum it stopped at, in parts of F's scale: its barrier's last bit.
_SAME_F = 1e-6
#: How many starting points are looked at for the size of each constraint.
_LOOKED_AT = 4
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


def search_from(nlp: Nlp, points: FloatArray, search: Search, jobs: int | None) -> Iterator[Start]:
    """One :class:`Start` for each point, in their order.

    Raises:
        InputError: the objective is to be compiled, and cannot be.
    """
    threads = max(1, jobs) if jobs is not None else min(os.cpu_count() or 1, max(1, len(points) // _STARTS_PER_JOB))
    # CasADi's symbols are not safe to share between threads: the solvers are all built here, and only run there.
    solvers: SimpleQueue[ca.Function] = SimpleQueue()
    symbols = _problem(nlp)
    problem = _compiled(symbols) if search.compiled else symbols
    for _ in range(min(threads, len(points))):
        solvers.put(ca.nlpsol("solver", "ipopt", problem, _options(search.max_iterations)))
    sizes = _row_sizes(nlp, points)
    parameters = np.concatenate([nlp.arguments, nlp.centre, nlp.scale, [nlp.sign / nlp.objective_scale], sizes])
    lower, upper = nlp.g_lower / sizes, nlp.g_upper / sizes

    def search_one(point: FloatArray) -> tuple[dict[str, FloatArray], str, int]:
        solver = solvers.get()
        try:
            result = solver(x0=(point - nlp.centre) / nlp.scale, p=parameters, lbx=-1, ubx=1, lbg=lower, ubg=upper)
            stats = solver.stats()
        finally:
            solvers.put(solver)
        found = {key: result[key].full().ravel() for key in ("x", "lam_x", "lam_g")}
        found["lam_g"] = found["lam_g"] / sizes
        return found, str(stats["return_status"]), int(stats.get("iter_count", 0))

    known: list[Start] = []
    with ThreadPoolExecutor(threads) as pool:
        for found, ipopt_status, iterations in (
            map(search_one, points) if threads == 1 else pool.map(search_one, points)
        ):
            start = _recognised(nlp, found["x"], known) if ipopt_status == "Solve_Succeeded" else None
            if start is None:
                start = _judged(nlp, found, ipopt_status)
                if start.status is StartStatus.CONVERGED:
                    known.append(start)
            yield replace(start, iterations=iterations)


def _row_sizes(nlp: Nlp, points: FloatArray) -> FloatArray:
    """(c,) typical length of each limit's gradient in scaled variables, so that Ipopt sees rows of order 1.

    The program's other constraints are written that way already and have 1.
    """
    rows = (
        np.array([nlp.program.kernels.derivatives(x, nlp.arguments).jacobian for x in points[:_LOOKED_AT]]) * nlp.scale
    )
    lengths = np.sqrt(np.einsum("kij,kij->ki", rows, rows))
    lengths = np.where(np.isfinite(lengths), lengths, 0.0).max(axis=0, initial=0.0)
    limits = np.array([any(constraint.keys) for constraint in nlp.program.constraints], dtype=bool)
    return np.where(limits & (lengths > 0), lengths, 1.0)


def _problem(nlp: Nlp) -> dict[str, SX]:
    """The program's structure over scaled variables and a scaled objective to be minimised."""
    program = nlp.program
    s, centre, scale, weight = SX.sym("s", nlp.n), SX.sym("centre", nlp.n), SX.sym("scale", nlp.n), SX.sym("weight")
    sizes = SX.sym("sizes", len(program.constraints))
    F, g = program.values.call([centre + scale * s, program.p])
    return {"x": s, "p": ca.vertcat(program.p, centre, scale, weight, sizes), "f": weight * F, "g": g / sizes}


def _compiled(problem: dict[str, SX]) -> str:
    """A library with everything of a problem that Ipopt calls, for CasADi to load as external functions."""
    solver = ca.nlpsol("solver", "ipopt", problem, _options(1))
    generator = ca.CodeGenerator("problem.c")
    for function in (solver.oracle(), *(solver.get_function(name) for name in solver.get_function())):
        generator.add(function)
    return str(shared_library(generator.dump()))


def _options(max_iterations: int) -> dict[str, Any]:
    return {
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


def _recognised(nlp: Nlp, stopped: FloatArray, known: list[Start]) -> Start | None:
    """The converged start that another one ended at too, from where Ipopt stopped in scaled variables.

    Within the distance at which two optima count as one, and with the same F to Ipopt's accuracy, it is that one: the
    correction would only find it again.
    """
    x = np.clip(nlp.centre + nlp.scale * stopped, nlp.lower, nlp.upper)
    for start in known:
        if np.max(np.abs(x - start.x) / nlp.scale) <= SAME_POINT:
            off = abs(nlp.evaluate(x)[0] - start.F)
            return start if off <= _SAME_F * nlp.objective_scale else None
    return None


def _judged(nlp: Nlp, found: dict[str, FloatArray], ipopt_status: str) -> Start:
    """Correct the point that Ipopt stopped at, and say by the program's own conditions what it is."""
    stopped = np.clip(nlp.centre + nlp.scale * found["x"], nlp.lower, nlp.upper)
    raw = at = linearise(nlp, stopped)
    stationarity = multipliers(at, at.active())[1]
    for share in _SHARES if np.isfinite(raw.violation) else ():
        corrected = correct(nlp, stopped, _held(nlp, raw, found["lam_x"], found["lam_g"], share))
        left = multipliers(corrected, corrected.active())[1]
        # A correction that makes F worse has gone to another stationary point.
        kept = corrected.phi <= raw.phi + _IPOPT_TOLERANCE or raw.violation > FEASIBLE
        if kept and (corrected.violation, left) <= (max(at.violation, FEASIBLE), stationarity):
            at, stationarity = corrected, left
        if kept and corrected.violation <= FEASIBLE and left <= _POLISHED:
            break
    if at.violation <= FEASIBLE and stationarity <= STATIONARY:
        status = StartStatus.CONVERGED
    else:
        status = {
            "Maximum_Iterations_Exceeded": StartStatus.ITERATION_LIMIT,
            "Infeasible_Problem_Detected": StartStatus.INFEASIBLE,
            "Invalid_Number_Detected": StartStatus.UNDEFINED,
        }.get(ipopt_status, StartStatus.STALLED)
    return Start(status, at.x, at.F, stationarity, at.violation, 0)


def _held(
    nlp: Nlp, at: Linearisation, bound_multipliers: FloatArray, multipliers_of_g: FloatArray, share: float
) -> list[int]:
    """Sides that an interior-point solution may lie on: near, with a multiplier that is not small beside the slack.

    An interior-point method ends with multiplier * slack about equal on all sides. A small share makes the choice
    generous: a side that does not belong gets a multiplier of the wrong sign and is let go by the correction.
    """
    table = nlp.sides
    reported = np.concatenate([bound_multipliers, multipliers_of_g])[table.place]
    # Ipopt's variables are scaled already, its constraints are not.
    strength = table.sign * reported * np.where(table.place < nlp.n, 1.0, 1 / at.per_unit)
    near = (at.slack < _NEAR) & (strength > share * np.maximum(at.slack, 0.0))
    held = np.flatnonzero(table.equal | near)
    # No more sides than variables can hold a point: those with the least multipliers beside their slack are let go.
    order = np.where(table.equal[held], np.inf, strength[held] / np.maximum(at.slack[held], np.finfo(float).eps))
    return [int(j) for j in held[np.sort(np.argsort(-order, kind="stable")[: nlp.n])]]
