"""Labels of a picture, with leader lines, at positions where they cover neither each other nor lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from ....models import FloatArray
from .fonts import legible
from .places import Sheet, Word, arrange

#: Room around a label, in pixels.
_ROOM = 2.0


@dataclass(frozen=True, eq=False)
class Label:
    """Label beside a point.

    Attributes:
        text: text of the label, not interpreted as mathematics.
        at: (k, 2) one or more points to choose from, in data coordinates.
        away: (2,) preferred direction from the point; zero for none.
        color: colour of the text.
        size: size of the text, points.
        bold: If true, the text is bold.
        name: ``gid`` of the artist.
        owner: name of the limb of the label; empty for none.
        is_led: If true, the label has a leader line at any distance.
    """

    text: str
    at: FloatArray
    away: FloatArray
    color: str
    size: float = 9.0
    bold: bool = False
    name: str = ""
    owner: str = ""
    is_led: bool = False


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Straight lines that labels should not cover.

    Attributes:
        segments: (k, 4) ends of the lines, in data coordinates.
        owners: (k,) names of the limbs of the lines; empty for none.
    """

    segments: FloatArray
    owners: tuple[str, ...]


def place_labels(axes: Axes, renderer: RendererAgg, labels: Sequence[Label], obstacles: Obstacles) -> list[Text]:
    """Place labels beside their points, one after the other, at the positions of least cost.

    Args:
        axes: axes with their final limits and position.
        renderer: renderer that measures the labels.
        labels: labels in order of importance.
        obstacles: lines that labels should not cover.
    """
    texts = [_text_of(axes, label) for label in labels]
    words = [_word_of(axes, label, text, renderer) for label, text in zip(labels, texts, strict=True)]
    back = axes.transData.inverted()
    found = arrange(words, _sheet_of(axes, renderer, obstacles))
    for label, text, placed in zip(labels, texts, found, strict=True):
        text.set_position(tuple(back.transform(placed.middle)))
        if placed.leader is not None:
            _draw_leader(axes, back.transform(placed.leader.reshape(2, 2)), label)
    return texts


def _sheet_of(axes: Axes, renderer: RendererAgg, obstacles: Obstacles) -> Sheet:
    """Return the lines of a picture in pixels, with the lines of limbs separated from other lines."""
    ends = axes.transData.transform(obstacles.segments.reshape(-1, 2)).reshape(-1, 4)
    owners = np.array(obstacles.owners, dtype=np.object_)
    is_limb = owners != ""
    frame, per_point = axes.get_window_extent(renderer), float(axes.figure.dpi) / 72
    return Sheet(ends[is_limb], owners[is_limb], ends[~is_limb], np.array(frame.extents), per_point)


def _word_of(axes: Axes, label: Label, text: Text, renderer: RendererAgg) -> Word:
    """Return the size and the points of a label in pixels."""
    extent = text.get_window_extent(renderer)
    half = np.array([extent.width, extent.height]) / 2 + _ROOM
    return Word(half, axes.transData.transform(label.at), label.away, label.owner, label.is_led)


def _text_of(axes: Axes, label: Label) -> Text:
    """Return the text of a label, before its placement."""
    return axes.text(
        float(label.at[0, 0]),
        float(label.at[0, 1]),
        legible(label.text),
        color=label.color,
        fontsize=label.size,
        fontweight="bold" if label.bold else "normal",
        ha="center",
        va="center",
        multialignment="center",
        parse_math=False,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
        zorder=100,
        gid=label.name or None,
    )


def _draw_leader(axes: Axes, line: FloatArray, label: Label) -> None:
    """Draw a leader line (2, 2) from a point, with a dot if it is on a limb, to a label."""
    axes.add_line(
        Line2D(
            line[:, 0], line[:, 1], color="white", linewidth=2.6, zorder=98, solid_capstyle="butt", gid="leader edge"
        )
    )
    axes.add_line(
        Line2D(
            line[:, 0],
            line[:, 1],
            color=label.color,
            linewidth=0.8,
            zorder=99,
            gid=f"leader {label.owner or label.text}",
        )
    )
    axes.plot([line[0, 0]], [line[0, 1]], marker="o", markersize=2.6, color=label.color, zorder=99, gid="leader dot")
