"""Objective of a case and its unit: F of a task, or the largest force, speed or power of the actuators."""

import math
from typing import TYPE_CHECKING

from ...models import Dimension, frozen_array
from ...models.statics import driven_joints
from ..case.case import Case
from ..case.forces import dimension_of_measure
from ..case.limits.objective import ObjectiveLimit
from ..case.task import LEG_LENGTH, SMALLEST
from ..evidence.loads import PoseLoads, largest_of
from ..proof.certificate.certificate import Certificate
from ..system.jsonvalues import Absent, JsonObject, finite_or_none
from ..units import objective_unit

if TYPE_CHECKING:
    from ..proof.workspace.judgement import Judgement
    from ..solver.certified import Certified


class ObjectiveData(JsonObject):
    """Objective other than F at the stated poses: an actuator quantity, or the worst F over a workspace or path.

    Attributes:
        minimise: name of the actuator quantity; absent for F.
        maximise: name of a quantity of J that is maximised along a path; absent for F.
        over: domain of the worst F, ``workspace`` or ``path``; absent for an actuator quantity.
        value: largest value over loads, actuators and poses, or worst F; a proved bound where limits cover a workspace
            or path. Null without an answer, or if nothing is proved.
        unit: unit of value and bound.
        bound: proved bound of the value for all designs within the limits; absent if no proof was requested.
        gap: distance of the bound from the value.
    """

    minimise: Absent[str]
    maximise: Absent[str]
    over: Absent[str]
    value: float | None
    unit: str
    bound: Absent[float]
    gap: Absent[float]


def objective_data(case: Case, value: float | None, certificate: Certificate | None = None) -> ObjectiveData | None:
    """Return the objective of a case, if it is not F at the stated poses; otherwise None.

    Args:
        case: the case.
        value: value of the objective; None without an answer.
        certificate: proved bound of the objective; None without a proof.
    """
    measure = case.tasks[0].measure
    if not (measure or case.worst_everywhere):
        return None
    bound = None if certificate is None else finite_or_none(certificate.bound)
    shown = None if value is None else finite_or_none(value)
    return ObjectiveData(
        minimise=None if measure == SMALLEST else measure or None,
        maximise=measure if measure == SMALLEST else None,
        over=case.limits_over if case.worst_everywhere else None,
        value=shown,
        unit=unit_of_objective(case),
        bound=bound,
        gap=None if bound is None or shown is None else case.tasks[0].sense.sign * (bound - shown),
    )


def certified_objective(certified: "Certified") -> ObjectiveData | None:
    """Return the objective that a certificate bounds, with the proved value over the workspace, if any."""
    certificate, solution = certified.certificate, certified.solution
    if certificate is None:
        return None
    value = None if math.isnan(certificate.incumbent) else certificate.incumbent
    proof = solution.workspace or solution.path
    if proof is not None and value is not None and solution.case.is_optimised_everywhere:
        value = over_workspace(solution.case, proof.judgement)
    return objective_data(solution.case, value, certificate)


def over_workspace(case: Case, judged: "Judgement") -> float:
    """Return a proved bound of the objective over every pose of a workspace or path; NaN without a proof."""
    measure = case.tasks[0].measure
    bounds = [each.bound for each in judged.extremes if each.key.startswith(f"{measure or ObjectiveLimit.key}.")]
    if measure:
        return _in_unit(case, max(map(abs, bounds), default=math.nan))
    return bounds[0] if bounds else math.nan


def pose_objective(case: Case, found: PoseLoads) -> float:
    """Return the actuator quantity that a case optimises, at one pose."""
    return _in_unit(case, largest_of(found, case.tasks[0].measure))


def _in_unit(case: Case, value: float) -> float:
    """Return an actuator quantity from evidence or a proof, in the case's unit."""
    return case.units.shown(value, _dimension(case))


def _dimension(case: Case) -> Dimension:
    """Return the dimension of the quantity that a case optimises in place of F."""
    measure = case.tasks[0].measure
    if measure == SMALLEST:
        return Dimension.NUMBER
    return Dimension.LENGTH if measure == LEG_LENGTH else dimension_of_measure(measure, driven_joints(case.model)[0])


def unit_of_objective(case: Case, task: int | None = None) -> str:
    """Return the unit of the objective.

    Args:
        case: the case.
        task: index of the task; None for the common unit of all tasks, which may not exist.
    """
    tasks = case.tasks if task is None else [case.tasks[task]]
    if tasks[0].measure:
        return case.units.label(_dimension(case))
    return objective_unit([frozen_array(each.twist, (6,)) for each in tasks], case.units)


def unit_of_claim(case: Case, name: str, dimension: Dimension) -> str:
    """Return the unit of a claim's quantity over a workspace or along a path: the unit of F for F of a task.

    Args:
        case: the case.
        name: name of the claim.
        dimension: dimension of the quantity.
    """
    tasks = [k for k, task in enumerate(case.tasks) if name in ("F", f"F of {task.name}")]
    is_of_F = dimension is Dimension.NUMBER and tasks and not case.tasks[0].measure
    return unit_of_objective(case, tasks[0]) if is_of_F else case.units.label(dimension)
