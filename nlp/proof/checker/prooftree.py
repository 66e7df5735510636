"""Claims of a proof: its tree, read from bytes, as statements about boxes that cover the whole box by construction."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..statement.limb_separation import separate
from ..statement.standard_form import StandardForm
from .proof import Node, ProofError

if TYPE_CHECKING:
    from ....models import FloatArray


#: Rounding of a sum of a few bounds, in parts of their sizes: many times the largest possible.
_SUM = 1e-14


@dataclass(frozen=True, eq=False)
class Claim:
    """The claim of a leaf or of a face about its box.

    Attributes:
        kind: kind of the node.
        index: of the condition or variable; 0 where the kind has none.
        lower, upper: (n,) ends of the box.
    """

    kind: Node
    index: int
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, eq=False)
class Part:
    """Claims about the box of one form: of the whole one, or of a limb.

    Attributes:
        form: the form.
        bound: the bound of the form's value that the claims prove; -inf where there is no feasible point.
        claims: the claims.
    """

    form: StandardForm
    bound: float
    claims: list[Claim]


def read_parts(tree: bytes, form: StandardForm, bound: float) -> list[Part]:
    """Read the parts of a tree, which together prove a bound of a form's value.

    Raises:
        ProofError: the bytes are no tree, or the bounds of limbs do not add up.
    """
    if tree[:1] != bytes([Node.LIMBS]):
        return [Part(form, bound, read_claims(tree, form))]
    separation = separate(form)
    if separation is None or separation.shared:
        raise ProofError("the tree is one of limbs without shared variables, which the case does not have")
    parts, at = [], 1
    for limb in separation.limbs:
        if at + 8 > len(tree):
            raise ProofError("the tree ends before every box is closed")
        (own,) = struct.unpack("<d", tree[at : at + 8])
        reader = TreeReader(tree, limb.form, at + 8)
        reader.read_tree()
        parts.append(Part(limb.form, own, reader.claims))
        at = reader.at
    if at != len(tree):
        raise ProofError("the tree goes on after every box is closed")
    empty = [part for part in parts if part.bound == -np.inf]
    if empty:
        return empty
    bounds = [*(part.bound for part in parts), separation.constant]
    size = sum(map(abs, bounds))
    if not (math.isfinite(size) and math.fsum(bounds) + _SUM * size <= bound):
        raise ProofError("the bounds of the limbs are more than the proven one together")
    return parts


def read_claims(tree: bytes, form: StandardForm) -> list[Claim]:
    """Read the claims of a tree; their boxes cover the form's.

    Raises:
        ProofError: the bytes are no tree.
    """
    reader = TreeReader(tree, form)
    reader.read_tree()
    if reader.at != len(tree):
        raise ProofError("the tree goes on after every box is closed")
    return reader.claims


class TreeReader:
    """A reader of nodes from a tree's bytes.

    Attributes:
        at: number of bytes read.
        claims: the claims of the nodes read.
    """

    def __init__(self, tree: bytes, form: StandardForm, at: int = 0) -> None:
        self._tree, self._form = tree, form
        self._conditions = range(len(form.functions), len(form.functions) + len(form.conditions))
        self.at = at
        self.claims: list[Claim] = []

    def read_tree(self) -> None:
        """Read all nodes of the tree of the form's box.

        Raises:
            ProofError: the bytes are no tree.
        """
        waiting = [(np.array(self._form.lower), np.array(self._form.upper))]
        while waiting:
            waiting += self.read_node(*waiting.pop())

    def _read_bytes(self, count: int) -> bytes:
        self.at += count
        if self.at > len(self._tree):
            raise ProofError("the tree ends before every box is closed")
        return self._tree[self.at - count : self.at]

    def _read_index(self, allowed: range, kind: str) -> int:
        (number,) = self._read_bytes(1)
        if number not in allowed:
            raise ProofError(f"the tree names {kind} {number}, which does not exist")
        return int(number)

    def read_node(self, lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Read the node of a box with ends (n,), and return the boxes of its children, the next one last."""
        (kind,) = self._read_bytes(1)
        if kind not in (Node.HALF, Node.ABOVE, Node.BELOW, Node.FACE_UPPER, Node.FACE_LOWER):
            self._add_leaf(kind, lower, upper)
            return []
        i = self._read_index(range(self._form.n), "variable")
        if kind == Node.HALF:
            middle = 0.5 * lower[i] + 0.5 * upper[i]
            return [(_with(lower, i, middle), upper), (lower, _with(upper, i, middle))]
        if kind == Node.FACE_UPPER:
            self.claims.append(Claim(Node.FACE_UPPER, i, lower, upper))
            return [(_with(lower, i, upper[i]), upper)]
        if kind == Node.FACE_LOWER:
            self.claims.append(Claim(Node.FACE_LOWER, i, lower, upper))
            return [(lower, _with(upper, i, lower[i]))]
        return self._read_cut(kind, i, lower, upper)

    def _read_cut(self, kind: int, i: int, lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Read a cut: one part is a leaf, and the other, if it is not empty, is returned."""
        (value,) = struct.unpack("<d", self._read_bytes(8))
        if not np.isfinite(value):
            raise ProofError("the tree cuts at a number that is not finite")
        (reason,) = self._read_bytes(1)
        cut = min(max(value, lower[i]), upper[i])
        if kind == Node.BELOW:
            self._add_leaf(reason, lower, _with(upper, i, cut))
            return [(_with(lower, i, cut), upper)] if value <= upper[i] else []
        self._add_leaf(reason, _with(lower, i, cut), upper)
        return [(lower, _with(upper, i, cut))] if value >= lower[i] else []

    def _add_leaf(self, kind: int, lower: FloatArray, upper: FloatArray) -> None:
        """Read the rest of a leaf, and add its claim."""
        index = 0
        if kind == Node.INFEASIBLE:
            index = self._read_index(self._conditions, "row")
        elif kind == Node.MONOTONE:
            index = self._read_index(range(self._form.n), "variable")
        elif kind != Node.BOUNDED:
            raise ProofError(f"the tree holds {kind} where a reason must stand")
        self.claims.append(Claim(Node(kind), index, lower, upper))


def _with(ends: FloatArray, i: int, value: float) -> FloatArray:
    """Return ends (n,) with another value at one index."""
    changed = ends.copy()
    changed[i] = value
    return changed
