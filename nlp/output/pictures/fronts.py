"""The front of several goals as a picture: one goal over the other for each pair of goals."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.figure import Figure

from ....models import FloatArray
from ...front.data import goal_units, goal_values
from ...front.front import Front
from ..fronttable import goal_names
from .canvas import INK, MUTED
from .figures import picture_of
from .frame import draw_frame

_SIZE = (6.4, 5.0)
#: Width and height of a panel of a pair of goals, in inches, and panels in a row.
_PANEL, _ACROSS = (4.6, 3.7), 3


def front_picture(front: Front, ending: str) -> bytes:
    """Return the content of a picture file of a front.

    Args:
        front: the front.
        ending: ``.png``, ``.svg`` or ``.pdf``.
    """
    return picture_of(lambda: front_figure(front), ending)


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
    figure = Figure(figsize=_SIZE, facecolor="white", layout="constrained")
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
        axes.tick_params(colors=INK, labelsize=9)
        axes.grid(color="#e3e6e8", linewidth=0.7)
        axes.set_axisbelow(True)
        for spine in axes.spines.values():
            spine.set_edgecolor(MUTED)
    figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold", color=INK, parse_math=False)
    return figure
