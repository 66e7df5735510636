"""F over several poses, and epigraph formulations of the worst case.

The worst of several values is not a smooth function. The epigraph formulation is smooth: the epigraph variable
``level`` replaces the values as the objective, with one constraint for each value.

* Poses, F maximised: the largest ``level`` with ``F_k >= level`` at every pose; F minimised: the smallest ``level``
  with ``F_k <= level``.
* Tasks, all maximised: the largest ``level`` with ``F_j >= w_j level`` for every task.
* Tasks, all minimised: the smallest ``level`` with ``w_j F_j <= level``.
* Tasks of both senses: the smallest ``level`` with ``w_j loss_j <= level``, where ``loss_j`` is the distance of ``F_j``
  from the task's own optimum. (The worst of values of opposite senses has no meaning.)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from operator import mul
from typing import TypeVar

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, frozen_vector
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Call, Constraint, Form, Reading
from ..case.pose import Free, OverPoses
from ..case.task import Sense
from .layout import Layout, assemble, lay_out
from .nlp import Nlp
from .places import Epigraph
from .sampling import starting_points

#: Number of points at which the size of F over several poses is evaluated.
_SIZE_POINTS = 32
#: Upper bound of the level of a worst pose, as a multiple of that size: usually above any F.
_LEVEL_BOUND = 2.0
#: Relative distance of a level from its bound at which the bound may be active; and the factor by which the range then
#: grows.
_AT_BOUND, _WIDER = 1e-6, 4.0

Number = TypeVar("Number", SX, float, FloatArray)


def total_over_poses(values: Sequence[Number], how: OverPoses) -> Number:
    """Return the sum or the mean of values at several poses; for the worst case over poses, return the sum.

    Args:
        values: value at each of one or more poses; all of one shape.
        how: combination of F over the poses of a case.
    """
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total / len(values) if how is OverPoses.MEAN and len(values) > 1 else total


def worst_value(values: Sequence[float] | FloatArray, sense: Sense) -> float:
    """Return the worst of several values of F: the smallest for a maximum, the largest for a minimum."""
    return float(np.min(values) if sense is Sense.MAX else np.max(values))


def formulate_worst_pose(layout: Layout, sense: Sense) -> Nlp:
    """Return the program of the best level of F that all poses reach.

    The bounds of the level follow from the magnitude of the terms of F at a few points. A search widens these bounds if
    F leaves them: :func:`with_wider_level`.

    Args:
        layout: symbols of a case with one task.
        sense: sense of the task.

    Raises:
        CaseError: a limb has zero length at every point of the box.
    """
    whole = assemble(layout, layout.robots[0].F[0], sense)
    points = starting_points(whole, _SIZE_POINTS, 0)
    states = [kernel(x, whole.arguments) for kernel in whole.program.kernels.robot_states for x in points]
    sizes = [float(state.magnitude[0, 0]) for state in states if np.isfinite(state.magnitude).all()]
    ceiling = max([*sizes, whole.objective_size])
    epigraph = EpigraphBuilder(layout, Free(-ceiling, _LEVEL_BOUND * ceiling, ceiling / 2), ceiling)
    for k, robot in enumerate(layout.robots):
        form = Form(above_level if sense is Sense.MAX else below_level, (False,))
        epigraph.add(f"F pose {k + 1}", form, robot.F[0], SX(1))
    return epigraph.program(sense)


def level_constraint(nlp: Nlp, F: SX, name: str) -> BoundedConstraint | None:
    """Return the constraint by which the level of a worst pose bounds F at a further pose.

    Args:
        nlp: program of one task; without a level there is no constraint.
        F: (1, 1) F at the pose.
        name: name of the constraint.
    """
    epigraph = nlp.program.places.epigraph
    first = None if epigraph is None else epigraph.constraints[0]
    if first is None or first.call is None:
        return None
    call = replace(first.call, inputs=ca.vertcat(first.call.inputs[:-1], F))
    return BoundedConstraint(replace(first, name=name, expression=call.value, call=call), 0.0, math.inf)


def F_of_tasks(layout: Layout) -> SX:  # noqa: N802 - the objective's name
    """Return F of each task at each of its poses, (tasks, poses)."""
    tasks = layout.places.tasks
    if not tasks:
        return ca.horzcat(*[robot.F for robot in layout.robots])
    pairs = list(zip(tasks, layout.robots, strict=True))
    rows = [ca.horzcat(*[robot.F for own, robot in pairs if own == task]) for task in dict.fromkeys(tasks)]
    return ca.vertcat(*rows)


def formulate_worst(case: Case, weights: Sequence[float], best: Sequence[float], ceiling: float) -> Nlp:
    """Return the program of the worst of several tasks.

    Args:
        case: a case with several tasks.
        weights: weight of each task.
        best: separate optimum of each task, for the losses.
        ceiling: positive level above all answers.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    layout = lay_out(case, case.tasks)
    F = F_of_tasks(layout)
    is_mean = case.over_poses is OverPoses.MEAN
    senses = {task.sense for task in case.tasks}
    epigraph = EpigraphBuilder(layout, Free(-0.1 * ceiling, 1.1 * ceiling, 0.5 * ceiling), ceiling)
    own_places, weight_places = [], []
    for j, task in enumerate(case.tasks):
        weight, (weight_place,) = layout.table.add(f"weight{j}", Dimension.NUMBER, weights[j])
        weight_places.append(weight_place.index)
        own, (place,) = layout.table.add(f"best{j}", Dimension.NUMBER, best[j])
        own_places.append(place.index)
        if len(senses) > 1:
            form = Form(_loss_of_maximum if task.sense is Sense.MAX else _loss_of_minimum, (is_mean,))
            epigraph.add(f"task {task.name}", form, F[j, :].T, weight, own)
        else:
            form = Form(above_level if task.sense is Sense.MAX else below_level, (is_mean,))
            epigraph.add(f"task {task.name}", form, F[j, :].T, weight)
    return epigraph.program(Sense.MAX if senses == {Sense.MAX} else Sense.MIN, tuple(own_places), tuple(weight_places))


