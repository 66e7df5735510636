"""Labels of a picture: words at places where they cover neither each other nor the lines, with leader lines."""

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

#: Room around a word, in pixels.
_ROOM = 2.0


@dataclass(frozen=True, eq=False)
class Label:
    """A word beside a place.

    Attributes:
        text: the word; never read as mathematics.
        at: (k, 2) one or more places to choose from, in data coordinates.
        away: (2,) the preferred direction from the place; zero for none.
        color: of the letters.
        size: of the letters, points.
        bold: whether they are bold.
        name: ``gid`` of the artist.
        owner: name of the limb that the word belongs to; empty for none.
        is_led: whether a leader line joins the word to its place however near they are.
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
    """Straight lines that words should not cover.

    Attributes:
        segments: (k, 4) their ends, in data coordinates.
        owners: (k,) name of the limb that each is part of; empty for none.
    """

    segments: FloatArray
    owners: tuple[str, ...]


def place_labels(axes: Axes, renderer: RendererAgg, labels: Sequence[Label], obstacles: Obstacles) -> list[Text]:
    """Put words beside their places, one after the other, each where its cost is least.

    Args:
        axes: with its final limits and place.
        renderer: measures the words.
        labels: the more important first.
        obstacles: lines that words should not cover.
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
    """Return the lines of a picture in pixels, with lines of limbs apart from other lines."""
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
    """Return a word on the axes, not yet at its place."""
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
    """Draw a thin line (2, 2) from a place on a limb, where it has a dot, to a word."""
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
