"""Branch and bound over boxes: the loop of every search.

A rule examines boxes: it closes them, or returns the part left, a bound over it and the coordinate to bisect. The loop
takes examined boxes in an order, bisects them, has the halves examined, and keeps those that are open. Bounds are upper
bounds of a value that is maximised; a rule without a value leaves them at 0.

All claims of a search are one value, :class:`State`, which a step replaces by its last assignment: a search that is
interrupted in a step keeps its claims from before the step.
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
TOO_SMALL = "the boxes that are left are too small to be divided"
#: With more open boxes than this the newest ones are taken first, so that a search needs no more memory.
_MANY = 2_000_000
#: With more open boxes than this those with the largest bounds are no longer looked for among all.
_FEW = 50_000
#: Number of boxes with which a search begins that are kept together.
_ROOTS = 4096
#: Seconds between two reports of progress.
_REPORT_EVERY = 0.1
#: Coordinates to bisect of boxes that are examined again as they are, and of those that are too small to be bisected.
WHOLE, SMALL = -1, -2

Columns = TypeVar("Columns")
Rows = TypeVar("Rows")


class Boxes(NamedTuple, Generic[Columns]):
    """B boxes.

    Attributes:
        lower, upper: (B, n) ends.
        bound: (B,) upper bounds.
        split: (B,) coordinate to bisect; ``WHOLE`` for none.
        more: columns that a rule carries: arrays (B, ...), or tuples of them.
    """

    lower: FloatArray
    upper: FloatArray
    bound: FloatArray
    split: NDArray[np.intp]
    more: Columns


def some(rows: Rows, which: NDArray[np.bool_] | NDArray[np.intp]) -> Rows:
    """Return some rows of an array, or of all arrays of a tuple; other columns have a method ``some`` of their own."""
    each: Any = rows
    if isinstance(each, tuple):
        chosen: Rows = _alike(each, [some(part, which) for part in each])
    else:
        chosen = each.some(which) if hasattr(each, "some") else each[which]
    return chosen


def joined(parts: Sequence[Rows]) -> Rows:
    """Return the rows of arrays, or of tuples of them, one after the other."""
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
    """Return columns as a tuple of the same type."""
    return getattr(type(pattern), "_make", tuple)(columns)


def bisected(boxes: Boxes[Columns]) -> Boxes[Columns]:
    """Return the lower halves of all boxes, then the upper ones."""
    every, count = np.arange(len(boxes.split)), len(boxes.split)
    parts = some(boxes, np.concatenate([every, every]))
    middle = 0.5 * boxes.lower[every, boxes.split] + 0.5 * boxes.upper[every, boxes.split]
    parts.upper[every, boxes.split] = parts.lower[count + every, boxes.split] = middle
    return parts


class Order(enum.Enum):
    """The boxes that a search takes first."""

    NEWEST = "parts of the boxes of the step before: depth first"
    LARGEST_CHUNK = "parts of the boxes of the step with the largest bound: cheap, for many boxes"
    LARGEST = "the boxes with the largest bounds; of many, those of the step with the largest one"


class BoxResults(NamedTuple, Generic[Columns]):
    """Results for boxes.

    Attributes:
        left: (O,) the parts of the open boxes that are left, with ``WHOLE`` or ``SMALL`` as for :meth:`Rule.record`.
        closed: largest bound of what was closed or cut off.
        examined: number of boxes examined.
        again: (O,) whether a part that is too small to be bisected is to be examined again, as one that was moved; None
            for no part.
        is_better: whether a better point is known, for which boxes that are too small are examined again.
        reasons: what a record of the search needs beside.
    """

    left: Boxes[Columns]
    closed: float
    examined: int
    again: NDArray[np.bool_] | None = None
    is_better: bool = False
    reasons: Any = None


class Rule(ABC, Generic[Columns]):
    """Examination of boxes for a kind of claim.

    Attributes:
        target: bound up to which boxes may be closed.
        block: number of boxes examined at once.
        names: of the coordinates, for :attr:`Search.fault`.
    """

    target: float = -math.inf
    block: int
    names: Sequence[str] = ()

    def divided(self, boxes: Boxes[Columns]) -> Boxes[Columns]:
        """Return the halves of boxes, with what they carry: all lower ones, then all upper ones."""
        return bisected(boxes)

    @abstractmethod
    def examine(self, boxes: Boxes[Columns]) -> BoxResults[Columns]:
        """Return the results for boxes."""

    def record(self, boxes: Boxes[Columns], found: BoxResults[Columns], split: NDArray[np.intp]) -> None:
        """Record a step for a proof.

        Args:
            boxes: the boxes before their examination.
            found: its results.
            split: (O,) coordinate along which each part that is left is bisected; ``WHOLE`` for those that are examined
                again, and ``SMALL`` for those that are too small.
        """


#: Boxes in the order of a search, the next one last: their largest bound, a number that counts up, and themselves.
_Chunk = tuple[float, int, Boxes[Columns]]


class State(NamedTuple, Generic[Columns]):
    """A search after a step.

    Attributes:
        waiting: parts of examined boxes, or examined boxes that are to be divided, as the order has it.
        small: boxes that are too small to be divided.
        closed: largest bound of what was closed.
        examined: number of boxes examined.
    """

    waiting: list[_Chunk[Columns]]
    small: list[Boxes[Columns]]
    closed: float
    examined: int

    @property
    def left(self) -> list[Boxes[Columns]]:
        """All boxes that are left."""
        return [*(boxes for _, _, boxes in self.waiting), *self.small]


AnyRule = TypeVar("AnyRule", bound=Rule[Any])


class Search(Generic[AnyRule]):
    """A search of a box.

    Args:
        rule: examines boxes.
        root: the whole box, or boxes that cover what is searched.
        whole: (n,) widths of the whole box; those of 0 do not count.
        least: width, in parts of the whole box, below which a box is not bisected, without and with a finite bound.
        order: the boxes that are taken first.

    Attributes:
        rule: examines boxes.
        state: after the last complete step.
    """

    def __init__(
        self, rule: AnyRule, root: Boxes[Any], *, whole: FloatArray, least: tuple[float, float], order: Order
    ) -> None:
        self.rule, self._order = rule, order
        self._columns = np.flatnonzero(whole > 0)
        self._whole, self._least, self._newest = whole[self._columns], least, 0
        # Of very many boxes, steps would copy all that are left.
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
        """Number of boxes that are left."""
        return sum(len(each.split) for each in self.state.left)

    @property
    def bound(self) -> float:
        """Upper bound over the whole box; -inf where all of it is closed without one."""
        waiting = self.state.waiting[-1][0] if self.state.waiting else -math.inf
        return max([self.state.closed, waiting, *(float(each.bound.max()) for each in self.state.small)])

    @property
    def fault(self) -> str:
        """Reason for stopping at small boxes of which one has no finite bound, with its place; else empty."""
        for boxes in self.state.small:
            which = int(np.argmin(np.isfinite(boxes.bound)))
            if not np.isfinite(boxes.bound[which]):
                point = 0.5 * (boxes.lower[which] + boxes.upper[which])
                at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.rule.names, point, strict=True))
                return f"the expressions have no finite bound near {at}, as where a limb has zero length"
        return ""

    def step(self, target: float) -> None:
        """Examine the parts of some boxes, and close those whose bounds do not exceed a target."""
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
        """Return the parts of boxes, of which some may stay whole."""
        is_cut = boxes.split >= 0
        if not is_cut.any():
            return boxes
        if is_cut.all():
            return self.rule.divided(boxes)
        return joined([some(boxes, ~is_cut), self.rule.divided(some(boxes, is_cut))])

    def _divisions(self, found: BoxResults[Any]) -> NDArray[np.intp]:
        """Return the coordinates to bisect of the parts that are left: see :meth:`Rule.record`."""
        lower, upper, bound, split, _ = found.left
        place = np.arange(len(split)), np.maximum(split, 0)
        middle = 0.5 * lower[place] + 0.5 * upper[place]
        width = ((upper - lower)[:, self._columns] / self._whole).max(axis=1, initial=0.0)
        is_small = width < np.where(np.isfinite(bound), self._least[1], self._least[0])
        is_small |= ~((lower[place] < middle) & (middle < upper[place]))
        once = False if found.again is None else found.again
        return np.where(is_small & (split >= 0), np.where(once, WHOLE, SMALL), split)

    def _put(self, waiting: list[_Chunk[Any]], boxes: Boxes[Any]) -> None:
        """Add boxes."""
        if len(boxes.split):
            key = 0.0 if self._order is Order.NEWEST else float(boxes.bound.max())
            self._newest += 1
            insort(waiting, (key, self._newest, boxes))

    def _take(self, waiting: list[_Chunk[Any]]) -> Boxes[Any]:
        """Remove and return boxes whose parts are a block; there must be one.

        Chunks are ordered by their largest bounds alone, so some other boxes may have larger bounds than these.
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
    """A search that is run step by step, of one box or of several; see :class:`Search`."""

    @property
    def is_open(self) -> bool:
        """Whether boxes are left to be examined."""

    @property
    def boxes(self) -> int:
        """Number of boxes examined."""

    def step(self, target: float) -> None:
        """Examine some boxes, and close those whose bounds do not exceed a target."""


@dataclass(frozen=True)
class Effort:
    """How long a search may take beside its time; its clock begins with it.

    Attributes:
        most_boxes: number of boxes after which it stops.
        progress: called with the seconds, about ten times a second.
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
        """Run a search until no box is open; return the reason for stopping before, or an empty text.

        Args:
            search: the search.
            ending: returns the reason for ending, which is empty where the claim is decided; None for going on.
            target: returns the bound up to which boxes may be closed.
        """
        return reason_of(lambda: self._run(search, ending, target))

    def _run(self, search: Steps, ending: Callable[[], str | None], target: Callable[[], float]) -> str:
        """Run a search that may be interrupted."""
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
