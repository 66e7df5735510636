"""Bytes of a proof by limbs that share variables: a tree of boxes of these, with numbers for each limb at the leaves.

The byte ``SHARED`` comes first, then the nodes in preorder; the root is the box of the shared variables:

    half i         bisection of shared variable i at 0.5 lower + 0.5 upper: the lower half's tree, then the upper half's
    infeasible     no point of the box keeps the conditions on shared variables alone
    bounded ...    for each limb its bound ``b_k``; where it is finite, its tilt ``t_k`` follows: g, then the upper
                   triangle of Q by rows

Numbers are doubles, little-endian. The claims of a bounded leaf over its box S of the shared variables s are

    phi_k(s, o) - t_k(s) <= b_k          for each limb, all of its own variables o, where its conditions hold,
    phi_0(s) + sum t_k(s) <= T - sum b_k    where the conditions on s hold, with T the proven bound.

Together they bound ``phi_0 + sum phi_k`` by T. A limb with the bound minus infinity has no feasible point over S; then
nothing is claimed of the others, whose bounds must be infinite.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..proof import Node, ProofError

if TYPE_CHECKING:
    from .....models import FloatArray


@dataclass(frozen=True, eq=False)
class Leaf:
    """A bounded leaf.

    Attributes:
        lower, upper: (m,) ends of its box.
        bounds: (K,) of the limbs.
        g: (K, m) and
        Q: (K, m, m) symmetric, of their tilts; 0 for infinite bounds.
    """

    lower: FloatArray
    upper: FloatArray
    bounds: FloatArray
    g: FloatArray
    Q: FloatArray


@dataclass(frozen=True, eq=False)
class SharedLeaves:
    """Leaves of a tree: bounded ones, and the ends (m,) of the boxes of infeasible ones."""

    bounded: list[Leaf]
    infeasible: list[tuple[FloatArray, FloatArray]]


def leaf_bytes(bounds: FloatArray, g: FloatArray, Q: FloatArray) -> bytes:
    """Return the node of a bounded leaf, from the arrays of :class:`Leaf`."""
    rows, columns = np.triu_indices(g.shape[1])
    parts = [bytes([Node.BOUNDED])]
    for k, bound in enumerate(bounds.tolist()):
        parts.append(struct.pack("<d", bound))
        if np.isfinite(bound):
            parts.append(np.concatenate([g[k], Q[k, rows, columns]]).astype("<f8").tobytes())
    return b"".join(parts)


def read_shared(tree: bytes, lower: FloatArray, upper: FloatArray, limbs: int) -> SharedLeaves:
    """Read the leaves of a tree, whose boxes cover that of the shared variables, ends (m,).

    Raises:
        ProofError: the bytes are no such tree.
    """
    reader = _Reader(tree, len(lower), limbs)
    reader.take(1)
    bounded: list[Leaf] = []
    infeasible: list[tuple[FloatArray, FloatArray]] = []
    waiting = [(np.array(lower), np.array(upper))]
    while waiting:
        low, high = waiting.pop()
        (kind,) = reader.take(1)
        if kind == Node.HALF:
            (i,) = reader.take(1)
            if i >= len(lower):
                raise ProofError(f"the tree names shared variable {i}, which does not exist")
            first, second = halves(low, high, i)
            waiting += [second, first]
        elif kind == Node.INFEASIBLE:
            infeasible.append((low, high))
        elif kind == Node.BOUNDED:
            bounded.append(reader.leaf(low, high))
        else:
            raise ProofError(f"the tree holds {kind} where a node of shared variables must stand")
    if reader.at != len(tree):
        raise ProofError("the tree goes on after every box is closed")
    return SharedLeaves(bounded, infeasible)


def halves(
    lower: FloatArray, upper: FloatArray, i: int
) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return ends of the halves of a box, ends (m,), bisected along variable i."""
    middle = 0.5 * lower[i] + 0.5 * upper[i]
    left, right = upper.copy(), lower.copy()
    left[i] = right[i] = middle
    return (lower, left), (right, upper)


class _Reader:
    """A reader of bytes: ``at`` is the number of those that were read."""

    def __init__(self, tree: bytes, m: int, limbs: int) -> None:
        self._tree, self._m, self._limbs = tree, m, limbs
        self.at = 0

    def take(self, count: int) -> bytes:
        """Return the next bytes.

        Raises:
            ProofError: there are not as many.
        """
        self.at += count
        if self.at > len(self._tree):
            raise ProofError("the tree ends before every box is closed")
        return self._tree[self.at - count : self.at]

    def leaf(self, lower: FloatArray, upper: FloatArray) -> Leaf:
        """Return the bounded leaf whose numbers come next.

        Raises:
            ProofError: a number is NaN or infinite where it must not be.
        """
        m, K = self._m, self._limbs
        rows, columns = np.triu_indices(m)
        bounds, g, Q = np.zeros(K), np.zeros((K, m)), np.zeros((K, m, m))
        for k in range(K):
            (bounds[k],) = struct.unpack("<d", self.take(8))
            if np.isfinite(bounds[k]):
                numbers = np.frombuffer(self.take(8 * (m + rows.size)), dtype="<f8")
                g[k], Q[k, rows, columns], Q[k, columns, rows] = numbers[:m], numbers[m:], numbers[m:]
        is_empty = bool((bounds == -np.inf).any())
        known = np.isinf(bounds) if is_empty else np.isfinite(bounds)
        if not (known.all() and np.isfinite(g).all() and np.isfinite(Q).all()):
            raise ProofError("a leaf of the tree has a bound or a tilt that is no number")
        return Leaf(lower, upper, bounds, g, Q)
