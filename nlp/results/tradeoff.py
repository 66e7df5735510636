"""Trade-off curves as a result, over the active limits of a solution, and as a table of designs."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from ...models import component_names
from ..case.case import Case
from ..case.task import Sense
from ..errors import CaseError
from ..evidence.state import PlatformPose
from ..interruption import is_requested
from ..solver.solution import Solution
from ..solver.status import Status
from ..solver.tradeoff import Tradeoff, TradeoffPoint, tradeoff
from ..system.jsonvalues import Absent, Inline, JsonObject, Vector, finite_or_none
from ..units import slope_unit
from .data import CaseResult, CertificateData, SolveResult
from .designs import Column, ColumnKind, Designs, DrawnDesign, Join, PageWords, certificate_columns, free_numbers
from .evidence import certificate_data
from .parts import HeadData, LimitData, VersionsData
from .point import head_data, stated_pose_notice, versions
from .result import result_of
from .rounding import number, ordered
from .text import Line, Tone
from .wording import title_line

#: Stands before the dotted key of a limit.
_LIMITS = "limits."


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
    if name.startswith(_LIMITS):
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
    dotted = name.removeprefix(_LIMITS)
    return dotted in (key, f"{key}.max") or f"{dotted}.max" == key


def _slope(name: str, result: CaseResult) -> float | None:
    """Return the derivative of F by the number: a limit's cost, or the sensitivity to a fixed number."""
    if name.startswith(_LIMITS):
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
    keys = tuple(f"{_LIMITS}{row.key}" for row in result.limits if row.active)
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
            found = tradeoff(at, values, name=name, starts=starts, jobs=jobs, first=[solution.x])
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


def tradeoff_designs(result: TradeoffResult, case: Case, found: Tradeoff | None = None) -> Designs[TradeoffPointData]:
    """Return a trade-off as a table of designs.

    Args:
        result: the trade-off.
        case: the case at one of the values.
        found: the same with its solutions, for drawings of the designs; None without them.
    """
    throughout, cautions, over = _active_throughout(result), _faults(result), over_words(result)
    solved = sum(point.status.is_answer for point in result.points)
    before = [title_line(case), Line(over, label="over")]
    before += [] if result.notice is None else [Line(result.notice, label="note", tone=Tone.CAUTION)]
    after = [Line(_listed(throughout), label="active throughout")] if throughout else []
    return Designs(
        "trade-off",
        case,
        over,
        tuple(_columns(result, throughout)),
        result.points,
        Join.CURVE,
        PageWords(
            f"{case.name}, robot {case.model.name}: {over}",
            f"{solved} of {len(result.points)} values have an answer",
            ("curve", "F against the number"),
            ("values", "Every value"),
            rules=("Each point is a solve of its own, with everything that is free chosen anew.",),
            cautions=tuple(f"{line}." for line in cautions),
            designs="The design at each value",
            bends="Where the curve bends",
            is_answer=solved > 0,
        ),
        before=before,
        after=[*after, *(Line(line, tone=Tone.CAUTION) for line in cautions)],
        drawn=lambda: () if found is None else _drawn(result, found),
        missing=cautions,
        throughout=_listed(throughout),
    )


def _columns(result: TradeoffResult, throughout: Sequence[str]) -> Iterator[Column[TradeoffPointData]]:
    """Yield the columns: the number, F with that of each of several tasks, its slope, what is active, the design."""
    objective, names = ColumnKind.OBJECTIVE, result.tasks
    yield Column(
        result.over,
        lambda point: point.value,
        ColumnKind.VARIED,
        label=result.over,
        unit=result.unit,
        text=lambda point: f"{point.value:.7g}",
    )
    if len(names) == 1:
        yield Column("F", lambda point: point.F, objective, label="F", text=_text_of_F, series=names[0])
    else:
        yield Column("F", lambda point: point.F, label="combined F", text=_text_of_F)
        yield from (_column_of_task(k, name) for k, name in enumerate(names))
    yield Column(
        "slope",
        lambda point: point.slope,
        ColumnKind.EVIDENCE,
        label="slope",
        unit=slope_unit(result.unit),
        text=lambda point: "" if point.slope is None else _signed(point.slope),
    )
    if any(point.certificate is not None for point in result.points):
        yield from certificate_columns(lambda point: point.certificate)
    yield Column(
        "status", lambda point: point.status.value, holds=str, label="status", text=lambda point: point.status.value
    )
    yield Column(
        "active",
        lambda point: " ".join(point.active),
        ColumnKind.ACTIVE,
        holds=str,
        label="also active" if throughout else "active",
        text=lambda point: _listed(name for name in point.active if name not in throughout),
    )
    answer = next((point for point in result.points if point.parameters is not None), None)
    for name in () if answer is None else _design(answer):
        yield _column_of_number(name)


