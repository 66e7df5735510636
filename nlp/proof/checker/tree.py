"""Trees of boxes as bytes: nodes in preorder, each a byte for its kind, followed by its indices and numbers.

    half i             bisection of variable i at 0.5 lower + 0.5 upper: the lower half's tree, then the upper half's
    cut i v            bisection of variable i at v
    above i v, below i v    cut of variable i at v: the part above (below) v is a leaf, whose reason follows; then the
                       tree of the other part
    face i, face' i    variable i is monotone: the tree of the box's upper (lower) face, which must lie on the root's
    bounded            the claim of the tree holds in the box: no feasible point has a value above the bound, or the
                       claim about poses
    infeasible k       condition k holds nowhere in the box; without k in a tree of shared variables
    monotone i         no maximum lies in the box, because every function rises along variable i
    outside            no pose of the box belongs to the workspace

The leaves therefore cover the root by construction, and a tree with too few or too many bytes is no proof. Expressions
are counted from 0, first the functions and then the conditions. Numbers are little-endian doubles.

If the limbs of a form share no variable, a tree may begin with the byte ``LIMBS``. Then follow, for each limb, its
bound and its tree over its own variables; the sum of the bounds must not exceed the proven bound. A limb with the bound
minus infinity has no feasible point; the trees of the other limbs are then single leaves without a bound.

If the limbs share variables, a tree may begin with the byte ``SHARED``. Then follow the nodes ``half``, ``infeasible``
and ``bounded``; the root is the box of the shared variables. An infeasible leaf claims that no point of the box
satisfies the conditions on shared variables. A bounded leaf is followed, for each limb, by its bound ``b_k``, and if
that is finite by its tilt ``t_k``, a quadratic function of the shared variables: g, then the upper triangle of Q by
rows. The claims of a bounded leaf over its box S of the shared variables s are

    phi_k(s, o) - t_k(s) <= b_k          for each limb, all of its own variables o, where its conditions hold,
    phi_0(s) + sum t_k(s) <= T - sum b_k    where the conditions on s hold, with T the proven bound.

Together they bound ``phi_0 + sum phi_k`` by T. A limb with the bound minus infinity has no feasible point over S; the
bounds of the other limbs must then be infinite, and claim nothing.
"""

from __future__ import annotations

import enum
import itertools
import struct
from collections import deque
from collections.abc import Callable, Iterator, Sequence, Set
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from ..statement.standard_form import StandardForm
from .proof_file import ProofError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

_VALUE = struct.Struct("<d")


class Node(enum.IntEnum):
    """Kinds of node, see this module's docstring, and first bytes of trees of limbs."""

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


#: Largest depth of a tree, in waiting sub-boxes. A search does not bisect below a least width, so searches with
#: hundreds of variables stay below this depth.
_DEEPEST = 10_000
#: Number of values in a block of a tree, including an allowance for the objects of each leaf; least number of leaves
#: in a block; and number of box bounds that are read ahead.
_BLOCK, _OBJECTS, _FEWEST, _AHEAD = 2**20, 32, 64, 2**20
#: Kinds of nodes for faces of a box.
FACES = (Node.FACE_UPPER, Node.FACE_LOWER)

#: Ends (n,) of a box, or (n, L) of several.
Box = tuple["FloatArray", "FloatArray"]
#: Kind of a leaf or face, its variable (-1 for a leaf), and the ends (n,) of its box.
Leaf = tuple[int, int, "FloatArray", "FloatArray"]
Block = TypeVar("Block")


def node_bytes(kind: Node, *indices: int, value: float | None = None) -> bytes:
    """Return the bytes of a node without the bytes of its sub-boxes, which follow."""
    return bytes([kind, *indices]) + (b"" if value is None else _VALUE.pack(value))


def halves(lower: FloatArray, upper: FloatArray, i: int, value: float | None = None) -> tuple[Box, Box]:
    """Return the bounds of both parts of a box, bisected along variable i at a value or at the centre."""
    at = 0.5 * lower[i] + 0.5 * upper[i] if value is None else value
    return (lower, with_end(upper, i, at)), (with_end(lower, i, at), upper)


def with_end(ends: FloatArray, i: int, value: float) -> FloatArray:
    """Return bounds (n,) with another value at one index."""
    changed = ends.copy()
    changed[i] = value
    return changed


def wrong_node(kind: int, allowed: Sequence[Node]) -> ProofError:
    """Return the error of a tree with a node of a kind that is not allowed at this place."""
    name = next((each.name for each in Node if each == kind), f"of the unknown kind {kind}")
    names = f"{', '.join(each.name for each in allowed[:-1])} or {allowed[-1].name}"
    return ProofError(f"the tree of boxes has a node {name} where only {names} is allowed")


