"""Combination of several tasks for one robot: average (equation 15), best weighted sum, or best worst case.

Every task is first solved by itself. Then the tasks are combined:

* ``average`` (equation 15): ``Q = (1/n) sum_j w_j q_j`` over the optima ``q_j`` of the tasks. As printed this is a mean
  only if the weights sum to ``n``: the weights are scaled to that sum, with a notice. Lengths and angles are averaged
  linearly, a rotation with a free axis on SO(3), a free direction on the sphere. Nothing is optimised at ``Q``, and
  only the bounds of the variables are guaranteed there, because a box is convex.
* ``weighted-sum`` and ``worst-case``: one program each; see :mod:`screwsynth.nlp.program.formulation`.

If dimensions or the pose change from task to task, the program of a task has only its own variables. The combined
program has those that all tasks share, and those of every task; an average is of the shared ones.

Each method reports its cost: F, rates and verdict of every task at the combined point, the loss against the optimum of
the task, and every violated limit.

If the optimum of a task is not unique, its ``q_j`` is arbitrary. It is then the point of the optimal set nearest (in
half ranges) to the mean of the other tasks' points. This is repeated for all tasks at once until no point moves, so
that the result does not depend on the order of the tasks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from ...models import FloatArray, frozen_array
from ..case.case import Case
from ..case.task import Method, Sense, Task
from ..evidence.kkt import FEASIBLE, close_equations, correct_point, linearise
from ..evidence.margins import measured_slack
from ..evidence.optimality import PointKind, examine
from ..evidence.state import state_or_none
from ..program.epigraph import formulate_worst, level_of_tasks
from ..program.formulation import formulate_weighted, proximity_program, scaled_weights, with_proximity_term
from ..program.nlp import Nlp
from ..program.pairs import with_pairs_at
from ..program.places import FreeRotation
from ..program.program import Program
from .multistart import ProgramSolution
from .solution import Combination, Solution, TaskOutcome
from .starts import StartStatus, same_value
from .status import Status

#: Weights of the distance to the other tasks' points, relative to the scale of F, for the search of the nearest optimum
#: of a set: descending weights approach this optimum, and a final correction removes the rest.
_DISTANCE_WEIGHTS = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
#: Largest number of rounds of this choice, and the movement in half ranges below which the rounds end.
_ROUNDS = 20
_STILL = 1e-9


class SolveOne(Protocol):
    """A function that solves one program with the settings of the whole solve."""

    def __call__(self, name: str, nlp: Nlp, first: Sequence[FloatArray] = ()) -> ProgramSolution:
        """Solve a program with a name for progress messages, from points (n,) and from sampled starting points."""
        ...


class Polish(Protocol):
    """A function that searches one program from points close to its solution."""

    def __call__(self, nlp: Nlp, *, first: Sequence[FloatArray]) -> ProgramSolution:
        """Search a program from the points ``first`` (n,) and from a few sampled starting points."""
        ...


def solution_of_one_task(case: Case, own: ProgramSolution) -> Solution:
    """Return the solution of a case with only one task, from the solution of the task's program."""
    F = own.nlp.evaluate(own.x)[0]
    outcome = TaskOutcome(case.tasks[0], own, _is_unique(own), own.x, own.state, F, own.evidence, 0.0, own.x)
    return Solution(case, own.status, own.x, (outcome,), None, own.seconds)


def combine(
    case: Case,
    nlps: Sequence[Nlp],
    own: Sequence[ProgramSolution],
    solve_one: SolveOne,
    polish: Polish,
    beside: Sequence[Sequence[FloatArray]] = (),
) -> Solution:
    """Combine several separately solved tasks by the method of the case.

    Args:
        case: case with at least two tasks and a free variable.
        nlps: nonlinear program of each task.
        own: solution of each task's program.
        solve_one: function that solves the combined program.
        polish: function that searches the nearest optimum of a set.
        beside: further points at which the combined search starts, each as the point of every task's program.

    Returns:
        The solution; its time is not set.
    """
    weights = scaled_weights(case)
    whole = formulate_weighted(case, weights) if case.changes else nlps[0]
    points, unique, notices = _choose_members(case, whole, nlps, own, polish)
    joined = _joined(whole, points)
    notices = [*_scaling_notices(case, weights), *notices]
    combined: ProgramSolution | None = None
    if not all(solution.status.is_answer for solution in own):
        x, status, value = joined[0], next(s.status for s in own if not s.status.is_answer), None
        x = x if case.changes else own[0].x
        notices.append("the tasks cannot be combined: a task has no optimum by itself")
    elif case.method is Method.AVERAGE:
        x, status, value = _average(whole, joined, weights), Status.AVERAGED, None
    else:
        joined += [_joined(whole, each)[0] for each in beside if _fits(nlps, each)]
        combined = _solve_combined(case, whole, nlps, own, joined, weights, solve_one)
        x, status, value = combined.x[: whole.n], combined.status, combined.nlp.evaluate(combined.x)[0]
    paired = with_pairs_at(whole, [x])
    at = linearise(paired, x)
    outside = np.flatnonzero(~(measured_slack(paired, x, at) >= -FEASIBLE))
    violated = tuple(dict.fromkeys(at.sides[j].name for j in outside))
    if violated and status.is_answer:
        status = Status.INFEASIBLE
    return Solution(
        case=case,
        status=status,
        x=frozen_array(x, (whole.n,)),
        outcomes=tuple(
            _outcome(nlp, replace(task, weight=weight), solution, is_unique, point, _at_task(whole, x, j))
            for j, (nlp, task, weight, solution, is_unique, point) in enumerate(
                zip(nlps, case.tasks, weights, own, unique, points, strict=True)
            )
        ),
        combination=Combination(case.method, value, tuple(weights), violated, tuple(notices), combined, whole),
        seconds=0.0,
    )


