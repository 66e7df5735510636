"""Lines, arrows and labels on Matplotlib axes, from points in the world frame and a parallel projection."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from ....models import FloatArray
from .labels import Label, Obstacles, place_labels
from .view import View

INK, MUTED, FAINT, RED = "#17212b", "#55616c", "#b9c1c9", "#a3250f"
#: Colour in Matplotlib's format.
Colour: TypeAlias = str | tuple[float, float, float, float]
#: Room around the drawing, as a fraction of the larger side.
_MARGIN = 0.07
#: Projected length, as a fraction of its length, below which an arrow is drawn as seen from its end.
_END_ON = 0.02


class Canvas:
    """Axes in parallel projection; labels are placed last, so that they cover no line and no other label.

    Args:
        axes: empty Matplotlib axes.
        view: parallel projection.
        centre: (3,) centre of the drawing; labels are placed outwards from it.
    """

    def __init__(self, axes: Axes, view: View, centre: FloatArray) -> None:
        self.view = view
        self._axes = axes
        self._centre = view.project(centre)
        self._labels: list[Label] = []
        self._segments: list[FloatArray] = []
        self._owners: list[str] = []
        axes.set_axis_off()
        axes.set_aspect("equal", adjustable="box")

    def line(
        self,
        points: FloatArray,
        name: str,
        *,
        limb: str = "",
        **style: Any,  # noqa: ANN401 - Matplotlib's keywords
    ) -> Line2D:
        """Draw a line through points (k, 3) and keep labels away from it; ``limb`` is the name of the line's limb."""
        flat = self.view.project(points)
        (line,) = self._axes.plot(flat[:, 0], flat[:, 1], gid=name, **{"solid_capstyle": "round", **style})
        self.keep_free(points, limb)
        return line

    def polygon(self, points: FloatArray, **style: Any) -> None:  # noqa: ANN401 - Matplotlib's keywords
        """Draw a filled polygon with corners (k, 3); labels may cover it."""
        self._axes.add_patch(Polygon(self.view.project(points), **style))

    def marker(
        self,
        point: FloatArray,
        name: str,
        symbol: str = "o",
        **style: Any,  # noqa: ANN401 - Matplotlib's keywords
    ) -> None:
        """Draw a marker at a point (3,) with a Matplotlib symbol; labels may cover it."""
        x, y = self.view.project(point)
        self._axes.plot([x], [y], marker=symbol, linestyle="none", gid=name, **style)

    def arrow(
        self,
        start: FloatArray,
        end: FloatArray,
        name: str,
        colour: Colour,
        width: float,
        zorder: float,
        *,
        has_two_heads: bool = False,
    ) -> None:
        """Draw an arrow between two points (3,), with two heads for a moment.

        Seen from its end, an arrow is a circle, with a dot if it points towards the viewer, and otherwise with a cross.
        """
        if self.is_end_on(start, end):
            size, is_near = 5.0 + 2.4 * width, self.view.depth(end) > self.view.depth(start)
            style: dict[str, Any] = {"markeredgecolor": colour, "zorder": zorder}
            self.marker(
                start, name, markersize=size, markerfacecolor="white", markeredgewidth=0.6 + 0.3 * width, **style
            )
            inner = 0.3 * size if is_near else 0.6 * size
            self.marker(
                start, f"{name} head", "o" if is_near else "x", markersize=inner, markerfacecolor=colour, **style
            )
            self.keep_free(np.array([start, end]))
            return
        if has_two_heads:
            self.arrow(start, start + 0.86 * (end - start), f"{name} second head", colour, width, zorder)
        a, b = self.view.project(start), self.view.project(end)
        style = {"arrowstyle": f"-|>,head_width={0.12 + 0.09 * width:.3f},head_length={0.3 + 0.14 * width:.3f}"}
        style |= {"color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
        self._axes.annotate("", tuple(b), tuple(a), arrowprops=style, zorder=zorder, gid=name, annotation_clip=False)
        self.keep_free(np.array([start, end]))

    def is_end_on(self, start: FloatArray, end: FloatArray) -> bool:
        """Return whether an arrow between two points (3,) is seen end-on."""
        way = end - start
        return bool(np.linalg.norm(self.view.project(way)) <= _END_ON * np.linalg.norm(way))

    def label(
        self,
        text: str,
        at: FloatArray,
        away: FloatArray,
        colour: str = INK,
        size: float = 9.0,
        *,
        bold: bool = False,
        limb: str = "",
        is_led: bool = False,
    ) -> None:
        """Request a label beside a point (3,), preferably in a direction (2,) of the picture.

        Args:
            text: text of the label.
            at: (3,) point, or (k, 3) points to choose from.
            away: (2,) preferred direction; zero for none.
            colour: colour of the text.
            size: size of the text, points.
            bold: If true, the text is bold.
            limb: name of the limb of the label, which then has a leader line; empty for none.
            is_led: If true, a label without a limb has a leader line too.
        """
        length = float(np.linalg.norm(away))
        places = np.atleast_2d(self.view.project(at))
        direction = away / length if length else away
        self._labels.append(
            Label(text, places, direction, colour, size, bold, f"label {text}", limb, is_led or bool(limb))
        )

    def outwards(self, at: FloatArray) -> FloatArray:
        """Return the projected direction (2,) from the centre to a point (3,)."""
        return np.asarray(self.view.project(at) - self._centre)

    def keep_free(self, points: FloatArray, limb: str = "") -> None:
        """Keep labels away from a line through points (k, 3), and the line within the limits of the axes."""
        flat = self.view.project(points)
        for a, b in pairwise(flat):
            self._segments.append(np.array([*a, *b]))
            self._owners.append(limb)

    def fit_limits(self) -> None:
        """Set the limits of the axes around the drawing, with room for labels, in the proportion of the panel."""
        flat = np.vstack(self._segments).reshape(-1, 2)
        low, high = flat.min(axis=0), flat.max(axis=0)
        half = (high - low) / 2 + _MARGIN * float(np.max(high - low))
        panel = self._axes.get_window_extent()
        unit = max(half[0] / panel.width, half[1] / panel.height)
        middle, half = (low + high) / 2, unit * np.array([panel.width, panel.height])
        self._axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        self._axes.set_ylim(middle[1] - half[1], middle[1] + half[1])

    def write_labels(self, renderer: RendererAgg) -> None:
        """Write the labels, when the axes have their final position."""
        self._axes.apply_aspect()
        # Limbs are closest together: their labels are placed first.
        ordered = sorted(self._labels, key=lambda label: not label.owner)
        place_labels(self._axes, renderer, ordered, Obstacles(np.vstack(self._segments), tuple(self._owners)))


def draw_edges(axes: Axes, size: float = 9) -> None:
    """Draw ticks, with labels of a size in points, and edges of axes in the colours of all pictures."""
    axes.tick_params(colors=INK, labelsize=size)
    for spine in axes.spines.values():
        spine.set_edgecolor(MUTED)


def arc(centre: FloatArray, through: FloatArray, normal: FloatArray, last: FloatArray | None = None) -> FloatArray:
    """Return points (k, 3) of a circle, or of its arc from ``through`` to the direction ``last`` (3,)."""
    axis, ray = normal / np.linalg.norm(normal), through - centre
    across = np.cross(axis, ray)
    turn = 2 * math.pi if last is None else math.atan2(float(last @ across), float(last @ ray))
    angles = np.linspace(0.0, turn, 97 if last is None else 25)
    return np.asarray(centre + np.outer(np.cos(angles), ray) + np.outer(np.sin(angles), across))
