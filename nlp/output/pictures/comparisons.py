"""Compared robots at their designs side by side, in one scale and from one view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ....models import Dimension
from ...comparison.compare import Comparison
from ...comparison.entry import Entry
from ...errors import EvaluationError
from .canvas import INK, MUTED
from .drawing import Drawing, drawing_of
from .fonts import legible
from .painting import Panel
from .view import clearest_view

#: Width, height and heading of a panel, in inches; panels in a row.
_WIDTH, _HEIGHT, _HEADING, _ACROSS = 4.2, 4.2, 0.65, 3
#: Part of a panel's width that the bar of the scale may have.
_BAR = 0.4


def comparison_drawings(found: Comparison) -> list[tuple[Entry, Drawing]]:
    """Return the drawing of each robot with an answer."""
    drawings = []
    for entry in found.entries:
        if entry.solution is None or not entry.has_answer:
            continue
        outcome = entry.solution.outcomes[0]
        try:
            drawings.append((entry, drawing_of(outcome.own.nlp, outcome.x, outcome.state)))
        except EvaluationError:  # a design that exists for the program, but whose drawing has no finite points
            continue
    return drawings


def comparison_figure(found: Comparison) -> Figure:
    """Return the robots of a comparison at their designs, all in one scale, with a bar that states it.

    Raises:
        EvaluationError: no robot has an answer that exists.
    """
    drawings = comparison_drawings(found)
    if not drawings:
        raise EvaluationError(f"{found.case.source or found.case.name}: no robot has a design to draw")
    across = min(len(drawings), _ACROSS)
    down = -(-len(drawings) // across)
    row = _HEIGHT + _HEADING
    width, height = across * _WIDTH, down * row + 0.5
    figure = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    # One eye for all panels: another view for each would hide which of two robots is the larger one.
    view = clearest_view(*(_plain(drawing) for _, drawing in drawings))
    panels: list[Axes] = []
    for k, (entry, drawing) in enumerate(drawings):
        left, top = k % across * _WIDTH, height - k // across * row
        axes = figure.add_axes((left / width, (top - row) / height, _WIDTH / width, _HEIGHT / height))
        # The start of the search and the free motions of one robot say nothing about another.
        # Words, which a picture of one robot has, would hide these smaller ones.
        Panel(axes, view, _plain(drawing)).paint()
        panels.append(axes)
        _write_heading(figure, (left + 0.15) / width, (top - 0.12) / height, entry)
    half = max(_half_width(axes) for axes in panels)
    for axes in panels:
        for get, put in ((axes.get_xlim, axes.set_xlim), (axes.get_ylim, axes.set_ylim)):
            middle = float(np.mean(get()))
            put(middle - half, middle + half)
    _draw_scale(figure, found, half, width, height)
    return figure


def _plain(drawing: Drawing) -> Drawing:
    """Return a drawing without its start and its free motions."""
    return replace(drawing, reference=None, free=())


def _half_width(axes: Axes) -> float:
    """Return half of the larger side of what a panel shows, length."""
    return max(float(np.ptp(axes.get_xlim())), float(np.ptp(axes.get_ylim()))) / 2


def _write_heading(figure: Figure, left: float, top: float, entry: Entry) -> None:
    """Write the name of a robot and its F above its panel."""
    value = entry.value
    words = (
        "no common value" if value is None else f"F = {value:.5g}" if len(entry.tasks) == 1 else f"value {value:.5g}"
    )
    if entry.can_move is False:
        words += ", cannot make the motion"
    heading = f"{legible(entry.contender.label)}"
    figure.text(left, top, heading, fontsize=12, color=INK, fontweight="bold", va="top", parse_math=False)
    figure.text(left, top - 0.24 / figure.get_figheight(), words, fontsize=9.5, color=MUTED, va="top", parse_math=False)


def _draw_scale(figure: Figure, found: Comparison, half: float, width: float, height: float) -> None:
    """Draw a bar whose length is a round number of the case's unit, for all panels."""
    longest = 2 * half * _BAR
    power = 10.0 ** np.floor(np.log10(longest))
    length = max(step * power for step in (1, 2, 5) if step * power <= longest)
    part = length / (2 * half) * _WIDTH / width
    axes = figure.add_axes((0, 0, 1, 0.5 / height))
    axes.set_axis_off()
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    left = 0.15 / width
    axes.plot([left, left + part], [0.45, 0.45], color=INK, linewidth=2.0, solid_capstyle="butt", gid="scale")
    text = f"{found.case.units.text(float(length), Dimension.LENGTH)}, in all panels"
    axes.text(left + part + 0.1 / width, 0.45, text, fontsize=9, color=MUTED, va="center", parse_math=False)
