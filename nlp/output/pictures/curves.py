"""Charts of designs: F over a varied limit or parameter, and one goal over another."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ....models import FloatArray
from ...words.designs import Column, ColumnKind, Designs, Row
from ...words.objective import objective_label
from .canvas import INK, RED, draw_edges


def draw_grid(axes: Axes) -> None:
    """Draw grid, ticks and edges of axes."""
    axes.grid(color="#e3e6e8", linewidth=0.7)
    axes.set_axisbelow(True)
    draw_edges(axes)


def draw_frame(axes: Axes, title: str) -> None:
    """Draw grid, ticks and edges of axes, and a title of at most two lines."""
    draw_grid(axes)
    axes.ticklabel_format(useOffset=False)
    lines = textwrap.wrap(title, 66, max_lines=2, placeholder=" …")
    axes.set_title("\n".join(lines), loc="left", fontsize=11, fontweight="bold", color=INK, parse_math=False)


#: Width and height of the picture, inches.
_SIZE = (7.2, 4.6)
#: Colours and marks of the tasks; further tasks repeat them.
_LOOKS = (("#08519c", "o"), ("#b34700", "s"), ("#3f86c4", "^"), ("#e08a3c", "D"))


def numbers_of(column: Column[Row], rows: Sequence[Row]) -> FloatArray:
    """Return the numbers (n,) of a column; a missing number is NaN."""
    return np.array([math.nan if (cell := column.cell(row)) is None else float(cell) for row in rows])


def lines_figure(designs: Designs[Row]) -> Figure:
    """Return F over the varied value as a Matplotlib figure; the line of a task has the ``gid`` "F" and its name."""
    figure = Figure(figsize=_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    (over,), columns = designs.of_kind(ColumnKind.VARIED), designs.of_kind(ColumnKind.OBJECTIVE)
    values, several = numbers_of(over, designs.rows), len(columns) > 1
    for k, column in enumerate(columns):
        colour, mark = _LOOKS[k % len(_LOOKS)]
        F, name = numbers_of(column, designs.rows), column.series
        label = name if several else None
        axes.plot(values, F, color=colour, marker=mark, markersize=4.5, linewidth=1.4, label=label, gid=f"F {name}")
    known = np.any([np.isfinite(numbers_of(column, designs.rows)) for column in columns], axis=0)
    for value in values[~known]:
        axes.axvline(value, color=RED, linewidth=0.8, linestyle=":", gid="no answer")
    axes.set_xlabel(over.axis, color=INK, parse_math=False)
    axes.set_ylabel(objective_label(designs.case), color=INK, parse_math=False)
    draw_frame(axes, designs.title)
    axes.margins(x=0.03)
    if several:
        for text in axes.legend(frameon=False, fontsize=9).get_texts():
            text.set_parse_math(False)
    if designs.missing:
        note = "\n".join(textwrap.wrap(f"Dotted: {'; '.join(designs.missing)}.", 95, max_lines=3, placeholder=" …"))
        figure.supxlabel(note, fontsize=8.5, color=RED, x=0.01, ha="left", parse_math=False)
    return figure


_FRONT_SIZE = (6.4, 5.0)
#: Width and height of the panel of a pair of goals, inches, and number of panels in a row.
_PANEL, _ACROSS = (4.6, 3.7), 3
#: Width and height of a panel on a narrow page, inches.
_NARROW_PANEL = (4.0, 3.2)


def goals_figure(designs: Designs[Row], *, is_narrow: bool = False) -> Figure:
    """Return one goal over the other as a Matplotlib figure; the line is interrupted at gaps of the front.

    More than two goals have a panel for each pair; with three goals, the colour shows the third.

    Args:
        designs: table of designs of a front.
        is_narrow: If true, the panels are below each other.
    """
    goals = designs.of_kind(ColumnKind.OBJECTIVE)
    labels, values = [goal.axis for goal in goals], np.stack([numbers_of(goal, designs.rows) for goal in goals], axis=1)
    if len(goals) > 2:
        return _pairs(labels, values, designs.title, is_narrow=is_narrow)
    figure = Figure(figsize=_FRONT_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    first = 0
    for last in (*designs.gaps, len(values) - 1):
        axes.plot(*values[first : last + 1].T, color="#08519c", marker="o", markersize=4.5, linewidth=1.4, gid="front")
        first = last + 1
    axes.set_xlabel(labels[0], color=INK, parse_math=False)
    axes.set_ylabel(labels[1], color=INK, parse_math=False)
    draw_frame(axes, designs.title)
    return figure


def _pairs(labels: list[str], values: FloatArray, title: str, *, is_narrow: bool) -> Figure:
    """Return a panel for each pair of goals; with three goals, the colour of the points (n, k) shows the third."""
    pairs = list(combinations(range(len(labels)), 2))
    across = 1 if is_narrow else min(len(pairs), _ACROSS)
    down = -(-len(pairs) // across)
    wide, high = _NARROW_PANEL if is_narrow else _PANEL
    figure = Figure(figsize=(across * wide, down * high + 0.4), facecolor="white", layout="constrained")
    for place, (i, j) in enumerate(pairs, start=1):
        axes = figure.add_subplot(down, across, place)
        others = [k for k in range(len(labels)) if k not in (i, j)]
        if len(others) == 1:
            points = axes.scatter(values[:, i], values[:, j], c=values[:, others[0]], cmap="viridis", s=22, gid="front")
            bar = figure.colorbar(points, ax=axes)
            bar.set_label(labels[others[0]], color=INK, parse_math=False)
        else:
            axes.scatter(values[:, i], values[:, j], color="#08519c", s=18, gid="front")
        axes.set_xlabel(labels[i], color=INK, parse_math=False)
        axes.set_ylabel(labels[j], color=INK, parse_math=False)
        draw_grid(axes)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK, parse_math=False)
    return figure