class TreeReader:
    """A reader of nodes from a tree's bytes; ``at`` is the number of bytes read so far."""

    def __init__(self, tree: bytes, at: int = 0) -> None:
        self._tree, self.at = tree, at

    def read(self, count: int) -> bytes:
        """Read the given number of bytes.

        Raises:
            ProofError: fewer bytes remain.
        """
        self.at += count
        if self.at > len(self._tree):
            raise ProofError("the tree of boxes is incomplete: it ends before every box is proved or excluded")
        return self._tree[self.at - count : self.at]

    def index(self, allowed: range, kind: str) -> int:
        """Read the next byte as the index of a variable or condition.

        Raises:
            ProofError: the index is not allowed.
        """
        (number,) = self.read(1)
        if number not in allowed:
            raise ProofError(f"the tree of boxes refers to {kind} {number}, which does not exist")
        return int(number)

    def number(self) -> float:
        """Read the next eight bytes as a double."""
        return float(_VALUE.unpack(self.read(_VALUE.size))[0])

    def finish(self) -> None:
        """Refuse a tree with further bytes after its last node.

        Raises:
            ProofError: further bytes remain.
        """
        if self.at != len(self._tree):
            raise ProofError("the tree of boxes has additional data after its last box")

    def walk(self, lower: FloatArray, upper: FloatArray, inner: Set[Node]) -> Iterator[Leaf]:
        """Read the nodes of the tree of a box with ends (n,), and yield its leaves and faces.

        Args:
            lower: (n,) lower ends.
            upper: (n,) upper ends.
            inner: allowed kinds of nodes with children. Other kinds are leaves; the caller must read the bytes after
                the first byte of a leaf before requesting the next leaf.

        Raises:
            ProofError: the bytes are no such tree.
        """
        waiting = [(np.array(lower), np.array(upper))]
        while waiting:
            if len(waiting) > _DEEPEST:
                raise ProofError(f"the tree of boxes has more than {_DEEPEST} nested bisections")
            low, high = waiting.pop()
            (kind,) = self.read(1)
            if kind not in inner:
                yield kind, -1, low, high
                continue
            i = self.index(range(len(low)), "variable")
            if kind == Node.HALF:
                waiting += halves(low, high, i)[::-1]
            elif kind == Node.CUT:
                value = self.number()
                if not low[i] <= value <= high[i]:
                    raise ProofError(f"the tree of boxes cuts a box at {value:.6g}, a value outside this box")
                waiting += halves(low, high, i, value)[::-1]
            elif kind in FACES:
                yield kind, i, low, high
                end = high[i] if kind == Node.FACE_UPPER else low[i]
                waiting.append((with_end(low, i, end), with_end(high, i, end)))
            else:
                value = self.number()
                if not np.isfinite(value):
                    raise ProofError("the tree of boxes cuts a box at a value that is not finite")
                (reason,) = self.read(1)
                parts = halves(low, high, i, min(max(value, low[i]), high[i]))
                closed, rest = parts if kind == Node.BELOW else parts[::-1]
                yield reason, -1, *closed
                # Nothing remains if the whole box is on the closed side.
                waiting += [rest] if (value <= high[i] if kind == Node.BELOW else value >= low[i]) else []


def ahead(blocks: Iterator[Block], size: Callable[[Block], int]) -> Iterator[Block]:
    """Yield blocks of a tree; blocks are read ahead up to the allowed number of box bounds.

    A tree of usual size that ends too early or too late is thus refused before any proof.

    Args:
        blocks: the blocks.
        size: function that returns the number of box bounds in a block.
    """
    waiting, kept = deque[Block](), 0
    for block in blocks:
        waiting.append(block)
        kept += size(block)
        while kept > _AHEAD:
            kept -= size(waiting[0])
            yield waiting.popleft()
    yield from waiting


def read_claims(reader: TreeReader, form: StandardForm) -> Iterator[dict[tuple[Node, int], Box]]:
    """Yield the claims of a tree in blocks: box bounds (n, L) by kind of node and by condition or variable (or 0).

    The boxes of all blocks cover the box of the form.

    Raises:
        ProofError: the bytes are no tree.
    """
    conditions = range(len(form.functions), len(form.functions) + len(form.conditions))
    inner = frozenset({Node.HALF, Node.ABOVE, Node.BELOW, *FACES})
    for block in blocks_of(reader.walk(form.lower, form.upper, inner), form.n):
        claims: dict[tuple[Node, int], list[Box]] = {}
        for kind, i, lower, upper in block:
            index = max(i, 0)
            if kind == Node.INFEASIBLE:
                index = reader.index(conditions, "condition")
            elif kind == Node.MONOTONE:
                index = reader.index(range(form.n), "variable")
            elif kind not in (Node.BOUNDED, *FACES) or (kind in FACES) != (i >= 0):
                raise wrong_node(kind, (Node.INFEASIBLE, Node.MONOTONE, Node.BOUNDED))
            claims.setdefault((Node(kind), index), []).append((lower, upper))
        yield {
            key: (np.array([low for low, _ in some]).T, np.array([up for _, up in some]).T)
            for key, some in claims.items()
        }


