"""Pictures of trade-off curves and of fronts: F over a number of the case, and one goal over another."""

from __future__ import annotations

import math
import textwrap
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ....models import FloatArray
from ...case.case import Case
from ...front.data import goal_units, goal_values
from ...front.front import Front
from ...results.objective import objective_label
from ...results.tradeoff import TradeoffResult, tradeoff_words
from ..fronttable import goal_names
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
#: A colour and a mark for each task; more tasks begin again.
_LOOKS = (("#08519c", "o"), ("#b34700", "s"), ("#3f86c4", "^"), ("#e08a3c", "D"))


def tradeoff_figure(case: Case, result: TradeoffResult) -> Figure:
    """Return F over the number as a Matplotlib figure; the line of each task carries ``F`` and its name as ``gid``."""
    figure = Figure(figsize=_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    values = [point.value for point in result.points]
    several = len(result.tasks) > 1
    for k, name in enumerate(result.tasks):
        colour, mark = _LOOKS[k % len(_LOOKS)]
        F = [math.nan if point.tasks[k] is None else point.tasks[k] for point in result.points]
        label = name if several else None
        axes.plot(values, F, color=colour, marker=mark, markersize=4.5, linewidth=1.4, label=label, gid=f"F {name}")  # type: ignore[arg-type]
    missing = [point.value for point in result.points if not point.status.is_answer]
    for value in missing:
        axes.axvline(value, color=RED, linewidth=0.8, linestyle=":", gid="no answer")
    axes.set_xlabel(f"{result.over}, {result.unit}" if result.unit else result.over, color=INK, parse_math=False)
    axes.set_ylabel(objective_label(case), color=INK, parse_math=False)
    draw_frame(axes, case.title or case.name)
    axes.margins(x=0.03)
    if several:
        for text in axes.legend(frameon=False, fontsize=9).get_texts():
            text.set_parse_math(False)
    words = tradeoff_words(result)
    if words:
        note = "\n".join(textwrap.wrap(f"Dotted: {'; '.join(words)}.", 95, max_lines=3, placeholder=" …"))
        figure.supxlabel(note, fontsize=8.5, color=RED, x=0.01, ha="left", parse_math=False)
    return figure


_FRONT_SIZE = (6.4, 5.0)
#: Width and height of a panel of a pair of goals, in inches, and panels in a row.
_PANEL, _ACROSS = (4.6, 3.7), 3


def front_figure(front: Front) -> Figure:
    """Return one goal over the other as a Matplotlib figure; a gap of the front has no line.

    More than two goals have a panel for each pair of them; of three, the third is the colour.
    """
    labels = [
        f"{name}, {unit}" if unit else name for name, unit in zip(goal_names(front), goal_units(front), strict=True)
    ]
    values = np.array([goal_values(front, point) for point in front.points])
    title = front.case.title or front.case.name
    if len(front.goals) > 2:
        return _pairs(labels, values, title)
    figure = Figure(figsize=_FRONT_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    first = 0
    for last in (*front.gaps, len(values) - 1):
        axes.plot(*values[first : last + 1].T, color="#08519c", marker="o", markersize=4.5, linewidth=1.4, gid="front")
        first = last + 1
    axes.set_xlabel(labels[0], color=INK, parse_math=False)
    axes.set_ylabel(labels[1], color=INK, parse_math=False)
    draw_frame(axes, title)
    return figure


def _pairs(labels: list[str], values: FloatArray, title: str) -> Figure:
    """Return a panel for each pair of goals; the points (n, k) of three goals have the third as their colour."""
    pairs = list(combinations(range(len(labels)), 2))
    across = min(len(pairs), _ACROSS)
    down = -(-len(pairs) // across)
    figure = Figure(figsize=(across * _PANEL[0], down * _PANEL[1] + 0.4), facecolor="white", layout="constrained")
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
