"""Result of a trade-off; trade-off curves over the active limits of a solution."""

import re
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from ..case.case import Case
from ..case.names import name_of_task
from ..case.task import Sense
from ..errors import CaseError
from ..evidence.state import PlatformPose, stated_poses
from ..interruption import is_requested
from ..solver.solution import Solution
from ..solver.status import Status
from ..solver.tradeoff import Tradeoff, TradeoffPoint, solve_along
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector, finite_or_none
from .data import CaseResult, CertificateData, SolveResult
from .evidence import certificate_data
from .parts import HeadData, LimitData, VersionsData
from .point import head_data, pose_data, stated_pose_notice, versions
from .result import result_of
from .rounding import ordered

#: Start of the dotted key of a limit.
LIMITS = "limits."


class TradeoffPointData(JsonObject):
    """Optimum at a value of the varied limit or parameter.

    Attributes:
        value: value of the limit or parameter.
        status: status of the solve.
        F: objective, or value of the combination of several tasks; null for an average, and without an answer.
        slope: derivative of F with respect to the varied value; null if unknown.
        tasks: F of each task at the point; null without an answer.
        active: active bounds and limits.
        parameters: dimensions by name; null without an answer.
        pose: first stated pose of the platform; null without an answer.
        poses: stated poses of all tasks in turn, if every task has its own pose; otherwise absent.
        certificate: proved bound; absent if no proof was requested.
    """

    value: float
    status: Status
    F: float | None
    slope: float | None
    tasks: tuple[float | None, ...]
    active: tuple[str, ...]
    parameters: Mapping[str, float | Vector] | None
    pose: PlatformPose | None
    poses: Absent[tuple[PlatformPose, ...]]
    certificate: Absent[CertificateData]


class TradeoffResult(JsonObject):
    """Result of a trade-off: the optimum of a case over values of a limit or parameter.

    Attributes:
        head: the case.
        over: name of the limit or parameter.
        unit: unit of its values; empty for a plain number.
        senses: sense of each task.
        tasks: name of each task.
        points: optima, one for each value; the status of values after an interruption is "interrupted".
        seed: random seed of the starting points.
        versions: versions of the software.
        seconds: wall time.
        notice: notice that limits over a workspace or path are taken at the stated pose only; otherwise absent.
    """

    head: Inline[HeadData]
    over: str
    unit: str
    senses: tuple[Sense, ...]
    tasks: tuple[str, ...]
    points: tuple[TradeoffPointData, ...]
    seed: int
    versions: VersionsData
    seconds: float
    notice: Absent[str]


def tradeoff_result(found: Tradeoff) -> TradeoffResult:
    """Return a trade-off as a result."""
    case = found.points[0].solution.case
    results = [result_of(point.solution) for point in found.points]
    return TradeoffResult(
        head=head_data(case),
        over=found.name,
        unit=unit_of_number(found.name, case, [row for result in results for row in result.limits]),
        senses=tuple(task.sense for task in case.tasks),
        tasks=tuple(task.name for task in case.tasks),
        points=(
            *(_point(found.name, point, result) for point, result in zip(found.points, results, strict=True)),
            *(_unsolved(value, len(case.tasks)) for value in found.unsolved),
        ),
        seed=found.points[0].solution.seed,
        versions=versions(),
        seconds=found.seconds,
        notice=stated_pose_notice(case),
    )


def unit_of_number(name: str, case: Case, limits: Sequence[LimitData] = ()) -> str:
    """Return the unit of a value of a case by its name; empty for a plain number or an unknown unit.

    Args:
        name: name of the value, as in ``--set``.
        case: the case.
        limits: rows of the limits, with their units.
    """
    if name.startswith(LIMITS):
        return next((row.unit for row in limits if _is_key(name, row.key)), "")
    if re.fullmatch(r"task(\[\d+\])?\.pitch", name):
        return f"{case.units.length}/rad"
    whole, _, end = name.rpartition(".")
    own = whole if end in ("min", "max", "start") else name
    if own.endswith("angle") and own not in case.scalars:
        return case.units.angle  # about a free axis
    return case.units.label(case.scalars[own]) if own in case.scalars else ""


def _point(name: str, point: TradeoffPoint, result: CaseResult) -> TradeoffPointData:
    is_answer = result.status.is_answer
    robot = result.robot if is_answer else None
    return TradeoffPointData(
        value=point.value,
        status=result.status,
        F=result.F if is_answer else None,
        slope=_slope(name, result) if is_answer else None,
        tasks=tuple(finite_or_none(each.F) if is_answer else None for each in point.solution.outcomes),
        active=_active(point.solution, result) if is_answer else (),
        parameters=_dimensions(point.solution) if robot is not None else None,
        pose=None if robot is None else robot.pose,
        poses=_poses(point.solution) if robot is not None else None,
        certificate=None if point.certified is None else certificate_data(point.certified.certificate),
    )


