"""Branch and bound over boxes: the loop of every search.

A rule examines boxes. It closes a box, or returns the open part of the box, a bound over this part, and the coordinate
to bisect. The loop takes examined boxes in an order, bisects them, has the halves examined, and keeps the open halves.
Bounds are upper bounds of a maximised value; a rule without a value has bounds of 0.

The state of a search is one value, :class:`State`. The last assignment of a step replaces this value, so a search that
is interrupted in a step keeps its earlier state.
"""

from __future__ import annotations

import enum
import math
import time
from abc import ABC, abstractmethod
from bisect import insort
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from ...interruption import Milestone, reached, reason_of, reason_to_stop

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Reason for stopping at boxes below the least width.
TOO_SMALL = "the open boxes are too small to be bisected"
#: Number of open boxes above which the newest ones are taken first, to limit the memory.
_MANY = 2_000_000
#: Number of open boxes above which the largest bounds are no longer searched among all boxes.
_FEW = 50_000
#: Number of first boxes that are kept together.
_ROOTS = 4096
#: Seconds between two reports of progress.
_REPORT_EVERY = 0.1
#: Values in place of a coordinate to bisect: ``WHOLE``, the box is examined again without bisection; ``SMALL``, the
#: box is too small.
WHOLE, SMALL = -1, -2

Columns = TypeVar("Columns")
Rows = TypeVar("Rows")


class Boxes(NamedTuple, Generic[Columns]):
    """B boxes with their bounds.

    Attributes:
        lower, upper: (B, n) ends of the boxes.
        bound: (B,) upper bound of the maximised value over each box.
        split: (B,) index of the coordinate to bisect; ``WHOLE`` for no bisection.
        more: data of the rule for each box: arrays (B, ...), or tuples of them.
    """

    lower: FloatArray
    upper: FloatArray
    bound: FloatArray
    split: NDArray[np.intp]
    more: Columns


def some(rows: Rows, which: NDArray[np.bool_] | NDArray[np.intp]) -> Rows:
    """Return some rows of an array, or of all arrays of a tuple; other types have a method ``some``."""
    each: Any = rows
    if isinstance(each, tuple):
        chosen: Rows = _alike(each, [some(part, which) for part in each])
    else:
        chosen = each.some(which) if hasattr(each, "some") else each[which]
    return chosen


def joined(parts: Sequence[Rows]) -> Rows:
    """Return the rows of arrays, or of tuples of arrays, one after the other."""
    every: Any = parts
    if len(parts) == 1:
        return parts[0]
    if isinstance(every[0], tuple):
        whole: Rows = _alike(every[0], [joined(each) for each in zip(*every, strict=True)])
    else:
        join: Any = getattr(every[0], "joined", np.concatenate)
        whole = join(every)
    return whole


def _alike(pattern: Any, columns: Sequence[Any]) -> Any:  # noqa: ANN401 - any kind of tuple
    """Return columns as a tuple of the type of ``pattern``, such as a named tuple."""
    return getattr(type(pattern), "_make", tuple)(columns)


def bisected(boxes: Boxes[Columns]) -> Boxes[Columns]:
    """Return the lower halves of all boxes, then the upper halves."""
    every, count = np.arange(len(boxes.split)), len(boxes.split)
    parts = some(boxes, np.concatenate([every, every]))
    middle = 0.5 * boxes.lower[every, boxes.split] + 0.5 * boxes.upper[every, boxes.split]
    parts.upper[every, boxes.split] = parts.lower[count + every, boxes.split] = middle
    return parts


class Order(enum.Enum):
    """Order in which a search takes boxes."""

    NEWEST = "sub-boxes from the previous step: depth first"
    LARGEST_CHUNK = "sub-boxes from the step with the largest bound: cheap, for many boxes"
    LARGEST = "the boxes with the largest bounds; if many boxes are open, the same as LARGEST_CHUNK"


class BoxResults(NamedTuple, Generic[Columns]):
    """Results of a rule's examination of boxes.

    Attributes:
        left: (O,) remaining sub-boxes of the open boxes, with ``WHOLE`` or ``SMALL`` as in :meth:`Rule.record`.
        closed: largest bound of closed boxes and of parts that were cut off.
        examined: number of examined boxes.
        again: (O,) whether a sub-box that is too small to be bisected must be examined again because it was moved;
            None if no sub-box must.
        is_better: If true, a better point is known, so that boxes too small to be bisected must be examined again.
        reasons: additional data for a record of the search.
    """

    left: Boxes[Columns]
    closed: float
    examined: int
    again: NDArray[np.bool_] | None = None
    is_better: bool = False
    reasons: Any = None


