"""Nonlinear program that a proof bounds, its fingerprint, and the proved claim in words.

Tasks, weights, senses, poses, limits and dimensions come from the case. A :class:`.proof_file.Statement` names one of
the few nonlinear programs of a case.
"""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context

import casadi as ca
import numpy as np

from ....models import Model
from ...case.case import Case
from ...case.pose import OverPoses
from ...case.task import Method, Sense
from ...errors import InputError
from ...program.epigraph import formulate_worst
from ...program.formulation import formulate, formulate_weighted, scaled_weights
from ...program.nlp import Nlp
from ...program.pairs import with_all_pairs
from ..statement.standard_form import standard_form
from .proof_file import ProofError, Statement

#: Significant digits of bounds in claims.
_DIGITS = 10
#: Number of points at which a fingerprint evaluates a program, and number of its sums.
_POINTS, _SUMS = 3, 4
#: Relative difference of the sums of one program in two processes: far above rounding, far below any change of a case.
_SAME = 1e-9


def has_modes(model: Model) -> bool:
    """Return whether a robot has several working modes that signs distinguish."""
    return any(each.is_mode for each in model.signs)


def has_both_senses(case: Case) -> bool:
    """Return whether some tasks are maximised and others minimised."""
    return len({task.sense for task in case.tasks}) > 1


def check_minimum(case: Case) -> None:
    """Refuse a case whose smallest F is not the optimum of one nonlinear program.

    Raises:
        InputError: the case has several tasks, or F is the least over several poses.
    """
    if len(case.tasks) > 1:
        raise InputError("above: needs a case with one task")
    if case.pose_count > 1 and case.over_poses is OverPoses.WORST and case.tasks[0].sense is Sense.MAX:
        raise InputError("above: cannot be used if the smallest F of several poses is maximised")


def program_of(case: Case, statement: Statement) -> Nlp:
    """Formulate the program of a case that a proof statement names.

    Raises:
        InputError: the case has no such program.
    """
    nlp = _program(case, statement)
    return replace(nlp, in_home_mode=True) if statement.in_home_mode else nlp


def _program(case: Case, statement: Statement) -> Nlp:
    """Formulate the nonlinear program for all working modes."""
    if statement.is_minimum:
        check_minimum(case)
    if len(statement.best) != (len(case.tasks) if _has_losses(case) else 0):
        raise ProofError(
            "the proof is for another case: its tasks, or their combination, differ from those of this case"
        )
    if len(case.tasks) == 1:
        nlp = formulate(case)
        return replace(nlp, sense=Sense.MIN) if statement.is_minimum else nlp
    weights = scaled_weights(case)
    if case.method is Method.AVERAGE:
        raise InputError(
            "no optimum can be proved for averaged tasks: set combine.method to 'weighted-sum' or 'worst-case'"
        )
    if case.method is Method.WEIGHTED_SUM:
        return formulate_weighted(case, weights)
    # The level's size matters only to local solvers: the bounded functions do not depend on it.
    return formulate_worst(case, weights, statement.best or [0.0] * len(weights), 1.0)


def _has_losses(case: Case) -> bool:
    """Return whether the worst case of the tasks refers to their losses."""
    return len(case.tasks) > 1 and case.method is Method.WORST_CASE and has_both_senses(case)


def fingerprint(nlp: Nlp) -> str:
    """Return a text that distinguishes programs: sizes, and sums of their values at a few points.

    The same case may give graphs whose constants differ in the last bit between processes, so that a hash of the graph
    is not suitable. A proof does not depend on the fingerprint: the check proves every claim for the program that it
    builds itself.
    """
    nlp = with_all_pairs(nlp)
    program = nlp.program
    function = ca.Function("values", [program.x, program.p], [ca.densify(ca.vertcat(program.objective, program.g))])
    rng = np.random.default_rng(0)
    shares = rng.random((_POINTS, nlp.n))
    points = [nlp.lower + share * (nlp.upper - nlp.lower) for share in shares]
    values = [function(x, nlp.arguments).full().ravel() for x in points]
    size = nlp.n
    if nlp.in_home_mode:
        # The boxes of the tree have no unknowns with a closed form.
        form = standard_form(nlp)
        size, function = form.n, ca.Function("form", [form.x], [form.expressions])
        values += [function(form.point_of(x)).full().ravel() for x in points]
    numbers = np.concatenate([*values, nlp.arguments, nlp.lower, nlp.upper, nlp.g_lower, nlp.g_upper])
    # A value counts by its magnitude and its sign; a value that is not finite counts as a constant.
    known = np.isfinite(numbers)
    parts = np.where(known, numbers / (1 + np.abs(np.where(known, numbers, 0.0))), np.where(numbers > 0, 2.0, -2.0))
    sums = rng.normal(size=(_SUMS, numbers.size)) @ parts
    return " ".join([str(size), str(len(nlp.g_lower)), str(int(nlp.sign)), *(f"{each:.12e}" for each in sums)])


def is_same_program(one: str, other: str) -> bool:
    """Return whether two fingerprints belong to the same program, up to rounding."""
    first, second = one.split(), other.split()
    if first[:3] != second[:3] or len(first) != len(second):
        return False
    try:
        return bool(
            np.allclose([float(each) for each in first], [float(each) for each in second], rtol=_SAME, atol=_SAME)
        )
    except ValueError:
        return False


