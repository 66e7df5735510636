"""Taking down a search as a proof: see :mod:`screwsynth.nlp.certificate.proof` for what is written."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from .bounding import Examined, Verdict
from .openboxes import Boxes
from .proof import Node, ProofError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...models import FloatArray


class ProofWriter:
    """Takes down a search; :class:`screwsynth.nlp.branchandbound.Recorder`.

    Args:
        functions: how many functions the least of which is maximised.
    """

    def __init__(self, functions: int) -> None:
        self._functions = functions
        self._nodes: dict[int, tuple[bytes, list[int]]] = {}

    def record(self, boxes: Boxes, found: Examined, cut: FloatArray, first_child: NDArray[np.int64]) -> None:
        """A block of examined boxes: the bytes of each, up to where its children's follow."""
        for k, place in enumerate(boxes.place.tolist()):
            child, is_cut = int(first_child[k]), bool(np.isfinite(cut[k]))
            if found.verdict[k] == Verdict.OPEN and child < 0:
                continue
            following = [] if child < 0 else [child + 1, child] if is_cut else [child]
            self._nodes[place] = (self._written(found, k, is_cut, boxes.upper[:, k]), following)

    def tree(self) -> bytes:
        """The whole tree.

        Raises:
            ProofError: a box was not closed.
        """
        parts: list[bytes] = []
        waiting = [0]
        while waiting:
            place = waiting.pop()
            if place not in self._nodes:
                raise ProofError("the search did not close every box, so there is no proof to write")
            text, following = self._nodes[place]
            parts.append(text)
            waiting += following
        return b"".join(parts)

    def _written(self, found: Examined, k: int, is_cut: bool, upper: FloatArray) -> bytes:
        """The bytes of one box, up to where its children's follow. Each contraction closes what it takes off."""
        verdict, reason = int(found.verdict[k]), int(found.reason[k])
        if verdict == Verdict.BOUNDED:
            return bytes([Node.BOUNDED])
        if verdict == Verdict.INFEASIBLE:
            return bytes([Node.INFEASIBLE, reason])
        if verdict == Verdict.MONOTONE:
            return bytes([Node.MONOTONE, reason])
        only = [reason] if verdict == Verdict.EMPTIED else range(len(upper))
        parts = [part for i in only for part in self._moved(found, k, i, float(upper[i]))]
        if is_cut:
            parts.append(bytes([Node.HALF, int(found.split[k])]))
        return b"".join(parts)

    def _moved(self, found: Examined, k: int, i: int, upper: float) -> list[bytes]:
        """What became of the ends of one variable."""
        below, above = int(found.cut_lower[i, k]), int(found.cut_upper[i, k])
        if -1 in (below, above):
            return [bytes([Node.FACE_UPPER if below == -1 else Node.FACE_LOWER, i])]
        parts = []
        if below >= 0:
            parts.append(bytes([Node.BELOW, i]) + struct.pack("<d", float(found.lower[i, k])) + self._leaf(below))
            if found.lower[i, k] > upper:
                return parts
        if above >= 0:
            parts.append(bytes([Node.ABOVE, i]) + struct.pack("<d", float(found.upper[i, k])) + self._leaf(above))
        return parts

    def _leaf(self, why: int) -> bytes:
        """The reason of a cut, by the number of the expression that decided it."""
        return bytes([Node.BOUNDED]) if why < self._functions else bytes([Node.INFEASIBLE, why])
