"""Trees of boxes as bytes: nodes in preorder, each a byte for its kind, then its indices and numbers.

    half i             bisection of variable i at 0.5 lower + 0.5 upper: the lower half's tree, then the upper half's
    cut i v            the same at v
    above i v, below i v    cut of variable i at v: the part above (below) v is a leaf, whose reason follows; then the
                       tree of the other part
    face i, face' i    variable i is monotone: the tree of the box's upper (lower) face, which must lie on the root's
    bounded            what the tree claims holds in the box: no feasible point has a value above the bound, or the
                       claim about poses
    infeasible k       condition k holds nowhere in the box; without k in a tree of shared variables
    monotone i         no maximum lies in the box, because every function rises along variable i
    outside            no pose of the box is one of the workspace

The leaves therefore cover the root by construction, and a tree with too few or too many bytes is no proof. Expressions
are counted from 0, the functions first and then the conditions. Numbers are doubles, little-endian.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Callable, Set
from typing import TYPE_CHECKING

import numpy as np

from .proof_file import ProofError

if TYPE_CHECKING:
    from ....models import FloatArray

_VALUE = struct.Struct("<d")


class Node(enum.IntEnum):
    """Kinds of node, as in this module's docstring, and what a tree of limbs begins with."""

    HALF = 1
    ABOVE = 2
    BELOW = 3
    FACE_UPPER = 4
    FACE_LOWER = 5
    BOUNDED = 6
    INFEASIBLE = 7
    MONOTONE = 8
    LIMBS = 9
    SHARED = 10
    CUT = 11
    OUTSIDE = 12


#: Kinds whose node has the faces of a box.
FACES = (Node.FACE_UPPER, Node.FACE_LOWER)

#: Callback with a leaf's (or face's) kind, variable (-1 for a leaf), and the ends (n,) of its box.
Leaf = Callable[[int, int, "FloatArray", "FloatArray"], None]


def node_bytes(kind: Node, *indices: int, value: float | None = None) -> bytes:
    """Return the bytes of a node up to those of its children."""
    return bytes([kind, *indices]) + (b"" if value is None else _VALUE.pack(value))


def halves(
    lower: FloatArray, upper: FloatArray, i: int, value: float | None = None
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return the ends of both parts of a box with ends (n,), cut along variable i at a value or in the middle."""
    at = 0.5 * lower[i] + 0.5 * upper[i] if value is None else value
    return (lower, with_end(upper, i, at)), (with_end(lower, i, at), upper)


def with_end(ends: FloatArray, i: int, value: float) -> FloatArray:
    """Return ends (n,) with another value at one index."""
    changed = ends.copy()
    changed[i] = value
    return changed


class TreeReader:
    """A reader of nodes from a tree's bytes; ``at`` is the number of bytes read."""

    def __init__(self, tree: bytes, at: int = 0) -> None:
        self._tree, self.at = tree, at

    def read(self, count: int) -> bytes:
        """Return the next bytes.

        Raises:
            ProofError: there are not as many.
        """
        self.at += count
        if self.at > len(self._tree):
            raise ProofError("the tree ends before every box is closed")
        return self._tree[self.at - count : self.at]

    def index(self, allowed: range, kind: str) -> int:
        """Return the next byte, an index.

        Raises:
            ProofError: it is not allowed.
        """
        (number,) = self.read(1)
        if number not in allowed:
            raise ProofError(f"the tree names {kind} {number}, which does not exist")
        return int(number)

    def number(self) -> float:
        """Return the next double."""
        return float(_VALUE.unpack(self.read(_VALUE.size))[0])

    def finish(self) -> None:
        """Refuse further bytes.

        Raises:
            ProofError: there are some.
        """
        if self.at != len(self._tree):
            raise ProofError("the tree goes on after every box is closed")

    def walk(self, lower: FloatArray, upper: FloatArray, leaf: Leaf, inner: Set[Node]) -> None:
        """Read the nodes of the tree of a box with ends (n,).

        Args:
            lower: lower ends.
            upper: upper ends.
            leaf: reads the rest of a leaf, and keeps it; refuses kinds that it does not know.
            inner: kinds of nodes with children that the tree may have.

        Raises:
            ProofError: the bytes are no such tree.
        """
        waiting = [(np.array(lower), np.array(upper))]
        while waiting:
            low, high = waiting.pop()
            (kind,) = self.read(1)
            if kind not in inner:
                leaf(kind, -1, low, high)
                continue
            i = self.index(range(len(low)), "variable")
            if kind == Node.HALF:
                waiting += halves(low, high, i)[::-1]
            elif kind == Node.CUT:
                value = self.number()
                if not low[i] <= value <= high[i]:
                    raise ProofError(f"the tree cuts a box at {value:.6g}, which is outside of it")
                waiting += halves(low, high, i, value)[::-1]
            elif kind in FACES:
                leaf(kind, i, low, high)
                end = high[i] if kind == Node.FACE_UPPER else low[i]
                waiting.append((with_end(low, i, end), with_end(high, i, end)))
            else:
                waiting += self._cut(kind, i, (low, high), leaf)

    def _cut(
        self, kind: int, i: int, box: tuple[FloatArray, FloatArray], leaf: Leaf
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Read a cut: one part is a leaf, and the other, if it is not empty, is returned."""
        value = self.number()
        if not np.isfinite(value):
            raise ProofError("the tree cuts at a number that is not finite")
        (reason,) = self.read(1)
        below, above = halves(*box, i, min(max(value, box[0][i]), box[1][i]))
        if kind == Node.BELOW:
            leaf(reason, -1, *below)
            return [above] if value <= box[1][i] else []
        leaf(reason, -1, *above)
        return [below] if value >= box[0][i] else []
