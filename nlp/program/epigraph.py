"""F over several poses, and the worst case as an epigraph.

The worst of several values is no smooth function. Its epigraph is: a variable ``level`` with one constraint for each
value, which is optimised in the place of the values.

* Poses: the best level that F keeps at every pose.
* Tasks, all to be maximised: the largest ``level`` with ``F_j >= w_j level`` for every task.
* Tasks, all to be minimised: the smallest ``level`` with ``w_j F_j <= level``.
* Tasks of both senses: the smallest ``level`` with ``w_j loss_j <= level``, where ``loss_j`` is how far ``F_j`` is from
  the task's own optimum. (The worst of values of opposite senses would mean nothing.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..case.pose import Free, OverPoses
from ..case.task import Sense
from .assembly import assemble
from .layout import Layout, lay_out
from .nlp import Nlp
from .places import Epigraph
from .sampling import starting_points

#: Points at which the size of F over several poses is evaluated.
_PROBES = 32
#: Upper bound of the level of a worst pose, in parts of that size: no F comes near it.
_FAR = 2.0

Number = TypeVar("Number", SX, float, FloatArray)


def total_over_poses(values: Sequence[Number], how: OverPoses) -> Number:
    """Return the sum or the mean of values at several poses; for the worst pose, the sum."""
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total / len(values) if how is OverPoses.MEAN and len(values) > 1 else total


def worst(values: Sequence[float] | FloatArray, sense: Sense) -> float:
    """Return the worst of several values of F: the smallest of those that are maximised."""
    return float(np.min(values) if sense is Sense.MAX else np.max(values))


def worst_pose(layout: Layout, sense: Sense) -> Nlp:
    """Return the program of the best level that F keeps at every pose.

    The level is bounded by the size that F would have without cancellation, which no F reaches.
    """
    whole = assemble(layout, layout.robots[0].F[0], sense)
    points = starting_points(whole, _PROBES, 0)
    states = [kernel(x, whole.arguments) for kernel in whole.program.kernels.robot_states for x in points]
    sizes = [float(state.magnitude[0, 0]) for state in states if np.isfinite(state.magnitude).all()]
    ceiling = max([*sizes, whole.objective_scale])
    epigraph = _Epigraph(layout, Free(-ceiling, _FAR * ceiling, ceiling / 2), ceiling)
    for k, robot in enumerate(layout.robots):
        room = robot.F[0] - epigraph.level if sense is Sense.MAX else epigraph.level - robot.F[0]
        epigraph.add(f"F pose {k + 1}", room)
    return epigraph.program(sense)


def formulate_worst(case: Case, weights: Sequence[float], best: Sequence[float], ceiling: float) -> Nlp:
    """Return the program of the worst of several tasks.

    Args:
        case: a case with several tasks.
        weights: one for each task.
        best: each task's own optimum, for the losses.
        ceiling: a level that no answer exceeds, positive.
    """
    layout = lay_out(case, case.tasks)
    F = total_over_poses([robot.F for robot in layout.robots], case.over_poses)
    senses = {task.sense for task in case.tasks}
    epigraph = _Epigraph(layout, Free(-0.1 * ceiling, 1.1 * ceiling, 0.5 * ceiling), ceiling)
    own_places = []
    for j, task in enumerate(case.tasks):
        weight = layout.table.add(f"weight{j}", Dimension.NUMBER, weights[j]).symbols
        own, (place,) = layout.table.add(f"best{j}", Dimension.NUMBER, best[j])
        own_places.append(place.index)
        if senses == {Sense.MAX}:
            room = F[j] - weight * epigraph.level
        elif senses == {Sense.MIN}:
            room = epigraph.level - weight * F[j]
        else:
            room = epigraph.level - weight * (own - F[j] if task.sense is Sense.MAX else F[j] - own)
        epigraph.add(f"task {task.name}", room)
    return epigraph.program(Sense.MAX if senses == {Sense.MAX} else Sense.MIN, tuple(own_places))


def level_of_tasks(case: Case, values: Sequence[float], weights: Sequence[float], best: Sequence[float]) -> float:
    """Return the level of :func:`formulate_worst` that values of F keep, one for each task."""
    senses = {task.sense for task in case.tasks}
    if senses == {Sense.MAX}:
        return min(F / w for F, w in zip(values, weights, strict=True))
    if senses == {Sense.MIN}:
        return max(w * F for F, w in zip(values, weights, strict=True))
    return max(
        w * (b - F if task.sense is Sense.MAX else F - b)
        for F, w, b, task in zip(values, weights, best, case.tasks, strict=True)
    )


def with_exact_level(nlp: Nlp, x: FloatArray) -> FloatArray:
    """Return a point (n,) with the level of a worst pose set to F there; any other program's point unchanged."""
    epigraph = nlp.program.places.epigraph
    if epigraph is None or len(nlp.program.robots) == 1:
        return x
    values = [float(kernel(x, nlp.arguments).F[0, 0]) for kernel in nlp.program.kernels.robot_states]
    moved = np.array(x)
    moved[epigraph.level] = worst(values, nlp.sense)
    return moved


def exact_levels(nlp: Nlp, points: FloatArray) -> FloatArray:
    """Return the level of a worst pose, (k,), that F keeps at each of several points (n, k)."""
    values = ca.vertcat(*[robot.F[0] for robot in nlp.program.robots])
    extreme = ca.mmin(values) if nlp.sense is Sense.MAX else ca.mmax(values)
    levels: FloatArray = ca.Function("levels", [nlp.program.x, nlp.program.p], [extreme])(points, nlp.arguments).full()
    return levels.ravel()


class _Epigraph:
    """An epigraph under construction: its variable, the last one of the program, and its constraints."""

    def __init__(self, layout: Layout, bounds: Free, ceiling: float) -> None:
        self._layout = layout
        self.level, (self._level_place,) = layout.table.add("level", Dimension.NUMBER, bounds)
        self._size, (self._size_place,) = layout.table.add("ceiling", Dimension.NUMBER, ceiling)
        self._reading = Reading(Dimension.NUMBER, from_value=lambda value: value * ceiling, slope=lambda _: 1 / ceiling)
        self._constraints: list[BoundedConstraint] = []

    def add(self, name: str, room: SX) -> None:
        """Add the constraint ``room >= 0``, in parts of the ceiling, so that its row is of order 1."""
        constraint = Constraint(name, room / self._size, self._reading)
        self._constraints.append(BoundedConstraint(constraint, 0.0, math.inf))

    def program(self, sense: Sense, best: tuple[int, ...] = ()) -> Nlp:
        """Return the program that optimises the level."""
        epigraph = Epigraph(
            self._level_place.index,
            self._size_place.index,
            tuple(item.constraint for item in self._constraints),
            best,
        )
        return assemble(self._layout, self.level, sense, self._constraints, epigraph)
