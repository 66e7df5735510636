"""Record of a search as the tree of a proof: see :mod:`screwsynth.nlp.proof.checker.tree` for the nodes.

A rule names a node by the ends of its box.
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

#: Part of itself by which the bound of a limb moves outwards: half as much as that of the whole.
_OUTWARDS = 5e-13


class TreeRecord:
    """The tree of a search.

    Attributes:
        begin: bytes before those of the root's node.
    """

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget everything recorded: the search begins again."""
        self.begin, self._root = b"", b""
        self._nodes: dict[bytes, tuple[bytes, tuple[bytes, ...]]] = {}
        self._limbs: list[tuple[TreeRecord, Callable[[], float]]] = []

    def limb(self, bound: Callable[[], float]) -> TreeRecord:
        """Return the record of the next limb's tree; the tree of the whole is that of its limbs then.

        Args:
            bound: returns the limb's bound at the end of the search; -inf without a feasible point.
        """
        record = TreeRecord()
        self._limbs.append((record, bound))
        return record

    def add(self, key: bytes, text: bytes, *parts: bytes) -> None:
        """Record a node: its bytes, and the keys of the parts of its box in the order of their trees."""
        # The first box that a search examines is the whole one.
        self._root = self._root or key
        self._nodes[key] = text, parts

    def cuts(self, lower: FloatArray, upper: FloatArray, split: NDArray[np.signedinteger]) -> None:
        """Record boxes (B, n) that are cut in the middle of a coordinate each, (B,)."""
        middle, halves = halves_of(lower, upper, split)
        for key, i, value, parts in zip(keys_of(lower, upper), split.tolist(), middle.tolist(), halves, strict=True):
            self.add(key, node_bytes(Node.CUT, i, value=value), *parts)

    def contractions(
        self, before: tuple[FloatArray, FloatArray], after: tuple[FloatArray, FloatArray], outside: NDArray[np.bool_]
    ) -> None:
        """Record boxes that were moved to the ball of rotations: ends before and after, and where none is left."""
        for k, (old, new) in enumerate(zip(keys_of(*before), keys_of(*after), strict=True)):
            if outside[k]:
                self.add(old, bytes([Node.OUTSIDE]))
            elif old != new:
                self.add(old, b"", new)

    def tree(self, *, with_open: bool = False) -> bytes:
        """Return the whole tree.

        Args:
            with_open: whether boxes without a node are leaves: open ones, for which the bound of a search that stopped
                is one as well, or those that a search of poses has not cut.

        Raises:
            ProofError: a box is not closed.
        """
        if self._limbs:
            return self._tree_of_limbs(with_open=with_open)
        return self.begin + self.tree_below(self._root, with_open=with_open)

    def tree_below(self, key: bytes, *, with_open: bool = False) -> bytes:
        """Return the tree of a box with a key; see :meth:`tree`."""
        parts, waiting = list[bytes](), [key]
        # A leaf of shared variables has numbers of its own, which an open box lacks.
        missing = bytes([Node.BOUNDED]) if with_open and not self.begin else None
        while waiting:
            text, following = self._nodes.get(waiting.pop(), (missing, ()))
            if text is None:
                raise ProofError("the search did not close every box, so there is no proof to write")
            parts.append(text)
            waiting += reversed(following)
        return b"".join(parts)

    def _tree_of_limbs(self, *, with_open: bool) -> bytes:
        """Return the limbs' bounds and trees; of limbs of which one has no feasible point, the tree of that one."""
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
    """Return the middles (B,) of a coordinate of each box (B, n), and the keys of its lower and its upper half."""
    every = np.arange(len(lower))
    middle = 0.5 * lower[every, split] + 0.5 * upper[every, split]
    below, above = upper.copy(), lower.copy()
    below[every, split] = above[every, split] = middle
    return middle, list(zip(keys_of(lower, below), keys_of(above, upper), strict=True))