def _scaling_notices(case: Case, scaled: Sequence[float]) -> list[str]:
    """Return a notice if the stated weights of a case were scaled."""
    given = [task.weight for task in case.tasks]
    if given == scaled:
        return []
    n, shown = len(given), ", ".join(f"{weight:g}" for weight in scaled)
    return [f"the weights sum to {sum(given):g} and were scaled to sum to {n}, the number of tasks: {shown}"]


def _outcome(nlp: Nlp, task: Task, own: ProgramSolution, unique: bool, point: FloatArray, x: FloatArray) -> TaskOutcome:
    """Return the outcome of a task at the combined point (n,)."""
    state = state_or_none(nlp, x)
    F = float("nan") if state is None else nlp.evaluate(x)[0]
    best = nlp.evaluate(own.x)[0]
    loss = best - F if task.sense is Sense.MAX else F - best
    at = frozen_array(x, (nlp.n,))
    return TaskOutcome(task, own, unique, frozen_array(point, (nlp.n,)), state, F, examine(nlp, x), loss, at)


def _at_task(whole: Nlp, x: FloatArray, task: int) -> FloatArray:
    """Return the variables of one task's program at a point (n,) of the whole program."""
    return x[whole.program.places.of_task(task, len(x))]


def _fits(nlps: Sequence[Nlp], points: Sequence[FloatArray]) -> bool:
    """Return whether each of several points has as many components as the program of its task has variables."""
    return all(nlp.n == len(point) for nlp, point in zip(nlps, points, strict=True))


def _joined(whole: Nlp, points: Sequence[FloatArray]) -> list[FloatArray]:
    """Return a point (n,) of the whole program for each task's point.

    The variables that all tasks share are those of the task; the others are those of their own task's point.
    """
    places = [whole.program.places.of_task(task, whole.n) for task in range(len(points))]
    joined = []
    for task, own in enumerate(points):
        x = np.zeros(whole.n)
        for at, point in zip(places, points, strict=True):
            x[at] = point
        x[places[task]] = own
        joined.append(x)
    return joined


def _solve_combined(
    case: Case,
    whole: Nlp,
    nlps: Sequence[Nlp],
    own: Sequence[ProgramSolution],
    points: Sequence[FloatArray],
    weights: Sequence[float],
    solve_one: SolveOne,
) -> ProgramSolution:
    """Solve the combined program from the optima of the tasks, their average, and sampled starting points."""
    first = [*points, _average(whole, points[: len(nlps)], weights)]
    if case.method is Method.WEIGHTED_SUM:
        return solve_one(case.method.value, whole if case.changes else formulate_weighted(case, weights), first)
    best = [nlp.evaluate(solution.x)[0] for nlp, solution in zip(nlps, own, strict=True)]
    each = [[nlp.evaluate(_at_task(whole, x, j))[0] for j, nlp in enumerate(nlps)] for x in first]
    levels = [level_of_tasks(case, values, weights, best) for values in each]
    # The level cannot exceed the smallest maximum of a task, nor be worse than at the best of the first points.
    senses = {task.sense for task in case.tasks}
    ceiling = min(b / w for b, w in zip(best, weights, strict=True)) if senses == {Sense.MAX} else min(levels)
    floor = 1e-3 * max(nlp.objective_size for nlp in nlps)
    nlp = formulate_worst(case, weights, best, max(ceiling, floor))
    bounded = np.clip(levels, nlp.lower[-1], nlp.upper[-1])
    starts = [np.append(x, level) for x, level in zip(first, bounded, strict=True)]
    return solve_one(case.method.value, nlp, starts)


