"""Pictures of several robots at their designs, with one scale and one view."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ....models import Dimension
from ...errors import EvaluationError
from ...words.designs import Designs, DrawnDesign, Row
from .canvas import INK, MUTED
from .drawing import Drawing, drawing_of
from .figures import add_colour_bar, add_legend, picture_of
from .fonts import legible
from .joints import Handles
from .painting import Panel, largest_rate
from .view import View, clearest_view

#: Width, height and heading of a panel, inches; number of panels in a row.
_WIDTH, _HEIGHT, _HEADING, _ACROSS = 4.2, 4.2, 0.65, 3
_ROW = _HEIGHT + _HEADING
#: Least width of the figure, heights of its title and of scales and legend, inches.
_LEAST, _TITLE, _FOOT = 6.6, 0.4, 1.65
#: Width of a legend's handle with the room around it, and mean width of a letter of the legend, inches.
_HANDLE, _LETTER = 0.7, 0.067
#: Largest length of the scale bar, as a fraction of a panel's width.
_BAR = 0.4


class _Pair(NamedTuple):
    """Design of a table, and its drawing without labels."""

    design: DrawnDesign
    drawing: Drawing


class _Scale(NamedTuple):
    """Common scale of all panels: view, rate at the ends of the colour scale, and half of a panel's width."""

    view: View
    largest: float
    half: float


