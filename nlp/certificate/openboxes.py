"""Boxes that wait to be examined, those with the largest bounds first."""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...models import FloatArray

#: With more boxes than this the newest are taken first, whatever their bounds: the search then goes to the bottom
#: before it goes on, and needs no more memory.
_MANY = 2_000_000


@dataclass(frozen=True, eq=False)
class Boxes:
    """B boxes.

    Attributes:
        lower, upper: (n, B) ends.
        bound: (B,) upper bound of what is maximised.
        place: (B,) numbers that tell the boxes apart.
    """

    lower: FloatArray
    upper: FloatArray
    bound: FloatArray
    place: NDArray[np.int64]

    @property
    def count(self) -> int:
        """How many they are."""
        return int(self.bound.size)

    def chosen(self, which: NDArray[np.intp]) -> Boxes:
        """Those of some indices."""
        return Boxes(self.lower[:, which], self.upper[:, which], self.bound[which], self.place[which])


def joined(parts: list[Boxes]) -> Boxes:
    """All boxes of several lists of them, at least one."""
    if len(parts) == 1:
        return parts[0]
    return Boxes(
        np.concatenate([part.lower for part in parts], axis=1),
        np.concatenate([part.upper for part in parts], axis=1),
        np.concatenate([part.bound for part in parts]),
        np.concatenate([part.place for part in parts]),
    )


@dataclass
class OpenBoxes:
    """Chunks of boxes, ordered by their largest bound; of equal ones the newest comes first.

    So boxes without a finite bound are followed to the bottom before any others: whether they are only wide, or hold a
    point without a value, shows soon.
    """

    _heap: list[tuple[float, int, Boxes]] = field(default_factory=list)
    _newest: int = 0
    count: int = 0

    def push(self, boxes: Boxes) -> None:
        """Add boxes."""
        if boxes.count:
            self._newest -= 1
            self.count += boxes.count
            heapq.heappush(self._heap, (-float(boxes.bound.max()), self._newest, boxes))

    def pop(self, most: int) -> Boxes:
        """Take about the most promising boxes, at most so many; there must be one."""
        taken: list[Boxes] = []
        room = most
        while self._heap and room:
            boxes = self._next()
            self.count -= boxes.count
            if boxes.count > room:
                order = np.argsort(-boxes.bound, kind="stable")
                self.push(boxes.chosen(order[room:]))
                boxes = boxes.chosen(order[:room])
            taken.append(boxes)
            room -= boxes.count
        return joined(taken)

    def _next(self) -> Boxes:
        if self.count <= _MANY:
            return heapq.heappop(self._heap)[2]
        newest = min(range(len(self._heap)), key=lambda i: self._heap[i][1])
        self._heap[newest], self._heap[-1] = self._heap[-1], self._heap[newest]
        boxes = self._heap.pop()[2]
        heapq.heapify(self._heap)
        return boxes

    @property
    def bound(self) -> float:
        """Largest bound of all; -inf when there are none."""
        return -self._heap[0][0] if self._heap else -np.inf