def level_of_tasks(case: Case, values: Sequence[float], weights: Sequence[float], best: Sequence[float]) -> float:
    """Return the best level of :func:`formulate_worst` for given values of F.

    Args:
        case: a case with several tasks.
        values: F of each task.
        weights: weight of each task.
        best: separate optimum of each task, for the losses.
    """
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
    """Return a point with the best level of a worst case of one task or of no other variables; other points unchanged.

    Args:
        nlp: the program.
        x: (n,) point.
    """
    epigraph = nlp.program.places.epigraph
    if epigraph is None or (len(nlp.program.places.twists) > 1 and not nlp.is_fixed):
        return x
    moved = np.array(x)
    moved[epigraph.level] = exact_levels(nlp, moved[:, None])[0]
    return moved


def with_wider_level(nlp: Nlp, x: FloatArray) -> Nlp | None:
    """Return a program with wider bounds of its level; None if these bounds are not active at a point (n,).

    The bounds are estimates, not limits of the case: a level on its bound is not an answer.
    """
    epigraph = nlp.program.places.epigraph
    if epigraph is None:
        return None
    k = epigraph.level
    level, way = float(with_exact_level(nlp, x)[k]), _AT_BOUND * (nlp.upper[k] - nlp.lower[k])
    is_inside = nlp.lower[k] + way < min(level, x[k]) and max(level, x[k]) < nlp.upper[k] - way
    if is_inside or not math.isfinite(level):
        return None
    lower, upper = np.array(nlp.lower), np.array(nlp.upper)
    lower[k], upper[k] = _WIDER * min(lower[k], level), _WIDER * max(upper[k], level)
    return replace(nlp, lower=frozen_vector(lower), upper=frozen_vector(upper))


def exact_levels(nlp: Nlp, points: FloatArray) -> FloatArray:
    """Return the best level of a worst case, (k,), at each of several points.

    Args:
        nlp: a program with a level.
        points: (n, k) points, one in each column.
    """
    levels = slack_levels(nlp, points)
    return np.asarray(levels.min(axis=0) if nlp.sense is Sense.MAX else levels.max(axis=0))


def slack_levels(nlp: Nlp, points: FloatArray) -> FloatArray:
    """Return the level (c, k) of each of the c objectives of a worst case at several points.

    Args:
        nlp: a program with a level.
        points: (n, k) points, one in each column.
    """
    epigraph = nlp.program.places.epigraph
    own = [each.expression for each in nlp.program.constraints if epigraph and each in epigraph.constraints]
    slacks = ca.Function("slacks", [nlp.program.x, nlp.program.p], [ca.vertcat(*own)])
    # The slacks are affine in the level, or in its square.
    ends = []
    for level in (0.0, 1.0):
        at = np.array(points)
        at[epigraph.level if epigraph else -1] = level
        ends.append(slacks(at, nlp.arguments).full())
    with np.errstate(all="ignore"):  # at points where the robot is undefined
        levels = ends[0] / (ends[0] - ends[1])
        return np.asarray(np.sqrt(levels) if epigraph and epigraph.power == 2 else levels)