def robots_figure(designs: Designs[Row]) -> Figure:
    """Return robots at their designs as a Matplotlib figure, with one scale and a scale bar.

    Raises:
        EvaluationError: no robot has an optimum at which it exists.
    """
    pairs = _pairs(designs)
    across = min(len(pairs), _ACROSS)
    width, height = max(across * _WIDTH, _LEAST), -(-len(pairs) // across) * _ROW + _TITLE + _FOOT
    figure = _empty(width, height)
    scale = _scale_of(pairs)
    for k, pair in enumerate(pairs):
        _draw_panel(figure, k % across * _WIDTH, height - _TITLE - k // across * _ROW, pair, scale)
    title = "".join(textwrap.wrap(legible(designs.title), int(width / 0.11), max_lines=1, placeholder=" …"))
    figure.text(0.15 / width, 1 - 0.15 / height, title, fontsize=12, color=INK, va="top", parse_math=False)
    _draw_length(figure, _FOOT - 0.28, designs, scale)
    _draw_legend(figure, pairs, scale)
    return figure


def robot_pictures(designs: Designs[Row]) -> list[bytes]:
    """Return an SVG picture of each robot with a scale bar, and last the common legend for a wide and a narrow page.

    Raises:
        EvaluationError: no robot has an optimum at which it exists.
    """
    pairs = _pairs(designs)
    scale = _scale_of(pairs)

    def panel(pair: _Pair) -> Figure:
        figure = _empty(_WIDTH, _ROW + 0.3)
        _draw_panel(figure, 0.0, _ROW + 0.3, pair, scale)
        _draw_length(figure, 0.15, designs, scale)
        return figure

    def legend(width: float) -> Figure:
        figure = _empty(width, _FOOT)
        _draw_legend(figure, pairs, scale, 0.15 / width)
        return figure

    legends = (picture_of(".svg", legend, width) for width in (_LEAST, _WIDTH))
    return [*(picture_of(".svg", panel, pair) for pair in pairs), *legends]


def _pairs(designs: Designs[Row]) -> list[_Pair]:
    """Return the designs that can be drawn; even a feasible design may give points that are not finite.

    Raises:
        EvaluationError: no design can be drawn.
    """
    pairs = []
    for each in designs.drawn():
        with suppress(EvaluationError):
            drawing = drawing_of(each.nlp, each.x, each.state, each.task)
            # Starting point, free motions and forces have scales of a single robot.
            pairs.append(_Pair(each, replace(drawing, reference=None, free=(), forces=None)))
    if not pairs:
        raise EvaluationError(f"{designs.case.source or designs.case.name}: no robot has a design to draw")
    return pairs


def _empty(width: float, height: float) -> Figure:
    """Return an empty figure; width and height are in inches."""
    figure = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _scale_of(pairs: Sequence[_Pair]) -> _Scale:
    """Return the common view, colour scale and length scale, so that sizes and rates of robots can be compared."""
    drawings = [pair.drawing for pair in pairs]
    view, half = clearest_view(*drawings), 0.0
    for drawing in drawings:
        axes = _empty(_WIDTH, _HEIGHT).add_axes((0, 0, 1, 1))
        Panel(axes, view, drawing).paint()
        half = max(half, float(np.ptp(axes.get_xlim())) / 2, float(np.ptp(axes.get_ylim())) / 2)
    return _Scale(view, max(map(largest_rate, drawings)) or 1.0, half)


def _draw_panel(figure: Figure, left: float, top: float, pair: _Pair, scale: _Scale) -> None:
    """Draw a robot below its name; the upper left corner is in inches."""
    width, height = figure.get_size_inches()
    axes = figure.add_axes((left / width, (top - _ROW) / height, _WIDTH / width, _HEIGHT / height))
    Panel(axes, scale.view, pair.drawing, scale.largest).paint()
    for get, put in ((axes.get_xlim, axes.set_xlim), (axes.get_ylim, axes.set_ylim)):
        middle = float(np.mean(get()))
        put(middle - scale.half, middle + scale.half)
    _write_heading(figure, (left + 0.15) / width, (top - 0.12) / height, pair.design)


def _draw_legend(figure: Figure, pairs: Sequence[_Pair], scale: _Scale, left: float = 0.48) -> None:
    """Draw the colour scale, from a fraction of the width on, and the common legend at the bottom of a figure."""
    width, height = figure.get_size_inches()
    entries: dict[str, Artist | Handles] = {}
    symbols: dict[str, Artist | Handles] = {}
    for pair in pairs:
        panel = Panel(_empty(_WIDTH, _HEIGHT).add_axes((0, 0, 1, 1)), scale.view, pair.drawing)
        panel.paint()
        # The largest velocity differs between panels.
        entries |= {text.split(" (fastest")[0]: handle for handle, text in panel.legend}
        symbols |= {text: handle for handle, text in panel.symbols}
    if pairs[0].drawing.rows:
        place = (left, (_FOOT - 0.35) / height, 0.5, 0.14 / height)
        add_colour_bar(figure, place, pairs[0].drawing, scale.largest, "horizontal")
    columns = max(1, min(len(symbols), int(width / 1.5)))
    letters = int((width - _HANDLE) / _LETTER)
    wrapped = [(handle, textwrap.fill(text, letters)) for text, handle in entries.items()]
    add_legend(figure, 0.15 / width, 0.5 / height, wrapped)
    add_legend(figure, 0.15 / width, 0.1 / height, [(handle, text) for text, handle in symbols.items()], columns)


def _write_heading(figure: Figure, left: float, top: float, design: DrawnDesign) -> None:
    """Write the name of a robot, its F and its size above its panel."""
    heading = legible(design.name)
    figure.text(left, top, heading, fontsize=12, color=INK, fontweight="bold", va="top", parse_math=False)
    lower = top - 0.24 / figure.get_figheight()
    figure.text(left, lower, design.words, fontsize=9.5, color=MUTED, va="top", parse_math=False)


def _draw_length(figure: Figure, bottom: float, designs: Designs[Row], scale: _Scale) -> None:
    """Draw a scale bar with a round length for all panels; its position is in inches."""
    longest = 2 * scale.half * _BAR
    power = 10.0 ** np.floor(np.log10(longest))
    length = max(step * power for step in (1, 2, 5) if step * power <= longest)
    width, height = figure.get_size_inches()
    left, part, at = 0.15 / width, length / (2 * scale.half) * _WIDTH / width, bottom / height
    bar = Line2D([left, left + part], [at, at], color=INK, linewidth=2.0, solid_capstyle="butt", gid="scale")
    figure.add_artist(bar)
    text = f"{designs.case.units.text(float(length), Dimension.LENGTH)}, in all panels"
    figure.text(left + part + 0.1 / width, at, text, fontsize=9, color=MUTED, va="center", parse_math=False)
