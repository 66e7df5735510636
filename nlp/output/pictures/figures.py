"""Picture files of robots in PNG, SVG and PDF, with the same bytes for the same robot and versions."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple, ParamSpec

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.text import Text

from ...units import rate_unit
from ...words.robot import rate_word
from .canvas import INK, MUTED, RED
from .drawing import Drawing
from .fonts import families, legible, needs_other_font
from .joints import Handles
from .painting import Panel, rate_colour_map
from .view import View, clearest_view

_P = ParamSpec("_P")
#: Settings without which two files of one picture would differ, or depend on the user's settings.
_SETTINGS: dict[Any, Any] = {
    "svg.hashsalt": "screwsynth",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "axes.unicode_minus": True,
    "savefig.dpi": 130,
    "figure.dpi": 100,
}
_METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None, "Creator": "screwsynth"},
    ".pdf": {"CreationDate": None, "Creator": "screwsynth", "Producer": None},
}
#: Largest number of panels in a single row; more panels are in rows of two.
_ACROSS = 3
#: Width and height of a panel, and room for the heading, the legend and the colour bar, in inches.
_WIDTH, _HEIGHT, _TOP, _BOTTOM, _SIDE = 7.2, 6.0, 0.95, 1.1, 1.15
#: Width and height of a picture on a narrow page, in inches.
_NARROW = (4.2, 3.8)
#: Room for the line of joint symbols, in inches.
_SYMBOLS = 0.22


def page_pictures(drawing: Drawing) -> tuple[bytes, bytes]:
    """Return SVG pictures of a robot for a wide and a narrow page, which has the heading itself.

    The narrow picture has no colour bar and no legend of lines.
    """
    return picture_of(".svg", figure_of, [drawing], on_page=True), narrow_picture(drawing)


def narrow_picture(drawing: Drawing) -> bytes:
    """Return an SVG picture of a robot for a narrow page."""
    return picture_of(".svg", _narrow_figure, drawing)


def _narrow_figure(drawing: Drawing) -> Figure:
    """Return a picture of a robot with labels as large as the text of a narrow page."""
    figure = Figure(figsize=_NARROW, facecolor="white")
    canvas = FigureCanvasAgg(figure)
    panel = Panel(figure.add_axes((0, 0, 1, 1)), clearest_view(drawing), drawing)
    panel.paint()
    panel.write(canvas.get_renderer())  # type: ignore[no-untyped-call]
    return figure


def picture(drawings: Sequence[Drawing], ending: str, *, view: View | None = None) -> bytes:
    """Return the content of a picture file.

    Args:
        drawings: drawings of one robot, or of the same robot with several tasks, side by side.
        ending: extension ``.png``, ``.svg`` or ``.pdf``.
        view: parallel projection; by default the clearest one for all drawings.
    """
    return picture_of(ending, figure_of, drawings, view=view)


def picture_of(ending: str, make: Callable[_P, Figure], *values: _P.args, **options: _P.kwargs) -> bytes:
    """Return the content of the picture file of a figure.

    Args:
        ending: extension ``.png``, ``.svg`` or ``.pdf``.
        make: function that returns the figure; called with the settings of all pictures.
        values: positional arguments of the function.
        options: keyword arguments of the function.
    """
    content = io.BytesIO()
    settings = {**mpl.rcParamsDefault, **_SETTINGS, "font.family": list(families())}
    with mpl.rc_context(settings):
        figure = make(*values, **options)
        if any(needs_other_font(text.get_text()) for text in figure.findobj(Text)):
            # Fonts of this kind contain outlines that only Type 3 embeds.
            mpl.rcParams["pdf.fonttype"] = 3
        figure.savefig(content, format=ending[1:].lower(), metadata=_METADATA[ending.lower()])
    return content.getvalue()


def figure_of(drawings: Sequence[Drawing], *, view: View | None = None, on_page: bool = False) -> Figure:
    """Return a picture as a Matplotlib figure; arguments as for :func:`picture`.

    A picture on a page has no heading, because the page has it.

    Every artist of a part of the robot has the name of the part as ``gid``: ``limb 1``, ``couple 1``, ``axis``,
    ``path``, ``velocity A1``, ``start limb 1``, ``mark x1``, ``joint B1``.
    """
    view = view or clearest_view(*drawings)
    across = len(drawings) if len(drawings) <= _ACROSS else 2
    side = _SIDE if drawings[0].rows else 0.2
    room = _BOTTOM + (_SYMBOLS if any(each.model.scene.joints for each in drawings) else 0.0)
    above = 0.1 if on_page else _TOP
    row_height = _HEIGHT + above + room
    width, height = across * (_WIDTH + side), -(-len(drawings) // across) * row_height
    figure = Figure(figsize=(width, height), facecolor="white")
    canvas = FigureCanvasAgg(figure)
    for k, drawing in enumerate(drawings):
        left, top = k % across * (_WIDTH + side), height - k // across * row_height
        bottom = top - row_height
        place = (left / width, (bottom + room) / height, _WIDTH / width, _HEIGHT / height)
        axes = figure.add_axes(place)
        panel = Panel(axes, view, drawing)
        panel.paint()
        if drawing.rows:
            corner = (left + _WIDTH + 0.1) / width, (bottom + 0.22 * row_height) / height
            bar = add_colour_bar(figure, (*corner, 0.16 / width, 0.5 * row_height / height), drawing, panel.largest)
            bar.ax.hlines([row.rate for row in drawing.rows], 0, 1, color=INK, linewidth=1.0, gid="rates")
        panel.write(canvas.get_renderer())  # type: ignore[no-untyped-call]
        low = bottom + 0.02 * (_HEIGHT + above + _BOTTOM)
        if panel.symbols:
            add_legend(figure, (left + 0.25) / width, low / height, panel.symbols, len(panel.symbols))
        add_legend(figure, (left + 0.25) / width, (low + room - _BOTTOM) / height, panel.legend)
        if not on_page:
            _write_heading(figure, (left + 0.25) / width, top / height, height, drawing)
    return figure


class _HeadingLine(NamedTuple):
    """Line above a panel, with its size in points."""

    text: str
    size: float
    colour: str
    bold: bool


def _heading(drawing: Drawing) -> list[_HeadingLine]:
    """Return the lines above a panel: name of the case or robot, and result."""
    title = drawing.model.name if drawing.case is None else drawing.case.title or drawing.case.name
    lines = [_HeadingLine(title, 12.0, INK, bold=True)]
    if drawing.headline:
        colour = MUTED if drawing.is_answer else RED
        lines.append(_HeadingLine(drawing.headline, 10.0, colour, bold=not drawing.is_answer))
    return lines


def _write_heading(figure: Figure, left: float, top: float, height: float, drawing: Drawing) -> None:
    """Write the heading above a panel; the position is in fractions of the figure, the figure's height in inches."""
    top -= 0.3 / height
    for text, size, colour, bold in _heading(drawing):
        lines = textwrap.wrap(legible(text), int(0.98 * _WIDTH * 72 / (0.58 * size)), max_lines=2, placeholder=" …")
        figure.text(
            left,
            top,
            "\n".join(lines),
            fontsize=size,
            color=colour,
            fontweight="bold" if bold else "normal",
            va="top",
            parse_math=False,
        )
        top -= (1.35 * size / 72 * len(lines)) / height


