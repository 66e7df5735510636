"""From a case to its nonlinear program.

The objective is the sum over the rows of the Jacobian of the squared reciprocal product with the task's twist,

    F = sum_i (L_i ^ chi)^2,        L_i ^ chi = m_i . omega + f_i . v            (equations 5 and 14)

where ``L_i = (f_i, m_i)`` is the unit wrench that limb ``i`` applies to the platform, its moment taken about the world
origin. Several tasks become one program in two ways: the weighted sum of their objectives, and the worst of them as the
bound of an epigraph.

Source: A. Wolf and co-workers, *Screw theory tools for the synthesis of the geometry of a parallel robot for a given
instantaneous task*; equation and section numbers throughout this package are that paper's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, frozen_array, vanished
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..case.pose import Free, OverPoses
from ..case.task import Sense
from ..errors import CaseError
from .layout import Layout, free_directions, lay_out
from .nlp import Nlp
from .program import MAGNITUDE, OBJECTIVE, SQUARES, Program, Scalar
from .sampling import starting_points

#: How many points are looked at for the size of F over several poses, and a level that no F comes near, in parts of it.
_PROBES = 32
_FAR = 2.0


def formulate(case: Case, task: int = 0) -> Nlp:
    """The nonlinear program of one of a case's tasks.

    Args:
        case: the case.
        task: index of the task.

    Raises:
        CaseError: a limb has zero length whatever the solver chooses, or fixed numbers contradict each other.
    """
    layout = lay_out(case, [case.tasks[task]])
    if len(layout.robots) > 1 and case.over_poses is OverPoses.WORST:
        return _worst_pose(layout, case.tasks[task].sense)
    return assemble(layout, layout.F[0], case.tasks[task].sense)


def formulate_each(case: Case) -> list[Nlp]:
    """The programs of all tasks of a case: one program, with each task's twist and sense.

    Raises:
        CaseError: as for :func:`formulate`.
    """
    first = formulate(case)
    place = [argument.name for argument in first.program.arguments].index("twist_0")
    programs = []
    for task in case.tasks:
        arguments = [*first.arguments[:place], *np.asarray(task.twist), *first.arguments[place + 6 :]]
        programs.append(replace(first, arguments=_vector(arguments), sense=task.sense))
    return programs


def formulate_weighted(case: Case, weights: Sequence[float]) -> Nlp:
    """The weighted sum of the tasks' objectives as one program.

    With one sense for all tasks it is that sense's optimum of ``sum w_j F_j``. With both, it is the maximum of the same
    sum in which the tasks to be minimised count negatively.

    Args:
        case: a case with several tasks.
        weights: one for each task.
    """
    layout = lay_out(case, case.tasks)
    senses = {task.sense for task in case.tasks}
    sense = senses.pop() if len(senses) == 1 else Sense.MAX
    signs = [1.0 if task.sense is sense else -1.0 for task in case.tasks]
    places = [
        layout.sheet.place(f"weight{j}", Dimension.NUMBER, s * w)
        for j, (s, w) in enumerate(zip(signs, weights, strict=True))
    ]
    objective = sum((place * layout.F[j] for j, place in enumerate(places)), SX(0))
    return assemble(layout, objective, sense)


def formulate_worst(case: Case, weights: Sequence[float], best: Sequence[float], ceiling: float) -> Nlp:
    """The worst task as one program, by a level that every task keeps: a smooth epigraph.

    * all to be maximised: the largest ``level`` with ``F_j >= w_j level`` for every task;
    * all to be minimised: the smallest ``level`` with ``w_j F_j <= level``;
    * both senses: the smallest ``level`` with ``w_j loss_j <= level``, where ``loss_j`` is how far ``F_j`` is from the
      best that the task can have by itself. (The worst of values of opposite senses would say nothing.)

    Args:
        case: a case with several tasks.
        weights: one for each task.
        best: each task's own optimum, for the losses.
        ceiling: a level that no answer exceeds, positive.
    """
    layout = lay_out(case, case.tasks)
    sheet, senses = layout.sheet, {task.sense for task in case.tasks}
    level = sheet.place("level", Dimension.NUMBER, Free(-0.1 * ceiling, 1.1 * ceiling, 0.5 * ceiling))
    size = sheet.place("ceiling", Dimension.NUMBER, ceiling)
    reading = Reading(Dimension.NUMBER, from_value=lambda value: value * ceiling, slope=lambda _: 1 / ceiling)
    constraints = []
    for j, task in enumerate(case.tasks):
        F = layout.F[j]
        weight = sheet.place(f"weight{j}", Dimension.NUMBER, weights[j])
        own = sheet.place(f"best{j}", Dimension.NUMBER, best[j])
        if senses == {Sense.MAX}:
            room = F - weight * level
        elif senses == {Sense.MIN}:
            room = level - weight * F
        else:
            room = level - weight * (own - F if task.sense is Sense.MAX else F - own)
        # In parts of the ceiling, so that the rows are of order 1 like the scaled variables.
        constraints.append(BoundedConstraint(Constraint(f"task {task.name}", room / size, reading), 0.0, math.inf))
    return assemble(layout, level, Sense.MAX if senses == {Sense.MAX} else Sense.MIN, constraints)


def _worst_pose(layout: Layout, sense: Sense) -> Nlp:
    """The worst pose as one program: the best level that F keeps at every pose.

    The level is bounded far away from every F, by the size that F would have without cancellation.
    """
    whole = assemble(layout, layout.F[0], sense)
    points = starting_points(whole, _PROBES, 0)
    states = [kernel(x, whole.arguments) for kernel in whole.program.kernels.robot_states for x in points]
    sizes = [float(state[MAGNITUDE][0, 0]) for state in states if np.isfinite(state[MAGNITUDE]).all()]
    ceiling = max([*sizes, whole.objective_scale])
    level = layout.sheet.place("level", Dimension.NUMBER, Free(-ceiling, _FAR * ceiling, ceiling / 2))
    size = layout.sheet.place("ceiling", Dimension.NUMBER, ceiling)
    reading = Reading(Dimension.NUMBER, from_value=lambda value: value * ceiling, slope=lambda _: 1 / ceiling)
    constraints = []
    for k, robot in enumerate(layout.robots):
        room = robot.F[0] - level if sense is Sense.MAX else level - robot.F[0]
        constraints.append(BoundedConstraint(Constraint(f"F pose {k + 1}", room / size, reading), 0.0, math.inf))
    return assemble(layout, level, sense, constraints)


def levelled(nlp: Nlp, x: FloatArray) -> FloatArray:
    """The point with the level of the worst pose put where F is; any other program's point as it is."""
    names = [variable.name for variable in nlp.program.variables]
    if "level" not in names or len(nlp.program.robots) == 1:
        return x
    values = [float(kernel(x, nlp.arguments)[OBJECTIVE][0, 0]) for kernel in nlp.program.kernels.robot_states]
    moved = np.array(x)
    moved[names.index("level")] = min(values) if nlp.sense is Sense.MAX else max(values)
    return moved