def check_statement(case: Case, statement: Statement, *, above: float | None, all_assemblies: bool) -> None:
    """Refuse a proof that does not prove the requested statement.

    Args:
        case: the case.
        statement: statement of the proof.
        above: requested lower bound of F; None to request a bound of the case's optimum.
        all_assemblies: If true, request a proof for all working modes; otherwise for the home working mode only.

    Raises:
        ProofError: the proof is for another statement.
        InputError: the case has no such statement.
    """
    if above is not None:
        check_minimum(case)
    if statement.is_minimum and above is None:
        raise ProofError(
            "the proof has a lower bound of F, not a bound of the optimum: give --above to check the lower bound"
        )
    if above is not None and case.tasks[0].sense is Sense.MAX and not statement.is_minimum:
        raise ProofError("the proof bounds the largest F, but --above requests a bound of the smallest F")
    if statement.in_home_mode and all_assemblies:
        raise ProofError("the proof covers only the home working mode, but --all-assemblies requests all working modes")
    if statement.in_home_mode and not has_modes(case.model):
        raise ProofError("the proof is for the home working mode, but this robot has no distinct working modes")


def claim_words(case: Case, statement: Statement, bound: float | None, unit: str = "") -> str:
    """Return a proven claim as a sentence without a full stop.

    Args:
        case: the case.
        statement: statement of the proof.
        bound: upper bound of the maximised value, which is minus F for a minimum; None without a feasible point.
        unit: unit of the objective.
    """
    where = f"within the limits of case '{case.name}'"
    if case.limits_over:
        where += ", taken at the stated pose only,"
    if has_modes(case.model):
        where += " in the home working mode" if statement.in_home_mode else " in every working mode"
    if bound is None:
        return f"there is no feasible point {where}"
    measure = case.tasks[0].measure
    if measure:  # the tree bounds its square
        words, count = measure.replace("_", " "), case.pose_count
        over = f"over all actuators{' and loads' if measure != 'actuator_speed' else ''}"
        over += f", at {count} poses" if count > 1 else ""
        side = f"at least {outward(root_below(-bound), up=False)} {unit}".rstrip()
        return f"the largest {words} {over} is {side} {where}"
    is_minimum = _has_minimum(case, statement)
    side = f"at least {outward(-bound + 0.0, up=False)}" if is_minimum else f"at most {outward(bound, up=True)}"
    side = f"{side} {unit}".rstrip()
    return f"F is {side} {where}, F being {_objective_words(case, statement)}{_pose_words(case)}"


def root_below(square: float) -> float:
    """Return a lower bound of the square root of a number; 0 for a negative number."""
    return math.nextafter(math.sqrt(max(square, 0.0)), 0.0)


def _has_minimum(case: Case, statement: Statement) -> bool:
    """Return whether the program of a statement minimises its objective."""
    both = has_both_senses(case)
    return statement.is_minimum or _has_losses(case) or (not both and case.tasks[0].sense is Sense.MIN)


def _objective_words(case: Case, statement: Statement) -> str:
    """Return the bounded objective of a statement in words, with the tasks and their weights."""
    names = [f"F({task.name!r})" for task in case.tasks]
    if len(names) == 1:
        return f"that of task {case.tasks[0].name!r}"
    weights = [exact(weight) for weight in scaled_weights(case)]
    if case.method is Method.WEIGHTED_SUM:
        both = has_both_senses(case)
        signs = ["-" if both and task.sense is Sense.MIN else "+" for task in case.tasks]
        terms = zip(signs, weights, names, strict=True)
        return " ".join(f"{sign} {weight} {name}" for sign, weight, name in terms).removeprefix("+ ")
    if statement.best:
        maxima = [task.sense is Sense.MAX for task in case.tasks]
        pairs = zip(maxima, names, statement.best, strict=True)
        names = [f"({exact(best)} - {name})" if is_max else f"({name} - {exact(best)})" for is_max, name, best in pairs]
    elif case.tasks[0].sense is Sense.MAX:
        return f"the least of {' and '.join(f'{name} / {w}' for name, w in zip(names, weights, strict=True))}"
    return f"the largest of {' and '.join(f'{w} {name}' for name, w in zip(names, weights, strict=True))}"


def _pose_words(case: Case) -> str:
    """Return in words how F is combined over the poses of a case; empty for one pose."""
    over = {OverPoses.SUM: "summed over", OverPoses.MEAN: "in the mean over", OverPoses.WORST: "at the worst of"}
    count, changes = case.poses_per_task, " and ".join(case.changes)
    words = f", with {changes} set for each task" if changes else ""
    return f"{words}, {over[case.over_poses]} {count} poses" if count > 1 else words


def outward(value: float, *, up: bool) -> str:
    """Return a proven bound as text, rounded to the safe side."""
    context = Context(prec=_DIGITS, rounding=ROUND_CEILING if up else ROUND_FLOOR)
    return f"{float(context.create_decimal_from_float(value)):.{_DIGITS}g}"


def exact(value: float) -> str:
    """Return a number of a premise as text from which the same double can be read."""
    return repr(value).removesuffix(".0")
