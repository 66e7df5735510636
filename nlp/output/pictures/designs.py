"""Pictures of tables of designs by the relation of their rows, and small pictures of single designs without text."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from ...errors import EvaluationError
from ...words.designs import ColumnKind, Designs, Join, Row
from .curves import goals_figure, lines_figure
from .drawing import Drawing
from .figures import picture_of
from .painting import Panel
from .regions import regions_figure, regions_legend
from .robots import robots_figure
from .view import View, clearest_view

#: Width and height of a picture, inches.
_SIZE = (2.9, 2.6)
#: Width and height of a chart on a narrow page, inches, and number of letters in a line of an axis label.
_NARROW, _LETTERS = (4.0, 3.4), 38
#: Largest number of goals with one panel.
_ONE_PANEL = 2


def page_figure(designs: Designs[Row], *, is_narrow: bool = False) -> Figure:
    """Return the picture of a table of designs for a page, which has the title and the legend itself.

    Args:
        designs: table of designs.
        is_narrow: If true, the picture has the width of a telephone.

    Raises:
        EvaluationError: no design can be drawn.
    """
    figure = designs_figure(designs, is_on_page=True, is_narrow=is_narrow)
    for axes in figure.axes:
        axes.set_title("", loc="left")
    figure.suptitle("")
    if is_narrow:
        goals = len(designs.of_kind(ColumnKind.OBJECTIVE))
        if goals <= _ONE_PANEL or designs.of_kind(ColumnKind.VARIED):
            figure.set_size_inches(*_NARROW)
        for axes in figure.axes:
            for label in (axes.xaxis.label, axes.yaxis.label):
                label.set_text(textwrap.fill(label.get_text(), _LETTERS))
            if isinstance(axes.xaxis.get_major_locator(), FixedLocator):
                texts = [text.get_text() for text in axes.get_xticklabels()]
                axes.set_xticks(axes.get_xticks()[::2], texts[::2])
    return figure


def designs_figure(designs: Designs[Row], *, is_on_page: bool = False, is_narrow: bool = False) -> Figure:
    """Return the picture of a table of designs as a Matplotlib figure.

    Args:
        designs: table of designs.
        is_on_page: If true, the page shows the sentences of :func:`legend_of`, and the picture does not.
        is_narrow: If true, the panels of several goals are below each other.

    Raises:
        EvaluationError: no design can be drawn.
    """
    if designs.join is Join.LIST:
        return robots_figure(designs)
    if designs.join is Join.GRID:
        return regions_figure(designs, () if is_on_page else legend_of(designs))
    if not designs.of_kind(ColumnKind.VARIED):
        return goals_figure(designs, is_narrow=is_narrow)
    if designs.join is Join.CLOUD:
        raise EvaluationError("A picture needs a grid over one or two varied names")
    return lines_figure(designs)


def legend_of(designs: Designs[Row]) -> list[str]:
    """Return the legend of the numbered regions in a picture; empty without numbered regions."""
    return regions_legend(designs) if designs.join is Join.GRID else []


def design_pictures(drawings: Sequence[Drawing]) -> list[bytes]:
    """Return an SVG picture of each design of one robot, in order, with one view and one scale.

    A picture shows the robot and the axis of its task, without frames and velocities; the colours of the limbs show
    their rates.
    """
    view = clearest_view(*drawings)
    plain = [replace(each, free=(), reference=None, forces=None) for each in drawings]
    frames = np.array([_limits(each, view) for each in plain])
    low, high = frames[:, 0].min(axis=0), frames[:, 1].max(axis=0)
    return [picture_of(".svg", _small, each, view, low, high) for each in plain]


def _painted(drawing: Drawing, view: View) -> Figure:
    """Return the robot on axes that fill a figure."""
    figure = Figure(figsize=_SIZE, facecolor="white")
    Panel(figure.add_axes((0, 0, 1, 1)), view, drawing, is_small=True).paint()
    return figure


def _limits(drawing: Drawing, view: View) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the lower left and the upper right corner of a picture, in the case's unit."""
    (axes,) = _painted(drawing, view).axes
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    return (left, bottom), (right, top)


def _small(drawing: Drawing, view: View, low: Sequence[float], high: Sequence[float]) -> Figure:
    """Return a picture with the given corners of its axes."""
    figure = _painted(drawing, view)
    (axes,) = figure.axes
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    return figure
