"""Searches from many starting points: Newton corrections, optimality conditions, and distinct optima.

The sides that the solver reports as active are fixed, and a few Newton steps bring the solver's point to rounding
error. The first-order conditions of the program then decide on convergence, never the report of the solver.
"""

from __future__ import annotations

import enum
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property
from queue import SimpleQueue
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from ...models.values import dataclass
from ..case.settings import Search
from ..evidence.assembly import Assembly, assembly_over_poses
from ..evidence.kkt import FEASIBLE, STATIONARY, Linearisation, correct_point, linearise, multipliers
from ..evidence.optimality import Evidence, PointKind, examine
from ..evidence.state import loops_are_closed
from ..evidence.workingmode import turned_over_poses
from ..interruption import is_requested
from ..program.nlp import Nlp
from .interface import LocalSearch, Solver, SolverResult, StopReason
from .ipopt import ipopt
from .status import Phase, PhaseProgress

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: A side farther than this from the solver's point, in half ranges, does not belong to the active set.
_NEAR = 1e-2
#: A side is taken as active if its multiplier exceeds this fraction of its slack. The smallest fraction, with the most
#: sides, is tried first; larger fractions follow unless the corrected point is as stationary as ``_POLISHED``.
_SHARES = (1e-4, 1.0, 1e2)
_POLISHED = 1e-10
#: Distance of a unit normal from the span of others below which it depends on them.
_DEPENDENT = 1e-6
#: Stationarity, violation and distance from active sides below which a correction would change nothing.
_EXACT = 1e-13
#: Largest loss of the scaled objective by a correction: the stopping tolerance of Ipopt.
_WORSE = 1e-8
#: Distance between points, in half ranges, below which two optima are the same.
SAME_POINT = 1e-4
#: Largest difference of F between the solver's point and the nearby optimum, relative to the scale of F: the remainder
#: of an interior-point method's barrier.
SAME_F = 1e-6
#: Smallest number of starts for each thread: with fewer, building another solver takes longer than the thread saves.
_STARTS_PER_JOB = 12


#: Seconds between two checks for a requested stop.
_LOOK = 0.05


