"""Record of a search as the tree of a proof: see :mod:`screwsynth.nlp.proof.checker.tree` for the nodes."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..checker.proof_file import ProofError
from ..checker.tree import Node, node_bytes
from .examination import COLLAPSED, Examination, Verdict
from .open_boxes import Boxes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray


#: Part of itself by which the bound of a limb moves outwards: half as much as that of the whole.
_OUTWARDS = 5e-13


class _NodeRecord(NamedTuple):
    """Bytes of a node, and the nodes of its children, the next one in preorder last."""

    text: bytes
    following: list[int]


class _LimbRecord(NamedTuple):
    """Record of a limb's tree, and the function that returns its bound."""

    writer: ProofWriter
    bound: Callable[[], float]


class ProofWriter:
    """The tree of a search, recorded block by block.

    Args:
        functions: number of functions, the least of which is maximised.
    """

    def __init__(self, functions: int) -> None:
        self._functions = functions
        self._nodes: dict[int, _NodeRecord] = {}
        self._limbs: list[_LimbRecord] = []
        self._shared: Callable[[], bytes] | None = None

    def clear(self) -> None:
        """Forget everything recorded: the search begins again."""
        self._nodes.clear()
        self._limbs.clear()
        self._shared = None

    def leave_to(self, tree: Callable[[], bytes]) -> None:
        """Let another record return the tree, as that of limbs that share variables does."""
        self._shared = tree

    def limb(self, bound: Callable[[], float]) -> ProofWriter:
        """Return the record of the next limb's tree; the tree of the whole is that of its limbs then.

        Args:
            bound: returns the limb's bound at the end of the search; -inf without a feasible point.
        """
        writer = ProofWriter(self._functions)
        self._limbs.append(_LimbRecord(writer, bound))
        return writer

    def _tree_of_limbs(self, *, with_open: bool) -> bytes:
        """Return the limbs' bounds and trees."""
        bounds = [each.bound() for each in self._limbs]
        parts = [bytes([Node.LIMBS])]
        for each, bound in zip(self._limbs, bounds, strict=True):
            if bound == -np.inf:
                parts += [struct.pack("<d", bound), each.writer.tree(with_open=with_open)]
            elif -np.inf in bounds:
                parts += [struct.pack("<d", np.inf), bytes([Node.BOUNDED])]
            else:
                parts += [struct.pack("<d", bound + _OUTWARDS * abs(bound)), each.writer.tree(with_open=with_open)]
        return b"".join(parts)

    def record(self, boxes: Boxes, found: Examination, cut: FloatArray, first_child: NDArray[np.int64]) -> None:
        """Record a block of examined boxes.

        Args:
            boxes: the boxes before their examination.
            found: its results.
            cut: (B,) place of the bisection of variable ``found.split``; NaN where a box is not bisected.
            first_child: (B,) node of the lower half, the upper half's being the next; without a bisection, node of the
                part of the box that is left; -1 for a leaf.
        """
        for k, place in enumerate(boxes.place.tolist()):
            child, is_cut = int(first_child[k]), bool(np.isfinite(cut[k]))
            if found.verdict[k] == Verdict.OPEN and child < 0:
                continue
            following = [] if child < 0 else [child + 1, child] if is_cut else [child]
            self._nodes[place] = _NodeRecord(self._node_bytes(found, k, is_cut, boxes.upper[:, k]), following)

    def tree(self, *, with_open: bool = False) -> bytes:
        """Return the whole tree.

        Args:
            with_open: whether open boxes are leaves too: the bound of a search that stopped is one for them as well.

        Raises:
            ProofError: a box is not closed.
        """
        if self._shared is not None:
            return self._shared()
        if self._limbs:
            return self._tree_of_limbs(with_open=with_open)
        parts: list[bytes] = []
        waiting = [0]
        while waiting:
            place = waiting.pop()
            if place not in self._nodes and with_open:
                parts.append(bytes([Node.BOUNDED]))
                continue
            if place not in self._nodes:
                raise ProofError("the search did not close every box, so there is no proof to write")
            text, following = self._nodes[place]
            parts.append(text)
            waiting += following
        return b"".join(parts)

    def _node_bytes(self, found: Examination, k: int, is_cut: bool, upper: FloatArray) -> bytes:
        """Return the bytes of box number ``k`` up to those of its children; a contraction closes the part cut off."""
        verdict, reason = int(found.verdict[k]), int(found.reason[k])
        if verdict == Verdict.BOUNDED:
            return bytes([Node.BOUNDED])
        if verdict == Verdict.INFEASIBLE:
            return node_bytes(Node.INFEASIBLE, reason)
        if verdict == Verdict.MONOTONE:
            return node_bytes(Node.MONOTONE, reason)
        only = [reason] if verdict == Verdict.EMPTIED else range(len(upper))
        parts = [part for i in only for part in self._contraction_bytes(found, k, i, float(upper[i]))]
        if is_cut:
            parts.append(node_bytes(Node.HALF, int(found.split[k])))
        return b"".join(parts)

    def _contraction_bytes(self, found: Examination, k: int, i: int, upper: float) -> list[bytes]:
        """Return the nodes of the contraction of box number ``k`` along variable ``i``."""
        below, above = int(found.cut_lower[i, k]), int(found.cut_upper[i, k])
        if COLLAPSED in (below, above):
            return [node_bytes(Node.FACE_UPPER if below == COLLAPSED else Node.FACE_LOWER, i)]
        parts = []
        if below >= 0:
            parts.append(node_bytes(Node.BELOW, i, value=float(found.lower[i, k])) + self._reason_bytes(below))
            if found.lower[i, k] > upper:
                return parts
        if above >= 0:
            parts.append(node_bytes(Node.ABOVE, i, value=float(found.upper[i, k])) + self._reason_bytes(above))
        return parts

    def _reason_bytes(self, why: int) -> bytes:
        """Return the reason for cutting a part off, from the number of the expression that excludes it."""
        return bytes([Node.BOUNDED]) if why < self._functions else node_bytes(Node.INFEASIBLE, why)
