"""Places for words in a picture where they cover neither each other nor the lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from ....models import FloatArray

#: Distances, in points, and number of directions of the places that are tried for a word.
_DISTANCES = (7.0, 12.0, 18.0, 26.0, 36.0)
_DIRECTIONS = 16
#: Room around a word, in pixels.
_ROOM = 2.0
#: Costs of covering another word, of covering a point that is kept free, and of a point of distance.
_OVERLAP, _COVERED, _FAR = 50.0, 4.0, 0.12
#: A word beyond the axes is cut off, which is worse than an overlap.
_OUTSIDE = 60.0


@dataclass(frozen=True, eq=False)
class Label:
    """A word beside a place.

    Attributes:
        text: the word; never read as mathematics.
        at: (2,) the place, in data coordinates.
        away: (2,) the preferred direction from the place; zero for none.
        color: of the letters.
        size: of the letters, points.
        bold: whether they are bold.
        name: ``gid`` of the artist.
    """

    text: str
    at: FloatArray
    away: FloatArray
    color: str
    size: float = 9.0
    bold: bool = False
    name: str = ""


def place_labels(axes: Axes, renderer: RendererAgg, labels: Sequence[Label], keep_free: FloatArray) -> list[Text]:
    """Put words beside their places, one after the other, each where its cost is least.

    Args:
        axes: with its final limits and place.
        renderer: measures the words.
        labels: the more important first.
        keep_free: (k, 2) points in data coordinates that words should not cover.
    """
    dots = axes.transData.transform(keep_free) if len(keep_free) else np.zeros((0, 2))
    frame = axes.get_window_extent(renderer)
    inside = (frame.x0, frame.y0, frame.x1, frame.y1)
    taken: list[tuple[float, float, float, float]] = []
    texts = []
    per_point = float(axes.figure.dpi) / 72
    for label in labels:
        text = axes.text(
            float(label.at[0]),
            float(label.at[1]),
            label.text,
            color=label.color,
            fontsize=label.size,
            fontweight="bold" if label.bold else "normal",
            ha="center",
            va="center",
            parse_math=False,
            path_effects=[withStroke(linewidth=2.5, foreground="white")],
            zorder=100,
            gid=label.name or None,
        )
        extent = text.get_window_extent(renderer)
        half = np.array([extent.width, extent.height]) / 2 + _ROOM
        centre = axes.transData.transform(label.at)
        best, least = centre, math.inf
        for distance in _DISTANCES:
            for step in range(_DIRECTIONS):
                direction = np.array(
                    [math.cos(2 * math.pi * step / _DIRECTIONS), math.sin(2 * math.pi * step / _DIRECTIONS)]
                )
                # The word's edge, not its middle, is that far from the place.
                reach = min(half / np.maximum(np.abs(direction), 1e-9))
                place = centre + direction * (distance * per_point + reach)
                box = (*(place - half), *(place + half))
                cost = _FAR * distance - 2.0 * float(direction @ label.away) + _cost(box, taken, dots, inside)
                if cost < least:
                    best, least = place, cost
        text.set_position(tuple(axes.transData.inverted().transform(best)))
        taken.append((*(best - half), *(best + half)))
        texts.append(text)
    return texts


def _cost(
    box: tuple[float, ...],
    taken: Sequence[tuple[float, ...]],
    dots: FloatArray,
    inside: tuple[float, float, float, float],
) -> float:
    """Return the cost of a word's box, in pixels: left, bottom, right, top.

    Args:
        box: of the word.
        taken: boxes of the words already placed.
        dots: (k, 2) points that words should not cover.
        inside: box of the axes.
    """
    cost = 0.0
    for other in taken:
        wide = min(box[2], other[2]) - max(box[0], other[0])
        high = min(box[3], other[3]) - max(box[1], other[1])
        if wide > 0 and high > 0:
            cost += _OVERLAP + wide * high / 10
    within = (dots[:, 0] > box[0]) & (dots[:, 0] < box[2]) & (dots[:, 1] > box[1]) & (dots[:, 1] < box[3])
    cost += _COVERED * int(np.count_nonzero(within))
    if box[0] < inside[0] or box[1] < inside[1] or box[2] > inside[2] or box[3] > inside[3]:
        cost += _OUTSIDE
    return cost
