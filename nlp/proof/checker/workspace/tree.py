"""Boxes of poses that are closed, as a tree in bytes.

The root is the box of the coordinates of a workspace: three of position, three of rotation (tangents of half angles).
The nodes in preorder, the first byte being the kind, are

    split i v      the box is cut at coordinate i = v: the tree of the part below follows, then that of the part above
    closed         the claim holds at every pose of the box
    outside        no pose of the box is one of the workspace

so that the leaves cover the root by construction.
"""

from __future__ import annotations

import enum
import struct
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..proof import ProofError
from .document import COORDINATES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray

_VALUE = struct.Struct("<d")


class PoseNode(enum.IntEnum):
    """Kinds of node."""

    SPLIT = 1
    CLOSED = 2
    OUTSIDE = 3


class Leaves(NamedTuple):
    """Leaves of a tree: ends (B, 6) of their boxes, and whether each is claimed to be outside of the workspace."""

    lower: FloatArray
    upper: FloatArray
    outside: NDArray[np.bool_]


def split_bytes(coordinate: int, value: float) -> bytes:
    """Return the bytes of a node that cuts a box."""
    return bytes([PoseNode.SPLIT, coordinate]) + _VALUE.pack(value)


def read_leaves(tree: bytes, lower: FloatArray, upper: FloatArray) -> Leaves:
    """Read the leaves of a tree.

    Args:
        tree: its bytes.
        lower: (6,) lower ends of the root.
        upper: (6,) upper ends.

    Raises:
        ProofError: the bytes are no tree of this root.
    """
    at = 0
    waiting = [(lower.tolist(), upper.tolist())]
    lows, highs, outside = [], [], []
    while waiting:
        low, high = waiting.pop()
        if at >= len(tree):
            raise ProofError("the tree ends before every box is closed")
        kind = tree[at]
        at += 1
        if kind == PoseNode.SPLIT:
            if at + 1 + _VALUE.size > len(tree) or tree[at] >= COORDINATES:
                raise ProofError("the tree cuts no coordinate of a pose")
            i = tree[at]
            (value,) = _VALUE.unpack_from(tree, at + 1)
            at += 1 + _VALUE.size
            if not low[i] <= value <= high[i]:
                raise ProofError(f"the tree cuts a box at {value:.6g}, which is outside of it")
            waiting += [
                ([*low[:i], value, *low[i + 1 :]], high),
                (low, [*high[:i], value, *high[i + 1 :]]),
            ]
        elif kind in (PoseNode.CLOSED, PoseNode.OUTSIDE):
            lows.append(low)
            highs.append(high)
            outside.append(kind == PoseNode.OUTSIDE)
        else:
            raise ProofError(f"the tree holds {kind} where a box must be closed or cut")
    if at != len(tree):
        raise ProofError("the tree goes on after every box is closed")
    return Leaves(np.array(lows), np.array(highs), np.array(outside, dtype=bool))
