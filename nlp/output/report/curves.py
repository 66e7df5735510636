"""Charts of F over a varied limit or parameter, for pages about trade-offs and solutions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ...words.designs import Column, ColumnKind, Designs, Row
from ...words.numbers import key_words
from ...words.objective import objective_label
from .charts import Curve, Spot, line_chart
from .markup import Markup, caption, tag


def curve_figures(*designs: Designs[Row], here: Mapping[str, float] | None = None) -> Markup:
    """Return charts of F over a varied value, side by side: one for each table and task.

    Args:
        designs: tables of designs over one varied value.
        here: values of the varied quantities in the case of the page, which the chart marks.
    """
    charts = [
        _chart(each, column, None if here is None else here.get(_over(each).name))
        for each in designs
        for column in each.of_kind(ColumnKind.OBJECTIVE)
    ]
    return tag("div", *charts, class_="charts")


def _over(designs: Designs[Row]) -> Column[Row]:
    (column,) = designs.of_kind(ColumnKind.VARIED)
    return column


def _numbers(column: Column[Row], rows: Sequence[Row]) -> list[float]:
    """Return the numbers of a column; a missing number is NaN."""
    return [math.nan if (cell := column.cell(row)) is None else float(cell) for row in rows]


def _chart(designs: Designs[Row], column: Column[Row], here: float | None) -> Markup:
    over, unit = _over(designs), f" {_over(designs).unit}" if _over(designs).unit else ""
    values, F = _numbers(over, designs.rows), _numbers(column, designs.rows)
    varied = key_words(over.label)
    of = f" of {column.series}" if len(designs.of_kind(ColumnKind.OBJECTIVE)) > 1 else ""
    name = f"F{of} over {varied}"
    solved = [(value, each) for value, each in zip(values, F, strict=True) if math.isfinite(each)]
    words = f"no optimum for any value from {values[0]:.5g} to {values[-1]:.5g}{unit}."
    if solved:
        (first, F_first), (last, F_last) = solved[0], solved[-1]
        words = f"{F_first:.6g} at {first:.5g}{unit}, {F_last:.6g} at {last:.5g}{unit}."
        missing = len(values) - len(solved)
        if missing:
            words += f" No optimum at {missing} of {len(values)} values."
    middles = _bend_values(designs)
    if middles:
        words += " Vertical lines: changes of the active bounds and limits."
    chart = line_chart(
        [Curve(values, F, "curve")],
        [
            Spot(value, each, "spot" if value == here else "other", f"{value:.6g}{unit}: F = {each:.7g}")
            for value, each in solved
        ],
        words=f"{name}: {words}",
        labels=(over.axis, objective_label(designs.case)),
        bounds=middles,
    )
    return tag("figure", chart, caption(name, words))


def _bend_values(designs: Designs[Row]) -> list[float]:
    """Return the midpoints between neighbouring values whose optima have different active bounds and limits."""
    (active,) = designs.of_kind(ColumnKind.ACTIVE)
    has_answer = [
        any(column.cell(row) is not None for column in designs.of_kind(ColumnKind.OBJECTIVE)) for row in designs.rows
    ]
    solved = [row for row, is_solved in zip(designs.rows, has_answer, strict=True) if is_solved]
    values, sides = _numbers(_over(designs), solved), [active.cell(row) for row in solved]
    return [(values[k - 1] + values[k]) / 2 for k in range(1, len(solved)) if sides[k] != sides[k - 1]]
