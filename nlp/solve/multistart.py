"""Solving a case from many starting points, and sorting out what they found."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..case.settings import Search
from ..errors import CaseError, EvaluationError
from ..evidence.kkt import FEASIBLE, linearise
from ..evidence.optimality import Evidence, PointKind, examine
from ..evidence.state import RobotState, evaluate
from ..program.formulation import formulate
from ..program.nlp import Nlp
from ..program.relaxation import RelaxedLimit, formulate_relaxation, relaxation_point, relaxed_limits
from ..program.sampling import starting_points
from .ipopt import SAME_POINT, Start, StartStatus, search_from

#: Two optima have the same F when it differs by less than this part of F's scale.
SAME_VALUE = 1e-9
#: A point that is better than the best optimum by more than this part of F's scale is no rounding of it.
_BETTER = 1e-6


#: Starting points of the search for the smallest relaxation.
_ELASTIC_STARTS = 8


class Status(enum.Enum):
    """How a whole solve ended; each value is the word in results."""

    OPTIMAL = "optimal"
    AVERAGED = "averaged"
    EVALUATED = "evaluated"
    SADDLE = "saddle"
    NOT_CONVERGED = "not converged"
    INFEASIBLE = "infeasible"

    @property
    def is_answer(self) -> bool:
        """Whether the solve gave what was asked for."""
        return self in (Status.OPTIMAL, Status.AVERAGED, Status.EVALUATED)


@dataclass(frozen=True, eq=False)
class Optimum:
    """An optimum that starts converged to.

    Attributes:
        F: objective.
        count: number of starts that ended there.
        x: (n,) one of the points.
        spread: largest distance between its points along one variable, as a part of that variable's range: 0 for an
            isolated optimum, up to 1 for a set of them, which may have several pieces.
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
        relaxation: for an infeasible case, the smallest movement of its limits found that makes it feasible; empty
            where none was found.
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

    @property
    def F(self) -> float:  # noqa: N802 - the objective's name
        """Objective at the optimum.

        Raises:
            EvaluationError: there is none, because the solve failed.
        """
        if not self.status.is_answer:
            raise EvaluationError(f"the solve gave no optimum: it is {self.status.value}")
        return self.nlp.evaluate(self.x)[0]


Progress = Callable[[int, int, float | None], None]


def solve(
    case: Case,
    *,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    compiled: bool = False,
    progress: Progress | None = None,
) -> Solution:
    """Solve a case with one task.

    Args:
        case: the case.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads; the result does not depend on it. Left out, as many as there are processors and work.
        compiled: whether Ipopt calls the objective as compiled C.
        progress: called after each start with the number done, the number of all, and the best F so far.

    Raises:
        CaseError: the case has several tasks, or contradicts itself.
        InputError: the objective is to be compiled, and there is no C compiler or it fails.
    """
    if len(case.tasks) > 1:
        raise CaseError("task", "are several: solve_tasks brings them together", len(case.tasks), case.source)
    search = case.search.but(starts, seed, compiled=compiled)
    return solve_nlp(formulate(case), search, jobs=jobs, progress=progress)