def _dimensions(solution: Solution) -> Mapping[str, float | Vector]:
    """Return the dimensions of a design by name; those that change from task to task by component and task."""
    changing, found = solution.case.dimensions_per_task, dict[str, float | Vector]()
    for item in solution.case.model.parameters:
        if not changing.keys() & set(item.components):
            found[item.name] = solution.parameters[item.name]
            continue
        for key, name in zip(item.components, solution.case.component_names(item), strict=True):
            of_tasks = range(len(solution.outcomes)) if key in changing else ()
            names = [name_of_task(name, task) for task in of_tasks] or [name]
            found |= {each: solution[each] for each in names}
    return MappingProxyType(found)


def _poses(solution: Solution) -> tuple[PlatformPose, ...] | None:
    """Return the stated poses of all tasks, if every task has its own pose."""
    if not solution.case.pose_per_task:
        return None
    at = [(outcome.own.nlp, outcome.at) for outcome in solution.outcomes]
    return tuple(pose_data(nlp.case, pose) for nlp, x in at for pose in stated_poses(nlp, x))


def _unsolved(value: float, tasks: int) -> TradeoffPointData:
    """Return the row of a value that an interrupted command has not solved."""
    return TradeoffPointData(
        value=value,
        status=Status.INTERRUPTED,
        F=None,
        slope=None,
        tasks=(None,) * tasks,
        active=(),
        parameters=None,
        pose=None,
        poses=None,
        certificate=None,
    )


def _is_key(name: str, key: str) -> bool:
    """Return whether a setting names a limit; the suffix ``.max`` may be left out."""
    dotted = name.removeprefix(LIMITS)
    return dotted in (key, f"{key}.max") or f"{dotted}.max" == key


def _slope(name: str, result: CaseResult) -> float | None:
    """Return the derivative of F with respect to the varied value: a limit, a bound, or a fixed parameter."""
    if name.startswith(LIMITS):
        return next((row.cost for row in result.limits if _is_key(name, row.key)), None)
    if not isinstance(result, SolveResult):
        return None
    whole, _, end = name.rpartition(".")
    if end in ("min", "max") and result.optimality is not None:
        # A multiplier is an improvement by relaxing the bound: upwards for a largest value, downwards for a smallest.
        sign = (1 if end == "max" else -1) * (1 if result.sense is Sense.MAX else -1)
        sides = (side for side in result.optimality.active if (side.name, side.bound) == (whole, end))
        return next((sign * side.multiplier for side in sides), None)
    return next((row.derivative for row in result.sensitivity or () if row.name == name), None)


def _active(solution: Solution, result: CaseResult) -> tuple[str, ...]:
    """Return the names of the active bounds, and the keys of the active limits."""
    keys = tuple(f"{LIMITS}{row.key}" for row in result.limits if row.active)
    own = solution.decided_by
    if own is None or own.evidence is None:
        return keys
    variables = {variable.name for variable in own.nlp.program.variables}
    sides = ((side.name, side.bound) for side in own.evidence.active if side.name in variables)
    return (*(f"{name}.{bound}" if bound in ("min", "max") else name for name, bound in sides), *keys)


#: Range of a curve to each side of the limit, as a fraction of it; number of values, odd to include the limit itself.
_REACH, _VALUES = 0.1, 7
#: Largest number of curves of a solution; number of starting points of each solve, besides the neighbouring optima.
_CURVES, _STARTS = 3, 4


def limit_curves(
    solution: Solution, result: CaseResult, case_at: Callable[[str, float], Case], jobs: int | None = None
) -> tuple[TradeoffResult, ...]:
    """Return trade-off curves over the active limits with the largest relative effect on F.

    Args:
        solution: solution of a case.
        result: result of the same solve.
        case_at: returns the case with a changed value, by its name, such as ``limits.leg_length.max``.
        jobs: number of threads; the result does not depend on it.

    Returns:
        A curve for each of these limits; empty without an answer, or with several tasks.
    """
    if not isinstance(result, SolveResult) or not solution.status.is_answer:
        return ()
    active = [row for row in result.limits if row.active and row.cost]
    active.sort(key=lambda row: -ordered(abs((row.cost or 0.0) * row.limit)))
    curves = []
    for row in active[:_CURVES]:
        name = f"limits.{row.key}"

        def at(value: float, name: str = name) -> Case:
            return case_at(name, value)

        values = [value for value in _values_about(row.limit) if _is_allowed(at, value)]
        if len(values) > 1:
            starts = min(_STARTS, solution.case.search.starts)
            found = solve_along(at, values, name=name, starts=starts, jobs=jobs, first=[solution.x])
            if is_requested():  # incomplete curves are not shown
                break
            curves.append(tradeoff_result(found))
    return tuple(curves)


def _values_about(limit: float) -> list[float]:
    """Return values around a limit, with the limit itself, exactly."""
    steps = np.linspace(-_REACH, _REACH, _VALUES)
    return [limit if k == _VALUES // 2 else float(limit * (1 + step)) for k, step in enumerate(steps)]


def _is_allowed(case_at: Callable[[float], Case], value: float) -> bool:
    """Return whether the case with a value is valid: some limits cannot be this large, or contradict other limits."""
    try:
        case_at(value)
    except CaseError:
        return False
    return True
