"""Placement of words in a picture: candidate places, costs, and the choice of the cheapest place.

All values are in pixels, without Matplotlib. Candidates are sorted by a lower bound of their cost, from distance and
direction. The costs of lines and other words are computed for many candidates at once. The search ends at the first
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

#: Distances, in points, and directions of the places that are tried for a word.
_DISTANCES = (7.0, 12.0, 18.0, 26.0, 36.0)
_DIRECTIONS = np.array([[math.cos(2 * math.pi * k / 16), math.sin(2 * math.pi * k / 16)] for k in range(16)])
#: Further distances for a word with a leader line, which may stand outside of the robot.
_LED_DISTANCES = (48.0, 64.0, 84.0, 108.0, 136.0, 168.0, 204.0)
#: Half of the width of a limb, in points.
_HALF_LIMB = 4.0
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
_LEADER_ALONG, _LEADER_PARTS = 2.0, np.array([[0.4], [0.6], [0.8], [1.0]])
#: A leader line is drawn where the word is farther from its place than this, in points.
_LED = 4.0
#: So far from its place, in points, every word has a leader line.
_ASTRAY = 15.0
#: Words whose cost is as large are placed again when all others stand, so often.
_CROWDED, _ROUNDS = 10.0, 4
#: Number of candidates in one computation. Fewer need more calls of NumPy; with more, most costs are not needed.
_AT_ONCE = 160
#: Directions in which left, bottom, right and top of a box move where the box grows.
_OUTWARDS = np.array([-1.0, -1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Word:
    """A word before its placement.

    Attributes:
        half: (2,) half of the size of the word's box.
        places: (k, 2) one or more points on the robot; the word names one of them.
        away: (2,) preferred direction from the point to the word; zero for none.
        owner: name of the limb that the word belongs to; empty for none.
        is_led: whether a leader line joins word and point at any distance.
    """

    half: FloatArray
    places: FloatArray
    away: FloatArray
    owner: str
    is_led: bool


@dataclass(frozen=True, eq=False)
class Sheet:
    """Lines of a picture without words.

    Attributes:
        limbs: (k, 4) ends of the lines of limbs.
        owners: (k,) name of the limb that each line is part of.
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
    """A word after its placement.

    Attributes:
        middle: (2,) middle of the word's box.
        half: (2,) half of the size of the box.
        leader: (4,) ends of the leader line, from the point on the robot; None without a leader line.
        cost: cost of the place.
    """

    middle: FloatArray
    half: FloatArray
    leader: FloatArray | None
    cost: float


class _Taken(NamedTuple):
    """Area of the picture that words cover.

    Attributes:
        boxes: (k, 4) left, bottom, right and top of each word's box.
        leaders: (m, 4) ends of leader lines.
    """

    boxes: FloatArray
    leaders: FloatArray


def arrange(words: Sequence[Word], sheet: Sheet) -> list[Placed]:
    """Return words at the cheapest places, one word after the other.

    Args:
        words: words, the more important first.
        sheet: lines that words should not cover.
    """
    candidates = [_Candidates(word, sheet) for word in words]
    found: list[Placed] = []
    for each in candidates:
        found.append(each.best(_taken_by(found)))
    for _ in range(_ROUNDS):
        # Words that came later may be in the way of earlier ones, which take the best place that is left.
        crowded = [k for k, each in enumerate(found) if each.cost >= _CROWDED]
        before = [found[k].cost for k in crowded]
        for k in crowded:
            found[k] = candidates[k].best(_taken_by([*found[:k], *found[k + 1 :]]))
        if [found[k].cost for k in crowded] == before:
            break
    return found


def _taken_by(words: Iterable[Placed]) -> _Taken:
    """Return the area that words cover."""
    boxes = [np.concatenate([each.middle - each.half, each.middle + each.half]) for each in words]
    leaders = [each.leader for each in words if each.leader is not None]
    return _Taken(np.reshape(boxes, (-1, 4)), np.reshape(leaders, (-1, 4)))


