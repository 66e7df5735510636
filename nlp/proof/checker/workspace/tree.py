"""Leaves of a tree of boxes of poses.

The root is the box of the coordinates of a workspace: three of position, three of rotation (tangents of half angles).
The nodes are ``cut``, ``bounded`` and ``outside`` of :mod:`..tree`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..proof_file import ProofError
from ..tree import Node, TreeReader

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray


class Leaves(NamedTuple):
    """Leaves of a tree: ends (B, 6) of their boxes, and whether each is claimed to be outside of the workspace."""

    lower: FloatArray
    upper: FloatArray
    outside: NDArray[np.bool_]


def read_leaves(tree: bytes, lower: FloatArray, upper: FloatArray) -> Leaves:
    """Read the leaves of a tree.

    Args:
        tree: its bytes.
        lower: (6,) lower ends of the root.
        upper: (6,) upper ends.

    Raises:
        ProofError: the bytes are no tree of this root.
    """
    reader, lows, highs, outside = TreeReader(tree), [], [], []

    def leaf(kind: int, _: int, low: FloatArray, high: FloatArray) -> None:
        if kind not in (Node.BOUNDED, Node.OUTSIDE):
            raise ProofError(f"the tree holds {kind} where a box must be closed or cut")
        lows.append(low)
        highs.append(high)
        outside.append(kind == Node.OUTSIDE)

    reader.walk(lower, upper, leaf, frozenset({Node.CUT}))
    reader.finish()
    return Leaves(np.array(lows), np.array(highs), np.array(outside, dtype=bool))
