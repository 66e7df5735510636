"""A front as a result, and its numbers in the case's units."""

from __future__ import annotations

from types import MappingProxyType

from ..program.places import Scalar
from ..program.program import design_indices
from ..results.evidence import certificate_data
from ..results.explorations import FrontGoalData, FrontPointData, FrontResult
from ..results.objective import unit_of_objective
from ..results.point import head_data, stated_pose_notice, versions
from ..system.jsonvalues import finite_or_none
from .front import Front, FrontPoint


def front_result(front: Front) -> FrontResult:
    """Return a front as a result."""
    goals = tuple(
        FrontGoalData.of(goal, name=goal.label, unit=unit)
        for goal, unit in zip(front.goals, goal_units(front), strict=True)
    )
    return FrontResult.of(
        front,
        head=head_data(front.case),
        notice=stated_pose_notice(front.case),
        front=goals,
        points=tuple(_point(front, each) for each in front.points),
        versions=versions(),
    )


def goal_values(front: Front, point: FrontPoint) -> list[float]:
    """Return the goals of a point in the case's units."""
    return [shown_goal(front, k, float(value)) for k, value in enumerate(point.values)]


def goal_bounds(front: Front, point: FrontPoint) -> list[float | None]:
    """Return the bounds of each goal at a point in the case's units."""
    return [None if bound is None else shown_goal(front, k, bound) for k, bound in enumerate(point.bounds)]


def goal_units(front: Front) -> list[str]:
    """Return the unit of each goal; an empty text for a plain number."""
    readings = [each[0].dimension for each in front.points[0].program.readings]
    return [
        front.case.units.label(dimension) if goal.task is None else unit_of_objective(front.case, goal.task)
        for goal, dimension in zip(front.goals, readings, strict=True)
    ]


def shown_goal(front: Front, k: int, value: float) -> float:
    """Return the value of a goal in the case's unit."""
    readings = front.points[0].program.readings[k]
    return front.case.units.shown(value, readings[0].dimension)


def design_places(front: Front) -> list[tuple[int, Scalar]]:
    """Return place and name of each free number of the case, without joints and without a goal's own level."""
    point = front.points[0]
    program = point.solution.nlp.program
    # The program of a limit as the goal has the limit's number as a further variable, its last one.
    last = len(program.variables) - (front.goals[point.program.optimised].task is None)
    return [(k, program.variables[k]) for k in design_indices(program) if k < last]


def _point(front: Front, point: FrontPoint) -> FrontPointData:
    evidence, names = point.solution.evidence, [goal.label for goal in front.goals]
    units = front.case.units
    bounds = zip(names, goal_bounds(front, point), strict=True)
    design = {
        each.name: units.shown(float(point.solution.x[place]), each.dimension) for place, each in design_places(front)
    }
    return FrontPointData(
        goals=MappingProxyType(dict(zip(names, goal_values(front, point), strict=True))),
        optimised=names[point.program.optimised],
        bounds=MappingProxyType({name: bound for name, bound in bounds if bound is not None}),
        status=point.solution.status,
        design=MappingProxyType(design),
        active=() if evidence is None else tuple(f"{side.name} {side.bound}" for side in evidence.active),
        multipliers=() if evidence is None else evidence.multipliers_in(units),
        kind=None if evidence is None else evidence.kind,
        stationarity=None if evidence is None else finite_or_none(evidence.stationarity),
        feasibility=None if evidence is None else finite_or_none(evidence.feasibility),
        certificate=certificate_data(point.certificate),
    )
