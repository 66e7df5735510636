"""Free travel of a platform from a pose in words."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...models import Dimension
from ..case.case import Case
from ..case.task import Sense
from ..proof.workspace.verdict import Outcome
from .claims import CLAIM_WORDS, SINGULAR
from .lines import title_line
from .motors import OUTCOME_WORDS
from .numbers import number
from .text import Line, TextTable, Tone, in_part

if TYPE_CHECKING:
    from ..proof.workspace.range_values import PairRange, RangeEnd, RangeStop
    from ..results.axisranges import AxisRangesResult


def axis_ranges_tables(result: AxisRangesResult) -> Iterator[TextTable]:
    """Yield two tables: a range for each coordinate, then a factor for each pair of coordinates."""
    rows = [
        (
            each.axis,
            each.unit,
            *(number(value, abs(each.at) + abs(value)) for value in (each.at, each.lower.value, each.upper.value)),
            *map(_end_words, (each.lower, each.upper)),
        )
        for each in result.axes
    ]
    headers = ("axis", "unit", "at pose", "from", "to", "lower end limited by", "upper end limited by")
    yield TextTable(
        headers,
        tuple(rows),
        name="axes",
        title="free travel along each axis, with the other coordinates fixed (proved)",
    )
    pairs = [(*each.axes, number(each.factor), _pair_words(each)) for each in result.pairs]
    title = "free travel along two axes at once: fraction of both ranges (proved)"
    yield TextTable(("axis", "and", "factor", "limited by"), tuple(pairs), name="pairs", title=title)


def axis_ranges_summary(case: Case, result: AxisRangesResult) -> Iterator[Line | TextTable]:
    """Yield the free travel: the pose, the range of each coordinate, and the factor of each pair."""
    yield title_line(case)
    units = case.units
    position, angles = (", ".join(number(value, 1.0) for value in part) for part in (result.pose[:3], result.pose[3:]))
    label = units.label(Dimension.ANGLE)
    yield Line(f"{position} {units.length}; roll, pitch, yaw {angles} {label}", label="pose")
    for each in result.faults:
        value = "" if math.isnan(each.value) else f": {number(each.value)} {each.unit}".rstrip()
        yield Line(_stop_words(each), label="not proved at the pose", tone=Tone.FAULT, after=value)
    if result.not_alone:
        yield Line(f"{', '.join(result.not_alone)}, moving with these coordinates", label="dependent coordinates")
    if result.reason:
        yield Line(f"{result.reason}: some axes or pairs were not examined", label="stopped", tone=Tone.CAUTION)
    if not result.axes:
        return
    length, angle = (number(each, digits=4) for each in result.largest)
    yield Line(f"up to {length} {units.length} or {angle} {label} to each side", label="search range")
    table, _ = axis_ranges_tables(result)
    yield table
    if result.pairs:
        yield from in_part("pairs of axes", [_matrix(result)])


def _matrix(result: AxisRangesResult) -> TextTable:
    """Return the factors of the pairs as a matrix, with a row and a column for each coordinate."""
    names = [each.axis for each in result.axes]
    factors = {each.axes: each.factor for each in result.pairs}
    rows = [
        (one, *(_factor_words(factors.get((one, other))) for k, other in enumerate(names) if k)) for one in names[:-1]
    ]
    title = "two axes moved together: proved fraction of both ranges about the pose"
    return TextTable(("axis", *names[1:]), tuple(rows), name="pairs", title=title)


def _factor_words(factor: float | None) -> str:
    """Return the text of a factor; empty for None."""
    return "" if factor is None else number(factor, digits=3) if factor else OUTCOME_WORDS[Outcome.OPEN]


def _pair_words(pair: PairRange) -> str:
    """Return, in words, the claim that limits two coordinates."""
    return "the ranges of the single axes" if pair.stop is None else _stop_words(pair.stop)


def _end_words(end: RangeEnd) -> str:
    """Return, in words, the claim that limits an end of a range."""
    return "the search range" if end.stop is None else _stop_words(end.stop)


def _stop_words(stop: RangeStop) -> str:
    """Return, in words, a claim that is not proved: a violation, or an undecided claim."""
    if stop.outcome is Outcome.OPEN:
        name = CLAIM_WORDS.get(stop.name, stop.name)
        return f"{OUTCOME_WORDS[Outcome.OPEN]}: {name}" + (f", {stop.reason}" if stop.reason else "")
    if stop.limit is None:
        return SINGULAR.get(stop.name, stop.name)
    side = "below" if stop.sense is Sense.MIN else "above"
    return f"{stop.name} {side} {number(stop.limit)} {stop.unit}".rstrip()
