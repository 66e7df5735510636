"""Pareto front of two or more goals, with evenly spread points by an adaptive rule.

The ends are the separate optima of the goals; if such an optimum is not unique, the other goals are optimised within
it. Goals are scaled by the distance of the ends.

Two goals: the widest gap between neighbours is divided. The goal with the larger difference gets a bound in the middle
of the gap, and the other goal is optimised. If this returns an end of the gap, for either goal as the bounded one, the
front has no point in the gap.

More goals: the next box is that with room for the largest piece of the front (:mod:`.boxes`). The goal along its
shortest side is optimised, and all other goals get bounds in the middle of their sides. If this gives no new point, the
other goals are optimised in turn; if none gives a point, the box is closed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...models import FloatArray
from ..case.case import Case
from ..case.settings import Search
from ..errors import EvaluationError, InputError
from ..interruption import Milestone, is_requested, one_call, reached, seconds_left, why_stopped, within
from ..proof.certificate.branch_and_bound import certify_program
from ..proof.certificate.certificate import Certificate
from ..proof.enclosure.engine import kernel
from ..solver.multistart import ProgramSolution, solve_program
from ..solver.searchjournal import kept_certificate
from ..solver.status import Status
from .boxes import GoalBox, Region
from .goals import Goal, GoalProgram, loosest_numbers, program_of, read_goals

#: Default number of points of a front.
POINTS = 16
#: Difference of goals, relative to the distance of the ends, below which two points are one point of the front.
_SAME = 1e-6
#: Relative difference by which a goal must be better for a point not to be dominated: rounding error of a bound.
_ROUNDING = 1e-8


@dataclass(frozen=True, eq=False)
class FrontPoint:
    """Point of a front: the optimum of one goal within bounds on the other goals.

    Attributes:
        values: (k,) values of the goals, angles in radians.
        program: program of the point.
        bounds: bound on each goal; None for the optimised goal, and for all goals at an end.
        solution: solution of the program, with its evidence.
        certificate: certificate of the optimised goal; None if not requested.
    """

    values: FloatArray
    program: GoalProgram
    bounds: tuple[float | None, ...]
    solution: ProgramSolution
    certificate: Certificate | None = None


@dataclass(frozen=True, eq=False)
class Front:
    """Pareto front of two or more goals.

    Attributes:
        case: case of the front.
        goals: k goals.
        points: nondominated points, from the worst to the best value of the first goal.
        gaps: for two goals, indices of the points after which the front has a gap.
        failed: number of searches without an optimum.
        seconds: wall time.
    """

    case: Case
    goals: tuple[Goal, ...]
    points: tuple[FrontPoint, ...]
    gaps: tuple[int, ...]
    failed: int
    seconds: float


@one_call
def pareto(
    case: Case,
    goals: Sequence[str],
    *,
    points: int = POINTS,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    certified: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Front:
    """Return the Pareto front of two or more goals of a case.

    Args:
        case: case of the front; every point satisfies all its limits.
        goals: texts of the goals, such as ``["max F:drive", "min limits.leg_length.max"]``.
        points: number of points, 2 or more; a front with gaps may have fewer points.
        starts: number of starting points; by default the number of the case.
        seed: seed that replaces the seed of the case.
        jobs: number of threads; the result does not depend on it.
        certified: If true, also compute a certificate for each point.
        progress: function called after each solve with the current and the requested number of points.

    Raises:
        CaseError: the case contradicts itself.
        InputError: a goal is unknown in the case, occurs twice, or is a limit that cannot be a goal; or there is only
                    one goal.
        EvaluationError: a goal has no separate optimum.
        UncoveredError: certificates are requested, and an expression has an operation without a rule.
    """
    if points < 2:
        raise InputError(f"pareto: points = {points}: must be at least 2")
    began, search, wanted = time.perf_counter(), case.search.but(starts, seed), read_goals(goals, case)
    if certified:
        kernel()  # an error before any solve if it is missing
    loosest = loosest_numbers(case, wanted)
    builder = _Builder(case, wanted, search, jobs)
    nothing = (None,) * len(wanted)
    ends: list[FrontPoint] = []
    for k in (1, 0, *range(2, len(wanted))):
        end = builder.solve(k, nothing, [])
        if is_requested():
            raise InputError(
                f"{case.source or case.name}: {why_stopped()} before the extreme points of the front are computed"
            )
        if end is None:
            fault = f"the goal {wanted[k].label} has no separate optimum within the limits"
            raise EvaluationError(f"{case.source or case.name}: {fault}")
        ends.append(end)
    size = np.ptp([end.values for end in ends], axis=0)
    size = np.where(size > 0, size, 1.0)
    ends = [builder.polished(end, size) for end in ends]
    reached(Milestone.POINT)
    say = progress or (lambda _done, _total: None)
    if len(wanted) == 2:
        found, gaps = _spread_between(builder, ends, size, points, say)
    else:
        found, gaps = _spread_in_boxes(builder, ends, size, loosest, points, say), []
    if certified:
        found = [replace(point, certificate=_certificate(point, jobs, len(found) - k)) for k, point in enumerate(found)]
    return Front(case, wanted, tuple(found), tuple(gaps), builder.failed, time.perf_counter() - began)


def _spread_between(
    builder: _Builder, ends: list[FrontPoint], size: FloatArray, count: int, progress: Callable[[int, int], None]
) -> tuple[list[FrontPoint], list[int]]:
    """Return the points of a front of two goals, and the pairs of neighbours that enclose a gap."""
    found, closed = list(ends), set[tuple[int, int]]()
    while len(found) < count and not is_requested():
        progress(len(found), count)
        pair = _widest(found, closed, size)
        if pair is None:
            break
        middle = builder.between(found[pair], found[pair + 1], size)
        if middle is None:
            if is_requested():  # an interrupted search does not prove a gap
                break
            closed.add((id(found[pair]), id(found[pair + 1])))
            continue
        kept = _undominated([*found, middle], builder.goals, size)
        if not any(each is middle for each in kept):  # a search again would find the same dominated point
            closed.add((id(found[pair]), id(found[pair + 1])))
        found = kept
    found = _undominated(found, builder.goals, size)
    return found, [k for k in range(len(found) - 1) if (id(found[k]), id(found[k + 1])) in closed]


def _spread_in_boxes(
    builder: _Builder,
    ends: list[FrontPoint],
    size: FloatArray,
    loosest: FloatArray,
    count: int,
    progress: Callable[[int, int], None],
) -> list[FrontPoint]:
    """Return the points of a front of more than two goals.

    The boxes extend to the worst value of each goal at the ends or in the case, and farther if a point is beyond.
    """
    signs, found = builder.signs, _undominated(ends, builder.goals, size)
    closed = set[tuple[float, ...]]()

    def cost(values: FloatArray) -> FloatArray:
        return np.asarray(signs * values / size)

    costs = np.array([cost(end.values) for end in ends])
    best, worst = costs.min(axis=0), np.fmax(costs.max(axis=0), cost(loosest))
    region = Region(best, worst, [cost(point.values) for point in found])
    while len(found) < count and not is_requested():
        progress(len(found), count)
        box = region.widest(closed)
        if box is None:
            break
        point = _point_in(builder, box, found, size)
        if point is None:
            closed.add(tuple(box.upper))
            continue
        kept = _undominated([*found, point], builder.goals, size)
        if len(kept) == len(found) + 1 and (cost(point.values) <= worst).all():
            region.add(cost(point.values))
        else:
            worst = np.maximum(worst, cost(point.values))
            region = Region(best, worst, [cost(each.values) for each in kept])
        found = kept
    return found


def _point_in(builder: _Builder, box: GoalBox, known: list[FrontPoint], size: FloatArray) -> FrontPoint | None:
    """Return a new point of a front from bounds in the middle of a box; None if no optimised goal gives one."""
    middle = (box.lower + box.upper) / 2 * size * builder.signs
    for k in np.argsort(box.sides, kind="stable").tolist():
        bounds = tuple(None if j == k else float(value) for j, value in enumerate(middle))
        point = builder.solve(k, bounds, _nearest(known, middle, size))
        if point is None or any(np.max(np.abs(point.values - each.values) / size) <= _SAME for each in known):
            continue
        if any(each is point for each in _undominated([*known, point], builder.goals, size)):
            return point
    return None


def _nearest(points: list[FrontPoint], middle: FloatArray, size: FloatArray) -> list[FrontPoint]:
    """Return the points of a front nearest to goals (k,), as starts of a search."""
    return sorted(points, key=lambda point: float(np.linalg.norm((point.values - middle) / size)))[:2]


class _Builder:
    """Solver of the programs of a front.

    Args:
        case: case of the front.
        goals: all goals.
        search: number of starts, seed and settings of the solver.
        jobs: number of threads.
    """

    def __init__(self, case: Case, goals: tuple[Goal, ...], search: Search, jobs: int | None) -> None:
        self.case, self.goals, self.search, self.jobs = case, goals, search, jobs
        self.failed = 0

    @property
    def signs(self) -> FloatArray:
        """Factors (k,) that turn the goals into costs."""
        return np.array([goal.sign for goal in self.goals])

    def solve(self, optimised: int, bounds: tuple[float | None, ...], near: list[FrontPoint]) -> FrontPoint | None:
        """Return the optimum of one goal within bounds on the other goals; None without an optimum."""
        program = program_of(self.case, self.goals, optimised, bounds)
        nlp = program.nlp
        first = [_start(program, point) for point in near]
        solution = solve_program(nlp, self.search, first=first, jobs=self.jobs)
        if not solution.status.is_answer:
            # An interrupted search does not count as failed.
            self.failed += solution.status is not Status.INTERRUPTED
            return None
        return FrontPoint(program.measure(solution.x), replace(program, nlp=solution.nlp), bounds, solution)

    def polished(self, end: FrontPoint, size: FloatArray) -> FrontPoint:
        """Return an end whose other goals are optimised too, for a separate optimum that is not unique."""
        k = end.program.optimised
        for j in range(len(self.goals)):
            if j == k:
                continue
            # As tight as rounding allows: with the optimum as the bound, a program may have no interior point.
            bounds = [
                None if i == j else float(value) for i, value in enumerate(end.values + self.signs * _ROUNDING * size)
            ]
            if end.bounds == (None,) * len(self.goals):
                bounds = [bound if i == k else None for i, bound in enumerate(bounds)]
            found = self.solve(j, tuple(bounds), [end])
            if found is not None and (self.signs * (end.values - found.values))[j] > _SAME * size[j]:
                end = found
        return end

    def between(self, one: FrontPoint, other: FrontPoint, size: FloatArray) -> FrontPoint | None:
        """Return a point between two neighbours; None if the front has no point between them."""
        apart = np.abs(one.values - other.values) / size
        for bounded in np.argsort(-apart, kind="stable").tolist():
            if apart[bounded] <= _SAME:
                continue
            bound = float((one.values[bounded] + other.values[bounded]) / 2)
            bounds = (bound, None) if bounded == 0 else (None, bound)
            found = self.solve(1 - bounded, bounds, [one, other])
            if found is not None and all(
                np.max(np.abs(found.values - each.values) / size) > _SAME for each in (one, other)
            ):
                return found
        return None


def _start(program: GoalProgram, point: FrontPoint) -> FloatArray:
    """Return a point of the front as a start of another program, projected between its bounds.

    A program with a limit as the optimised goal has the value of the limit, in the case's unit, as its last variable.
    """
    nlp = program.nlp
    dimension = program.readings[program.optimised][0].dimension
    level = nlp.case.units.shown(float(point.values[program.optimised]), dimension)
    both: FloatArray = np.append(point.solution.x, level)[: nlp.n]
    if nlp.n > point.solution.x.size:
        both[-1] = level
    return np.asarray(np.clip(both, nlp.lower, nlp.upper), dtype=np.float64)


def _widest(points: list[FrontPoint], closed: set[tuple[int, int]], size: FloatArray) -> int | None:
    """Return the index of the first of the two most distant neighbours; None if no gap can be divided."""
    best, widest = None, _SAME
    for k in range(len(points) - 1):
        apart = float(np.linalg.norm((points[k].values - points[k + 1].values) / size))
        if apart > widest and (id(points[k]), id(points[k + 1])) not in closed:
            best, widest = k, apart
    return best


def _undominated(points: list[FrontPoint], goals: tuple[Goal, ...], size: FloatArray) -> list[FrontPoint]:
    """Return the nondominated points, from the worst to the best value of the first goal."""
    signs = np.array([goal.sign for goal in goals])
    costs = [signs * point.values / size for point in points]
    kept = []
    for k, cost in enumerate(costs):
        # Of points that are equal within rounding, keep the first.
        beaten = any(
            (other <= cost + _ROUNDING).all() and ((other < cost - _ROUNDING).any() or j < k)
            for j, other in enumerate(costs)
            if j != k
        )
        if not beaten:
            kept.append(k)
    return [points[k] for k in sorted(kept, key=lambda k: (-costs[k][0], costs[k][1]))]


def _certificate(point: FrontPoint, jobs: int | None, left: int) -> Certificate:
    """Return the certificate of the optimised goal of a point; ``left`` points share the remaining time equally."""
    with within(seconds_left() / left):
        nlp, x = point.solution.nlp, point.solution.x
        return kept_certificate(nlp, x, partial(certify_program, nlp, x, claimed=point.solution.F, jobs=jobs))
