"""Trade-off curves as tables of designs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from ...models import component_names
from ..case.case import Case
from ..results.tradeoff import LIMITS, TradeoffPointData, TradeoffResult
from ..solver.status import Status
from ..solver.tradeoff import Tradeoff
from .designs import (
    Column,
    ColumnKind,
    Designs,
    DrawnDesign,
    Join,
    PageWords,
    certificate_columns,
    design_values,
    drawn_task,
)
from .lines import title_line
from .numbers import key_words, number, per_words
from .text import Line, Tone


def tradeoff_designs(result: TradeoffResult, case: Case, found: Tradeoff | None = None) -> Designs[TradeoffPointData]:
    """Return a trade-off as a table of designs.

    Args:
        result: the trade-off.
        case: the case at one of the values.
        found: the trade-off with its solutions, for drawings of the designs; None without drawings.
    """
    throughout, cautions, over = _active_throughout(result), _faults(result), over_words(result)
    solved = sum(point.status.is_answer for point in result.points)
    before = [title_line(case), Line(over, label="over")]
    before += [] if result.notice is None else [Line(result.notice, label="note", tone=Tone.CAUTION)]
    after = [Line(_listed(throughout), label="active throughout")] if throughout else []
    return Designs(
        "trade-off",
        case,
        f"values: {over}",
        tuple(_columns(result, throughout)),
        result.points,
        Join.CURVE,
        PageWords(
            f"Trade-off: {case.name}, robot {case.model.name}, over {key_words(result.over)}",
            f"{solved} of {len(result.points)} values have an answer",
            ("curve", "Trade-off curve"),
            ("values", "All values"),
            rules=("Each point is a separate solve: all variables are optimised again.",),
            cautions=tuple(f"{line}." for line in cautions),
            designs="Designs along the curve",
            bends="Changes of the active limits",
            is_answer=solved > 0,
        ),
        before=before,
        after=[*after, *(Line(line, tone=Tone.CAUTION) for line in cautions)],
        drawn=lambda: () if found is None else _drawn(result, found),
        missing=cautions,
        throughout=_listed(throughout),
    )


def _columns(result: TradeoffResult, throughout: Sequence[str]) -> Iterator[Column[TradeoffPointData]]:
    """Yield the columns: varied value, F, F of each task, slope, active limits, and the design."""
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
        unit=f"F {per_words(result.unit)}",
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
        label="further active limits" if throughout else "active",
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
    """Return the column of a variable of the design."""
    return Column(name, lambda point: _design(point).get(name), ColumnKind.VARIABLE)


def _drawn(result: TradeoffResult, found: Tradeoff) -> list[DrawnDesign]:
    """Return the designs at the values that have an answer."""
    designs = []
    for row, point in zip(result.points, found.points, strict=False):
        if row.status.is_answer:
            outcome = point.solution.outcomes[0]
            F = "" if row.F is None else f"F = {row.F:.6g}"
            of_each = (f"F of {name} = {each:.6g}" for name, each in zip(result.tasks, row.tasks, strict=True) if each)
            designs.append(
                DrawnDesign(
                    f"{key_words(result.over)} = {row.value:.5g} {result.unit}".rstrip(),
                    (F or ", ".join(of_each)) + drawn_task(point.solution.case),
                    design_values(point.solution.whole, point.solution.x),
                    tuple(each.removeprefix(LIMITS) for each in row.active),
                    outcome.own.nlp,
                    outcome.at,
                    outcome.state,
                )
            )
    return designs


def over_words(result: TradeoffResult) -> str:
    """Return the name of the varied limit or parameter, with its range and unit."""
    first, last = result.points[0].value, result.points[-1].value
    count = len(result.points)
    return f"{result.over} from {first:g} to {last:g} {result.unit}".rstrip() + f", {count} value{'s'[: count != 1]}"


def _active_throughout(result: TradeoffResult) -> list[str]:
    sets = [point.active for point in result.points if point.status.is_answer]
    return [name for name in sets[0] if all(name in active for active in sets)] if len(sets) > 1 else []


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name.removeprefix("limits.") for name in names)


def _faults(result: TradeoffResult) -> list[str]:
    """Return the values without an answer, a clause for each status."""
    missing = [point for point in result.points if not point.status.is_answer]
    return [_status_words(result, status) for status in dict.fromkeys(point.status for point in missing)]


def _status_words(result: TradeoffResult, status: Status) -> str:
    """Return the values of a status; for an interrupted command, the number of solved values instead."""
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
    """Return the values of a design by name: components of its parameters, then position, axis and angle."""
    if point.parameters is None or point.pose is None:
        return {}

    def parts(name: str, value: float | Sequence[float]) -> dict[str, float]:
        if not isinstance(value, Sequence):
            return {name: value}
        return dict(zip(component_names(name, len(value)), value, strict=True))

    found = {key: part for name, value in point.parameters.items() for key, part in parts(name, value).items()}
    if point.poses is not None:
        for k, pose in enumerate(point.poses):
            found |= parts(f"pose{k + 1}_p", pose.position) | parts(f"pose{k + 1}_axis", pose.axis)
            found[f"pose{k + 1}_angle"] = pose.angle
        return found
    return {**found, **parts("p", point.pose.position), **parts("axis", point.pose.axis), "angle": point.pose.angle}
