"""Searches from many starting points, each corrected and judged by the program's own conditions.

At the point where a solver stopped, the sides that it found active are held, and a few Newton steps bring the point to
rounding error. Whether that point has converged is then judged by the program's own first-order conditions and never by
the solver's word.
"""

from __future__ import annotations

import enum
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from queue import SimpleQueue

import numpy as np

from ...models import FloatArray
from ..case.settings import Search
from ..evidence.kkt import FEASIBLE, STATIONARY, Linearisation, correct_point, linearise, multipliers
from ..program.nlp import Nlp
from .interface import LocalSearch, Solver, SolverResult, StopReason
from .ipopt import ipopt

#: A side farther than this, in half ranges, from where the solver stopped is not one that the optimum lies on.
_NEAR = 1e-2
#: What part of its slack the multiplier of a side must exceed for the side to be held. The generous choice is tried
#: first; where it does not lead to a point this stationary, because it holds sides that the optimum does not lie on,
#: stricter ones follow.
_SHARES = (1e-4, 1.0, 1e2)
_POLISHED = 1e-10
#: A correction may make the scaled objective worse by this much: the tolerance that Ipopt stops at.
_WORSE = 1e-8
#: Two optima are the same when their points differ by less than this, in half ranges.
SAME_POINT = 1e-4
#: How far F where the solver stopped may be from the optimum it stopped at, in parts of F's scale: a barrier's last
#: bit.
_SAME_F = 1e-6
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


_FAILURES = {
    StopReason.ITERATION_LIMIT: StartStatus.ITERATION_LIMIT,
    StopReason.INFEASIBLE: StartStatus.INFEASIBLE,
    StopReason.UNDEFINED: StartStatus.UNDEFINED,
}


@dataclass(frozen=True, eq=False)
class Start:
    """The search from one starting point.

    Attributes:
        status: how it ended.
        x: (n,) where it ended.
        F: objective there, NaN where it is undefined.
        stationarity: largest scaled derivative of the Lagrangian there.
        violation: largest distance outside a limit there, in half ranges.
        iterations: of the solver.
    """

    status: StartStatus
    x: FloatArray
    F: float
    stationarity: float
    violation: float
    iterations: int


def search_from(
    nlp: Nlp, points: FloatArray, search: Search, jobs: int | None = None, solver: Solver = ipopt
) -> Iterator[Start]:
    """Search a program from each of several points.

    Args:
        nlp: the program.
        points: (k, n) starting points.
        search: the solver's settings.
        jobs: number of threads; left out, as many as there are processors and work.
        solver: the local solver.

    Yields:
        One start for each point, in their order.

    Raises:
        InputError: the objective is to be compiled, and cannot be.
    """
    threads = max(1, jobs) if jobs is not None else min(os.cpu_count() or 1, max(1, len(points) // _STARTS_PER_JOB))
    waiting: SimpleQueue[LocalSearch] = SimpleQueue()
    for each in solver(nlp, search, points, min(threads, len(points))):
        waiting.put(each)

    def search_one(point: FloatArray) -> SolverResult:
        local_search = waiting.get()
        try:
            return local_search(point)
        finally:
            waiting.put(local_search)

    known: list[Start] = []
    with ThreadPoolExecutor(threads) as pool:
        for found in map(search_one, points) if threads == 1 else pool.map(search_one, points):
            same = _known_optimum(nlp, found.x, known) if found.reason is StopReason.SUCCEEDED else None
            start = judge(nlp, found) if same is None else replace(same, iterations=found.iterations)
            if same is None and start.status is StartStatus.CONVERGED:
                known.append(start)
            yield start


def _known_optimum(nlp: Nlp, stopped: FloatArray, known: list[Start]) -> Start | None:
    """Return the converged start that another search ended at too, or None.

    Within the distance at which two optima count as one, and with the same F to the solver's accuracy, both ended at
    the same optimum: the correction would only find it again.
    """
    x = np.clip(stopped, nlp.lower, nlp.upper)
    for start in known:
        if np.max(np.abs(x - start.x) / nlp.scale) <= SAME_POINT:
            off = abs(nlp.evaluate(x)[0] - start.F)
            return start if off <= _SAME_F * nlp.objective_scale else None
    return None


def judge(nlp: Nlp, found: SolverResult) -> Start:
    """Correct the point at which a solver stopped, and judge it by the program's own conditions."""
    stopped = np.clip(found.x, nlp.lower, nlp.upper)
    raw = at = linearise(nlp, stopped)
    stationarity = multipliers(at, at.active())[1]
    for share in _SHARES if np.isfinite(raw.violation) else ():
        corrected = correct_point(nlp, stopped, _likely_active(nlp, raw, found, share))
        left = multipliers(corrected, corrected.active())[1]
        # A correction that makes F worse has gone to another stationary point.
        kept = corrected.phi <= raw.phi + max(_WORSE, nlp.rounding) or raw.violation > FEASIBLE
        if kept and (corrected.violation, left) <= (max(at.violation, FEASIBLE), stationarity):
            at, stationarity = corrected, left
        if kept and corrected.violation <= FEASIBLE and left <= max(_POLISHED, corrected.rounding):
            break
    if at.violation <= FEASIBLE and stationarity <= STATIONARY:
        status = StartStatus.CONVERGED
    else:
        status = _FAILURES.get(found.reason, StartStatus.STALLED)
    return Start(status, at.x, at.F, stationarity, at.violation, found.iterations)


def _likely_active(nlp: Nlp, at: Linearisation, found: SolverResult, share: float) -> list[int]:
    """Return the sides that an interior-point solution may lie on: near, with a multiplier not small beside the slack.

    An interior-point method ends with multiplier * slack about equal on all sides. A small share makes the choice
    generous: a side that does not belong gets a multiplier of the wrong sign and leaves the active set in the
    correction.
    """
    table = nlp.sides
    reported = np.concatenate([found.bound_multipliers, found.constraint_multipliers])[table.place]
    # Multipliers of bounds are per half range already, those of constraints are not.
    strength = table.sign * reported * np.where(table.place < nlp.n, 1.0, 1 / at.per_unit)
    near = (at.slack < _NEAR) & (strength > share * np.maximum(at.slack, 0.0))
    held = np.flatnonzero(table.equal | near)
    # No more sides than variables can hold a point: those with the least multipliers beside their slack are left out.
    order = np.where(table.equal[held], np.inf, strength[held] / np.maximum(at.slack[held], np.finfo(float).eps))
    return [int(j) for j in held[np.sort(np.argsort(-order, kind="stable")[: nlp.n])]]