class Rule(ABC, Generic[Columns]):
    """Rule by which a search examines boxes, for one kind of claim.

    Attributes:
        target: largest bound of a box that may be closed.
        block: number of boxes examined at once.
        names: names of the coordinates, for :attr:`Search.fault`.
    """

    target: float = -math.inf
    block: int
    names: Sequence[str] = ()

    def divided(self, boxes: Boxes[Columns]) -> Boxes[Columns]:
        """Return the halves of boxes with the data of each box: all lower halves, then all upper halves."""
        return bisected(boxes)

    @abstractmethod
    def examine(self, boxes: Boxes[Columns]) -> BoxResults[Columns]:
        """Examine boxes; return the open sub-boxes and the bounds of the closed boxes."""

    def record(self, boxes: Boxes[Columns], found: BoxResults[Columns], split: NDArray[np.intp]) -> None:
        """Record a step for a proof.

        Args:
            boxes: the boxes before their examination.
            found: results of the examination.
            split: (O,) index of the coordinate along which each remaining part is bisected; ``WHOLE`` for parts that
                are examined again, ``SMALL`` for parts that are too small.
        """


#: Boxes in the order of a search, the next one last: largest bound, running number, and the boxes.
_Chunk = tuple[float, int, Boxes[Columns]]


class State(NamedTuple, Generic[Columns]):
    """State of a search after a step.

    Attributes:
        waiting: examined boxes, or sub-boxes, that are still to be bisected, in the order of the search.
        small: boxes that are too small to be bisected.
        closed: largest bound of closed boxes.
        examined: number of examined boxes.
    """

    waiting: list[_Chunk[Columns]]
    small: list[Boxes[Columns]]
    closed: float
    examined: int

    @property
    def left(self) -> list[Boxes[Columns]]:
        """All open boxes."""
        return [*(boxes for _, _, boxes in self.waiting), *self.small]


AnyRule = TypeVar("AnyRule", bound=Rule[Any])


class Search(Generic[AnyRule]):
    """Branch and bound over a box, step by step.

    Args:
        rule: rule for the examination of boxes.
        root: the whole box, or boxes that cover the domain.
        whole: (n,) widths of the whole box; coordinates with width 0 are ignored.
        least: two relative widths below which a box is not bisected: for boxes without a finite bound, and with one.
        order: order in which boxes are taken.

    Attributes:
        rule: rule for the examination of boxes.
        state: state after the last complete step.
    """

    def __init__(
        self, rule: AnyRule, root: Boxes[Any], *, whole: FloatArray, least: tuple[float, float], order: Order
    ) -> None:
        self.rule, self._order = rule, order
        self._columns = np.flatnonzero(whole > 0)
        self._whole, self._least, self._newest = whole[self._columns], least, 0
        # Very many first boxes are kept in chunks, as a step copies all boxes of a chunk.
        count = len(root.split)
        parts = [some(root, np.arange(k, min(k + _ROOTS, count))) for k in range(0, count, _ROOTS)]
        waiting = [(math.inf, -k, part) for k, part in reversed(list(enumerate(parts)))]
        self.state: State[Any] = State(waiting, [], -math.inf, 0)

    @property
    def is_open(self) -> bool:
        """Whether boxes are left to be examined."""
        return bool(self.state.waiting)

    @property
    def boxes(self) -> int:
        """Number of boxes examined."""
        return self.state.examined

    @property
    def left(self) -> int:
        """Number of open boxes."""
        return sum(len(each.split) for each in self.state.left)

    @property
    def bound(self) -> float:
        """Upper bound over the whole box; -inf if the whole box is closed without a bound."""
        waiting = self.state.waiting[-1][0] if self.state.waiting else -math.inf
        return max([self.state.closed, waiting, *(float(each.bound.max()) for each in self.state.small)])

    @property
    def fault(self) -> str:
        """Reason for stopping at a small box without a finite bound, with the place of the box.

        Empty without such a box.
        """
        for boxes in self.state.small:
            which = int(np.argmin(np.isfinite(boxes.bound)))
            if not np.isfinite(boxes.bound[which]):
                point = 0.5 * (boxes.lower[which] + boxes.upper[which])
                at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.rule.names, point, strict=True))
                return f"the expressions have no finite bound near {at}; for example, a limb may have zero length there"
        return ""

    def step(self, target: float) -> None:
        """Bisect some boxes, examine the sub-boxes, and close the sub-boxes with bounds of at most a target."""
        waiting, small = list(self.state.waiting), list(self.state.small)
        parts = self._divided(self._take(waiting))
        self.rule.target = target
        found = self.rule.examine(parts)
        split = self._divisions(found)
        self.rule.record(parts, found, split)
        left = found.left._replace(split=split)
        small += [some(left, split == SMALL)] * bool((split == SMALL).any())
        cut = left if (split >= 0).all() else some(left, split >= 0)
        if self._order is not Order.LARGEST:
            cut = self._divided(cut)
            cut = cut._replace(split=np.full(len(cut.split), WHOLE))
        self._put(waiting, cut)
        if (split == WHOLE).any():
            self._put(waiting, some(left, split == WHOLE))
        if found.is_better:
            for each in small:
                self._put(waiting, each._replace(split=np.full(len(each.split), WHOLE)))
            small = []
        closed, examined = max(self.state.closed, found.closed), self.state.examined + found.examined
        self.state = State(waiting, small, closed, examined)

    def _divided(self, boxes: Boxes[Any]) -> Boxes[Any]:
        """Return the sub-boxes of boxes; some boxes may stay whole."""
        is_cut = boxes.split >= 0
        if not is_cut.any():
            return boxes
        if is_cut.all():
            return self.rule.divided(boxes)
        return joined([some(boxes, ~is_cut), self.rule.divided(some(boxes, is_cut))])

    def _divisions(self, found: BoxResults[Any]) -> NDArray[np.intp]:
        """Return the coordinates along which the remaining sub-boxes are bisected: see :meth:`Rule.record`."""
        lower, upper, bound, split, _ = found.left
        place = np.arange(len(split)), np.maximum(split, 0)
        middle = 0.5 * lower[place] + 0.5 * upper[place]
        width = ((upper - lower)[:, self._columns] / self._whole).max(axis=1, initial=0.0)
        is_small = width < np.where(np.isfinite(bound), self._least[1], self._least[0])
        is_small |= ~((lower[place] < middle) & (middle < upper[place]))
        once = False if found.again is None else found.again
        return np.where(is_small & (split >= 0), np.where(once, WHOLE, SMALL), split)

    def _put(self, waiting: list[_Chunk[Any]], boxes: Boxes[Any]) -> None:
        """Add examined boxes to the waiting boxes."""
        if len(boxes.split):
            key = 0.0 if self._order is Order.NEWEST else float(boxes.bound.max())
            self._newest += 1
            insort(waiting, (key, self._newest, boxes))

    def _take(self, waiting: list[_Chunk[Any]]) -> Boxes[Any]:
        """Remove and return boxes for one block of sub-boxes; at least one box must be waiting.

        Chunks are ordered only by their largest bounds, so some waiting boxes may have larger bounds than the returned
        boxes.
        """
        taken: list[Boxes[Any]] = []
        room, count = self.rule.block, self.left
        if self._order is Order.LARGEST and count <= _FEW:
            waiting[:] = [(math.inf, 0, joined([boxes for _, _, boxes in waiting]))]
        while waiting and room > 0:
            place = max(range(len(waiting)), key=lambda k: waiting[k][1]) if count > _MANY else -1
            boxes = waiting.pop(place)[2]
            parts = np.where(boxes.split >= 0, 2, 1)
            if parts.sum() > room:
                is_newest = self._order is Order.NEWEST
                order = np.arange(len(boxes.split)) if is_newest else np.argsort(-boxes.bound, kind="stable")
                fit = max(1, int(np.searchsorted(np.cumsum(parts[order]), room, side="right")))
                self._put(waiting, some(boxes, order[fit:]))
                boxes, room = some(boxes, order[:fit]), 0
            taken.append(boxes)
            room -= int(parts.sum())
            if self._order is Order.NEWEST:
                break
        return joined(taken)