def solve_nlp(
    nlp: Nlp,
    search: Search,
    *,
    first: Sequence[FloatArray] = (),
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Solve a program; where its limits seem to contradict each other, find out which and by how much.

    Args:
        nlp: the program.
        search: how to search.
        first: points (n,) to start from before those that the search samples.
        jobs: as for :func:`solve`.
        progress: as for :func:`solve`.
    """
    began = time.perf_counter()
    solution = _searched(nlp, search, first=first, jobs=jobs, progress=progress)
    limited = any(any(constraint.keys) for constraint in nlp.program.constraints)
    if solution.status is not Status.INFEASIBLE or not limited:
        return solution
    stretched = formulate_relaxation(nlp)
    points = [relaxation_point(nlp, x) for x in (solution.x, nlp.start)]
    relaxed = _searched(stretched, replace(search, starts=min(search.starts, _ELASTIC_STARTS)), first=points, jobs=jobs)
    # An optimum of relaxations is often degenerate, with more limits active than it takes; what counts is that it is
    # feasible.
    feasible = [start for start in relaxed.starts if start.violation <= FEASIBLE]
    if not feasible:
        return replace(solution, seconds=time.perf_counter() - began)
    least = min(feasible, key=lambda start: start.F)
    moved = relaxed_limits(nlp, least.x)
    if not moved:
        # The limits can be met after all: the search only did not find out where.
        solution = _searched(nlp, search, first=[*first, least.x[: nlp.n]], jobs=jobs)
    return replace(solution, relaxation=moved, seconds=time.perf_counter() - began)


def _searched(
    nlp: Nlp,
    search: Search,
    *,
    first: Sequence[FloatArray] = (),
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Search a program from many starting points."""
    began = time.perf_counter()
    if nlp.n == 0:
        x = frozen_array(nlp.start, (0,))
        at = linearise(nlp, x)
        status = Status.EVALUATED if at.violation <= FEASIBLE else Status.INFEASIBLE
        evidence = None if status is Status.EVALUATED else examine(nlp, x)
        return Solution(status, nlp, x, evaluate(nlp, x), evidence, (), (), search.seed, time.perf_counter() - began)
    points = np.vstack([*first, starting_points(nlp, search.starts, search.seed)])
    done: list[Start] = []
    best: float | None = None
    for start in search_from(nlp, points, search, jobs):
        done.append(start)
        if start.status is StartStatus.CONVERGED and (best is None or nlp.sign * start.F < nlp.sign * best):
            best = start.F
        if progress is not None:
            progress(len(done), len(points), best)
    done, optima = _sorted_out(nlp, done)
    beaten = _better_unconverged(nlp, done, optima)
    if beaten is not None:
        x = beaten.x
    else:
        x = optima[0].x if optima else min(done, key=lambda start: (start.violation, start.stationarity)).x
    evidence = examine(nlp, x)
    return Solution(
        status=_status(evidence, bool(optima) and beaten is None),
        nlp=nlp,
        x=frozen_array(x, (nlp.n,)),
        state=state_or_none(nlp, x),
        evidence=evidence,
        starts=tuple(done),
        optima=tuple(optima),
        seed=search.seed,
        seconds=time.perf_counter() - began,
    )


def _better_unconverged(nlp: Nlp, done: list[Start], optima: list[Optimum]) -> Start | None:
    """A feasible point of a start that did not converge and that is better than every optimum found, if there is one.

    Then the best optimum found is not the best there is, and must not be given for it.
    """
    feasible = [start for start in done if start.status is not StartStatus.CONVERGED and start.violation <= FEASIBLE]
    if not (feasible and optima):
        return None
    best = min(feasible, key=lambda start: nlp.sign * start.F)
    gain = nlp.sign * (optima[0].F - best.F)
    return best if gain > _BETTER * nlp.objective_scale else None


def _status(evidence: Evidence, converged: bool) -> Status:
    if converged and evidence.kind.is_optimum:
        return Status.OPTIMAL
    if evidence.kind is PointKind.INFEASIBLE:
        return Status.INFEASIBLE
    return Status.SADDLE if evidence.kind is PointKind.SADDLE else Status.NOT_CONVERGED


def state_or_none(nlp: Nlp, x: FloatArray) -> RobotState | None:
    """The robot at a point, or None where its equations have no value."""
    try:
        return evaluate(nlp, x)
    except EvaluationError:
        return None


def _sorted_out(nlp: Nlp, done: list[Start]) -> tuple[list[Start], list[Optimum]]:
    """The starts, with those that ended at a saddle marked, and the distinct optima among the others, best first.

    Where an optimum is not isolated, all points of its F count as one set; it may have several pieces.
    """
    optima: list[Optimum] = []
    saddles: list[Start] = []
    converged = [start for start in done if start.status is StartStatus.CONVERGED]
    remaining = sorted(converged, key=lambda start: nlp.sign * start.F)
    while remaining:
        lead = remaining[0]
        level = [s for s in remaining if abs(s.F - lead.F) <= SAME_VALUE * nlp.objective_scale]
        groups: list[list[Start]] = []
        for start in level:
            near = next((group for group in groups if _distance(nlp, group[0].x, start.x) <= SAME_POINT), None)
            if near is None:
                groups.append([start])
            else:
                near.append(start)
        if examine(nlp, lead.x).kind is PointKind.NOT_ISOLATED:
            groups = [level]
        else:
            kinds = [examine(nlp, group[0].x).kind for group in groups]
            judged = list(zip(kinds, groups, strict=True))
            saddles += [start for kind, group in judged if not kind.is_optimum for start in group]
            groups = [group for kind, group in judged if kind.is_optimum]
        for group in groups:
            x = np.array([start.x for start in group])
            spread = float(np.max(np.ptp(x, axis=0) / (2 * nlp.scale)))
            optima.append(Optimum(group[0].F, len(group), group[0].x, spread))
        remaining = [start for start in remaining if start not in level]
    return [replace(start, status=StartStatus.SADDLE) if start in saddles else start for start in done], optima


def _distance(nlp: Nlp, one: FloatArray, other: FloatArray) -> float:
    return float(np.max(np.abs(one - other) / nlp.scale))
