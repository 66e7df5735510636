"""Trade-off curves in words: lines, a table of text, and rows for a CSV file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ...models import component_names, frozen_array
from ..case.case import Case
from ..solver.status import Status
from ..system.csvtext import csv_text
from ..units import objective_unit, slope_unit
from .rounding import number
from .text import Line, TextTable, Tone
from .wording import title_line

if TYPE_CHECKING:
    from .tradeoff import TradeoffPointData, TradeoffResult


def tradeoff_summary(case: Case, result: TradeoffResult) -> Iterator[Line | TextTable]:
    """Yield a trade-off: what is varied, then a row for each value."""
    yield title_line(case)
    yield Line(over_words(result), label="over")
    if result.notice is not None:
        yield Line(result.notice, label="note", tone=Tone.CAUTION)
    yield tradeoff_table(result)
    if throughout_words(result):
        yield Line(throughout_words(result), label="active throughout")
    for line in tradeoff_words(result):
        yield Line(line, tone=Tone.CAUTION)


def over_words(result: TradeoffResult) -> str:
    """Return the number that is varied, with its range and unit."""
    first, last = result.points[0].value, result.points[-1].value
    count = len(result.points)
    return f"{result.over} from {first:g} to {last:g} {result.unit}".rstrip() + f", {count} value{'s'[: count != 1]}"


def tradeoff_table(result: TradeoffResult) -> TextTable:
    """Return a row for each value: F, its slope and what is active there only; with several tasks F of each."""
    several = len(result.tasks) > 1
    header = f"{result.over}\n{result.unit}" if result.unit else result.over
    per = f"slope\n{slope_unit(result.unit)}"
    names = tuple(f"F of {name}" for name in result.tasks) if several else ()
    throughout = _active_throughout(result)
    last = "also active" if throughout else "active"
    headers = (header, "F" if not several else "combined F", *names, per, "status", last)
    rows = tuple(
        (
            f"{point.value:.7g}",
            _number(point.F),
            *(_number(F) for F in (point.tasks if several else ())),
            "" if point.slope is None else _signed(point.slope),
            point.status.value,
            _listed(name for name in point.active if name not in throughout),
        )
        for point in result.points
    )
    return TextTable(headers, rows)


def throughout_words(result: TradeoffResult) -> str:
    """Return the bounds and limits that are active at every value with an answer; an empty text for none."""
    return _listed(_active_throughout(result))


def _active_throughout(result: TradeoffResult) -> list[str]:
    sets = [point.active for point in result.points if point.status.is_answer]
    return [name for name in sets[0] if all(name in active for active in sets)] if len(sets) > 1 else []


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name.removeprefix("limits.") for name in names)


def tradeoff_words(result: TradeoffResult) -> list[str]:
    """Return sentences about values without an answer."""
    missing = [point for point in result.points if not point.status.is_answer]
    return [_status_words(result, status) for status in dict.fromkeys(point.status for point in missing)]


def _status_words(result: TradeoffResult, status: Status) -> str:
    """Return the values of a status; of those that an interrupted command has not solved, the last ones, the number."""
    own = [point.value for point in result.points if point.status is status]
    if status is Status.INTERRUPTED:
        return f"stopped before the end: {len(result.points) - len(own)} of {len(result.points)} values are solved"
    return f"{status.value} at {', '.join(f'{value:.5g}' for value in own)} {result.unit}".rstrip()


def unit_of_objective(case: Case, task: int | None = None) -> str:
    """Return the unit of F.

    Args:
        case: the case.
        task: index of the task whose F it is; all tasks together for None, which have a unit where they agree in it.
    """
    tasks = case.tasks if task is None else [case.tasks[task]]
    return objective_unit([frozen_array(each.twist, (6,)) for each in tasks], case.units)


def objective_label(case: Case, task: int | None = None) -> str:
    """Return F with its unit, for an axis; arguments are those of :func:`unit_of_objective`."""
    unit = unit_of_objective(case, task)
    return f"F, {unit}" if unit else "F"


def tradeoff_csv(result: TradeoffResult) -> str:
    """Return a trade-off as CSV, one row for each value; what has no value is an empty cell."""
    answer = next((point for point in result.points if point.parameters is not None), None)
    names = [] if answer is None else list(_design(answer))
    several = len(result.tasks) > 1
    own = [f"F {name}" for name in result.tasks] if several else []
    head, rows = [result.over, "F", *own, "slope", "status", "active", *names], []
    for point in result.points:
        design = _design(point)
        cells: list[object] = [point.F, *(point.tasks if several else ()), point.slope]
        others = [design.get(name) for name in names]
        rows.append([point.value, *cells, point.status.value, " ".join(point.active), *others])
    return csv_text(head, rows)


def _number(value: float | None) -> str:
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
