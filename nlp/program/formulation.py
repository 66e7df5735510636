"""Nonlinear programs of a case.

The objective is F (equations 5 and 14), written in :mod:`screwsynth.models.instance`. Several tasks become one program
in two ways: the weighted sum of their objectives here, and the worst of them in :mod:`.epigraph`.

Source: A. Wolf and co-workers, *Screw theory tools for the synthesis of the geometry of a parallel robot for a given
instantaneous task*; equation and section numbers throughout this package are that paper's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from casadi import SX

from ...models import Dimension, FloatArray, frozen_vector
from ..case.case import Case
from ..case.limits.constraint import Call, Form
from ..case.pose import OverPoses
from ..case.task import Sense
from .actuators import formulate_actuators
from .epigraph import F_of_tasks, formulate_worst_pose, weighted_total
from .layout import Layout, assemble, lay_out
from .nlp import Nlp
from .places import Scalar
from .program import Program


def formulate(case: Case, task: int = 0) -> Nlp:
    """Return the nonlinear program of one task of a case.

    If dimensions or the pose change from task to task, the program has those of this task.

    Args:
        case: the case.
        task: index of the task.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    if case.changes:
        return formulate(case.of_task(task))
    layout = lay_out(case, [case.tasks[task]])
    sense = case.tasks[task].sense
    if case.tasks[task].measure:
        return formulate_actuators(layout)
    if len(layout.robots) > 1 and case.over_poses is OverPoses.WORST:
        return formulate_worst_pose(layout, sense)
    return assemble(layout, _weighted_call(layout, [SX(1)]), sense)


def formulate_everywhere(case: Case) -> Nlp:
    """Return the program of the worst F of the stated poses, to which an exchange adds further poses.

    Args:
        case: a case with one task.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    return formulate_worst_pose(lay_out(case, case.tasks), case.tasks[0].sense)


def formulate_each(case: Case) -> list[Nlp]:
    """Return the programs of all tasks of a case.

    The programs share their symbols, and differ only by twist and sense.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    first = formulate(case)
    (twist,) = first.program.places.twists
    programs = []
    for task in case.tasks:
        arguments = np.array(first.arguments)
        arguments[twist] = np.asarray(task.twist)
        programs.append(replace(first, arguments=frozen_vector(arguments), sense=task.sense))
    return programs


def formulate_tasks(case: Case) -> list[Nlp]:
    """Return the programs of all tasks of a case, also if dimensions or the pose change from task to task.

    The programs of such a case have variables of their own: those that all tasks share, and those of the task.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    if not case.changes:
        return formulate_each(case)
    return [formulate(case, task) for task in range(len(case.tasks))]


def scaled_weights(case: Case) -> list[float]:
    """Return the tasks' weights scaled to sum to the number of tasks, as in equation 15."""
    given = [task.weight for task in case.tasks]
    total, n = sum(given), len(given)
    return given if abs(total - n) <= 1e-12 * n else [weight * n / total for weight in given]


def formulate_weighted(case: Case, weights: Sequence[float]) -> Nlp:
    """Return the program of the weighted sum of the tasks' objectives.

    If all tasks have one sense, the objective is ``sum w_j F_j`` with that sense. If both senses occur, the sum is
    maximised with negative signs for the tasks to be minimised.

    Args:
        case: a case with several tasks.
        weights: weight of each task.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    layout = lay_out(case, case.tasks)
    senses = {task.sense for task in case.tasks}
    sense = senses.pop() if len(senses) == 1 else Sense.MAX
    signs = [1.0 if task.sense is sense else -1.0 for task in case.tasks]
    added = [
        layout.table.add(f"weight{j}", Dimension.NUMBER, sign * weight)
        for j, (sign, weight) in enumerate(zip(signs, weights, strict=True))
    ]
    call = _weighted_call(layout, [each.symbols for each in added])
    return assemble(layout, call, sense, weights=tuple(each.places[0].index for each in added))


def formulate_whole(case: Case) -> Nlp:
    """Return a program with the variables of all tasks of a case.

    It is the program of the first task, unless dimensions or the pose change from task to task.

    Raises:
        CaseError: a limb has zero length at every point of the box, or fixed parameters contradict each other.
    """
    return formulate_weighted(case, scaled_weights(case)) if case.changes else formulate(case)


def _weighted_call(layout: Layout, weights: Sequence[SX]) -> Call:
    """Return the weighted sum of the tasks' objectives over all poses, with weights (1, 1)."""
    form = Form(weighted_total, (len(weights), layout.case.over_poses is OverPoses.MEAN))
    return Call(form, ca.vertcat(*weights, ca.vec(F_of_tasks(layout))))


def proximity_program(program: Program) -> Program:
    """Return a program with a cost on the squared distance from a point; see :func:`with_proximity_term`."""
    n = len(program.variables)
    t, scale, cost = SX.sym("target", n), SX.sym("scale", n), SX.sym("cost")
    return replace(
        program,
        objective_call=None,
        objective=program.objective + cost * ca.sumsqr((program.x - t) / scale),
        p=ca.vertcat(program.p, t, scale, cost),
        arguments=(*program.arguments, *(Scalar(f"near{i}", Dimension.NUMBER) for i in range(2 * n + 1))),
    )


def with_proximity_term(nlp: Nlp, extended: Program, target: FloatArray, strength: float) -> Nlp:
    """Return a program whose objective also has a cost on the squared distance from a point.

    If the optima of the original program form a set, the optimum of the new program tends to the point of that set
    nearest to the target as the strength tends to zero. Distances are in half ranges of the variables.

    Args:
        nlp: the original program.
        extended: result of :func:`proximity_program`, built once for all points and strengths.
        target: (n,) target point.
        strength: cost of a distance of 1, as a multiple of the objective's scale.
    """
    values = [*nlp.arguments, *target, *nlp.scale, nlp.sign * strength * nlp.objective_scale]
    return replace(nlp, program=extended, arguments=frozen_vector(values))
