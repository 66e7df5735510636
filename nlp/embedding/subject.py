"""Program of a case for the generated C: of its task, or of several tasks by the method of the case."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import frozen_vector
from ..case.case import Case
from ..case.pose import OverPoses
from ..case.task import Method, Sense
from ..errors import CaseError
from ..program.formulation import formulate, formulate_weighted, formulate_whole, scaled_weights
from ..program.nlp import Nlp
from ..program.pairs import with_all_pairs
from ..proof.statement.standard_form import is_in_home_mode
from ..solver.multistart import solve_program
from ..solver.solve import solve
from ..solver.status import Status

#: Largest number of joint names in a message.
_MOST_SHOWN = 8

#: Largest number of constraints on pairs of poses, all of which the solver in C has: a dozen poses with six legs.
_MOST_PAIRS = 1000
#: Digits of values from a solve: few enough to be the same on every computer.
_DIGITS = 9


class Subject(NamedTuple):
    """Nonlinear program, and its optimal value; None without an optimum in the home working mode."""

    nlp: Nlp
    optimum: float | None


def find_subject(case: Case) -> Subject:
    """Return the program of a case for the generated C.

    For a worst case, each task is solved separately first, because the worst case is relative to the separate optima.

    Raises:
        CaseError: the case is inconsistent, or C cannot be generated for its robot, its tasks or its poses.
        InputError: the functions of the case have no finite value at any trial point.
    """
    if len(case.tasks) > 1 and case.method is Method.AVERAGE:
        fault = "must be 'weighted-sum' or 'worst-case' for C, because an average of optima has no objective"
        raise CaseError("combine.method", fault, case.method.value, case.source)
    if case.tasks[0].measure:
        fault = "is not supported in C: minimise F, and limit forces, speeds and powers instead"
        raise CaseError("objective.minimise", fault, case.tasks[0].measure, case.source)
    _refuse_nested_loops(case)
    _check_pairs(formulate_whole(case))
    if len(case.tasks) == 1 or case.method is Method.WEIGHTED_SUM:
        several = len(case.tasks) > 1
        nlp = formulate_weighted(case, scaled_weights(case)) if several else formulate(case)
        own = solve_program(nlp, case.search)
        is_known = own.status is Status.OPTIMAL and is_in_home_mode(own.nlp, own.x) is not False
        return Subject(with_all_pairs(own.nlp), own.F if is_known else None)
    combination = solve(case).combination
    combined = None if combination is None else combination.combined
    if combined is None:
        fault = "cannot combine the tasks: for at least one of them, solved alone, no optimum was found"
        raise CaseError("combine.method", fault, case.method.value, case.source)
    return Subject(_rounded(with_all_pairs(combined.nlp)), combined.F if combined.status is Status.OPTIMAL else None)


def _refuse_nested_loops(case: Case) -> None:
    """Refuse a robot with nested loops: three of them made 20 MB of C, which did not compile in four minutes."""
    for each in case.model.structure:
        if each.nested:
            shown = ", ".join(each.nested[:_MOST_SHOWN]) + (", ..." if len(each.nested) > _MOST_SHOWN else "")
            fault = (
                f"has loops within a limb (joints {shown}) that branches cannot describe; C is not supported for them"
            )
            raise CaseError("robot", fault, source=case.source)


def magnitude_of(nlp: Nlp) -> SX:
    """Return the objective (1, 1) with the magnitudes of its terms: an upper bound on its absolute value.

    For several poses, the value is an estimate from the first pose of each task.
    """
    case, places = nlp.case, nlp.program.places
    size = nlp.program.robot.magnitude
    if case.changes:
        size = ca.vertcat(*[robot.magnitude for robot in nlp.program.robots[:: case.poses_per_task]])
    if places.weights:
        weights = ca.fabs(nlp.program.p[list(places.weights)])
        if places.epigraph is None:
            size = ca.dot(weights, size)
        else:
            size = size / weights if {task.sense for task in case.tasks} == {Sense.MAX} else size * weights
    if case.over_poses is OverPoses.SUM:
        size = size * case.poses_per_task
    return ca.mmax(size)


def _check_pairs(nlp: Nlp) -> None:
    """Refuse a program with too many pairs of poses.

    Raises:
        CaseError: the program has too many such pairs.
    """
    families = (*nlp.families, *nlp.fixed_families)
    counts = [family.values.numel() for family in families]
    pairs = sum(count * (count - 1) * len(family.pair(0, 1)) for count, family in zip(counts, families, strict=True))
    if pairs > _MOST_PAIRS:
        fault = f"gives {pairs} constraints on pairs of poses; C is generated for at most {_MOST_PAIRS}"
        raise CaseError("pose", fault, nlp.case.pose_count, nlp.case.source)


def _rounded(nlp: Nlp) -> Nlp:
    """Return a program in which the values from a solve are rounded."""
    epigraph = nlp.program.places.epigraph
    if epigraph is None:
        return nlp
    level, best = [epigraph.level], [epigraph.ceiling, *epigraph.best]
    places = {"lower": level, "upper": level, "start": level, "arguments": best}
    vectors = {name: np.array(getattr(nlp, name)) for name in places}
    for name, indices in places.items():
        vectors[name][indices] = [float(f"{value:.{_DIGITS}g}") for value in vectors[name][indices]]
    changed: dict[str, Any] = {name: frozen_vector(vector) for name, vector in vectors.items()}
    return replace(nlp, **changed)


def objective_words(nlp: Nlp) -> str:
    """Return the objective of a program in words."""
    case, poses = nlp.case, nlp.case.poses_per_task
    over = f" over {poses} poses" if poses > 1 else ""
    if nlp.program.places.weights:
        if case.method is Method.WEIGHTED_SUM:
            total = "mean" if poses > 1 and case.over_poses is OverPoses.MEAN else "sum"
            return f"the weighted sum of F of {len(case.tasks)} tasks" + (f", each the {total}{over}" if over else "")
        return f"the level of the worst of {len(case.tasks)} tasks, which is the last variable" + over
    if not over:
        return "F of the task"
    if case.over_poses is OverPoses.WORST:
        return f"the level of the worst F{over}, which is the last variable"
    return f"the {case.over_poses.value} of F{over}"


#: Rounding error of a range of a full turn.
_ROUNDING = 1e-12


def turning_joints(nlp: Nlp) -> frozenset[int]:
    """Return the indices of joint coordinates with a range of a full turn and period 2 pi in all functions.

    A function has this period if the coordinate enters only by its sine and cosine, with either sign.
    """
    turning = {i for i in nlp.program.places.inner if abs(nlp.upper[i] - nlp.lower[i] - 2 * math.pi) < _ROUNDING}
    if not turning:
        return frozenset()
    program = nlp.program
    outputs = [
        program.objective,
        *(each.expression for each in program.constraints),
        *(r.signs for r in program.robots),
    ]
    function = ca.Function("all", [program.x, program.p], [ca.veccat(*outputs)])
    held: dict[int, int] = {}
    for k in range(function.n_instructions()):
        op, inputs = function.instruction_id(k), function.instruction_input(k)
        if op == ca.OP_OUTPUT:
            turning.discard(held.get(inputs[0], -1))
            continue
        place = function.instruction_output(k)[0]
        if op == ca.OP_INPUT:
            source, index = inputs
            found = index if source == 0 else -1
        elif op in (ca.OP_SIN, ca.OP_COS, ca.OP_CONST):
            found = -1
        elif op == ca.OP_NEG:
            found = held.get(inputs[0], -1)
        else:
            found = -1
            turning -= {held.get(each, -1) for each in inputs}
        held[place] = found
    return frozenset(turning)
