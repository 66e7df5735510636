"""Charts along a tool path: actuator coordinates, speeds and forces, and the smallest margin of all limits."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...words.path import verdict_words
from .canvas import INK, MUTED, RED
from .curves import draw_grid
from .fonts import legible
from .pathpanels import (
    ACTUATOR_COLOURS,
    LIMIT_COLOURS,
    PathMark,
    PathPanel,
    PathPicture,
    actuator_names,
    marks_text,
    nearest_parts,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Width, height of a panel, and heights of the texts above and below, inches.
_WIDTH, _PANEL, _WORDS = 8.0, 1.75, 1.7
#: Distance, as a fraction of the width, below which labels of violations would overlap.
_NEAR = 0.06
_BANDS: dict[bool, dict[str, Any]] = {
    True: {"facecolor": "#f3b8ac", "alpha": 0.55},
    False: {"facecolor": "#c5ccd3", "alpha": 0.6},
}


def path_figure(picture: PathPicture) -> Figure:
    """Return a Matplotlib figure of charts along a path, one below another.

    The ``gid`` of artists: ``TITLE ACTUATOR`` for a curve, with the prefix ``smallest`` for the smaller of two values;
    ``limit`` for a limit; ``margin KEY`` for the smallest margin where this limit is nearest; ``fault LINE`` for a
    violation; ``refuted`` and ``open`` for segments that are not proved.
    """
    count = len(picture.panels) + bool(picture.margins.size)
    notes = [line for each in picture.notes for line in textwrap.wrap(legible(each), 118)]
    size = _WIDTH, _PANEL * max(count, 1) + _WORDS + 0.15 * len(notes)
    figure = Figure(figsize=size, facecolor="white", layout="constrained")
    every = figure.subplots(max(count, 1), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for axes, panel in zip(every, picture.panels, strict=False):
        _paint(axes, picture, panel)
    if picture.margins.size:
        _paint_margins(every[-1], picture)
    for axes in every:
        _mark(axes, picture)
        draw_grid(axes)
        axes.tick_params(labelsize=8)
        axes.margins(x=0.01)
    _name_faults(every[0], picture)
    every[-1].set_xlabel(picture.label, color=INK, fontsize=9, parse_math=False)
    every[-1].set_xlim(float(picture.way.knots[0]), float(picture.way.knots[-1]) or 1.0)
    case = picture.judged.case
    title = textwrap.wrap(legible(case.title or case.name), 72, max_lines=1, placeholder=" …")
    title += textwrap.wrap(legible(f"{picture.judged.path.source}: {verdict_words(picture.result)}"), 96)
    figure.suptitle("\n".join(title), fontsize=10, color=INK, parse_math=False)
    _add_legend(figure, picture, notes)
    return figure


def _paint(axes: Axes, picture: PathPicture, panel: PathPanel) -> None:
    """Draw the curves and limits of a panel."""
    for curve in panel.curves:
        axes.plot(
            picture.at,
            curve.values,
            color=INK if panel.is_setting else ACTUATOR_COLOURS[curve.place % len(ACTUATOR_COLOURS)],
            linewidth=1.2,
            linestyle="--" if curve.is_other else "-",
            gid=f"{'smallest ' * curve.is_other}{panel.title} {curve.name}",
        )
    for limit in panel.limits:
        axes.axhline(limit, color=RED, linewidth=1.0, gid="limit")
    axes.set_title(legible(panel.label), loc="left", fontsize=9, color=INK, pad=3, parse_math=False)


def _paint_margins(axes: Axes, picture: PathPicture) -> None:
    """Draw the smallest margin in the colours of the nearest limits, with a legend."""
    for k, words in picture.limits:
        axes.plot(
            picture.at,
            nearest_parts(picture.samples.nearest, k, picture.drawn_margins),
            color=LIMIT_COLOURS[k % len(LIMIT_COLOURS)],
            linewidth=1.8,
            label=legible(words),
            gid=f"margin {picture.samples.keys[k]}",
        )
    axes.axhline(0.0, color=RED, linewidth=1.0, gid="limit")
    axes.set_title("smallest margin, %", loc="left", fontsize=9, color=INK, pad=3)
    if picture.limits:
        place: dict[str, Any] = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.1}
        legend = axes.legend(**place, ncols=min(len(picture.limits), 3), frameon=False, fontsize=8, labelcolor=INK)
        for text in legend.get_texts():
            text.set_parse_math(False)


def _mark(axes: Axes, picture: PathPicture) -> None:
    """Shade segments that are not proved, and draw a line at each violation."""
    for band in picture.bands:
        axes.axvspan(
            band.start, band.end, linewidth=0, zorder=0, gid="refuted" if band.is_refuted else "open",
            **_BANDS[band.is_refuted],
        )  # fmt: skip
    for mark in picture.marks:
        axes.axvline(mark.at, color=RED, linewidth=1.0, linestyle=":", gid=f"fault {mark.line}")


def _name_faults(axes: Axes, picture: PathPicture) -> None:
    """Write the lines of violations above the first panel; neighbouring violations share a label."""
    width = float(picture.way.knots[-1]) or 1.0
    groups: list[list[PathMark]] = []
    for mark in picture.marks:
        if groups and mark.at - groups[-1][0].at < _NEAR * width:
            groups[-1].append(mark)
        else:
            groups.append([mark])
    for group in groups:
        at = np.clip(np.mean([each.at for each in group]), 0.03 * width, 0.97 * width)
        words = legible(marks_text(group))
        place = axes.get_xaxis_transform()
        axes.text(float(at), 1.14, words, transform=place, fontsize=8, color=RED, ha="center", va="bottom")


def _add_legend(figure: Figure, picture: PathPicture, notes: Sequence[str]) -> None:
    """Write notes and the legend below the panels."""
    handles: list[Line2D] = []
    for place, name in actuator_names(picture).items():
        colour = ACTUATOR_COLOURS[place % len(ACTUATOR_COLOURS)]
        handles.append(Line2D([], [], color=colour, linewidth=1.6, label=legible(f"actuator {name}")))
    if any(each.is_other for panel in picture.panels for each in panel.curves):
        handles.append(Line2D([], [], color=MUTED, linestyle="--", label="smaller of two values"))
    if any(panel.limits for panel in picture.panels) or picture.margins.size:
        handles.append(Line2D([], [], color=RED, linewidth=1.0, label="limit"))
    legend = figure.legend(
        handles=handles,
        loc="outside lower left",
        ncols=_columns(handles),
        frameon=False,
        fontsize=8,
        labelcolor=INK,
        title="\n".join(notes),
        title_fontproperties={"size": 8},
        alignment="left",
    )
    for text in (*legend.get_texts(), legend.get_title()):
        text.set_parse_math(False)


def _columns(handles: Sequence[Line2D]) -> int:
    """Return the number of columns of a legend, with at most two rows for short texts."""
    longest = max((len(str(each.get_label())) for each in handles), default=0)
    return max(1, min(len(handles), int(120 / (longest + 5))))
