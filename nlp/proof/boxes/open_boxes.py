"""Open boxes of a search, those with the largest bounds first."""

from __future__ import annotations

import heapq
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: With more open boxes than this the search is depth-first, so that it needs no more memory.
_MANY = 2_000_000


class _Chunk(Protocol):
    """Boxes with bounds."""

    @property
    def bound(self) -> FloatArray:
        """(B,) upper bounds."""

    @property
    def count(self) -> int:
        """Number of boxes."""

    def select(self, which: NDArray[np.intp]) -> Self:
        """Return the boxes at some indices."""

    def joined(self, others: list[Self]) -> Self:
        """Return these boxes and those of others."""


Chunk = TypeVar("Chunk", bound=_Chunk)


@dataclass(frozen=True, eq=False)
class Boxes:
    """B boxes.

    Attributes:
        lower, upper: (n, B) ends.
        bound: (B,) upper bound of the value that is maximised.
        place: (B,) number of the box's node in the tree of the search, the root's being 0.
    """

    lower: FloatArray
    upper: FloatArray
    bound: FloatArray
    place: NDArray[np.int64]

    @property
    def count(self) -> int:
        """Number of boxes."""
        return int(self.bound.size)

    def select(self, which: NDArray[np.intp]) -> Boxes:
        """Return the boxes at some indices."""
        return Boxes(self.lower[:, which], self.upper[:, which], self.bound[which], self.place[which])

    def joined(self, others: list[Boxes]) -> Boxes:
        """Return these boxes and those of others."""
        parts = [self, *others]
        return Boxes(
            np.concatenate([part.lower for part in parts], axis=1),
            np.concatenate([part.upper for part in parts], axis=1),
            np.concatenate([part.bound for part in parts]),
            np.concatenate([part.place for part in parts]),
        )


@dataclass
class OpenBoxes(Generic[Chunk]):
    """Chunks of open boxes, ordered by their largest bound; of equal ones the newest comes first.

    Boxes without a finite bound are thus bisected before any others, depth-first. The search soon finds whether they
    are merely wide, or hold a point without a value.
    """

    _heap: list[tuple[float, int, Chunk]] = field(default_factory=list)
    _newest: int = 0
    count: int = 0

    def push(self, boxes: Chunk) -> None:
        """Add boxes."""
        if boxes.count:
            self._newest -= 1
            self.count += boxes.count
            heapq.heappush(self._heap, (-float(boxes.bound.max()), self._newest, boxes))

    def pop(self, most: int) -> Chunk:
        """Remove and return boxes with the largest bounds, at most so many; there must be one.

        Chunks are ordered by their largest bounds alone, so some other boxes may have larger bounds than these.
        """
        taken: list[Chunk] = []
        room = most
        while self._heap and room:
            boxes = self._next()
            self.count -= boxes.count
            if boxes.count > room:
                order = np.argsort(-boxes.bound, kind="stable")
                self.push(boxes.select(order[room:]))
                boxes = boxes.select(order[:room])
            taken.append(boxes)
            room -= boxes.count
        return taken[0].joined(taken[1:]) if len(taken) > 1 else taken[0]

    def _next(self) -> Chunk:
        """Remove and return the chunk with the largest bound, or the newest one where there are many boxes."""
        if self.count <= _MANY:
            return heapq.heappop(self._heap)[2]
        newest = min(range(len(self._heap)), key=lambda i: self._heap[i][1])
        self._heap[newest], self._heap[-1] = self._heap[-1], self._heap[newest]
        boxes = self._heap.pop()[2]
        heapq.heapify(self._heap)
        return boxes

    @property
    def bound(self) -> float:
        """Largest bound of all boxes; -inf without a box."""
        return -self._heap[0][0] if self._heap else -np.inf


class _Claim(NamedTuple):
    """What a search claims: an upper bound over all boxes, and the number of open ones."""

    bound: float
    left: int


class BoundedSearch(ABC, Generic[Chunk]):
    """What every search by bisection keeps: its open boxes, and a bound over all boxes.

    Bound and number of open boxes are those after the last complete step: one that is interrupted changes neither.

    Args:
        root: the whole box.

    Attributes:
        boxes: number of boxes examined.
    """

    def __init__(self, root: Chunk) -> None:
        self._opened: OpenBoxes[Chunk] = OpenBoxes()
        self._opened.push(root)
        # Open boxes that are too small to bisect.
        self._undivided: list[Chunk] = []
        # Largest bound of all boxes that were closed because of their bounds.
        self._closed_bound = -math.inf
        self.boxes, self._turn = 0, 0
        self._claim = _Claim(float(root.bound.max()), root.count)

    def step(self, threshold: float) -> None:
        """Examine some boxes, and close those whose bounds do not exceed a threshold."""
        self._step(threshold)
        bounds = [float(boxes.bound.max()) for boxes in self._undivided]
        left = self._opened.count + sum(boxes.count for boxes in self._undivided)
        self._claim = _Claim(max(self._closed_bound, self._opened.bound, *bounds, -math.inf), left)

    @abstractmethod
    def _step(self, threshold: float) -> None:
        """Examine some boxes, and close those whose bounds do not exceed a threshold."""

    @property
    def is_open(self) -> bool:
        """Whether boxes are left to be examined."""
        return self._opened.count > 0

    @property
    def left(self) -> int:
        """Number of open boxes."""
        return self._claim.left

    @property
    def bound(self) -> float:
        """Upper bound of the maximum over the boxes, without that of the incumbent; -inf where no point is feasible."""
        return self._claim.bound
