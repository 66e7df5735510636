"""Places for words in a picture where they cover neither each other nor the lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from ....models import FloatArray
from .fonts import legible

BoolArray = npt.NDArray[np.bool_]


def segments_in_box(segments: FloatArray, box: tuple[float, ...]) -> BoolArray:
    """Return for each line whether a part of it is within a box, (k,).

    Liang and Barsky: the line ``a + t (b - a)`` is within one pair of sides for an interval of ``t``, and within the
    box where both intervals and ``0 <= t <= 1`` have a point in common.

    Args:
        segments: (k, 4) ends of the lines.
        box: left, bottom, right, top.
    """
    if not len(segments):
        return np.zeros(0, dtype=np.bool_)
    low, high = np.zeros(len(segments)), np.ones(len(segments))
    for axis in range(2):
        start, way = segments[:, axis], segments[:, 2 + axis] - segments[:, axis]
        near, far = box[axis] - start, box[2 + axis] - start
        level = np.abs(way) < 1e-12
        safe = np.where(level, 1.0, way)
        first, last = np.minimum(near / safe, far / safe), np.maximum(near / safe, far / safe)
        beside = level & ((near > 0) | (far < 0))
        low = np.maximum(low, np.where(level, 0.0, first))
        high = np.minimum(high, np.where(level, 1.0, last))
        high = np.where(beside, -1.0, high)
    return np.asarray(low <= high)


def segments_cross(segments: FloatArray, line: FloatArray) -> BoolArray:
    """Return for each of the lines (k, 4) whether it crosses another line (4,), (k,)."""
    if not len(segments):
        return np.zeros(0, dtype=np.bool_)
    a, b = segments[:, :2], segments[:, 2:]
    c, d = line[:2], line[2:]

    def side(p: FloatArray, q: FloatArray, r: FloatArray) -> FloatArray:
        u, v = q - p, r - p
        return np.asarray(u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0])

    one = side(a, b, c) * side(a, b, d)
    other = side(c, d, a) * side(c, d, b)
    return np.asarray((one < 0) & (other < 0))


def distances_to_segment(points: FloatArray, line: FloatArray) -> FloatArray:
    """Return the distance of each point (k, 2) from a straight line between its ends (4,), (k,)."""
    start, way = line[:2], line[2:] - line[:2]
    square = float(way @ way)
    part = np.clip((points - start) @ way / square, 0.0, 1.0) if square else np.zeros(len(points))
    return np.asarray(np.linalg.norm(points - start - np.outer(part, way), axis=1))


#: Distances, in points, and number of directions of the places that are tried for a word.
_DISTANCES = (7.0, 12.0, 18.0, 26.0, 36.0)
_DIRECTIONS = 16
#: Further distances for a word with a leader line, which may stand outside of the robot.
_LED_DISTANCES = (48.0, 64.0, 84.0, 108.0, 136.0, 168.0, 204.0)
#: Room around a word, in pixels, and half of the width of a limb, in points.
_ROOM, _HALF_LIMB = 2.0, 4.0
#: Costs of covering another word, of covering a line that is kept free, and of a point of distance.
_OVERLAP, _COVERED, _FAR = 50.0, 12.0, 0.12
#: A word on a limb that is not its own is wrong, and a leader line across one misleads.
_ON_OTHER_LIMB, _LEADER_CROSSES = 400.0, 14.0
#: A leader line that ends where another limb is too, or passes the dot of another one, might mean that one.
_AMBIGUOUS = 30.0
#: A leader line that passes a joint, so near in points, seems to name it.
_PASSES_JOINT, _NEAR_JOINT = 10.0, 6.0
#: A word beyond the axes is cut off, which is worse than an overlap.
_OUTSIDE = 600.0
#: A leader line should run along no other line: cost of each that is beside it, and the parts of its way looked at.
_LEADER_ALONG, _LEADER_PARTS = 2.0, (0.4, 0.6, 0.8, 1.0)
#: A leader line is drawn where the word is farther from its place than this, in points.
_LED = 4.0
#: So far from its place, in points, every word has a leader line.
_ASTRAY = 15.0
#: Words whose cost is as large are placed again when all others stand, so often.
_CROWDED, _ROUNDS = 10.0, 4


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


class _Placed(NamedTuple):
    """A word at its place, in pixels.

    Attributes:
        middle: (2,) of its box.
        half: (2,) half of the size of its box.
        leader: (4,) ends of its leader line, from the place that it names; None without one.
        cost: of the place.
    """

    middle: FloatArray
    half: FloatArray
    leader: FloatArray | None
    cost: float

    @property
    def box(self) -> FloatArray:
        """Its left, bottom, right and top, (4,)."""
        return np.concatenate([self.middle - self.half, self.middle + self.half])


@dataclass(frozen=True, eq=False)
class _Sheet:
    """What is already on the paper, in pixels.

    Attributes:
        segments: (k, 4) lines.
        owners: (k,) limb of each line; empty for none.
        frame: left, bottom, right and top of the axes.
        taken: boxes of the words already placed, (4,) each.
        leaders: leader lines already placed, (4,) each.
        per_point: pixels of a point.
    """

    segments: FloatArray
    owners: FloatArray
    frame: tuple[float, float, float, float]
    taken: list[FloatArray]
    leaders: list[FloatArray]
    per_point: float

    def put(self, placed: _Placed) -> None:
        """Put a word with its leader line on the paper."""
        self.taken.append(placed.box)
        if placed.leader is not None:
            self.leaders.append(placed.leader)


def place_labels(axes: Axes, renderer: RendererAgg, labels: Sequence[Label], obstacles: Obstacles) -> list[Text]:
    """Put words beside their places, one after the other, each where its cost is least.

    Args:
        axes: with its final limits and place.
        renderer: measures the words.
        labels: the more important first.
        obstacles: lines that words should not cover.
    """
    ends = axes.transData.transform(obstacles.segments.reshape(-1, 2)).reshape(-1, 4)
    frame = axes.get_window_extent(renderer)
    sheet = _Sheet(
        ends,
        np.array(obstacles.owners, dtype=object),
        (frame.x0, frame.y0, frame.x1, frame.y1),
        [],
        [],
        float(axes.figure.dpi) / 72,
    )
    texts = [_text_of(axes, label) for label in labels]
    extents = [text.get_window_extent(renderer) for text in texts]
    halves = [np.array([each.width, each.height]) / 2 + _ROOM for each in extents]
    found: list[_Placed] = []
    for label, half in zip(labels, halves, strict=True):
        found.append(_best_place(label, half, axes.transData.transform(label.at), sheet))
        sheet.put(found[-1])
    for _ in range(_ROUNDS):
        # Words that came later may be in the way of earlier ones, which take the best place that is left.
        crowded = [k for k, each in enumerate(found) if each.cost >= _CROWDED]
        before = [found[k].cost for k in crowded]
        for k in crowded:
            without = replace(sheet, taken=[], leaders=[])
            for each in (*found[:k], *found[k + 1 :]):
                without.put(each)
            found[k] = _best_place(labels[k], halves[k], axes.transData.transform(labels[k].at), without)
        if [found[k].cost for k in crowded] == before:
            break
    back = axes.transData.inverted()
    for label, text, placed in zip(labels, texts, found, strict=True):
        text.set_position(tuple(back.transform(placed.middle)))
        if placed.leader is not None:
            _draw_leader(axes, back.transform(placed.leader.reshape(2, 2)), label)
    return texts


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


def _is_led(label: Label, start: FloatArray, end: FloatArray, sheet: _Sheet) -> bool:
    """Return whether a word has a leader line from its place (2,) to its edge (2,), in pixels."""
    least = _LED if label.is_led else _ASTRAY
    return bool(np.linalg.norm(end - start) > least * sheet.per_point)


def _edge_towards(place: FloatArray, half: FloatArray, target: FloatArray) -> FloatArray:
    """Return the point (2,) of the edge of a word's box on the way from its middle to a target."""
    way = target - place
    part = min(half / np.maximum(np.abs(way), 1e-9))
    return np.asarray(place + min(float(part), 1.0) * way)