def blocks_of(leaves: Iterator[Leaf], numbers: int) -> Iterator[Iterator[Leaf]]:
    """Yield the leaves of a tree in blocks; each block must be consumed before the next one.

    A leaf takes only a few bytes of a tree, but all leaves of a large tree together would exceed the memory.

    Args:
        leaves: the leaves.
        numbers: number of values to keep for each leaf.
    """
    count = max(_BLOCK // (numbers + _OBJECTS), _FEWEST)
    for first in leaves:
        yield itertools.chain([first], itertools.islice(leaves, count - 1))


class SharedLeaves(NamedTuple):
    """L leaves of a tree of m shared variables, with K limbs.

    Attributes:
        lower, upper: (m, L) ends of the boxes of the leaves.
        bounds: (K, L) bounds of the limbs; all infinite for an infeasible leaf, which makes no claim about a limb.
        g: (K, m, L) linear coefficients of the tilts; 0 for infinite bounds.
        Q: (K, m, m, L) symmetric matrices of the tilts; 0 for infinite bounds.
    """

    lower: FloatArray
    upper: FloatArray
    bounds: FloatArray
    g: FloatArray
    Q: FloatArray

    def select(self, which: NDArray[np.bool_]) -> SharedLeaves:
        """Return the leaves that ``which`` marks."""
        return SharedLeaves(*(each[..., which] for each in self))


def leaf_bytes(bounds: FloatArray, g: FloatArray, Q: FloatArray) -> bytes:
    """Return the node of a bounded leaf with bounds (K,) and tilts (K, m), (K, m, m)."""
    rows, columns = np.triu_indices(g.shape[1])
    parts = [bytes([Node.BOUNDED])]
    for k, bound in enumerate(bounds.tolist()):
        parts.append(struct.pack("<d", bound))
        if np.isfinite(bound):
            parts.append(np.concatenate([g[k], Q[k, rows, columns]]).astype("<f8").tobytes())
    return b"".join(parts)


def read_shared(tree: bytes, lower: FloatArray, upper: FloatArray, limbs: int) -> Iterator[SharedLeaves]:
    """Yield the leaves of a tree of shared variables in blocks; together their boxes cover the box with ends (m,).

    Raises:
        ProofError: the bytes are no such tree, or a number is NaN, or infinite where this is not allowed.
    """
    reader, m = TreeReader(tree, 1), len(lower)
    every = reader.walk(lower, upper, frozenset({Node.HALF}))
    for block in blocks_of(every, 2 * m + limbs * (1 + m + m * m)):
        leaves = []
        for kind, _, low, high in block:
            if kind not in (Node.INFEASIBLE, Node.BOUNDED):
                raise wrong_node(kind, (Node.INFEASIBLE, Node.BOUNDED))
            leaves.append((low, high, *_numbers_of_leaf(reader if kind == Node.BOUNDED else None, limbs, m)))
        yield SharedLeaves(*(np.stack(each, axis=-1) for each in zip(*leaves, strict=True)))
    reader.finish()


def _numbers_of_leaf(reader: TreeReader | None, K: int, m: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Read the bounds and polynomial coefficients of a final box from the next bytes, or those of an infeasible box.

    Raises:
        ProofError: a number is NaN, or infinite where this is not allowed.
    """
    rows, columns = np.triu_indices(m)
    bounds, g, Q = np.full(K, np.inf), np.zeros((K, m)), np.zeros((K, m, m))
    if reader is None:
        return bounds, g, Q
    for k in range(K):
        bounds[k] = reader.number()
        if np.isfinite(bounds[k]):
            numbers = np.frombuffer(reader.read(8 * (m + rows.size)), dtype="<f8")
            g[k], Q[k, rows, columns], Q[k, columns, rows] = numbers[:m], numbers[m:], numbers[m:]
    is_empty = bool((bounds == -np.inf).any())
    known = np.isinf(bounds) if is_empty else np.isfinite(bounds)
    if not (known.all() and np.isfinite(g).all() and np.isfinite(Q).all()):
        raise ProofError("a final box of the tree has a bound or a polynomial coefficient that is not a finite number")
    return bounds, g, Q
