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

Where the limbs of a form share no variable, a tree may begin with the byte ``LIMBS``. For each limb then follow its
bound and its tree, over its own variables, and the sum of the bounds must not exceed the proven one. A limb with the
bound minus infinity has no feasible point, and then the trees of the others are bare leaves without a bound.

Where the limbs share variables, a tree may begin with the byte ``SHARED``. Then come the nodes ``half``, ``infeasible``
and ``bounded``; the root is the box of the shared variables. An infeasible leaf says that no point of the box keeps the
conditions on shared variables alone. After the byte of a bounded leaf there is for each limb its bound ``b_k``, and
where that is finite its tilt ``t_k``, a quadratic function of the shared variables: g, then the upper triangle of Q by
rows. The claims of a bounded leaf over its box S of the shared variables s are

    phi_k(s, o) - t_k(s) <= b_k          for each limb, all of its own variables o, where its conditions hold,
    phi_0(s) + sum t_k(s) <= T - sum b_k    where the conditions on s hold, with T the proven bound.

Together they bound ``phi_0 + sum phi_k`` by T. A limb with the bound minus infinity has no feasible point over S; then
nothing is claimed of the others, whose bounds must be infinite.
"""

from __future__ import annotations

import enum
import struct
from collections.abc import Callable, Set
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..statement.standard_form import StandardForm
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

#: Ends (n,) of a box.
Box = tuple["FloatArray", "FloatArray"]
#: Callback with a leaf's (or face's) kind, variable (-1 for a leaf), and the ends (n,) of its box.
Leaf = Callable[[int, int, "FloatArray", "FloatArray"], None]


def node_bytes(kind: Node, *indices: int, value: float | None = None) -> bytes:
    """Return the bytes of a node up to those of its children."""
    return bytes([kind, *indices]) + (b"" if value is None else _VALUE.pack(value))


def halves(lower: FloatArray, upper: FloatArray, i: int, value: float | None = None) -> tuple[Box, Box]:
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

    def _cut(self, kind: int, i: int, box: Box, leaf: Leaf) -> list[Box]:
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


def read_claims(reader: TreeReader, form: StandardForm) -> dict[tuple[Node, int], list[Box]]:
    """Read the claims of a tree: their boxes, which cover the form's, by kind of node and condition or variable (or 0).

    Raises:
        ProofError: the bytes are no tree.
    """
    claims: dict[tuple[Node, int], list[Box]] = {}
    conditions = range(len(form.functions), len(form.functions) + len(form.conditions))

    def leaf(kind: int, i: int, lower: FloatArray, upper: FloatArray) -> None:
        index = max(i, 0)
        if kind == Node.INFEASIBLE:
            index = reader.index(conditions, "row")
        elif kind == Node.MONOTONE:
            index = reader.index(range(form.n), "variable")
        elif kind not in (Node.BOUNDED, *FACES) or (kind in FACES) != (i >= 0):
            raise ProofError(f"the tree holds {kind} where a reason must stand")
        claims.setdefault((Node(kind), index), []).append((lower, upper))

    reader.walk(form.lower, form.upper, leaf, frozenset({Node.HALF, Node.ABOVE, Node.BELOW, *FACES}))
    return claims


class SharedLeaf(NamedTuple):
    """A leaf of a tree of shared variables.

    Attributes:
        lower, upper: (m,) ends of its box.
        bounds: (K,) of the limbs; all infinite for an infeasible leaf, which claims nothing of any limb.
        g: (K, m) and
        Q: (K, m, m) symmetric, of their tilts; 0 for infinite bounds.
    """

    lower: FloatArray
    upper: FloatArray
    bounds: FloatArray
    g: FloatArray
    Q: FloatArray


def leaf_bytes(bounds: FloatArray, g: FloatArray, Q: FloatArray) -> bytes:
    """Return the node of a bounded leaf, from the arrays of :class:`SharedLeaf`."""
    rows, columns = np.triu_indices(g.shape[1])
    parts = [bytes([Node.BOUNDED])]
    for k, bound in enumerate(bounds.tolist()):
        parts.append(struct.pack("<d", bound))
        if np.isfinite(bound):
            parts.append(np.concatenate([g[k], Q[k, rows, columns]]).astype("<f8").tobytes())
    return b"".join(parts)


def read_shared(tree: bytes, lower: FloatArray, upper: FloatArray, limbs: int) -> list[SharedLeaf]:
    """Return the leaves of a tree of shared variables, whose boxes cover that with ends (m,).

    Raises:
        ProofError: the bytes are no such tree.
    """
    reader = TreeReader(tree, 1)
    leaves: list[SharedLeaf] = []

    def leaf(kind: int, _: int, low: FloatArray, high: FloatArray) -> None:
        if kind == Node.INFEASIBLE:
            m = len(low)
            leaves.append(SharedLeaf(low, high, np.full(limbs, np.inf), np.zeros((limbs, m)), np.zeros((limbs, m, m))))
        elif kind == Node.BOUNDED:
            leaves.append(_read_leaf(reader, limbs, low, high))
        else:
            raise ProofError(f"the tree holds {kind} where a node of shared variables must stand")

    reader.walk(lower, upper, leaf, frozenset({Node.HALF}))
    reader.finish()
    return leaves


def _read_leaf(reader: TreeReader, K: int, lower: FloatArray, upper: FloatArray) -> SharedLeaf:
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
    return SharedLeaf(lower, upper, bounds, g, Q)