def _best_place(label: Label, half: FloatArray, places: FloatArray, sheet: _Sheet) -> _Placed:
    """Return where the cost of a word is least.

    Args:
        label: the word.
        half: (2,) half of the size of its box.
        places: (k, 2) places to choose from, in pixels.
        sheet: what is already on the paper.
    """
    best = _Placed(places[0], half, None, math.inf)
    distances = (*_DISTANCES, *_LED_DISTANCES) if label.is_led else _DISTANCES
    for place in places:
        for distance in distances:
            for step in range(_DIRECTIONS):
                angle = 2 * math.pi * step / _DIRECTIONS
                direction = np.array([math.cos(angle), math.sin(angle)])
                # The word's edge, not its middle, is that far from the place.
                reach = min(half / np.maximum(np.abs(direction), 1e-9))
                middle = place + direction * (distance * sheet.per_point + reach)
                cost = _FAR * distance - 2.0 * float(direction @ label.away)
                if cost < best.cost:
                    cost += _cost(label, middle, half, sheet)
                edge = _edge_towards(middle, half, place)
                is_led = _is_led(label, place, edge, sheet)
                if cost < best.cost and is_led:
                    cost += _leader_cost(label, place, edge, sheet)
                if cost < best.cost:
                    best = _Placed(middle, half, np.array([*place, *edge]) if is_led else None, cost)
    return best