def _column_of_task(k: int, name: str) -> Column[TradeoffPointData]:
    """Return the column of F of one of several tasks."""
    return Column(
        f"F {name}",
        lambda point: point.tasks[k],
        ColumnKind.OBJECTIVE,
        label=f"F of {name}",
        text=lambda point: _number_text(point.tasks[k]),
        series=name,
    )


def _column_of_number(name: str) -> Column[TradeoffPointData]:
    """Return the column of a number of the design."""
    return Column(name, lambda point: _design(point).get(name), ColumnKind.VARIABLE)


def _drawn(result: TradeoffResult, found: Tradeoff) -> list[DrawnDesign]:
    """Return the designs at values that have an answer."""
    designs = []
    for row, point in zip(result.points, found.points, strict=False):
        if row.status.is_answer:
            outcome = point.solution.outcomes[0]
            F = "" if row.F is None else f"F = {row.F:.6g}"
            of_each = (f"F of {name} = {each:.6g}" for name, each in zip(result.tasks, row.tasks, strict=True) if each)
            designs.append(
                DrawnDesign(
                    f"{result.over} = {row.value:.5g} {result.unit}".rstrip(),
                    F or ", ".join(of_each),
                    free_numbers(outcome.own.nlp, outcome.x),
                    tuple(each.removeprefix(_LIMITS) for each in row.active),
                    outcome.own.nlp,
                    outcome.x,
                    outcome.state,
                )
            )
    return designs


def over_words(result: TradeoffResult) -> str:
    """Return the number that is varied, with its range and unit."""
    first, last = result.points[0].value, result.points[-1].value
    count = len(result.points)
    return f"{result.over} from {first:g} to {last:g} {result.unit}".rstrip() + f", {count} value{'s'[: count != 1]}"


def _active_throughout(result: TradeoffResult) -> list[str]:
    sets = [point.active for point in result.points if point.status.is_answer]
    return [name for name in sets[0] if all(name in active for active in sets)] if len(sets) > 1 else []


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name.removeprefix("limits.") for name in names)


def _faults(result: TradeoffResult) -> list[str]:
    """Return a clause about the values of each status that is no answer."""
    missing = [point for point in result.points if not point.status.is_answer]
    return [_status_words(result, status) for status in dict.fromkeys(point.status for point in missing)]


def _status_words(result: TradeoffResult, status: Status) -> str:
    """Return the values of a status; of those that an interrupted command has not solved, the last ones, the number."""
    own = [point.value for point in result.points if point.status is status]
    if status is Status.INTERRUPTED:
        return f"stopped before the end: {len(result.points) - len(own)} of {len(result.points)} values are solved"
    return f"{status.value} at {', '.join(f'{value:.5g}' for value in own)} {result.unit}".rstrip()


def _text_of_F(point: TradeoffPointData) -> str:  # noqa: N802 - the objective's name
    return _number_text(point.F)


def _number_text(value: float | None) -> str:
    return "none" if value is None else number(value)


def _signed(value: float) -> str:
    return f"{value:+.4g}" if value else "0"


def _design(point: TradeoffPointData) -> dict[str, float]:
    """Return the numbers of a design by name: components of its parameters, then position, axis and angle."""
    if point.parameters is None or point.pose is None:
        return {}

    def parts(name: str, value: float | Sequence[float]) -> dict[str, float]:
        if not isinstance(value, Sequence):
            return {name: value}
        return dict(zip(component_names(name, len(value)), value, strict=True))

    found = {key: part for name, value in point.parameters.items() for key, part in parts(name, value).items()}
    return {**found, **parts("p", point.pose.position), **parts("axis", point.pose.axis), "angle": point.pose.angle}
