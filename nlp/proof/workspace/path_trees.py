"""Trees of searches along a tool path, as bytes of a proof record.

Each segment has one tree over the places of the path from the segment's index to the next integer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..boxes.tree import TreeRecord
from ..checker.tree import Node, node_bytes

if TYPE_CHECKING:
    from ....models import FloatArray


def record_halves(record: TreeRecord, pieces: FloatArray) -> None:
    """Record the bisection of pieces (B, 3) of a path: index of the segment, and both ends of the parameter."""
    for k, low, high in pieces.tolist():
        middle = 0.5 * (low + high)
        at = _node(k + low, k + high, k + middle)
        record.add(_key(k, low, high), at, _key(k, low, middle), _key(k, middle, high))


def tree_of_path(record: TreeRecord, pieces: FloatArray) -> bytes:
    """Return the trees of a search along a path as bytes, one after the other.

    Args:
        record: recorder of the search's tree.
        pieces: (M, 3) first pieces of the search: equal parts of each segment, in the order of the path.
    """
    parts = list[bytes]()
    for piece, following in zip(pieces.tolist(), [*pieces[1:].tolist(), [np.inf, 0.0, 0.0]], strict=True):
        k, low, high = piece
        if following[0] == k:
            # The first part of the rest of the segment is cut off.
            parts.append(_node(k + low, k + 1.0, k + high))
        parts.append(record.tree_below(_key(k, low, high), with_open=True))
    return b"".join(parts)


def _node(low: float, high: float, at: float) -> bytes:
    """Return the bytes of the node that cuts a range of places, from ``low`` to ``high``, at ``at``."""
    if 0.5 * low + 0.5 * high == at:
        return node_bytes(Node.HALF, 0)
    return node_bytes(Node.CUT, 0, value=at)


def _key(k: float, low: float, high: float) -> bytes:
    return np.array([k, low, high]).tobytes()
