"""Bytes of a proof by limbs that share variables: a tree of boxes of these, with numbers for each limb at the leaves.

The byte ``SHARED`` comes first, then the nodes ``half``, ``infeasible`` and ``bounded`` of :mod:`..tree`; the root is
the box of the shared variables. An infeasible leaf says that no point of the box keeps the conditions on shared
variables alone. After the byte of a bounded leaf there is for each limb its bound ``b_k``, and where that is finite its
tilt ``t_k``: g, then the upper triangle of Q by rows. The claims of a bounded leaf over its box S of the shared
variables s are

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

from ..proof_file import ProofError
from ..tree import Node, TreeReader

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
    reader, leaves = TreeReader(tree, 1), SharedLeaves([], [])

    def leaf(kind: int, _: int, low: FloatArray, high: FloatArray) -> None:
        if kind == Node.INFEASIBLE:
            leaves.infeasible.append((low, high))
        elif kind == Node.BOUNDED:
            leaves.bounded.append(_read_leaf(reader, limbs, low, high))
        else:
            raise ProofError(f"the tree holds {kind} where a node of shared variables must stand")

    reader.walk(lower, upper, leaf, frozenset({Node.HALF}))
    reader.finish()
    return leaves


def _read_leaf(reader: TreeReader, K: int, lower: FloatArray, upper: FloatArray) -> Leaf:
    """Return the bounded leaf whose numbers come next.

    Raises:
        ProofError: a number is NaN or infinite where it must not be.
    """
    m = len(lower)
    rows, columns = np.triu_indices(m)
    bounds, g, Q = np.zeros(K), np.zeros((K, m)), np.zeros((K, m, m))
    for k in range(K):
        bounds[k] = reader.number()
        if np.isfinite(bounds[k]):
            numbers = np.frombuffer(reader.read(8 * (m + rows.size)), dtype="<f8")
            g[k], Q[k, rows, columns], Q[k, columns, rows] = numbers[:m], numbers[m:], numbers[m:]
    is_empty = bool((bounds == -np.inf).any())
    known = np.isinf(bounds) if is_empty else np.isfinite(bounds)
    if not (known.all() and np.isfinite(g).all() and np.isfinite(Q).all()):
        raise ProofError("a leaf of the tree has a bound or a tilt that is no number")
    return Leaf(lower, upper, bounds, g, Q)
