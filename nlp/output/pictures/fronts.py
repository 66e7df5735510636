"""The front of two goals as a picture."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...front.front import Front
from ..fronttable import goal_names, goal_units, goal_values
from .canvas import INK
from .figures import picture_of
from .frame import draw_frame

_SIZE = (6.4, 5.0)


def front_picture(front: Front, ending: str) -> bytes:
    """Return the content of a picture file of a front.

    Args:
        front: the front.
        ending: ``.png``, ``.svg`` or ``.pdf``.
    """
    return picture_of(lambda: front_figure(front), ending)


def front_figure(front: Front) -> Figure:
    """Return one goal over the other as a Matplotlib figure; a gap of the front has no line."""
    figure = Figure(figsize=_SIZE, facecolor="white", layout="constrained")
    axes = figure.add_subplot()
    values = np.array([goal_values(front, point) for point in front.points])
    first = 0
    for last in (*front.gaps, len(values) - 1):
        axes.plot(*values[first : last + 1].T, color="#08519c", marker="o", markersize=4.5, linewidth=1.4, gid="front")
        first = last + 1
    labels = [
        f"{name}, {unit}" if unit else name for name, unit in zip(goal_names(front), goal_units(front), strict=True)
    ]
    axes.set_xlabel(labels[0], color=INK, parse_math=False)
    axes.set_ylabel(labels[1], color=INK, parse_math=False)
    draw_frame(axes, front.case.title or front.case.name)
    return figure