class _Candidates:
    """Candidate places (n,) of a word: all distances and directions from each point that the word may name.

    Costs of lines are kept: where a word is placed again, other words have moved, but the lines have not.

    Args:
        word: the word.
        sheet: lines that words should not cover.
    """

    def __init__(self, word: Word, sheet: Sheet) -> None:
        self._word, self._sheet = word, sheet
        distances = np.array((*_DISTANCES, *_LED_DISTANCES) if word.is_led else _DISTANCES)
        # The distance is that of the word's edge, not of the word's middle.
        reach = np.min(word.half / np.maximum(np.abs(_DIRECTIONS), 1e-9), axis=1)
        off = _DIRECTIONS * (distances[:, None] * sheet.per_point + reach)[..., None]
        # One product for each direction: a product of matrices may round in another way, and decide ties otherwise.
        preferred = np.array([2.0 * float(direction @ word.away) for direction in _DIRECTIONS])
        count = len(word.places)
        self._place = np.repeat(np.arange(count), off.shape[0] * off.shape[1])
        self._middle = (word.places[:, None, None] + off).reshape(-1, 2)
        self._box = np.hstack([self._middle - word.half, self._middle + word.half])
        self._is_led = np.tile(np.repeat(distances > (_LED if word.is_led else _ASTRAY), len(_DIRECTIONS)), count)
        self._leader = self._leaders()
        # Lower bound of the cost: lines and other words only add to it.
        self._least = np.tile((_FAR * distances[:, None] - preferred).ravel(), count)
        self._order = np.argsort(self._least, kind="stable")
        self._is_own = sheet.owners == word.owner
        self._line_costs = np.full((len(self._least), 4), math.nan)
        self._leader_costs = np.full(len(self._least), math.nan)
        # Squares around the points, where a leader line has its dot.
        room = 1.5 * _HALF_LIMB * sheet.per_point
        self._dots = np.hstack([word.places, word.places]) + room * _OUTWARDS

    def _leaders(self) -> FloatArray:
        """Return leader lines (n, 4), from the point on the robot towards the middle of the box, up to its edge."""
        places = self._word.places[self._place]
        way = places - self._middle
        part = np.min(self._word.half / np.maximum(np.abs(way), 1e-9), axis=1, keepdims=True)
        return np.hstack([places, self._middle + np.minimum(part, 1.0) * way])

    def best(self, taken: _Taken) -> Placed:
        """Return the cheapest candidate beside other words; the first of candidates with equal cost."""
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
        """Return the cost (m,) of words and lines under the word, for some candidates (m,)."""
        boxes = self._box[members]
        cost = _overlap_costs(boxes, taken.boxes)
        new = members[np.isnan(self._line_costs[members, 0])]
        if new.size:
            self._line_costs[new] = self._costs_of_lines(new)
        # Terms are added in a fixed order: rounding in another order might change which of two places is cheaper.
        for each in self._line_costs[members].T:
            cost += each
        return cost + _OVERLAP * _count(segments_in_boxes(taken.leaders, boxes))

    def _costs_of_lines(self, members: IndexArray) -> FloatArray:
        """Return costs (m, 4) of a word beyond the frame, on other limbs, on the word's limb, and on other lines."""
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
        # The line of a joint's own name begins at the joint.
        is_apart = np.linalg.norm(joints - self._word.places[:, None], axis=2) > near
        cost = _LEADER_CROSSES * _count(segments_cross(others, leaders))
        cost += _PASSES_JOINT * _count((distances_to_segments(joints, leaders) < near) & is_apart[place])
        if self._word.owner:
            # Where two limbs cross on paper, a line to one of them might mean the other.
            cost += _AMBIGUOUS * _count(segments_in_boxes(others, self._dots))[place]
        # A leader line that runs along another line cannot be told from it.
        start, end = leaders[:, None, :2], leaders[:, None, 2:]
        on_way = start + _LEADER_PARTS * (end - start)
        beside = np.concatenate([on_way, on_way], axis=2) + 0.75 * _HALF_LIMB * sheet.per_point * _OUTWARDS
        for lines in (sheet.limbs, sheet.lines):
            is_beside = segments_in_boxes(lines, beside.reshape(-1, 4))
            cost += _LEADER_ALONG * _count(is_beside.reshape(len(leaders), -1))
        return cost


def _overlap_costs(boxes: FloatArray, taken: FloatArray) -> FloatArray:
    """Return the cost (n,) of overlaps of boxes (n, 4) with the boxes of other words (k, 4)."""
    low = np.maximum(boxes[:, None, :2], taken[:, :2])
    size = np.minimum(boxes[:, None, 2:], taken[:, 2:]) - low
    wide, high = size[..., 0], size[..., 1]
    costs = np.where((wide > 0) & (high > 0), _OVERLAP + wide * high / 10, 0.0)
    # A cumulative sum adds in the order of the words; a plain sum may add in another order, and round otherwise.
    return np.asarray(np.cumsum(np.hstack([np.zeros((len(boxes), 1)), costs]), axis=1)[:, -1])


def _count(pairs: BoolArray) -> FloatArray:
    """Return the number of true values in each row of pairs (n, k), (n,)."""
    return np.asarray(np.count_nonzero(pairs, axis=1), dtype=np.float64)