def _choose_members(
    case: Case, whole: Nlp, nlps: Sequence[Nlp], own: Sequence[ProgramSolution], polish: Polish
) -> tuple[list[FloatArray], list[bool], list[str]]:
    """Choose the point of each task's optimal set that is nearest to the other tasks' points.

    Returns:
        The chosen points, whether each task's optimum is unique, and notices about optima that are not unique.
    """
    points = [np.array(solution.x) for solution in own]
    members = [_known_members(solution) for solution in own]
    unique = [_is_unique(solution) for solution in own]
    notices = [
        f"the optimum of {case.tasks[j].name!r} is not unique: the optimum nearest to the other tasks' optima was used"
        for j, solution in enumerate(own)
        if not unique[j] and solution.status.is_answer
    ]
    # One program serves all tasks with the same variables: only their arguments differ.
    extended = [proximity_program(nlp.program) for nlp in (nlps if case.changes else nlps[:1])]
    for _ in range(_ROUNDS if notices else 0):
        following = list(points)
        for j in range(len(own)):
            if not unique[j]:
                target = np.mean([point for k, point in enumerate(_towards(whole, points, j)) if k != j], axis=0)
                program = extended[j if case.changes else 0]
                following[j] = _nearest_member(nlps[j], own[j], members[j], target, program, polish)
        pairs = zip(nlps, following, points, strict=True)
        moved = max(float(np.max(np.abs(a - b) / nlp.scale)) for nlp, a, b in pairs)
        points = following
        if moved <= _STILL:
            break
    return points, unique, notices


def _towards(whole: Nlp, points: Sequence[FloatArray], task: int) -> list[FloatArray]:
    """Return the points of all tasks in the variables of one task's program, with its own variables unchanged."""
    own, places = whole.program.places.of_task(task, whole.n), whole.program.places
    joined = np.array(_joined(whole, points))
    if places.owners:
        kept = [k for k in own if places.owners[k] == task]
        joined[:, kept] = joined[task, kept]
    return list(joined[:, own])


def _may_be_connected(solution: ProgramSolution) -> bool:
    """Return whether the optimum may belong to a connected set of optima."""
    return solution.evidence is not None and solution.evidence.kind in (PointKind.NOT_ISOLATED, PointKind.UNDECIDED)


def _is_unique(solution: ProgramSolution) -> bool:
    """Return whether no other optimum with the same F is known."""
    return len(_known_members(solution)) == 1 and not _may_be_connected(solution)


def _known_members(solution: ProgramSolution) -> list[FloatArray]:
    """Return known points of an optimal set: one for each isolated optimum; on a connected set, of all starts."""
    if not solution.optima:
        return [np.array(solution.x)]
    tolerance = same_value(solution.nlp)
    best = solution.optima[0].F
    if _may_be_connected(solution):
        converged = [start for start in solution.starts if start.status is StartStatus.CONVERGED]
        return [start.x for start in converged if abs(start.F - best) <= tolerance]
    return [optimum.x for optimum in solution.optima if abs(optimum.F - best) <= tolerance]


def _nearest_member(
    nlp: Nlp,
    solution: ProgramSolution,
    members: Sequence[FloatArray],
    target: FloatArray,
    extended: Program,
    polish: Polish,
) -> FloatArray:
    """Return the point of a task's optimal set nearest to a point (n,), searched from the known optima."""

    def distance(x: FloatArray) -> float:
        return float(np.linalg.norm((x - target) / nlp.scale))

    closest = min(members, key=distance)
    if not _may_be_connected(solution):
        return closest
    best = nlp.evaluate(solution.x)[0]
    points = [closest, target]
    for weight in _DISTANCE_WEIGHTS:
        found = polish(with_proximity_term(nlp, extended, target, weight), first=points)
        points = [found.x]
        for start in found.starts:
            back = correct_point(nlp, start.x, linearise(nlp, start.x).active())
            kept = abs(back.F - best) <= same_value(nlp) and back.violation <= FEASIBLE
            if kept and distance(back.x) < distance(closest):
                closest = back.x
    return closest


def _average(nlp: Nlp, points: Sequence[FloatArray], weights: Sequence[float]) -> FloatArray:
    """Return ``Q = (1/n) sum_j w_j q_j`` over points (n,); rotations and directions are averaged on their manifolds."""
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
    # Joint unknowns are not averaged: at the averaged dimensions and pose they follow from the loop equations.
    return close_equations(nlp, Q) if nlp.program.model.unknowns else np.asarray(Q, dtype=np.float64)


def _mean_rotation(vectors: Sequence[FloatArray], shares: FloatArray) -> FloatArray:
    """Return the quaternion vector (3,) of the weighted chordal mean of rotations, from their quaternion vectors.

    The chordal mean of matrices is that of unit quaternions without their signs: the eigenvector of ``sum w q q'`` with
    the largest eigenvalue (F. L. Markley et al., *Averaging Quaternions*, J. Guidance 30 (2007)).
    """
    q = np.array([[np.sqrt(max(1 - float(v @ v), 0.0)), *v] for v in vectors])
    _, directions = np.linalg.eigh((q * shares[:, None]).T @ q)
    mean = directions[:, -1]
    return np.asarray(mean[1:] * (1.0 if mean[0] >= 0 else -1.0), dtype=np.float64)