def add_colour_bar(
    figure: Figure,
    place: tuple[float, float, float, float],
    drawing: Drawing,
    largest: float,
    orientation: Literal["vertical", "horizontal"] = "vertical",
) -> Colorbar:
    """Draw the colour scale of the rates; left, bottom, width and height are in fractions of the figure."""
    scale = ScalarMappable(Normalize(-largest, largest), rate_colour_map())
    bar = figure.colorbar(scale, cax=figure.add_axes(place), orientation=orientation)
    unit = rate_unit(drawing.motion.twist, drawing.case.units) if drawing.motion and drawing.case else ""
    bar.set_label(legible(f"{rate_word(drawing.model)} of each limb, {unit}"), color=INK, fontsize=9, parse_math=False)
    bar.ax.tick_params(labelsize=8, colors=INK)
    bar.outline.set_edgecolor(MUTED)
    return bar


def add_legend(
    figure: Figure, left: float, bottom: float, entries: Sequence[tuple[Artist | Handles, str]], columns: int = 1
) -> None:
    """Write a legend of handles and texts, at a position in fractions of the figure."""
    if entries:
        figure.legend(
            handles=[handle for handle, _ in entries],
            labels=[legible(text) for _, text in entries],
            loc="lower left",
            bbox_to_anchor=(left, bottom),
            frameon=False,
            fontsize=8.5,
            ncols=columns,
            labelcolor=INK,
            borderaxespad=0,
            handlelength=2.2 if columns == 1 else 1.4,
            columnspacing=1.6,
            handletextpad=0.8 if columns == 1 else 0.4,
        )