class Steps(Protocol):
    """A search of one or several boxes, run step by step; see :class:`Search`."""

    @property
    def is_open(self) -> bool:
        """Whether boxes are left to be examined."""

    @property
    def boxes(self) -> int:
        """Number of boxes examined."""

    def step(self, target: float) -> None:
        """Examine some boxes, and close boxes with bounds of at most a target."""


@dataclass(frozen=True)
class Effort:
    """Limits on the effort of a search, with its clock.

    Attributes:
        most_boxes: number of boxes after which the search stops.
        progress: function that is called with the elapsed seconds, about ten times a second.
        began: time at the start.
    """

    most_boxes: int | None = None
    progress: Callable[[float], None] | None = None
    began: float = field(default_factory=lambda: time.perf_counter())  # noqa: PLW0108 - tests have a clock of their own

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self.began

    def run(
        self, search: Steps, ending: Callable[[], str | None], target: Callable[[], float] = lambda: -math.inf
    ) -> str:
        """Run a search until no box is open. Return the reason for an earlier stop, or an empty text.

        Args:
            search: the search.
            ending: function that returns the reason for ending, empty if the claim is decided; None to continue.
            target: function that returns the largest bound of a box that may be closed.
        """
        return reason_of(lambda: self._run(search, ending, target))

    def _run(self, search: Steps, ending: Callable[[], str | None], target: Callable[[], float]) -> str:
        """Run a search until it ends; an interrupt may raise an exception between two steps."""
        reported = -math.inf
        reached(Milestone.BOUND)
        while True:
            ended = ending()
            if ended is not None or not search.is_open:
                return ended or ""
            seconds = self.seconds
            reason = reason_to_stop(seconds, search.boxes, self.most_boxes)
            if reason:
                return reason
            if self.progress is not None and seconds - reported >= _REPORT_EVERY:
                reported = seconds
                self.progress(seconds)
            search.step(target())
