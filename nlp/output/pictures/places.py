"""Placement of labels in a picture: candidate positions, costs, and selection of the cheapest position.

All values are in pixels, without Matplotlib. Candidates are sorted by a lower bound of their cost, from distance and
direction. The costs of lines and other labels are computed for many candidates at once. The search ends at the first
candidate with a lower bound above the smallest cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ....models import FloatArray
from .segments import BoolArray, distances_to_segments, segments_cross, segments_in_boxes

IndexArray = npt.NDArray[np.intp]

#: Distances, in points, and directions of the candidate positions of a label.
_DISTANCES = (7.0, 12.0, 18.0, 26.0, 36.0)
_DIRECTIONS = np.array([[math.cos(2 * math.pi * k / 16), math.sin(2 * math.pi * k / 16)] for k in range(16)])
#: Further distances for a label with a leader line, which may be outside of the robot.
_LED_DISTANCES = (48.0, 64.0, 84.0, 108.0, 136.0, 168.0, 204.0)
#: Half of the width of a limb, in points.
_HALF_LIMB = 4.0
#: Costs of covering another label, of covering a line, and of one point of distance.
_OVERLAP, _COVERED, _FAR = 50.0, 12.0, 0.12
#: Costs of a label on another limb, which is wrong, and of a leader line across another limb, which misleads.
_ON_OTHER_LIMB, _LEADER_CROSSES = 400.0, 14.0
#: Cost of an ambiguous leader line, which ends where another limb is too, or passes the dot of another leader line.
_AMBIGUOUS = 30.0
#: Distance, in points, at which a leader line that passes a joint seems to name the joint, and its cost.
_PASSES_JOINT, _NEAR_JOINT = 10.0, 6.0
#: Cost of a label beyond the axes, which is cut off: higher than that of an overlap.
_OUTSIDE = 600.0
#: Cost of each other line along a leader line, and the fractions of its length that are examined.
_LEADER_ALONG, _LEADER_PARTS = 2.0, np.array([[0.4], [0.6], [0.8], [1.0]])
#: Distance of a label from its point, in points, above which a leader line is drawn.
_LED = 4.0
#: Distance, in points, above which every label has a leader line.
_ASTRAY = 15.0
#: Cost above which labels are placed again after all others, and the number of repetitions.
_CROWDED, _ROUNDS = 10.0, 4
#: Number of candidates in one computation: fewer need more calls of NumPy, more compute unnecessary costs.
_AT_ONCE = 160
#: Signs of the movement of left, bottom, right and top of a growing box.
_OUTWARDS = np.array([-1.0, -1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Word:
    """Label before its placement.

    Attributes:
        half: (2,) half of the size of the label's box.
        places: (k, 2) one or more points on the robot, one of which gets the label.
        away: (2,) preferred direction from the point to the label; zero for none.
        owner: name of the limb of the label; empty for none.
        is_led: If true, the label has a leader line at any distance.
    """

    half: FloatArray
    places: FloatArray
    away: FloatArray
    owner: str
    is_led: bool


@dataclass(frozen=True, eq=False)
class Sheet:
    """Lines of a picture without labels.

    Attributes:
        limbs: (k, 4) ends of the lines of limbs.
        owners: (k,) names of the limbs of these lines.
        lines: (m, 4) ends of all other lines.
        frame: (4,) left, bottom, right and top of the axes.
        per_point: number of pixels in a point, 1/72 inch.
    """

    limbs: FloatArray
    owners: npt.NDArray[np.object_]
    lines: FloatArray
    frame: FloatArray
    per_point: float


class Placed(NamedTuple):
    """Label after its placement.

    Attributes:
        middle: (2,) centre of the label's box.
        half: (2,) half of the size of the box.
        leader: (4,) ends of the leader line, from the point on the robot; None without a leader line.
        cost: cost of the place.
    """

    middle: FloatArray
    half: FloatArray
    leader: FloatArray | None
    cost: float


class _Taken(NamedTuple):
    """Area of the picture that is covered by labels.

    Attributes:
        boxes: (k, 4) left, bottom, right and top of the labels' boxes.
        leaders: (m, 4) ends of leader lines.
    """

    boxes: FloatArray
    leaders: FloatArray


def arrange(words: Sequence[Word], sheet: Sheet) -> list[Placed]:
    """Return labels at the cheapest positions, one label after the other.

    Args:
        words: labels in order of importance.
        sheet: lines that labels should not cover.
    """
    candidates = [_Candidates(word, sheet) for word in words]
    found: list[Placed] = []
    for each in candidates:
        found.append(each.best(_taken_by(found)))
    for _ in range(_ROUNDS):
        # Later labels may conflict with earlier ones, which then get the best remaining position.
        crowded = [k for k, each in enumerate(found) if each.cost >= _CROWDED]
        before = [found[k].cost for k in crowded]
        for k in crowded:
            found[k] = candidates[k].best(_taken_by([*found[:k], *found[k + 1 :]]))
        if [found[k].cost for k in crowded] == before:
            break
    return found


def _taken_by(words: Iterable[Placed]) -> _Taken:
    """Return the area that is covered by labels."""
    boxes = [np.concatenate([each.middle - each.half, each.middle + each.half]) for each in words]
    leaders = [each.leader for each in words if each.leader is not None]
    return _Taken(np.reshape(boxes, (-1, 4)), np.reshape(leaders, (-1, 4)))


class _Candidates:
    """Candidate positions (n,) of a label: all distances and directions from each of its points.

    Costs of lines are stored: when a label is placed again, only other labels have moved.

    Args:
        word: label to place.
        sheet: lines that labels should not cover.
    """

    def __init__(self, word: Word, sheet: Sheet) -> None:
        self._word, self._sheet = word, sheet
        distances = np.array((*_DISTANCES, *_LED_DISTANCES) if word.is_led else _DISTANCES)
        # The distance is measured to the edge of the label, not to its centre.
        reach = np.min(word.half / np.maximum(np.abs(_DIRECTIONS), 1e-9), axis=1)
        off = _DIRECTIONS * (distances[:, None] * sheet.per_point + reach)[..., None]
        # One product per direction: a matrix product may round differently, and decide ties differently.
        preferred = np.array([2.0 * float(direction @ word.away) for direction in _DIRECTIONS])
        count = len(word.places)
        self._place = np.repeat(np.arange(count), off.shape[0] * off.shape[1])
        self._middle = (word.places[:, None, None] + off).reshape(-1, 2)
        self._box = np.hstack([self._middle - word.half, self._middle + word.half])
        self._is_led = np.tile(np.repeat(distances > (_LED if word.is_led else _ASTRAY), len(_DIRECTIONS)), count)
        self._leader = self._leaders()
        # Lower bound of the cost: lines and other labels only increase it.
        self._least = np.tile((_FAR * distances[:, None] - preferred).ravel(), count)
        self._order = np.argsort(self._least, kind="stable")
        self._is_own = sheet.owners == word.owner
        self._line_costs = np.full((len(self._least), 4), math.nan)
        self._leader_costs = np.full(len(self._least), math.nan)
        # Squares around the points for the dots of leader lines.
        room = 1.5 * _HALF_LIMB * sheet.per_point
        self._dots = np.hstack([word.places, word.places]) + room * _OUTWARDS

    def _leaders(self) -> FloatArray:
        """Return leader lines (n, 4), from the point on the robot towards the centre of the box, up to its edge."""
        places = self._word.places[self._place]
        way = places - self._middle
        part = np.min(self._word.half / np.maximum(np.abs(way), 1e-9), axis=1, keepdims=True)
        return np.hstack([places, self._middle + np.minimum(part, 1.0) * way])

    def best(self, taken: _Taken) -> Placed:
        """Return the cheapest candidate, given the other labels; among candidates of equal cost, the first."""
        costs = np.full(len(self._least), math.inf)
        least = math.inf
        for first in range(0, len(costs), _AT_ONCE):
            members = self._order[first : first + _AT_ONCE]
            if self._least[members[0]] > least:
                break
            costs[members] = self._least[members] + self._word_cost(members, taken)
            led = members[self._is_led[members] & (costs[members] <= least)]
            costs[led] += self._leader_cost(led, taken)
            least = min(least, float(np.min(costs[members])))
        k = int(np.argmin(costs))
        return Placed(self._middle[k], self._word.half, self._leader[k] if self._is_led[k] else None, float(costs[k]))

    def _word_cost(self, members: IndexArray, taken: _Taken) -> FloatArray:
        """Return the cost (m,) of labels and lines under the label, for some candidates (m,)."""
        boxes = self._box[members]
        cost = _overlap_costs(boxes, taken.boxes)
        new = members[np.isnan(self._line_costs[members, 0])]
        if new.size:
            self._line_costs[new] = self._costs_of_lines(new)
        # Terms are added in a fixed order: another order may round differently, and select another position.
        for each in self._line_costs[members].T:
            cost += each
        return cost + _OVERLAP * _count(segments_in_boxes(taken.leaders, boxes))

    def _costs_of_lines(self, members: IndexArray) -> FloatArray:
        """Return costs (m, 4) of a label beyond the frame, on other limbs, on the label's limb, and on other lines."""
        boxes, frame = self._box[members], self._sheet.frame
        is_outside = (boxes[:, :2] < frame[:2]).any(axis=1) | (boxes[:, 2:] > frame[2:]).any(axis=1)
        on_limb = segments_in_boxes(self._sheet.limbs, boxes + _HALF_LIMB * self._sheet.per_point * _OUTWARDS)
        return np.column_stack(
            [
                _OUTSIDE * is_outside,
                _ON_OTHER_LIMB * _count(on_limb & ~self._is_own),
                _COVERED * _count(on_limb & self._is_own),
                _COVERED * _count(segments_in_boxes(self._sheet.lines, boxes)),
            ]
        )

    def _leader_cost(self, members: IndexArray, taken: _Taken) -> FloatArray:
        """Return the cost (m,) of leader lines, for some candidates (m,)."""
        new = members[np.isnan(self._leader_costs[members])]
        if new.size:
            self._leader_costs[new] = self._costs_of_leaders(new)
        leaders, room = self._leader[members], 1.5 * _HALF_LIMB * self._sheet.per_point
        cost = self._leader_costs[members] + _OVERLAP * _count(segments_in_boxes(leaders, taken.boxes).T)
        if taken.leaders.size:
            cost += _OVERLAP * _count(segments_cross(taken.leaders, leaders))
            cost += _AMBIGUOUS * _count(segments_in_boxes(taken.leaders, self._dots))[self._place[members]]
            cost += _AMBIGUOUS * _count(distances_to_segments(taken.leaders[:, :2], leaders) < room)
        return cost

    def _costs_of_leaders(self, members: IndexArray) -> FloatArray:
        """Return the cost (m,) of limbs, joints and other lines near leader lines, for some candidates (m,)."""
        sheet, leaders, place = self._sheet, self._leader[members], self._place[members]
        others, joints = sheet.limbs[~self._is_own], sheet.limbs.reshape(-1, 2)
        near = _NEAR_JOINT * sheet.per_point
        # The leader line of a joint's name begins at the joint.
        is_apart = np.linalg.norm(joints - self._word.places[:, None], axis=2) > near
        cost = _LEADER_CROSSES * _count(segments_cross(others, leaders))
        cost += _PASSES_JOINT * _count((distances_to_segments(joints, leaders) < near) & is_apart[place])
        if self._word.owner:
            # Where two limbs cross in the picture, a leader line is ambiguous.
            cost += _AMBIGUOUS * _count(segments_in_boxes(others, self._dots))[place]
        # A leader line along another line cannot be distinguished from it.
        start, end = leaders[:, None, :2], leaders[:, None, 2:]
        on_way = start + _LEADER_PARTS * (end - start)
        beside = np.concatenate([on_way, on_way], axis=2) + 0.75 * _HALF_LIMB * sheet.per_point * _OUTWARDS
        for lines in (sheet.limbs, sheet.lines):
            is_beside = segments_in_boxes(lines, beside.reshape(-1, 4))
            cost += _LEADER_ALONG * _count(is_beside.reshape(len(leaders), -1))
        return cost


def _overlap_costs(boxes: FloatArray, taken: FloatArray) -> FloatArray:
    """Return the cost (n,) of overlaps of boxes (n, 4) with the boxes of other labels (k, 4)."""
    low = np.maximum(boxes[:, None, :2], taken[:, :2])
    size = np.minimum(boxes[:, None, 2:], taken[:, 2:]) - low
    wide, high = size[..., 0], size[..., 1]
    costs = np.where((wide > 0) & (high > 0), _OVERLAP + wide * high / 10, 0.0)
    # A cumulative sum adds in the order of the labels; a plain sum may use another order, and round differently.
    return np.asarray(np.cumsum(np.hstack([np.zeros((len(boxes), 1)), costs]), axis=1)[:, -1])


def _count(pairs: BoolArray) -> FloatArray:
    """Return the number of true values in each row of pairs (n, k), (n,)."""
    return np.asarray(np.count_nonzero(pairs, axis=1), dtype=np.float64)
