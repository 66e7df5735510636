"""Boxes as one value: ends, bounds, the coordinate to bisect, and the columns that a rule carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar, cast

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

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
    found: Any
    if isinstance(each, np.ndarray):
        found = each[which]
    elif isinstance(each, tuple):
        parts = [some(part, which) for part in each]
        found = type(each)(*parts) if hasattr(each, "_fields") else tuple(parts)
    else:
        found = each.some(which)
    return cast("Rows", found)


def joined(parts: Sequence[Rows]) -> Rows:
    """Return the rows of arrays, or of tuples of them, one after the other."""
    first: Any = parts[0]
    found: Any
    if len(parts) == 1:
        found = first
    elif isinstance(first, np.ndarray):
        found = np.concatenate(cast("Any", parts))
    elif isinstance(first, tuple):
        columns = [joined(each) for each in zip(*cast("Any", parts), strict=True)]
        found = type(first)(*columns) if hasattr(first, "_fields") else tuple(columns)
    else:
        found = first.joined(parts)
    return cast("Rows", found)


def bisected(boxes: Boxes[Columns]) -> Boxes[Columns]:
    """Return the lower halves of all boxes, then the upper ones."""
    every, count = np.arange(len(boxes.split)), len(boxes.split)
    parts = some(boxes, np.concatenate([every, every]))
    middle = 0.5 * boxes.lower[every, boxes.split] + 0.5 * boxes.upper[every, boxes.split]
    parts.upper[every, boxes.split] = parts.lower[count + every, boxes.split] = middle
    return parts