def above_level(numbers: SX, is_mean: bool) -> SX:
    """Return ``(F - weight level) / ceiling`` from ceiling, level, weight and F at each pose."""
    ceiling, level, weight = ca.vertsplit(numbers[:3])
    return (_total(numbers[3:], is_mean) - weight * level) / ceiling


def below_level(numbers: SX, is_mean: bool) -> SX:
    """Return ``(level - weight F) / ceiling`` from ceiling, level, weight and F at each pose."""
    ceiling, level, weight = ca.vertsplit(numbers[:3])
    return (level - weight * _total(numbers[3:], is_mean)) / ceiling


def below_squared_level(numbers: SX) -> SX:
    """Return ``(level^2 - square) / ceiling^2`` from ceiling, level and a square."""
    ceiling, level, square = ca.vertsplit(numbers)
    return (level**2 - square) / ceiling**2


def _loss_of_maximum(numbers: SX, is_mean: bool) -> SX:
    """Return ``(level - weight (own - F)) / ceiling`` from ceiling, level, own optimum, weight and F at each pose."""
    ceiling, level, own, weight = ca.vertsplit(numbers[:4])
    return (level - weight * (own - _total(numbers[4:], is_mean))) / ceiling


def _loss_of_minimum(numbers: SX, is_mean: bool) -> SX:
    """Return ``(level - weight (F - own)) / ceiling`` from ceiling, level, own optimum, weight and F at each pose."""
    ceiling, level, own, weight = ca.vertsplit(numbers[:4])
    return (level - weight * (_total(numbers[4:], is_mean) - own)) / ceiling


def weighted_total(numbers: SX, tasks: int, is_mean: bool) -> SX:
    """Return ``sum w_j F_j`` from the tasks' weights and F of each task at each pose, pose after pose."""
    weights, F = numbers[:tasks], ca.reshape(numbers[tasks:], tasks, -1)
    return sum((weights[j] * _total(F[j, :].T, is_mean) for j in range(tasks)), SX(0))


def _total(values: SX, is_mean: bool) -> SX:
    """Return the sum or the mean, (1, 1), of values (N, 1) at N poses."""
    return total_over_poses(ca.vertsplit(values), OverPoses.MEAN if is_mean else OverPoses.SUM)


def _constant(slope: float, value: float) -> float:  # noqa: ARG001 - a slope is a function of the bound
    return slope


class EpigraphBuilder:
    """Epigraph under construction: the epigraph variable, last of the program's variables, and its constraints.

    Args:
        layout: symbols of the case, to which the epigraph variable is added.
        bounds: bounds and start of the epigraph variable.
        ceiling: positive divisor of the constraints.
        power: 2 if the level is the root of the worst of squares.
    """

    def __init__(self, layout: Layout, bounds: Free, ceiling: float, power: int = 1) -> None:
        self._layout, self._power = layout, power
        self.level, (self._level_place,) = layout.table.add("level", Dimension.NUMBER, bounds)
        self._size, (self._size_place,) = layout.table.add("ceiling", Dimension.NUMBER, ceiling)
        self._reading = Reading(
            Dimension.NUMBER, from_value=partial(mul, ceiling), slope=partial(_constant, 1 / ceiling)
        )
        self._constraints: list[BoundedConstraint] = []

    def add(self, name: str, slack: Form, *inputs: SX) -> None:
        """Add the constraint ``slack >= 0``, divided by the ceiling to scale its gradient.

        Args:
            name: name of the constraint.
            slack: function of ceiling, level and inputs.
            inputs: F of a task at each pose, then the separate values of the task.
        """
        call = Call(slack, ca.vertcat(self._size, self.level, *reversed(inputs)))
        constraint = Constraint(name, call.value, self._reading, call=call)
        self._constraints.append(BoundedConstraint(constraint, 0.0, math.inf))

    def program(self, sense: Sense, best: tuple[int, ...] = (), weights: tuple[int, ...] = ()) -> Nlp:
        """Return the program that optimises the level.

        Args:
            sense: sense of the level.
            best: indices in ``p`` of the separate optimum of each task.
            weights: indices in ``p`` of the tasks' weights.

        Raises:
            CaseError: a limb has zero length at every point of the box.
        """
        epigraph = Epigraph(
            self._level_place.index,
            self._size_place.index,
            tuple(item.constraint for item in self._constraints),
            best,
            self._power,
        )
        return assemble(self._layout, self.level, sense, self._constraints, epigraph, weights)
