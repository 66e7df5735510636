"""Recorder of a search: the tree of boxes for a proof file; :mod:`screwsynth.nlp.proof.checker.tree` defines the nodes.

A node of the tree is found by a key: the ends of its box as bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..checker.proof_file import ProofError
from ..checker.tree import Node, node_bytes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Relative outward shift of the bound of a limb: half of the shift of the total bound.
_OUTWARDS = 5e-13


class TreeRecord:
    """Tree of the boxes of a search, recorded for a proof file.

    Attributes:
        begin: bytes of the tree before the node of the whole box.
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Delete all recorded nodes, because the search begins again."""
        self.begin, self._root = b"", b""
        self._nodes: dict[bytes, tuple[bytes, tuple[bytes, ...]]] = {}
        self._limbs: list[tuple[TreeRecord, Callable[[], float]]] = []

    def limb(self, bound: Callable[[], float]) -> TreeRecord:
        """Return the recorder for the tree of the next limb. The whole tree then consists of the trees of the limbs.

        Args:
            bound: function that returns the limb's bound at the end of the search; -inf without a feasible point.
        """
        record = TreeRecord()
        self._limbs.append((record, bound))
        return record

    def add(self, key: bytes, text: bytes, *parts: bytes) -> None:
        """Record a node of the tree.

        Args:
            key: ends of the node's box, as bytes.
            text: bytes of the node.
            parts: keys of the sub-boxes, in the order of their trees.
        """
        # The first box of a search is the whole box.
        self._root = self._root or key
        self._nodes[key] = text, parts

    def cuts(self, lower: FloatArray, upper: FloatArray, split: NDArray[np.signedinteger]) -> None:
        """Record the bisection of boxes (B, n), each along one coordinate (B,)."""
        middle, halves = halves_of(lower, upper, split)
        for key, i, value, parts in zip(keys_of(lower, upper), split.tolist(), middle.tolist(), halves, strict=True):
            self.add(key, node_bytes(Node.CUT, i, value=value), *parts)

    def contractions(
        self, before: tuple[FloatArray, FloatArray], after: tuple[FloatArray, FloatArray], outside: NDArray[np.bool_]
    ) -> None:
        """Record boxes contracted to the ball of rotations: bounds before and after, and whether each box is empty."""
        for k, (old, new) in enumerate(zip(keys_of(*before), keys_of(*after), strict=True)):
            if outside[k]:
                self.add(old, bytes([Node.OUTSIDE]))
            elif old != new:
                self.add(old, b"", new)

    def tree(self, *, with_open: bool = False) -> bytes:
        """Return the whole tree.

        Args:
            with_open: If true, boxes without a node become leaves. These are open boxes, which the bound of a stopped
                search also covers, or boxes that a search of poses did not bisect.

        Raises:
            ProofError: a box is not closed.
        """
        if self._limbs:
            return self._tree_of_limbs(with_open=with_open)
        return self.begin + self.tree_below(self._root, with_open=with_open)

    def tree_below(self, key: bytes, *, with_open: bool = False) -> bytes:
        """Return the part of the tree for one box, by the key of the box; see :meth:`tree`."""
        parts, waiting = list[bytes](), [key]
        # A leaf of shared variables has additional values, and an open box has none.
        missing = bytes([Node.BOUNDED]) if with_open and not self.begin else None
        while waiting:
            text, following = self._nodes.get(waiting.pop(), (missing, ()))
            if text is None:
                raise ProofError("the search left undecided boxes: there is no proof to write")
            parts.append(text)
            waiting += reversed(following)
        return b"".join(parts)

    def _tree_of_limbs(self, *, with_open: bool) -> bytes:
        """Return the limbs' bounds and trees; if a limb has no feasible point, only the tree of this limb."""
        bounds = [bound() for _, bound in self._limbs]
        parts = [bytes([Node.LIMBS])]
        for (record, _), bound in zip(self._limbs, bounds, strict=True):
            is_needed = bound == -np.inf or -np.inf not in bounds
            outer = bound + _OUTWARDS * abs(bound) if bound > -np.inf else bound
            parts.append(struct.pack("<d", outer if is_needed else np.inf))
            parts.append(record.tree(with_open=with_open) if is_needed else bytes([Node.BOUNDED]))
        return b"".join(parts)


def keys_of(lower: FloatArray, upper: FloatArray) -> list[bytes]:
    """Return the keys of boxes with ends (B, n)."""
    ends = np.ascontiguousarray(np.concatenate([lower, upper], axis=1))
    return [row.tobytes() for row in ends]


def halves_of(
    lower: FloatArray, upper: FloatArray, split: NDArray[np.signedinteger]
) -> tuple[FloatArray, list[tuple[bytes, bytes]]]:
    """Return the middle (B,) of the coordinate to bisect of each box (B, n), and the keys of both halves."""
    every = np.arange(len(lower))
    middle = 0.5 * lower[every, split] + 0.5 * upper[every, split]
    below, above = upper.copy(), lower.copy()
    below[every, split] = above[every, split] = middle
    return middle, list(zip(keys_of(lower, below), keys_of(above, upper), strict=True))