def _cost(label: Label, middle: FloatArray, half: FloatArray, sheet: _Sheet) -> float:
    """Return the cost of what a word covers whose box has this middle (2,), arguments as for :func:`_best_place`."""
    box = (*(middle - half), *(middle + half))
    cost = 0.0
    for other in sheet.taken:
        wide = min(box[2], other[2]) - max(box[0], other[0])
        high = min(box[3], other[3]) - max(box[1], other[1])
        if wide > 0 and high > 0:
            cost += _OVERLAP + wide * high / 10
    inside = sheet.frame
    if box[0] < inside[0] or box[1] < inside[1] or box[2] > inside[2] or box[3] > inside[3]:
        cost += _OUTSIDE
    limbs = sheet.owners != ""
    room = _HALF_LIMB * sheet.per_point
    wide_box = (box[0] - room, box[1] - room, box[2] + room, box[3] + room)
    on_limb = segments_in_box(sheet.segments[limbs], wide_box)
    cost += _ON_OTHER_LIMB * int(np.count_nonzero(on_limb & (sheet.owners[limbs] != label.owner)))
    cost += _COVERED * int(np.count_nonzero(on_limb & (sheet.owners[limbs] == label.owner)))
    cost += _COVERED * int(np.count_nonzero(segments_in_box(sheet.segments[~limbs], box)))
    if sheet.leaders:
        cost += _OVERLAP * int(np.count_nonzero(segments_in_box(np.array(sheet.leaders), box)))
    return cost


def _leader_cost(label: Label, start: FloatArray, end: FloatArray, sheet: _Sheet) -> float:
    """Return the cost of a leader line from a word's place (2,) to its edge (2,), in pixels."""
    leader = np.array([*start, *end])
    limbs = sheet.owners != ""
    others = sheet.segments[limbs & (sheet.owners != label.owner)]
    joints = sheet.segments[limbs].reshape(-1, 2)
    # The line of a joint's own name begins at the joint.
    joints = joints[np.linalg.norm(joints - start, axis=1) > _NEAR_JOINT * sheet.per_point]
    cost = _LEADER_CROSSES * int(np.count_nonzero(segments_cross(others, leader)))
    cost += _PASSES_JOINT * int(np.count_nonzero(distances_to_segment(joints, leader) < _NEAR_JOINT * sheet.per_point))
    room = 1.5 * _HALF_LIMB * sheet.per_point
    near = (*(start - room), *(start + room))
    if label.owner:
        # Where two limbs cross on paper, a line to one of them might mean the other.
        cost += _AMBIGUOUS * int(np.count_nonzero(segments_in_box(others, near)))
    if sheet.leaders:
        leaders = np.array(sheet.leaders)
        cost += _OVERLAP * int(np.count_nonzero(segments_cross(leaders, leader)))
        cost += _AMBIGUOUS * int(np.count_nonzero(segments_in_box(leaders, near)))
        cost += _AMBIGUOUS * int(np.count_nonzero(distances_to_segment(leaders[:, :2], leader) < room))
    for part in _LEADER_PARTS:
        # A leader line that runs along another line cannot be told from it.
        on_way = start + part * (end - start)
        beside = (*(on_way - room / 2), *(on_way + room / 2))
        cost += _LEADER_ALONG * int(np.count_nonzero(segments_in_box(sheet.segments, beside)))
    for other in sheet.taken:
        cost += _OVERLAP * int(np.count_nonzero(segments_in_box(leader[None, :], tuple(other))))
    return cost
