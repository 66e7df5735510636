"""Several tasks for one robot: equation 15, the best weighted sum, and the best worst task.

Every task is first solved by itself. Then they are brought together:

* ``average`` (equation 15): ``Q = (1/n) sum_j w_j q_j`` of the tasks' own optima ``q_j``. As printed this is a mean
  only when the weights sum to ``n``; they are scaled so, with a notice. Lengths and angles average linearly, a rotation
  whose axis is free on SO(3), a free direction on the sphere. Nothing is optimised at ``Q``, and only bounds are sure
  to hold there, because they are convex.
* ``weighted-sum`` and ``worst-case``: one program each; see :mod:`screwsynth.nlp.program.formulation`.

Each way says what it costs: every task's F, rates and verdict at the combined point, its loss against its own optimum,
and every limit that is violated.

Where a task's optimum is not unique, its ``q_j`` is arbitrary. It is then settled by the rule *nearest to the others*:
the member of the optimal set nearest (in half ranges) to the mean of the other tasks' points, for all tasks at once,
again and again until none moves: the order of the tasks means nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..case.settings import Search
from ..case.task import Method, Sense, Task
from ..errors import CaseError
from ..evidence.kkt import FEASIBLE, correct, linearise
from ..evidence.optimality import Evidence, PointKind, examine
from ..evidence.state import RobotState
from ..program.epigraph import formulate_worst, level_of_tasks
from ..program.formulation import formulate_each, formulate_weighted, with_proximity_term
from ..program.nlp import Nlp
from ..program.places import FreeRotation
from .ipopt import StartStatus
from .multistart import SAME_VALUE, Progress, Solution, Status, solve_nlp, state_or_none

#: How strongly an optimum that is not isolated is drawn to the other tasks', in parts of F's scale, weaker and weaker:
#: the point tends to the nearest of the optimal set, and the correction that follows takes the rest off.
_DRAWN = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
#: Rounds of settling, and the movement in half ranges that ends it.
_ROUNDS = 20
_SETTLED = 1e-9


@dataclass(frozen=True, eq=False)
class TaskOutcome:
    """What a compromise means for one task.

    Attributes:
        task: the task, its weight as used.
        own: what the task could have by itself.
        unique: whether its own optimum is the only one.
        x: (n,) the member of its optimal set that was used.
        state: the robot at the combined point, with this task's rates; None where it does not exist. At the first
            pose, where there are several.
        F: the task's objective at the combined point; NaN where it does not exist.
        evidence: what the combined point is for this task alone.
        loss: how much worse its F is than its own optimum; negative where the combined search came upon a better one.
    """

    task: Task
    own: Solution
    unique: bool
    x: FloatArray
    state: RobotState | None
    F: float
    evidence: Evidence
    loss: float


@dataclass(frozen=True, eq=False)
class Compromise:
    """Several tasks brought together.

    Attributes:
        status: how it ended; ``averaged`` is the average where it keeps every limit.
        method: how they were brought together.
        case: the case.
        x: (n,) the combined point, in the variables of a single task's program.
        value: of the combined objective: the weighted sum, or the level that every task keeps; None for an average.
        outcomes: one for each task.
        violated: names of the limits that the combined point lies outside of.
        notices: what the user should know of the way there.
        combined: the solution of the combined program; None for an average.
        seconds: wall time.
    """

    status: Status
    method: Method
    case: Case
    x: FloatArray
    value: float | None
    outcomes: tuple[TaskOutcome, ...]
    violated: tuple[str, ...]
    notices: tuple[str, ...]
    combined: Solution | None
    seconds: float

    @property
    def is_made(self) -> bool:
        """Whether the point is what the method yields, be it within the limits or not."""
        alone = all(outcome.own.status.is_answer for outcome in self.outcomes)
        return alone and (self.combined is None or self.combined.status.is_answer)


TaskProgress = Callable[[str, int, int, float | None], None]


def solve_tasks(
    case: Case,
    *,
    starts: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    compiled: bool = False,
    progress: TaskProgress | None = None,
) -> Compromise:
    """Solve a case with several tasks by the method that it names.

    Args:
        case: a case with at least two tasks and something free.
        starts: number of starting points instead of the case's.
        seed: seed instead of the case's.
        jobs: number of threads.
        compiled: whether Ipopt calls the objective as compiled C.
        progress: called with what is being solved, the starts done, all starts, and the best objective so far.

    Raises:
        CaseError: the case has one task only, nothing is free, or it contradicts itself.
    """
    began = time.perf_counter()
    search = case.search.but(starts, seed, compiled=compiled)
    nlps = formulate_each(case)
    if len(nlps) < 2:
        raise CaseError("task", "is one: several are needed to bring them together", source=case.source)
    if nlps[0].n == 0:
        raise CaseError("robot", "has nothing free, so there is nothing to bring together", source=case.source)

    def told(what: str) -> Progress | None:
        return None if progress is None else lambda done, total, best: progress(what, done, total, best)

    own = [
        solve_nlp(nlp, search, jobs=jobs, progress=told(task.name)) for nlp, task in zip(nlps, case.tasks, strict=True)
    ]
    weights, notices = _weights(case)
    points, unique, told_of = _settled(nlps, own, search)
    notices += told_of
    combined: Solution | None = None
    if not all(solution.status.is_answer for solution in own):
        x, status, value = own[0].x, next(s.status for s in own if not s.status.is_answer), None
        notices.append("a task has no optimum by itself, so there is nothing to bring together")
    elif case.method is Method.AVERAGE:
        x, status, value = _average(nlps[0], points, weights), Status.AVERAGED, None
    else:
        combined = _combined(case, nlps, own, points, weights, search, jobs, told(case.method.value))
        x, status, value = combined.x[: nlps[0].n], combined.status, combined.nlp.evaluate(combined.x)[0]
    at = linearise(nlps[0], x)
    violated = tuple(dict.fromkeys(at.sides[j].name for j in np.flatnonzero(at.slack < -FEASIBLE)))
    if violated and status.is_answer:
        status = Status.INFEASIBLE
    return Compromise(
        status=status,
        method=case.method,
        case=case,
        x=frozen_array(x, (nlps[0].n,)),
        value=value,
        outcomes=tuple(
            _outcome(nlp, replace(task, weight=weight), solution, alone, point, x)
            for nlp, task, weight, solution, alone, point in zip(
                nlps, case.tasks, weights, own, unique, points, strict=True
            )
        ),
        violated=violated,
        notices=tuple(notices),
        combined=combined,
        seconds=time.perf_counter() - began,
    )


def _weights(case: Case) -> tuple[list[float], list[str]]:
    """Weights that sum to the number of tasks, as equation 15 needs them."""
    given = [task.weight for task in case.tasks]
    total, n = sum(given), len(given)
    if abs(total - n) <= 1e-12 * n:
        return given, []
    scaled = [weight * n / total for weight in given]
    shown = ", ".join(f"{weight:g}" for weight in scaled)
    return scaled, [f"the weights sum to {total:g} and were scaled to sum to {n}, the number of tasks: {shown}"]


def _outcome(nlp: Nlp, task: Task, own: Solution, unique: bool, point: FloatArray, x: FloatArray) -> TaskOutcome:
    state = state_or_none(nlp, x)
    F = float("nan") if state is None else nlp.evaluate(x)[0]
    best = nlp.evaluate(own.x)[0]
    loss = best - F if task.sense is Sense.MAX else F - best
    return TaskOutcome(task, own, unique, frozen_array(point, (nlp.n,)), state, F, examine(nlp, x), loss)


def _combined(
    case: Case,
    nlps: Sequence[Nlp],
    own: Sequence[Solution],
    points: Sequence[FloatArray],
    weights: Sequence[float],
    search: Search,
    jobs: int | None,
    progress: Progress | None,
) -> Solution:
    """The combined program solved, from the tasks' own optima, their average, and the search's starts."""
    first = [*points, _average(nlps[0], points, weights)]
    if case.method is Method.WEIGHTED_SUM:
        return solve_nlp(formulate_weighted(case, weights), search, first=first, jobs=jobs, progress=progress)
    best = [nlp.evaluate(solution.x)[0] for nlp, solution in zip(nlps, own, strict=True)]
    levels = [level_of_tasks(case, [nlp.evaluate(x)[0] for nlp in nlps], weights, best) for x in first]
    # No answer is beyond the least of the tasks' own maxima, nor worse than the best of the first points.
    senses = {task.sense for task in case.tasks}
    ceiling = min(b / w for b, w in zip(best, weights, strict=True)) if senses == {Sense.MAX} else min(levels)
    floor = 1e-3 * max(nlp.objective_scale for nlp in nlps)
    nlp = formulate_worst(case, weights, best, max(ceiling, floor))
    bounded = np.clip(levels, nlp.lower[-1], nlp.upper[-1])
    starts = [np.append(x, level) for x, level in zip(first, bounded, strict=True)]
    return solve_nlp(nlp, search, first=starts, jobs=jobs, progress=progress)


def _settled(
    nlps: Sequence[Nlp], own: Sequence[Solution], search: Search
) -> tuple[list[FloatArray], list[bool], list[str]]:
    """A point of each task's optimal set, whether it is the only one, and notices about those that are not."""
    points = [np.array(solution.x) for solution in own]
    members = [_members(solution) for solution in own]
    unique = [len(each) == 1 and not _is_set(solution) for each, solution in zip(members, own, strict=True)]
    notices = [
        f"the optimum of {solution.nlp.case.tasks[j].name!r} is not unique: "
        "the one nearest to the other tasks' optima was used"
        for j, solution in enumerate(own)
        if not unique[j] and solution.status.is_answer
    ]
    for _ in range(_ROUNDS if notices else 0):
        following = list(points)
        for j in range(len(own)):
            if not unique[j]:
                target = np.mean([point for k, point in enumerate(points) if k != j], axis=0)
                following[j] = _nearest(nlps[j], own[j], members[j], target, search)
        moved = max(float(np.max(np.abs(a - b) / nlps[0].scale)) for a, b in zip(following, points, strict=True))
        points = following
        if moved <= _SETTLED:
            break
    return points, unique, notices


