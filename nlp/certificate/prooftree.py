"""Unfolding the tree of a proof: from its bytes to claims about boxes, which cover the whole box by construction."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .proof import Node, ProofError
from .standardform import StandardForm

if TYPE_CHECKING:
    from ...models import FloatArray


@dataclass(frozen=True, eq=False)
class Claim:
    """What a node says about its box."""

    kind: Node
    index: int
    lower: FloatArray
    upper: FloatArray


def unfolded(tree: bytes, form: StandardForm) -> list[Claim]:
    """The claims of a tree, whose boxes cover the form's.

    Raises:
        ProofError: it is not whole.
    """
    reader = TreeReader(tree, form)
    waiting = [(np.array(form.lower), np.array(form.upper))]
    while waiting:
        waiting += reader.node(*waiting.pop())
    if reader.at != len(tree):
        raise ProofError("the tree goes on after every box is closed")
    return reader.claims


class TreeReader:
    """Reads nodes from a tree's bytes, and collects what they claim."""

    def __init__(self, tree: bytes, form: StandardForm) -> None:
        self._tree, self._form = tree, form
        self._rows = range(len(form.functions), len(form.functions) + len(form.rows))
        self.at = 0
        self.claims: list[Claim] = []

    def _taken(self, count: int) -> bytes:
        self.at += count
        if self.at > len(self._tree):
            raise ProofError("the tree ends before every box is closed")
        return self._tree[self.at - count : self.at]

    def _one_of(self, allowed: range, what: str) -> int:
        (number,) = self._taken(1)
        if number not in allowed:
            raise ProofError(f"the tree names {what} {number}, which does not exist")
        return int(number)

    def node(self, lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Read the node of a box; returns the boxes of the nodes that follow, the next one last."""
        (kind,) = self._taken(1)
        if kind not in (Node.HALF, Node.ABOVE, Node.BELOW, Node.FACE_UPPER, Node.FACE_LOWER):
            self._leaf(kind, lower, upper)
            return []
        i = self._one_of(range(self._form.n), "variable")
        if kind == Node.HALF:
            middle = 0.5 * lower[i] + 0.5 * upper[i]
            return [(_with(lower, i, middle), upper), (lower, _with(upper, i, middle))]
        if kind == Node.FACE_UPPER:
            self.claims.append(Claim(Node.FACE_UPPER, i, lower, upper))
            return [(_with(lower, i, upper[i]), upper)]
        if kind == Node.FACE_LOWER:
            self.claims.append(Claim(Node.FACE_LOWER, i, lower, upper))
            return [(lower, _with(upper, i, lower[i]))]
        return self._cut(kind, i, lower, upper)

    def _cut(self, kind: int, i: int, lower: FloatArray, upper: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """A part is closed; what is left follows, unless nothing is."""
        (value,) = struct.unpack("<d", self._taken(8))
        if not np.isfinite(value):
            raise ProofError("the tree cuts at a number that is not finite")
        (reason,) = self._taken(1)
        cut = min(max(value, lower[i]), upper[i])
        if kind == Node.BELOW:
            self._leaf(reason, lower, _with(upper, i, cut))
            return [(_with(lower, i, cut), upper)] if value <= upper[i] else []
        self._leaf(reason, _with(lower, i, cut), upper)
        return [(lower, _with(upper, i, cut))] if value >= lower[i] else []

    def _leaf(self, kind: int, lower: FloatArray, upper: FloatArray) -> None:
        index = 0
        if kind == Node.INFEASIBLE:
            index = self._one_of(self._rows, "row")
        elif kind == Node.MONOTONE:
            index = self._one_of(range(self._form.n), "variable")
        elif kind != Node.BOUNDED:
            raise ProofError(f"the tree holds {kind} where a reason must stand")
        self.claims.append(Claim(Node(kind), index, lower, upper))


def _with(ends: FloatArray, i: int, value: float) -> FloatArray:
    changed = ends.copy()
    changed[i] = value
    return changed
