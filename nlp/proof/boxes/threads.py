"""Threads that share the parts of one step of a search; the results do not depend on their number."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

#: Fewest boxes of a piece: two of the kernel's blocks of 32. Starting a piece costs about as much as a few boxes.
_LEAST_PIECE = 64


class Threads:
    """Threads for one step after the other.

    Args:
        jobs: number of threads; one for each processor when left out.

    Attributes:
        jobs: number of threads.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = max(1, jobs if jobs is not None else os.cpu_count() or 1)
        self._pool = ThreadPoolExecutor(self.jobs) if self.jobs > 1 else None

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Return the results of a function for some items, in their order; a thread that is done takes the next one."""
        every = list(items)
        if self._pool is None or len(every) < 2:
            return [function(each) for each in every]
        return [each.result() for each in [self._pool.submit(function, each) for each in every]]

    def close(self) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()


def pieces(count: int, jobs: int) -> Sequence[tuple[int, int]]:
    """Return begins and ends of the pieces of so many boxes for some threads.

    Boxes cost differently, by what closes them. So each piece is a part of what is left: large ones first, in which
    few lanes of the kernel stay empty, and small ones last, so that no thread waits long for another.
    """
    if jobs == 1:
        return [(0, count)]
    found, begin = [], 0
    while begin < count:
        size = max(_LEAST_PIECE, (count - begin) // (2 * jobs) // _LEAST_PIECE * _LEAST_PIECE)
        # A last piece that would be smaller is added to this one.
        end = begin + size if count - begin - size >= _LEAST_PIECE else count
        found.append((begin, end))
        begin = end
    return found