def _is_set(solution: Solution) -> bool:
    return solution.evidence is not None and solution.evidence.kind in (PointKind.NOT_ISOLATED, PointKind.UNDECIDED)


def _members(solution: Solution) -> list[FloatArray]:
    """Known members of a solution's optimal set: one of each isolated optimum, every start's point on a set of them."""
    if not solution.optima:
        return [np.array(solution.x)]
    tolerance = SAME_VALUE * solution.nlp.objective_scale
    best = solution.optima[0].F
    if _is_set(solution):
        converged = [start for start in solution.starts if start.status is StartStatus.CONVERGED]
        return [start.x for start in converged if abs(start.F - best) <= tolerance]
    return [optimum.x for optimum in solution.optima if abs(optimum.F - best) <= tolerance]


def _nearest(
    nlp: Nlp, solution: Solution, members: Sequence[FloatArray], target: FloatArray, search: Search
) -> FloatArray:
    """The member of a task's optimal set nearest to a point, as far as it can be found from the known members."""

    def distance(x: FloatArray) -> float:
        return float(np.linalg.norm((x - target) / nlp.scale))

    closest = min(members, key=distance)
    if not _is_set(solution):
        return closest
    best = nlp.evaluate(solution.x)[0]
    points = [closest, target]
    for strength in _DRAWN:
        drawn = solve_nlp(with_proximity_term(nlp, target, strength), replace(search, starts=1), first=points, jobs=1)
        points = [drawn.x]
        for start in drawn.starts:
            back = correct(nlp, start.x, linearise(nlp, start.x).active())
            kept = abs(back.F - best) <= SAME_VALUE * nlp.objective_scale and back.violation <= FEASIBLE
            if kept and distance(back.x) < distance(closest):
                closest = back.x
    return closest