def near(nlp: Nlp, target: FloatArray, strength: float) -> Nlp:
    """A program whose objective is drawn a little towards a point.

    Where the optima of the original form a set, the optimum of this one tends to the set's nearest point as the
    strength tends to zero (distances in half ranges).

    Args:
        nlp: the original.
        target: (n,) the point.
        strength: what a distance of 1 costs, in parts of the objective's scale.
    """
    program = nlp.program
    t, scale, cost = SX.sym("target", nlp.n), SX.sym("scale", nlp.n), SX.sym("cost")
    drawn = replace(
        program,
        objective=program.objective + cost * ca.sumsqr((program.x - t) / scale),
        p=ca.vertcat(program.p, t, scale, cost),
        arguments=(*program.arguments, *(Scalar(f"near{i}", Dimension.NUMBER) for i in range(2 * nlp.n + 1))),
    )
    values = [*nlp.arguments, *target, *nlp.scale, nlp.sign * strength * nlp.objective_scale]
    return replace(nlp, program=drawn, arguments=_vector(values))


def assemble(layout: Layout, objective: SX, sense: Sense, constraints: Sequence[BoundedConstraint] = ()) -> Nlp:
    """The program of a layout with its objective, and constraints beside the layout's own.

    Raises:
        CaseError: a limb has zero length whatever the solver chooses.
    """
    case, sheet = layout.case, layout.sheet
    bounded = (*layout.constraints, *constraints)
    program = Program(
        variables=tuple(sheet.variables),
        arguments=tuple(sheet.arguments),
        x=ca.vertcat(SX(0, 1), *sheet.x),
        p=ca.vertcat(SX(0, 1), *sheet.p),
        objective=objective,
        constraints=tuple(item.constraint for item in bounded),
        robot=layout.robots[0],
        further=layout.robots[1:],
        model=case.model,
        directions=free_directions(case.model, sheet.variables),
    )
    nlp = Nlp(
        program=program,
        case=case,
        sense=sense,
        arguments=_vector(sheet.values),
        lower=_vector([bound.lower for bound in sheet.bounds]),
        upper=_vector([bound.upper for bound in sheet.bounds]),
        start=_vector([bound.first for bound in sheet.bounds]),
        g_lower=_vector([item.lower for item in bounded]),
        g_upper=_vector([item.upper for item in bounded]),
        met=layout.met,
    )
    _check_limbs(nlp)
    return nlp


def _vector(values: Sequence[float]) -> FloatArray:
    return frozen_array(values, (len(values),))


def _check_limbs(nlp: Nlp) -> None:
    """Refuse a limb whose direction vanishes whatever the solver chooses."""
    program = nlp.program
    for robot, kernel in zip(program.robots, program.kernels.robot_states, strict=True):
        values = kernel(nlp.start, nlp.arguments)[SQUARES].ravel()
        free = ca.which_depends(robot.squares, program.x, 1, True) if nlp.n else [False] * len(values)
        for row, value, varies in zip(program.model.wrenches, values, free, strict=True):
            if not varies and not value > 0:
                raise CaseError("robot.parameters", vanished(row), source=nlp.case.source)