class StartStatus(enum.Enum):
    """Outcome of the search from one starting point; each value is a sentence."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "stopped at the iteration limit: raise solve.max_iterations"
    INFEASIBLE = "found no point within the limits"
    SADDLE = "ended where F is stationary but neither largest nor smallest"
    UNDEFINED = "met a point where the robot's equations have no finite value"
    STALLED = "stopped before it was stationary"
    LIMB_SINGULAR = "ended where passive joints of a limb are dependent, so that F jumps"
    SINGULAR = "ended where J is singular and forces are undetermined: add limits.smallest_singular_value"
    OPEN = "ended where loops of the robot are open: another way to assemble its joints"


_FAILURES = {
    StopReason.ITERATION_LIMIT: StartStatus.ITERATION_LIMIT,
    StopReason.INFEASIBLE: StartStatus.INFEASIBLE,
    StopReason.UNDEFINED: StartStatus.UNDEFINED,
}
#: Stationary points that are no optima, apart from saddles.
_REFUSED = {
    PointKind.LIMB_SINGULAR: StartStatus.LIMB_SINGULAR,
    PointKind.SINGULAR: StartStatus.SINGULAR,
}


@dataclass(frozen=True, eq=False)
class Start:
    """Result of the search from one starting point.

    Attributes:
        status: outcome of the search.
        x: (n,) last point of the search.
        F: objective at the last point, NaN where it is undefined.
        stationarity: largest scaled derivative of the Lagrangian at the last point.
        violation: largest violation of a limit at the last point, in half ranges.
        iterations: number of iterations of all solvers.
        solver: name of the solver that ended the search; ``sqp`` for the search in C only.
    """

    status: StartStatus
    x: FloatArray
    F: float
    stationarity: float
    violation: float
    iterations: int
    solver: str = "ipopt"


def search_from(
    nlp: Nlp, points: FloatArray, search: Search, jobs: int | None = None, solver: Solver = ipopt
) -> Iterator[Start]:
    """Search a program from each of several starting points.

    Args:
        nlp: the nonlinear program.
        points: (k, n) starting points.
        search: settings of the solver.
        jobs: number of threads; if left out, as many as processors and starts allow.
        solver: local solver.

    Yields:
        One result for each point, in order; after a stop request, only the results of complete searches.

    Raises:
        InputError: the objective cannot be compiled, although the search asks for it.
    """
    threads = max(1, jobs) if jobs is not None else min(os.cpu_count() or 1, max(1, len(points) // _STARTS_PER_JOB))
    idle: SimpleQueue[LocalSearch] = SimpleQueue()
    name = getattr(solver, "__name__", type(solver).__name__)
    for each in solver(nlp, search, points, min(threads, len(points))):
        idle.put(each)

    def search_one(point: FloatArray) -> SolverResult:
        local_search = idle.get()
        try:
            return local_search(point)
        finally:
            idle.put(local_search)

    known: list[Start] = []
    # Even a single search runs in another thread, so that this one reacts to a stop request at once.
    pool = ThreadPoolExecutor(threads)
    try:
        for future in [pool.submit(search_one, point) for point in points]:
            found = _wait_for(future)
            if found is None:
                return
            same = known_optimum(nlp, found.x, known) if found.reason is StopReason.SUCCEEDED else None
            start = judge(nlp, found) if same is None else replace(same, iterations=found.iterations)
            start = replace(start, solver=name)
            if same is None and start.status is StartStatus.CONVERGED:
                known.append(start)
            yield start
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _wait_for(future: Future[SolverResult]) -> SolverResult | None:
    """Return the result of a search, or None if a stop is requested first."""
    while not is_requested():
        try:
            return future.result(timeout=_LOOK)
        except TimeoutError:
            if future.done():
                return future.result()
    return None


def known_optimum(nlp: Nlp, stopped: FloatArray, known: list[Start]) -> Start | None:
    """Return a converged start whose optimum is close to a solver's point, or None.

    Two searches ended at the same optimum if their points count as equal and F agrees to the solver's accuracy: a
    correction would only find the optimum again.
    """
    x = np.clip(stopped, nlp.lower, nlp.upper)
    for start in known:
        if np.max(np.abs(x - start.x) / nlp.scale) <= SAME_POINT:
            off = abs(nlp.evaluate(x)[0] - start.F)
            return start if off <= SAME_F * nlp.objective_scale else None
    return None


def judge(nlp: Nlp, found: SolverResult) -> Start:
    """Correct the last point of a local solver by Newton's method, and test the KKT conditions there."""
    stopped = np.clip(found.x, nlp.lower, nlp.upper)
    raw = at = linearise(nlp, stopped)
    active = at.active()
    stationarity = multipliers(at, active)[1]
    off = max(raw.violation, float(np.abs(raw.slack[list(active)]).max(initial=0.0)))
    is_exact = max(stationarity, off) <= _EXACT
    for share in _SHARES if np.isfinite(raw.violation) and not is_exact else ():
        corrected = correct_point(nlp, stopped, _likely_active(nlp, raw, found, share))
        left = multipliers(corrected, corrected.active())[1]
        # A correction that makes F worse has moved to another stationary point.
        kept = corrected.phi <= raw.phi + max(_WORSE, nlp.rounding) or raw.violation > FEASIBLE
        if kept and (corrected.violation, left) <= (max(at.violation, FEASIBLE), stationarity):
            at, stationarity = corrected, left
        if kept and corrected.violation <= FEASIBLE and left <= max(_POLISHED, corrected.rounding):
            break
    if at.violation <= FEASIBLE and not loops_are_closed(nlp, at.x):
        status = StartStatus.OPEN
    elif at.violation <= FEASIBLE and stationarity <= STATIONARY:
        status = StartStatus.CONVERGED
    else:
        status = _FAILURES.get(found.reason, StartStatus.STALLED)
    return Start(status, at.x, at.F, stationarity, at.violation, found.iterations)


def _likely_active(nlp: Nlp, at: Linearisation, found: SolverResult, share: float) -> list[int]:
    """Return the sides that may be active at an interior-point solution: near, with a large multiplier.

    A multiplier is large if it exceeds ``share`` times the slack of its side. An interior-point method ends with about
    equal multiplier * slack on all sides. A small share makes the choice generous: an inactive side then gets a
    multiplier of the wrong sign and leaves the active set in the correction.
    """
    sides = nlp.sides
    reported = np.concatenate([found.bound_multipliers, found.constraint_multipliers])[sides.place]
    # Multipliers of bounds are per half range already; those of constraints are per unit.
    strength = sides.sign * reported * np.where(sides.place < nlp.n, 1.0, 1 / at.per_unit)
    near = (at.slack < _NEAR) & (strength > share * np.maximum(at.slack, 0.0))
    held = np.flatnonzero(sides.equal | near)
    if len(held) <= nlp.n:
        return [int(j) for j in held]
    # n independent sides determine a point. Further sides are left out in the order of multiplier / slack, and so are
    # dependent ones, such as the sides of symmetric limbs.
    order = np.where(sides.equal[held], np.inf, strength[held] / np.maximum(at.slack[held], np.finfo(float).eps))
    return sorted(_independent(at.normals, held[np.argsort(-order, kind="stable")]))


