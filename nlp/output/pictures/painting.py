"""Painting of a robot with its task on Matplotlib axes, near lines over far lines."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.lines import Line2D

from ....models import Body, FloatArray, Link, LinkKind, MarkKind, WrenchKind
from ...units import rate_unit
from .canvas import FAINT, INK, MUTED, RED, Canvas, Colour, arc
from .drawing import Drawing, Motion
from .joints import Handles, paint_joint_symbols, symbol_legend
from .loads import DrawnForces, ForceArrow
from .posture import Posture
from .style import BESIDE, FORCE_COLOURS, RATE_COLOURS, rate_text
from .view import View, painting_order

BASE_FACE, PLATFORM_FACE, JOINT_FACE = "#e6eaee", "#dbe6ef", "#ffffff"
VELOCITY, FREE = "#6d2a8c", "#0b6b57"
RAIL, PLAIN = "#8a949d", "#7d8a96"
_FORCE_WIDTHS = {"load": 3.0, "moment": 3.0, "push": 2.4, "pull": 2.4, "drive": 2.4}
_FORCE_WORDS = {
    "push": "leg in compression", "pull": "leg in tension", "drive": "actuator force on a slide",
}  # fmt: skip
#: Width of a link with its edges, in points.
_WIDTHS = {LinkKind.BAR: 7.0, LinkKind.ROD: 4.4}
#: Length of the longest velocity arrow, of frame axes, and of couple arrows, as a fraction of the robot's size.
_ARROW, _FRAME, _COUPLE = 0.42, 0.24, 0.24
_JOINT_AXIS = 0.2
#: Points on a limb for its label, as fractions of its length.
_ALONG_LINK = (0.45, 0.3, 0.6, 0.2, 0.72, 0.1, 0.84)
#: The same for the arrow of a length parameter.
_ALONG_ARROW = (0.5, 0.35, 0.7)
#: Radius of the arc of an angle, as a fraction of its first ray.
_ARC = 0.72
#: Length of a velocity arrow, as a fraction of the longest one, below which its head would be longer than the arrow.
_SHORTEST = 0.06
#: Fraction below which a value is shown as 0: of the largest rate, of the robot's size for a pitch, and of the largest
#: possible velocity of the motion.
_NOISE = 1e-9


def rate_colour_map() -> LinearSegmentedColormap:
    """Return the colour map of rates, from the fastest shortening to the fastest lengthening."""
    return LinearSegmentedColormap.from_list("rates", RATE_COLOURS)


def largest_rate(drawing: Drawing) -> float:
    """Return the largest rate of a drawing; 0 if F is 0, because the rates are then rounding errors."""
    return max((abs(row.rate) for row in drawing.rows if not math.isnan(row.share)), default=0.0)


def _end_on(colour: str) -> Line2D:
    """Return the mark of a legend for an axis that is seen end-on."""
    return Line2D([], [], linestyle="none", marker="o", markersize=8, markeredgecolor=colour, markerfacecolor="white")


class Panel:
    """Picture of one robot on Matplotlib axes.

    Args:
        axes: empty Matplotlib axes.
        view: parallel projection.
        drawing: robot with its task.
        largest: rate at the ends of the colour scale; by default the largest rate of the robot.
        is_small: If true, the picture has neither frames nor velocities nor the path of the task: in a small picture,
            their arrowheads would cover the robot.

    Attributes:
        largest: rate at the ends of the colour scale, positive.
        legend: handles and texts of the legend.
        symbols: handles and texts of the legend of joint symbols.
    """

    def __init__(
        self, axes: Axes, view: View, drawing: Drawing, largest: float | None = None, *, is_small: bool = False
    ) -> None:
        self.drawing, self._is_small = drawing, is_small
        self.largest = largest or largest_rate(drawing) or 1.0
        self.legend: list[tuple[Artist, str]] = []
        self.symbols: list[tuple[Handles, str]] = []
        self._canvas = Canvas(axes, view, np.mean(drawing.posture.points, axis=0))
        self._colours = rate_colour_map()
        self._scale = Normalize(-self.largest, self.largest)

    def paint(self) -> None:
        """Paint everything except labels, and set the limits of the axes."""
        drawing, posture = self.drawing, self.drawing.posture
        if drawing.reference is not None:
            self._paint_start(drawing.reference)
        self._paint_plate(Body.BASE)
        if not self._is_small:
            self._paint_frame("O", np.zeros(3), np.eye(3))
        for motion in drawing.free:
            self._paint_motion(motion, free=True)
        if drawing.motion is not None:
            self._paint_motion(drawing.motion, free=False)
        self._paint_limbs()
        self._paint_plate(Body.PLATFORM)
        self._paint_joints()
        if not self._is_small:
            self._paint_frame("P", posture.position, posture.rotation)
        if drawing.rows and not self._is_small:
            self._paint_couples()
            self._paint_velocities()
        if drawing.forces is not None:
            self._paint_forces(drawing.forces)
        self._paint_directions()
        if drawing.case is None:
            self._paint_parameters()
        self._canvas.fit_limits()

    def write(self, renderer: RendererAgg) -> None:
        """Write the labels, when the axes have their final position."""
        self._canvas.write_labels(renderer)

    def _paint_start(self, start: Posture) -> None:
        """Paint the posture at the starting point, thin and grey."""
        for first, last, link in self.drawing.links:
            if link.body is not Body.BASE or not np.allclose(start.points, self.drawing.posture.points):
                ends = start.points[[first, last]]
                self._canvas.line(
                    ends, f"start {link.body.value} {link.limb or ''}".strip(), color=FAINT, linewidth=1.4, zorder=3
                )
        for body, loop in self.drawing.plates:
            if body is Body.PLATFORM:
                self._canvas.polygon(start.points[list(loop)], facecolor=FAINT, alpha=0.25, zorder=2.5)
        self.legend.append((Line2D([], [], color=FAINT, linewidth=2), "starting point of the search"))

    def _paint_plate(self, body: Body) -> None:
        """Paint the outline of base or platform, and the circles through joints of this body."""
        posture, platform = self.drawing.posture, body is Body.PLATFORM
        for kind, loop in self.drawing.plates:
            if kind is body:
                self._canvas.polygon(
                    posture.points[list(loop)],
                    facecolor=PLATFORM_FACE if platform else BASE_FACE,
                    edgecolor=MUTED,
                    linewidth=1.6,
                    alpha=0.82 if platform else 1.0,
                    joinstyle="round",
                    zorder=40 if platform else 4,
                    gid=f"plate {body.value}",
                )
                self._canvas.keep_free(posture.points[[*loop, loop[0]]])
        for circle, (centre, through, normal) in zip(self.drawing.model.scene.circles, posture.circles, strict=True):
            if circle.body is body:
                self._canvas.line(
                    arc(centre, through, normal),
                    f"circle {body.value}",
                    color=MUTED,
                    linewidth=0.8,
                    linestyle=(0, (4, 3)),
                    zorder=41 if platform else 5,
                )

    def _paint_limbs(self) -> None:
        """Paint limbs with a dark edge and a light side, near ones over far ones."""
        rates = self.drawing.limb_rates()
        points = self.drawing.posture.points
        self._paint_rails()
        lines = [
            (points[[a, b]], link)
            for a, b, link in self.drawing.links
            if link.kind is not LinkKind.RAIL and (link.limb or link.body is Body.LIMB)
        ]
        for place, index in enumerate(painting_order(self._canvas.view, [line for line, _ in lines])):
            line, link = lines[index]
            limb, colour = link.limb, self._link_colour(link, rates)
            at, wide = 10 + 20 * place / len(lines), _WIDTHS[link.kind]
            # Only the limb's coloured line is an obstacle for labels of other limbs.
            self._canvas.line(line, f"limb edge {limb}", color=INK, linewidth=wide, zorder=at)
            self._canvas.line(
                line, f"limb {limb}", color=colour, linewidth=wide - 1.6, zorder=at + 0.1, limb=limb or ""
            )
            self._canvas.line(
                line, f"limb light {limb}", color="white", alpha=0.35, linewidth=0.2 * wide, zorder=at + 0.2
            )
        for limb in dict.fromkeys(link.limb for _, link in lines if link.limb):
            # One label per limb, on its longest link.
            line, link = max(
                ((line, link) for line, link in lines if link.limb == limb),
                key=lambda each: float(np.linalg.norm(np.ptp(each[0], axis=0))),
            )
            places = line[0] + np.outer(_ALONG_LINK, line[1] - line[0])
            words = f"\n{self._rates_text(limb) or self._rate_text(rates[limb])}" if rates else ""
            text = f"limb {limb}{words}"
            self._canvas.label(text, places, self._canvas.outwards(places[0]), bold=True, size=8.5, limb=limb)

    def _paint_rails(self) -> None:
        """Paint rails, and bars of base and platform that do not form an outline."""
        drawing = self.drawing
        plates = {body for body, _ in drawing.plates}
        for first, last, link in drawing.links:
            ends = drawing.posture.points[[first, last]]
            if link.kind is LinkKind.RAIL:
                self._canvas.line(ends, f"rail {link.limb}", color=RAIL, linewidth=3.2, zorder=7)
            elif link.body is not Body.LIMB and link.body not in plates:
                self._canvas.line(ends, f"bar {link.body.value}", color=MUTED, linewidth=4.5, zorder=9)

    def _paint_joints(self) -> None:
        """Paint the symbol of every joint; without joint symbols, a circle at every end of a line."""
        if self.drawing.model.scene.joints:
            paint_joint_symbols(self._canvas, self.drawing)
            self.symbols = symbol_legend(self.drawing)
            return
        for point, place in zip(self.drawing.model.scene.points, self.drawing.posture.points, strict=True):
            used = any(point.name in (link.start, link.end) for _, _, link in self.drawing.links)
            if used:
                self._canvas.marker(
                    place,
                    f"joint {point.name}",
                    markersize=7.5,
                    markerfacecolor=JOINT_FACE,
                    markeredgecolor=INK,
                    markeredgewidth=1.3,
                    zorder=45 if point.body is Body.PLATFORM else 31,
                )

    def _paint_frame(self, name: str, origin: FloatArray, rotation: FloatArray) -> None:
        """Paint the axes of the world frame, ``O``, or of the platform frame, ``P``."""
        length = _FRAME * self.drawing.size
        at = 9.5 if name == "O" else 46
        for letter, axis in zip("xyz", rotation.T, strict=True):
            end = origin + length * axis
            self._canvas.arrow(origin, end, f"frame {name} {letter}", INK, 1.1, at)
            if name == "O":
                self._canvas.label(letter, end, self._canvas.view.project(axis), MUTED, 8.5)

    def _paint_motion(self, motion: Motion, *, free: bool) -> None:
        """Paint the axis of a twist in bold with a helix of its pitch; a free motion dashed and without a helix."""
        colour, width = (FREE, 2.0) if free else (INK, 3.6)
        name = "free axis" if free else "axis"
        is_point = self._canvas.is_end_on(*motion.line)
        if math.isinf(motion.pitch) or is_point:
            self._canvas.arrow(motion.line[0], motion.line[1], name, colour, width, 47)
        else:
            dashes = (0, (3, 2)) if free else "solid"
            self._canvas.line(motion.line, name, color=colour, linewidth=width, zorder=8, linestyle=dashes)
        if not free and motion.has_path and not self._is_small:
            self._canvas.line(motion.path[:-2], "path", color=VELOCITY, linewidth=2.0, zorder=9)
            self._canvas.arrow(motion.path[-3], motion.path[-1], "path head", VELOCITY, 2.0, 9)
        if free:
            if not any(text.startswith("free motion") for _, text in self.legend):
                handle = _end_on(FREE) if is_point else Line2D([], [], color=FREE, linewidth=2, linestyle=(0, (3, 2)))
                self.legend.append((handle, "free motion with all actuators locked"))
            return
        handle = _end_on(INK) if is_point else Line2D([], [], color=INK, linewidth=3.6)
        self.legend.append((handle, f"task: {self._words(motion)}"))

    def _words(self, motion: Motion) -> str:
        """Return the text of the task in the legend."""
        unit = self.drawing.case.units.length if self.drawing.case else ""
        if math.isinf(motion.pitch):
            return f"{motion.name} (translation)"
        if abs(motion.pitch) < _NOISE * self.drawing.size:
            return f"{motion.name} (rotation, path in purple)"
        path = ", path in purple" if motion.has_path else ""
        return f"{motion.name} (screw of pitch {motion.pitch:.5g} {unit}{path})"

    def _paint_couples(self) -> None:
        """Paint couples as arrows with two heads, at the points that join their limbs to the platform.

        Several couples of one limb have no arrows: only their plane is defined.
        """
        couples = [row.limb for row in self.drawing.rows if row.kind is WrenchKind.COUPLE]
        for row, wrench, values in zip(
            self.drawing.rows, self.drawing.model.rows, self.drawing.posture.jacobian, strict=True
        ):
            index = self.drawing.attachment(row.limb)
            if wrench.kind is not WrenchKind.COUPLE or index is None or couples.count(row.limb) > 1:
                continue
            at = self.drawing.posture.points[index]
            direction = values[3:] / np.linalg.norm(values[3:])
            end, colour = at + _COUPLE * self.drawing.size * direction, self._colour(row.rate)
            self._canvas.arrow(at, end, f"couple {row.limb}", colour, 2.6, 50, has_two_heads=True)
            text = f"couple of limb {row.limb}\n{self._rate_text(row.rate)}"
            self._canvas.label(text, end, self._canvas.outwards(end), bold=True, size=8.5, is_led=True)
            if not any(text.startswith("couple") for _, text in self.legend):
                handle = Line2D([], [], color=MUTED, linewidth=2.6, marker=">")
                self.legend.append((handle, "couple of a limb (two heads)"))

    @property
    def _most(self) -> float:
        """Upper bound on the velocity of a part of the robot in the task's motion; 0 without a motion."""
        motion = self.drawing.motion
        if motion is None:
            return 0.0
        return float(np.linalg.norm(motion.twist[:3])) * self.drawing.size + float(np.linalg.norm(motion.twist[3:]))

    def _paint_velocities(self) -> None:
        """Paint the velocities of the platform's corners; the largest one has a fixed length."""
        velocities = self.drawing.velocities_at(self.drawing.posture)
        fastest = float(np.max(np.linalg.norm(velocities, axis=1), initial=0.0))
        if fastest <= _NOISE * self._most:
            return
        factor = _ARROW * self.drawing.size / fastest
        for index, velocity in zip(self.drawing.corners, velocities, strict=True):
            at, name = self.drawing.posture.points[index], self.drawing.model.scene.points[index].name
            if np.linalg.norm(velocity) > _SHORTEST * fastest:
                self._canvas.arrow(at, at + factor * velocity, f"velocity {name}", VELOCITY, 1.5, 48)
        handle = Line2D([], [], color=VELOCITY, linewidth=1.5, marker=">")
        words = f"velocity of the platform's corners, not to scale (fastest {fastest:.4g} {self._rate_unit()})"
        self.legend.append((handle, words))

    def _paint_forces(self, forces: DrawnForces) -> None:
        """Paint a load and the actuator forces that balance it, with different colours for compression and tension."""
        for arrow in forces.arrows:
            start, end = arrow.ends + self._beside(arrow)
            name = f"{arrow.kind} {arrow.name}"
            colour, width, is_moment = FORCE_COLOURS[arrow.kind], _FORCE_WIDTHS[arrow.kind], arrow.kind == "moment"
            self._canvas.arrow(start, end, name, colour, width, 52, has_two_heads=is_moment)
            if arrow.kind == "pull":
                self._canvas.marker(start, name, "o", color=FORCE_COLOURS["pull"], markersize=5, zorder=52)
        for kind, words in {"load": forces.words, **_FORCE_WORDS}.items():
            if any(arrow.kind == kind for arrow in forces.arrows) or kind == "load":
                mark = "o" if kind == "pull" else ">"
                line = Line2D([], [], color=FORCE_COLOURS[kind], linewidth=_FORCE_WIDTHS[kind], marker=mark)
                self.legend.append((line, words))
        if forces.torques:
            self.legend.append((Line2D([], [], linestyle="none"), f"without arrows: {forces.torques}"))

    def _beside(self, arrow: ForceArrow) -> FloatArray:
        """Return the offset (3,) of an arrow from its leg or slide, outwards in the picture."""
        if not arrow.is_beside:
            return np.zeros(3)
        right, up, _ = self._canvas.view.axes
        flat = self._canvas.view.project(arrow.ends[1] - arrow.ends[0])
        across = np.array([-flat[1], flat[0]]) / (np.linalg.norm(flat) or 1.0)
        across *= 1.0 if across @ self._canvas.outwards(arrow.ends[0]) >= 0 else -1.0
        return np.asarray(BESIDE * self.drawing.size * (across[0] * right + across[1] * up))

    def _paint_directions(self) -> None:
        """Paint named directions, such as joint axes."""
        for item, (origin, vector) in zip(
            self.drawing.model.scene.directions, self.drawing.posture.directions, strict=True
        ):
            end = origin + _JOINT_AXIS * self.drawing.size * vector
            self._canvas.arrow(origin, end, f"direction {item.name}", MUTED, 1.2, 49)
            self._canvas.label(item.name, end, self._canvas.view.project(vector), MUTED, 8.0)

    def _paint_parameters(self) -> None:
        """Paint parameters: a length as an arrow, an angle as an arc between two rays, a point as its name."""
        for mark, points in zip(self.drawing.model.scene.marks, self.drawing.posture.marks, strict=True):
            name, colour = f"mark {mark.parameter}", RED
            if mark.kind is MarkKind.POINT:
                away = self._canvas.outwards(points[0])
                self._canvas.label(mark.parameter, points[0], away, colour, 9.0, bold=True, is_led=True)
            elif mark.kind is MarkKind.LENGTH:
                self._canvas.arrow(points[0], points[1], name, colour, 1.6, 55)
                places = points[0] + np.outer(_ALONG_ARROW, points[1] - points[0])
                away = self._canvas.outwards(places[0])
                self._canvas.label(mark.parameter, places, away, colour, 11.0, bold=True, is_led=True)
            else:
                self._paint_angle(name, mark.parameter, points, colour)

    def _paint_angle(self, name: str, parameter: str, points: FloatArray, colour: str) -> None:
        """Paint the arc of an angle with given vertex, start and end (3, 3)."""
        vertex, start, end = points
        for ray in (start, end):
            self._canvas.line(np.array([vertex, ray]), f"{name} ray", color=colour, linewidth=1.0, zorder=54)
        normal = np.cross(start - vertex, end - vertex)
        if not normal.any():
            return
        curve = arc(vertex, vertex + _ARC * (start - vertex), normal, last=end - vertex)
        self._canvas.line(curve, name, color=colour, linewidth=1.8, zorder=55)
        middle = curve[len(curve) // 2]
        away = self._canvas.view.project(middle - vertex)
        self._canvas.label(parameter, middle, away, colour, 11.0, bold=True, is_led=True)

    def _colour(self, rate: float) -> tuple[float, float, float, float]:
        red, green, blue, alpha = self._colours(self._scale(rate))
        return red, green, blue, alpha

    def _link_colour(self, link: Link, rates: Mapping[str, float]) -> Colour:
        """Return the colour of a link, from the rate of the link or of its limb."""
        if link.limb is None or link.limb not in rates:
            return PLAIN
        own = self._link_rate(link)
        return self._colour(rates[link.limb] if own is None else own)

    def _link_rate(self, link: Link) -> float | None:
        """Return the rate of the only row of a link; None for a link with several rows."""
        row = self.drawing.link_row(link)
        return None if row is None else self.drawing.rows[row].rate

    def _rates_text(self, limb: str) -> str:
        """Return the rates of a limb's rods as text with the unit; empty for a limb without rods."""
        unit, rows = self._rate_unit(), self.drawing.link_rows(limb)
        texts = [f"{row.member}: {self._rate_text(row.rate).removesuffix(unit).strip()}" for row in rows]
        return " and ".join(texts) + f" {unit}".rstrip() if texts else ""

    def _rate_text(self, rate: float) -> str:
        """Return a rate with sign and unit; rounding errors relative to the largest rate are 0."""
        text = "0" if abs(rate) <= _NOISE * max(self.largest, _NOISE * self._most) else rate_text(rate)
        return f"{text} {self._rate_unit()}".strip()

    def _rate_unit(self) -> str:
        """Return the unit of rates and velocities; empty without a task or a case."""
        motion, case = self.drawing.motion, self.drawing.case
        return rate_unit(motion.twist, case.units) if motion is not None and case is not None else ""
