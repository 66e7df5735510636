"""Painting a robot on Matplotlib axes in parallel projection: from the floor up, the nearer over the farther."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from ....models import Body, FloatArray, MarkKind, WrenchKind
from .labels import Label, place_labels
from .posture import Posture
from .scene import Drawing, Motion
from .view import View, painting_order

INK, MUTED, FAINT = "#17212b", "#55616c", "#b9c1c9"
BASE_FACE, PLATFORM_FACE, JOINT_FACE = "#e6eaee", "#dbe6ef", "#ffffff"
VELOCITY, FREE = "#6d2a8c", "#0b6b57"
#: From shortening to lengthening; nothing in the middle is as light as the paper.
RATES = ("#08519c", "#3f86c4", "#9aa3ab", "#e08a3c", "#b34700")
#: Length of the longest velocity arrow, of the frames' axes and of a couple's arrow, in parts of the robot's size.
_ARROW, _FRAME, _COUPLE = 0.42, 0.24, 0.24
_JOINT_AXIS = 0.2
#: Radius of an angle's arc, in parts of its first ray.
_ARC = 0.72
#: As Matplotlib takes it.
Colour: TypeAlias = str | tuple[float, float, float, float]
#: A rate below this part of the largest is drawn as none.
_NOISE = 1e-9


class Panel:
    """One robot on one pair of axes.

    Args:
        axes: empty.
        view: from where.
        drawing: the robot.

    Attributes:
        largest: rate at the ends of the colour scale, positive.
        legend: what else is to be explained: a handle and a text each.
    """

    def __init__(self, axes: Axes, view: View, drawing: Drawing) -> None:
        self.axes, self.view, self.drawing = axes, view, drawing
        # Where F is 0 there are no shares, and the rates are rounding error.
        moved = [abs(row.rate) for row in drawing.rows if not math.isnan(row.share)]
        self.largest = max(moved, default=0.0) or 1.0
        self.legend: list[tuple[Artist, str]] = []
        self._colours = LinearSegmentedColormap.from_list("rates", RATES)
        self._scale = Normalize(-self.largest, self.largest)
        self._labels: list[Label] = []
        self._solid: list[FloatArray] = []
        self._centre = view.project(np.mean(drawing.posture.points, axis=0))
        axes.set_axis_off()
        axes.set_aspect("equal", adjustable="box")

    def paint(self) -> None:
        """Draw everything but words, and settle the limits."""
        drawing, posture = self.drawing, self.drawing.posture
        if drawing.reference is not None:
            self._start(drawing.reference)
        self._plate(Body.BASE)
        self._frame("O", np.zeros(3), np.eye(3))
        for motion in drawing.free:
            self._motion(motion, free=True)
        if drawing.motion is not None:
            self._motion(drawing.motion, free=False)
        self._limbs()
        self._plate(Body.PLATFORM)
        self._joints()
        self._frame("P", posture.position, posture.rotation)
        if drawing.rows:
            self._couples()
            self._velocities()
        self._directions()
        if drawing.case is None:
            self._marks()
        self._settle()

    def write(self, renderer: RendererAgg) -> None:
        """Write the words, once the axes have their final place."""
        self.axes.apply_aspect()
        place_labels(self.axes, renderer, self._labels, np.vstack(self._solid))

    def _line(self, points: FloatArray, name: str, **style: Any) -> Line2D:  # noqa: ANN401 - Matplotlib's own words
        """A line through points (k, 3), which words should not cover."""
        flat = self.view.project(points)
        (line,) = self.axes.plot(flat[:, 0], flat[:, 1], gid=name, **{"solid_capstyle": "round", **style})
        self._keep(points)
        return line

    def _keep(self, points: FloatArray) -> None:
        flat = self.view.project(points)
        for a, b in pairwise(flat):
            self._solid.append(a + np.linspace(0, 1, 12)[:, None] * (b - a))
        self._solid.append(flat[-1:])

    def _arrow(
        self, start: FloatArray, end: FloatArray, name: str, colour: Colour, width: float, zorder: float
    ) -> None:
        """An arrow between two points (3,); one towards the eye is only its head."""
        a, b = self.view.project(start), self.view.project(end)
        style: dict[str, Any] = {
            "arrowstyle": f"-|>,head_width={0.12 + 0.09 * width:.3f},head_length={0.3 + 0.14 * width:.3f}"
        }
        style |= {"color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
        self.axes.annotate("", tuple(b), tuple(a), arrowprops=style, zorder=zorder, gid=name, annotation_clip=False)
        self._keep(np.array([start, end]))

    def _label(
        self, text: str, at: FloatArray, away: FloatArray, colour: str = INK, size: float = 9.0, *, bold: bool = False
    ) -> None:
        """A word beside a point (3,), rather in a direction on paper (2,)."""
        length = float(np.linalg.norm(away))
        self._labels.append(
            Label(text, self.view.project(at), away / length if length else away, colour, size, bold, f"label {text}")
        )

    def _outwards(self, at: FloatArray) -> FloatArray:
        return np.asarray(self.view.project(at) - self._centre)

    def _start(self, start: Posture) -> None:
        """The start, thin and grey."""
        for first, last, link in self.drawing.links:
            if link.body is not Body.BASE or not np.allclose(start.points, self.drawing.posture.points):
                ends = start.points[[first, last]]
                self._line(
                    ends, f"start {link.body.value} {link.limb or ''}".strip(), color=FAINT, linewidth=1.4, zorder=3
                )
        for body, loop in self.drawing.plates:
            if body is Body.PLATFORM:
                outline = Polygon(self.view.project(start.points[list(loop)]), facecolor=FAINT, alpha=0.25, zorder=2.5)
                self.axes.add_patch(outline)
        self.legend.append((Line2D([], [], color=FAINT, linewidth=2), "where the search started"))

    def _plate(self, body: Body) -> None:
        posture, platform = self.drawing.posture, body is Body.PLATFORM
        for kind, loop in self.drawing.plates:
            if kind is body:
                outline = Polygon(
                    self.view.project(posture.points[list(loop)]),
                    facecolor=PLATFORM_FACE if platform else BASE_FACE,
                    edgecolor=MUTED,
                    linewidth=1.6,
                    alpha=0.82 if platform else 1.0,
                    joinstyle="round",
                    zorder=40 if platform else 4,
                    gid=f"plate {body.value}",
                )
                self.axes.add_patch(outline)
                self._keep(posture.points[[*loop, loop[0]]])
        for circle, (centre, through, normal) in zip(self.drawing.model.scene.circles, posture.circles, strict=True):
            if circle.body is body:
                self._line(
                    _round(centre, through, normal),
                    f"circle {body.value}",
                    color=MUTED,
                    linewidth=0.8,
                    linestyle=(0, (4, 3)),
                    zorder=41 if platform else 5,
                )

    def _limbs(self) -> None:
        """Limbs with a dark edge and a light side, in the order in which they cover each other."""
        rates = self.drawing.limb_rates()
        lines = [(self.drawing.posture.points[[a, b]], link.limb) for a, b, link in self.drawing.links if link.limb]
        for place, index in enumerate(painting_order(self.view, [line for line, _ in lines])):
            line, limb = lines[index]
            colour = self._colour(rates[limb]) if rates else "#7d8a96"
            at = 10 + 20 * place / len(lines)
            self._line(line, f"limb edge {limb}", color=INK, linewidth=7.0, zorder=at)
            self._line(line, f"limb {limb}", color=colour, linewidth=5.4, zorder=at + 0.1)
            self._line(line, f"limb light {limb}", color="white", alpha=0.35, linewidth=1.4, zorder=at + 0.2)
            name = limb if not rates else f"{limb}: {_signed(rates[limb], self.largest)}"
            part = 0.3 if place % 2 else 0.45
            at_limb = line[0] + part * (line[1] - line[0])
            self._label(name, at_limb, self._outwards(at_limb), bold=True, size=9.0)

    def _joints(self) -> None:
        for point, place in zip(self.drawing.model.scene.points, self.drawing.posture.points, strict=True):
            x, y = self.view.project(place)
            used = any(point.name in (link.start, link.end) for _, _, link in self.drawing.links)
            if used:
                self.axes.plot(
                    [x],
                    [y],
                    marker="o",
                    markersize=7.5,
                    markerfacecolor=JOINT_FACE,
                    markeredgecolor=INK,
                    markeredgewidth=1.3,
                    linestyle="none",
                    zorder=45 if point.body is Body.PLATFORM else 31,
                    gid=f"joint {point.name}",
                )

    def _frame(self, name: str, origin: FloatArray, rotation: FloatArray) -> None:
        length = _FRAME * self.drawing.size
        at = 6 if name == "O" else 46
        for letter, axis in zip("xyz", rotation.T, strict=True):
            end = origin + length * axis
            self._arrow(origin, end, f"frame {name} {letter}", INK, 1.1, at)
            if name == "O":
                self._label(letter, end, self.view.project(axis), MUTED, 8.5)

    def _motion(self, motion: Motion, *, free: bool) -> None:
        """A twist's axis in bold with the path that shows its pitch; free motions dashed."""
        colour, width = (FREE, 2.0) if free else (INK, 3.6)
        name = "free axis" if free else "axis"
        if math.isinf(motion.pitch):
            self._arrow(motion.line[0], motion.line[1], name, colour, width, 47)
        else:
            style = {"color": colour, "linewidth": width, "zorder": 8}
            self._line(motion.line, name, **style, **({"linestyle": (0, (3, 2))} if free else {}))
            if not free:
                self._line(motion.path[:-2], "path", color=VELOCITY, linewidth=2.0, zorder=9)
                self._arrow(motion.path[-3], motion.path[-1], "path head", VELOCITY, 2.0, 9)
        if free:
            if not any(text.startswith("motion that") for _, text in self.legend):
                handle = Line2D([], [], color=FREE, linewidth=2, linestyle=(0, (3, 2)))
                self.legend.append((handle, "motion that nothing resists"))
            return
        self.legend.append((Line2D([], [], color=INK, linewidth=3.6), f"task: {self._words(motion)}"))

    def _words(self, motion: Motion) -> str:
        unit = self.drawing.case.units.length if self.drawing.case else ""
        if math.isinf(motion.pitch):
            return f"{motion.name} (translation)"
        if abs(motion.pitch) < _NOISE * self.drawing.size:
            return f"{motion.name} (rotation, path in purple)"
        return f"{motion.name} (screw of pitch {motion.pitch:.4g} {unit}, path in purple)"

    def _couples(self) -> None:
        """Couples as arrows with two heads where their limbs meet the platform."""
        for row, wrench, values in zip(
            self.drawing.rows, self.drawing.model.wrenches, self.drawing.posture.jacobian, strict=True
        ):
            at = self.drawing.attachment(row.limb)
            if wrench.kind is not WrenchKind.COUPLE or at is None:
                continue
            direction = values[3:] / np.linalg.norm(values[3:])
            end, colour = at + _COUPLE * self.drawing.size * direction, self._colour(row.rate)
            self._arrow(at, end, f"couple {row.limb}", colour, 2.6, 50)
            self._arrow(at, at + 0.86 * (end - at), f"couple head {row.limb}", colour, 2.6, 50)
            self._label(f"couple {row.limb}: {_signed(row.rate, self.largest)}", end, self._outwards(end), bold=True)
            if not any(text.startswith("couple") for _, text in self.legend):
                handle = Line2D([], [], color=MUTED, linewidth=2.6, marker=">")
                self.legend.append((handle, "couple that a limb applies (two heads)"))

    def _velocities(self) -> None:
        velocities = self.drawing.velocities
        fastest = float(np.max(np.linalg.norm(velocities, axis=1), initial=0.0))
        if fastest <= _NOISE * self.drawing.size:
            return
        factor = _ARROW * self.drawing.size / fastest
        for index, velocity in zip(self.drawing.corners, velocities, strict=True):
            at, name = self.drawing.posture.points[index], self.drawing.model.scene.points[index].name
            if np.linalg.norm(velocity) > 1e-6 * fastest:
                self._arrow(at, at + factor * velocity, f"velocity {name}", VELOCITY, 1.5, 48)
        handle = Line2D([], [], color=VELOCITY, linewidth=1.5, marker=">")
        self.legend.append((handle, f"velocity of the platform's corners, not to scale (fastest {fastest:.4g})"))

    def _directions(self) -> None:
        for item, (origin, vector) in zip(
            self.drawing.model.scene.directions, self.drawing.posture.directions, strict=True
        ):
            end = origin + _JOINT_AXIS * self.drawing.size * vector
            self._arrow(origin, end, f"direction {item.name}", MUTED, 1.2, 49)
            self._label(item.name, end, self.view.project(vector), MUTED, 8.0)

    def _marks(self) -> None:
        """Parameters: a length between two heads, an angle as an arc between two rays, a point by its name."""
        for mark, points in zip(self.drawing.model.scene.marks, self.drawing.posture.marks, strict=True):
            name, colour = f"mark {mark.parameter}", "#a3250f"
            if mark.kind is MarkKind.POINT:
                self._label(mark.parameter, points[0], self._outwards(points[0]), colour, 9.0, bold=True)
            elif mark.kind is MarkKind.LENGTH:
                self._arrow(points[0], points[1], name, colour, 1.6, 55)
                self._label(mark.parameter, points.mean(axis=0), np.array([0.0, 1.0]), colour, 11.0, bold=True)
            else:
                self._angle(name, mark.parameter, points, colour)

    def _angle(self, name: str, parameter: str, points: FloatArray, colour: str) -> None:
        vertex, start, end = points
        for ray in (start, end):
            self._line(np.array([vertex, ray]), f"{name} ray", color=colour, linewidth=1.0, zorder=54)
        normal = np.cross(start - vertex, end - vertex)
        if not normal.any():
            return
        arc = _round(vertex, vertex + _ARC * (start - vertex), normal, last=end - vertex)
        self._line(arc, name, color=colour, linewidth=1.8, zorder=55)
        middle = arc[len(arc) // 2]
        self._label(parameter, middle, self.view.project(middle - vertex), colour, 11.0, bold=True)

    def _colour(self, rate: float) -> tuple[float, float, float, float]:
        red, green, blue, alpha = self._colours(self._scale(rate))
        return red, green, blue, alpha

    def _settle(self) -> None:
        """Limits around everything drawn, with room for words, in the proportion of the panel."""
        flat = np.vstack(self._solid)
        low, high = flat.min(axis=0), flat.max(axis=0)
        half = (high - low) / 2 + 0.07 * float(np.max(high - low))
        panel = self.axes.get_window_extent()
        unit = max(half[0] / panel.width, half[1] / panel.height)
        middle, half = (low + high) / 2, unit * np.array([panel.width, panel.height])
        self.axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        self.axes.set_ylim(middle[1] - half[1], middle[1] + half[1])


def _signed(rate: float, largest: float) -> str:
    """A rate with its sign; rounding error beside the largest is none."""
    return "0" if abs(rate) <= _NOISE * max(largest, 1e-6) else f"{rate:+.3g}".replace("-", "\N{MINUS SIGN}")


def _round(centre: FloatArray, through: FloatArray, normal: FloatArray, last: FloatArray | None = None) -> FloatArray:
    """Points (k, 3) of a circle, or of its arc up to the direction ``last``."""
    axis, ray = normal / np.linalg.norm(normal), through - centre
    across = np.cross(axis, ray)
    turn = 2 * math.pi if last is None else math.atan2(float(last @ across), float(last @ ray))
    angles = np.linspace(0.0, turn, 97 if last is None else 25)
    return np.asarray(centre + np.outer(np.cos(angles), ray) + np.outer(np.sin(angles), across))
