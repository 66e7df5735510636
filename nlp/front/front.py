"""The front of two goals, spread evenly by an adaptive rule.

The ends are the optima of each goal alone. Then the widest gap between neighbours is divided, in goals divided by the
distance of the ends: the goal that differs more in the gap gets a bound in the middle, and the other one is optimised.
Where this leads back to an end of the gap with either goal as the bounded one, the front has no point in the gap.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...models import FloatArray
from ..case.case import Case
from ..case.settings import Search
from ..certificate.branchandbound import certify_program
from ..certificate.certificate import Certificate
from ..errors import EvaluationError
from ..interruption import is_requested
from ..solver.multistart import ProgramSolution, solve_program
from .goals import Goal
from .programs import GoalProgram, check_goals, program_of

#: Points whose goals differ by less than this part of the distance of the ends are one point of the front.
_SAME = 1e-6
#: A point is dominated where no goal is better than that of another by more than this part: rounding of a bound.
_ROUNDING = 1e-8


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """A point of a front: the optimum of one goal within a bound of the other.

    Attributes:
        values: (2,) the goals, angles in radians.
        program: whose optimum it is.
        bound: of the other goal; None at an end.
        solution: of the program, with its evidence.
        certificate: proven bound of the optimised goal; None where none was asked for.
    """

    values: FloatArray
    program: GoalProgram
    bound: float | None
    solution: ProgramSolution
    certificate: Certificate | None = None


@dataclass(frozen=True, eq=False)
class Front:
    """A front of two goals.

    Attributes:
        case: the case.
        goals: both goals.
        points: none of which dominates another, in the order of the first goal, its best value last.
        gaps: pairs of neighbours (index of the first) between which the front has no point.
        failed: number of searches that found no optimum.
        seconds: wall time.
    """

    case: Case
    goals: tuple[Goal, Goal]
    points: tuple[FrontPoint, ...]
    gaps: tuple[int, ...]
    failed: int
    seconds: float


def find_front(
    case: Case,
    goals: tuple[Goal, Goal],
    count: int,
    *,
    search: Search,
    jobs: int | None = None,
    certify: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Front:
    """Return the front of two goals.

    Args:
        case: the case.
        goals: both goals.
        count: number of points, at least 2; fewer where the front has gaps or is one point.
        search: number of starts, seed and the solver's settings.
        jobs: number of threads; the result does not depend on it.
        certify: whether the optimum of each point is proved too.
        progress: called after each solve with the numbers of points found and wanted.

    Raises:
        CaseError: the case contradicts itself.
        InputError: a limit is not in the case or cannot move.
        EvaluationError: a goal alone has no optimum.
        UncoveredError: an optimum is to be proved, and an expression has an operation without a rule.
    """
    began = time.perf_counter()
    check_goals(case, goals)
    builder = _Builder(case, goals, search, jobs)
    ends = [builder.solve(k, None, []) for k in (1, 0)]
    found = [end for end in ends if end is not None]
    if len(found) < 2:
        which = goals[1 if ends[0] is None else 0]
        raise EvaluationError(
            f"{case.source or case.name}: the goal {which.label} alone has no optimum within the limits"
        )
    size = np.abs(found[0].values - found[1].values)
    size = np.where(size > 0, size, 1.0)
    closed: set[tuple[int, int]] = set()
    while len(found) < count and not is_requested():
        if progress is not None:
            progress(len(found), count)
        pair = _widest(found, closed, size)
        if pair is None:
            break
        middle = builder.between(found[pair], found[pair + 1], size)
        if middle is None:
            closed.add((id(found[pair]), id(found[pair + 1])))
            continue
        found = _undominated([*found, middle], goals, size)
    found = _undominated(found, goals, size)
    gaps = [k for k in range(len(found) - 1) if (id(found[k]), id(found[k + 1])) in closed]
    if certify:
        found = [replace(point, certificate=_certificate(point, jobs)) for point in found]
    return Front(case, goals, tuple(found), tuple(gaps), builder.failed, time.perf_counter() - began)


class _Builder:
    """Solves of the programs of a front.

    Args:
        case: the case.
        goals: both goals.
        search: number of starts, seed and the solver's settings.
        jobs: number of threads.
    """

    def __init__(self, case: Case, goals: tuple[Goal, Goal], search: Search, jobs: int | None) -> None:
        self.case, self.goals, self.search, self.jobs = case, goals, search, jobs
        self.failed = 0

    def solve(self, optimised: int, bound: float | None, near: list[FrontPoint]) -> FrontPoint | None:
        """Return the optimum of one goal within a bound of the other; None where none is found."""
        program = program_of(self.case, self.goals, optimised, bound)
        nlp = program.nlp
        first = [_start(program, point) for point in near]
        solution = solve_program(nlp, self.search, first=first, jobs=self.jobs)
        if not solution.status.is_answer:
            self.failed += 1
            return None
        return FrontPoint(program.measure(solution.x), replace(program, nlp=solution.nlp), bound, solution)

    def between(self, one: FrontPoint, other: FrontPoint, size: FloatArray) -> FrontPoint | None:
        """Return a point between two neighbours; None where the front has none."""
        apart = np.abs(one.values - other.values) / size
        for bounded in np.argsort(-apart, kind="stable").tolist():
            if apart[bounded] <= _SAME:
                continue
            bound = float((one.values[bounded] + other.values[bounded]) / 2)
            found = self.solve(1 - bounded, bound, [one, other])
            if found is not None and all(
                np.max(np.abs(found.values - each.values) / size) > _SAME for each in (one, other)
            ):
                return found
        return None


def _start(program: GoalProgram, point: FrontPoint) -> FloatArray:
    """Return a point of the front as a start of another program, between its bounds.

    A program whose optimised goal is a limit has that limit's number as its last variable.
    """
    nlp = program.nlp
    level = point.values[program.optimised]
    both: FloatArray = np.append(point.solution.x, level)[: nlp.n]
    if nlp.n > point.solution.x.size:
        both[-1] = level
    return np.asarray(np.clip(both, nlp.lower, nlp.upper), dtype=np.float64)


def _widest(points: list[FrontPoint], closed: set[tuple[int, int]], size: FloatArray) -> int | None:
    """Return the index of the first of the two neighbours farthest apart; None where no gap can be divided."""
    best, widest = None, _SAME
    for k in range(len(points) - 1):
        apart = float(np.linalg.norm((points[k].values - points[k + 1].values) / size))
        if apart > widest and (id(points[k]), id(points[k + 1])) not in closed:
            best, widest = k, apart
    return best


def _undominated(points: list[FrontPoint], goals: tuple[Goal, Goal], size: FloatArray) -> list[FrontPoint]:
    """Return the points that no other one dominates, in the order of the first goal, its best value last."""
    signs = np.array([goal.sign for goal in goals])
    costs = [signs * point.values / size for point in points]
    kept = []
    for k, cost in enumerate(costs):
        # Of points that are the same within rounding, the first one stays.
        beaten = any(
            (other <= cost + _ROUNDING).all() and ((other < cost - _ROUNDING).any() or j < k)
            for j, other in enumerate(costs)
            if j != k
        )
        if not beaten:
            kept.append(k)
    return [points[k] for k in sorted(kept, key=lambda k: (-costs[k][0], costs[k][1]))]


def _certificate(point: FrontPoint, jobs: int | None) -> Certificate:
    """Return the proven bound of a point's optimised goal."""
    return certify_program(point.solution.nlp, point.solution.x, claimed=point.solution.F, jobs=jobs)
