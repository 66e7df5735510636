"""How far a platform can move from a pose, in words."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..case.task import Sense
from ..proof.statement.claims import CONSTRAINTS, REGULAR
from ..proof.workspace.verdict import Outcome
from .lines import title_line
from .numbers import number
from .text import Line, TextTable, Tone, in_part

if TYPE_CHECKING:
    from ..proof.workspace.range_values import PairRange, RangeEnd, RangeStop
    from ..results.axisranges import AxisRangesResult


def axis_ranges_tables(result: AxisRangesResult) -> Iterator[TextTable]:
    """Yield the ranges, a row for each coordinate, and the factors, a row for each pair."""
    rows = [
        (
            each.axis,
            each.unit,
            *(number(value, abs(each.at) + abs(value)) for value in (each.at, each.lower.value, each.upper.value)),
            *map(_end_words, (each.lower, each.upper)),
        )
        for each in result.axes
    ]
    headers = ("axis", "unit", "at", "from", "to", "limited below by", "limited above by")
    yield TextTable(headers, tuple(rows), name="axes", title="each alone: proved at every point")
    pairs = [(*each.axes, number(each.factor), _pair_words(each)) for each in result.pairs]
    yield TextTable(("axis", "and", "factor", "limited by"), tuple(pairs), name="pairs")


def axis_ranges_summary(case: Case, result: AxisRangesResult) -> Iterator[Line | TextTable]:
    """Yield how far the platform can move: the pose, the ranges of each coordinate, and factors of each two."""
    yield title_line(case)
    units = case.units
    position, angles = (", ".join(number(value, 1.0) for value in part) for part in (result.pose[:3], result.pose[3:]))
    label = units.label(Dimension.ANGLE)
    yield Line(f"{position} {units.length}; roll, pitch, yaw {angles} {label}", label="pose")
    for each in result.faults:
        value = "" if math.isnan(each.value) else f": {number(each.value)} {each.unit}".rstrip()
        yield Line(_stop_words(each), label="not proved there", tone=Tone.FAULT, after=value)
    if result.not_alone:
        yield Line(f"{', '.join(result.not_alone)}, and move with these coordinates", label="follow")
    if result.reason:
        yield Line(f"{result.reason}: not every axis and pair is judged", label="stopped", tone=Tone.CAUTION)
    if not result.axes:
        return
    length, angle = (number(each, digits=4) for each in result.largest)
    yield Line(f"by {length} {units.length} or {angle} {label} at most, to each side", label="moved")
    table, _ = axis_ranges_tables(result)
    yield table
    if result.pairs:
        yield from in_part("two at once", [_matrix(result)])


def _matrix(result: AxisRangesResult) -> TextTable:
    """Return the factors of pairs as a table with a row and a column for each coordinate."""
    names = [each.axis for each in result.axes]
    factors = {each.axes: each.factor for each in result.pairs}
    rows = [
        (one, *(_factor_words(factors.get((one, other))) for k, other in enumerate(names) if k)) for one in names[:-1]
    ]
    title = "two at once: part of both ranges, about the pose, that is proved"
    return TextTable(("axis", *names[1:]), tuple(rows), name="pairs", title=title)


def _factor_words(factor: float | None) -> str:
    """Return a factor; empty where there is none."""
    return "" if factor is None else number(factor, digits=3) if factor else "open"


def _pair_words(pair: PairRange) -> str:
    """Return what limits two coordinates."""
    return "nothing more" if pair.stop is None else _stop_words(pair.stop)


def _end_words(end: RangeEnd) -> str:
    """Return what limits an end of a range."""
    return "the largest range" if end.stop is None else _stop_words(end.stop)


def _stop_words(stop: RangeStop) -> str:
    """Return a claim that is not proved: what happens, or that it is open."""
    if stop.outcome is Outcome.OPEN:
        return f"open: {stop.name}" + (f", {stop.reason}" if stop.reason else "")
    if stop.limit is None:
        return {REGULAR: "J is singular", CONSTRAINTS: "constraint wrenches lose rank"}.get(stop.name, stop.name)
    side = "below" if stop.sense is Sense.MIN else "above"
    return f"{stop.name} {side} {number(stop.limit)} {stop.unit}".rstrip()