def _independent(normals: FloatArray, order: NDArray[np.intp]) -> list[int]:
    """Return the sides, in the given order, whose unit normals (n,) are independent of the preceding normals."""
    kept = list[int]()
    basis = np.zeros((0, normals.shape[1]))
    for j in order:
        left = normals[j]
        for _ in range(2):  # twice, because of rounding in the first projection
            left = left - basis.T @ (basis @ left)
        length = float(np.linalg.norm(left))
        if length > _DEPENDENT:
            kept.append(int(j))
            basis = np.vstack([basis, left / length])
    return kept


#: Difference of F, relative to its scale, below which two optima have the same F.
SAME_VALUE = 1e-9


@dataclass(frozen=True, eq=False)
class Optimum:
    """An optimum to which starts converged.

    Attributes:
        F: objective.
        count: number of starts that converged to the optimum.
        x: (n,) one of the points at which searches ended.
        spread: largest distance between end points of these searches along one variable, divided by the range of the
            variable: 0 for an isolated optimum, up to 1 for a set of optima, which may have several pieces.
        evidence: evidence of optimality at ``x``.
        nlp: nonlinear program of the optimum.
    """

    F: float
    count: int
    x: FloatArray
    spread: float
    evidence: Evidence
    nlp: Nlp

    @cached_property
    def assembly(self) -> Assembly | None:
        """Assembly mode at ``x``, computed at the first use; None without loops."""
        return assembly_over_poses(self.nlp, self.x)


def same_value(nlp: Nlp) -> float:
    """Return the largest difference of F between optima with the same F."""
    return max(SAME_VALUE, nlp.rounding) * nlp.objective_scale


def distinct_optima(nlp: Nlp, done: Sequence[Start], phase: PhaseProgress) -> tuple[list[Start], list[Optimum]]:
    """Group converged starts by F and point, and examine one point of each group, once.

    Saddles and singular points are marked in the status of their starts; the other points are optima, best first.

    If an optimum is not isolated, all points with its F count as one set, which may have several pieces. Points in
    different working modes of a limb belong to different sets.
    """
    optima: list[Optimum] = []
    refused: dict[int, StartStatus] = {}
    converged = [start for start in done if start.status is StartStatus.CONVERGED]
    remaining = sorted(converged, key=lambda start: nlp.sign * start.F)
    while remaining:
        phase(Phase.EVIDENCE, len(converged) - len(remaining), len(converged))
        best = remaining[0].F
        # The order of the starts decides, so that rounding does not choose among points with the same F.
        level = [start for start in converged if start in remaining and abs(start.F - best) <= same_value(nlp)]
        lead = level[0]
        evidence = examine(nlp, lead.x)
        # The lead is the first start with this F, and so of the first group, which can use its evidence.
        isolated = evidence.kind is not PointKind.NOT_ISOLATED
        groups = _group_by_point(nlp, level) if isolated else _group_by_mode(nlp, level)
        examined = [evidence, *(examine(nlp, group[0].x) for group in groups[1:])]
        for each, group in zip(examined, groups, strict=True):
            if not each.kind.is_optimum:
                refused |= dict.fromkeys(map(id, group), _REFUSED.get(each.kind, StartStatus.SADDLE))
                continue
            x = np.array([start.x for start in group])
            spread = float(np.max(np.ptp(x, axis=0) / (2 * nlp.scale)))
            optima.append(Optimum(group[0].F, len(group), group[0].x, spread, each, nlp))
        remaining = [start for start in remaining if start not in level]
    starts = [replace(start, status=refused.get(id(start), start.status)) for start in done]
    return starts, optima


def _group_by_point(nlp: Nlp, starts: Sequence[Start]) -> list[list[Start]]:
    """Group starts with equal points, in the order of the first start of each group."""
    groups: list[list[Start]] = []
    for start in starts:
        same = next((group for group in groups if _largest_distance(nlp, group[0].x, start.x) <= SAME_POINT), None)
        if same is None:
            groups.append([start])
        else:
            same.append(start)
    return groups


def _group_by_mode(nlp: Nlp, starts: Sequence[Start]) -> list[list[Start]]:
    """Group starts in the same working modes, in the order of the first start of each group."""
    groups: dict[tuple[tuple[str, ...], ...], list[Start]] = {}
    for start in starts:
        groups.setdefault(turned_over_poses(nlp, start.x), []).append(start)
    return list(groups.values())


def _largest_distance(nlp: Nlp, one: FloatArray, other: FloatArray) -> float:
    """Return the largest distance along one variable, in half ranges."""
    return float(np.max(np.abs(one - other) / nlp.scale))
