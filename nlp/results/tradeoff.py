"""Trade-off curves as a result, over the active limits of a solution."""

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..case.case import Case
from ..case.task import Sense
from ..errors import CaseError
from ..evidence.state import PlatformPose
from ..interruption import is_requested
from ..solver.solution import Solution
from ..solver.status import Status
from ..solver.tradeoff import Tradeoff, TradeoffPoint, solve_along
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector, finite_or_none
from .data import CaseResult, CertificateData, SolveResult
from .evidence import certificate_data
from .parts import HeadData, LimitData, VersionsData
from .point import head_data, stated_pose_notice, versions
from .result import result_of
from .rounding import ordered

#: Stands before the dotted key of a limit.
LIMITS = "limits."


class TradeoffPointData(JsonObject):
    """The optimum at one value of the number.

    Attributes:
        value: of the number.
        status: of the solve.
        F: objective; with several tasks the value of their combination, null for an average; null without an answer.
        slope: derivative of F by the number; null where it is not known.
        tasks: F of each task at the point; null without an answer.
        active: bounds and limits that the point lies on.
        parameters: dimensions by name; null without an answer.
        pose: of the platform, the first that the case states; null without an answer.
        certificate: the proven bound; absent where none was asked for.
    """

    value: float
    status: Status
    F: float | None
    slope: float | None
    tasks: tuple[float | None, ...]
    active: tuple[str, ...]
    parameters: Mapping[str, float | Vector] | None
    pose: PlatformPose | None
    certificate: Absent[CertificateData]


class TradeoffResult(JsonObject):
    """Result of a trade-off: the optimum of a case over values of one of its numbers.

    Attributes:
        head: the case.
        over: name of the number.
        unit: of the number; empty for a plain number.
        senses: of each task.
        tasks: name of each task.
        points: one for each value; the status is "interrupted" for those that an interrupted command has not solved.
        seed: of the starting points.
        versions: of the programs.
        seconds: wall time.
        notice: that the limits are taken at the stated pose alone, where the case has them over its workspace; else
            absent.
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
    """Return the unit of a case's number by its name; empty for a plain number, or where it is not known.

    Args:
        name: as ``--set`` takes it.
        case: the case.
        limits: rows of its limits, which have their units.
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
        parameters=None if robot is None else robot.parameters,
        pose=None if robot is None else robot.pose,
        certificate=None if point.certified is None else certificate_data(point.certified.certificate),
    )


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
        certificate=None,
    )


def _is_key(name: str, key: str) -> bool:
    """Return whether a setting's name is that of a limit's number, whose key may leave out ``max``."""
    dotted = name.removeprefix(LIMITS)
    return dotted in (key, f"{key}.max") or f"{dotted}.max" == key


def _slope(name: str, result: CaseResult) -> float | None:
    """Return the derivative of F by the number: a limit's cost, or the sensitivity to a fixed number."""
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


#: Range of a curve to each side of the limit, as a part of it; number of values, odd so that the limit is among them.
_REACH, _VALUES = 0.1, 7
#: Curves of one solution at most, those of the costliest limits; starting points of each solve beside its neighbours'.
_CURVES, _STARTS = 3, 4


def limit_curves(
    solution: Solution, result: CaseResult, case_at: Callable[[str, float], Case], jobs: int | None = None
) -> tuple[TradeoffResult, ...]:
    """Solve again along the costliest active limits of an answer to a case with one task.

    Args:
        solution: the answer.
        result: of the same solve.
        case_at: returns the case with a number by name, such as ``limits.leg_length.max``, and its value.
        jobs: number of threads; the result does not depend on it.

    Returns:
        A curve for each of these limits; none where there is no answer, or where there are several tasks.
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
            if is_requested():  # only whole curves are shown
                break
            curves.append(tradeoff_result(found))
    return tuple(curves)


def _values_about(limit: float) -> list[float]:
    """Return values about a limit, the limit itself among them and without its rounding."""
    steps = np.linspace(-_REACH, _REACH, _VALUES)
    return [limit if k == _VALUES // 2 else float(limit * (1 + step)) for k, step in enumerate(steps)]


def _is_allowed(case_at: Callable[[float], Case], value: float) -> bool:
    """Return whether there is a case with a value: some limits cannot be this large, or cross others."""
    try:
        case_at(value)
    except CaseError:
        return False
    return True