def _average(nlp: Nlp, points: Sequence[FloatArray], weights: Sequence[float]) -> FloatArray:
    """``Q = (1/n) sum_j w_j q_j`` over points (n,), rotations and directions on their own manifolds."""
    shares = np.array(weights) / len(weights)
    Q = shares @ np.array(points)
    for triple in nlp.program.places.directions:
        size = float(np.linalg.norm(Q[list(triple)]))
        if size > 0:
            Q[list(triple)] /= size
    for rotation in nlp.program.places.rotations:
        if isinstance(rotation, FreeRotation):
            q = list(rotation.q)
            Q[q] = _mean_rotation([point[q] for point in points], shares)
    return np.asarray(Q, dtype=np.float64)


def _mean_rotation(vectors: Sequence[FloatArray], shares: FloatArray) -> FloatArray:
    """Quaternion vector of the weighted chordal mean of rotations given by theirs.

    The chordal mean of matrices is that of unit quaternions without their signs: the eigenvector of ``sum w q q'`` with
    the largest eigenvalue (F. L. Markley et al., *Averaging Quaternions*, J. Guidance 30 (2007)).
    """
    q = np.array([[np.sqrt(max(1 - float(v @ v), 0.0)), *v] for v in vectors])
    _, directions = np.linalg.eigh((q * shares[:, None]).T @ q)
    mean = directions[:, -1]
    return np.asarray(mean[1:] * (1.0 if mean[0] >= 0 else -1.0), dtype=np.float64)
