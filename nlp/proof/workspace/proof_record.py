"""Record of searches over a workspace, from which the proof on paper is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..boxes.proof_writer import ProofWriter
from ..certificate.certificate import CertificateStatus
from ..checker.tree import Node, node_bytes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray
    from ...program.nlp import Nlp
    from ..certificate.certificate import Certificate
    from ..statement.claims import Claim
    from ..statement.tolerance import Directions

#: Part of itself by which the bound of a number that is the same at every pose moves outwards, as that of a search.
_FOLDED = 1e-12


class TreeRecord:
    """The boxes that a search has cut, by their ends: a box that is cut nowhere is a leaf.

    Attributes:
        lacks_boxes: whether boxes were left out that the check has no rule for: a number of the pose that follows from
            others leaves its range there.
    """

    def __init__(self) -> None:
        self.lacks_boxes = False
        self._root = b""
        self._outside: set[bytes] = set()
        self._moved: dict[bytes, bytes] = {}
        self._cuts: dict[bytes, tuple[bytes, bytes, bytes]] = {}

    def cuts(self, lower: FloatArray, upper: FloatArray, split: NDArray[np.signedinteger]) -> None:
        """Record boxes (B, 6) that are cut in the middle of a coordinate each, (B,)."""
        keys, every = _keys(lower, upper), np.arange(len(lower))
        middle = 0.5 * lower[every, split] + 0.5 * upper[every, split]
        below, above = upper.copy(), lower.copy()
        below[every, split] = above[every, split] = middle
        cuts = zip(keys, split.tolist(), middle.tolist(), _keys(lower, below), _keys(above, upper), strict=True)
        for key, i, value, one, other in cuts:
            self._root = self._root or key
            self._cuts[key] = node_bytes(Node.CUT, i, value=value), one, other

    def contractions(
        self, before: tuple[FloatArray, FloatArray], after: tuple[FloatArray, FloatArray], outside: NDArray[np.bool_]
    ) -> None:
        """Record boxes that were moved to the ball of rotations: ends before and after, and where none is left."""
        for k, (old, new) in enumerate(zip(_keys(*before), _keys(*after), strict=True)):
            if outside[k]:
                self._outside.add(old)
            elif old != new:
                self._moved[old] = new

    def tree(self) -> bytes:
        """Return the tree: every box that was not cut is claimed to be closed."""
        parts: list[bytes] = []
        waiting = [self._root]
        while waiting:
            key = waiting.pop()
            key = key if key in self._outside else self._moved.get(key, key)
            cut = self._cuts.get(key)
            if cut is not None:
                parts.append(cut[0])
                waiting += [cut[2], cut[1]]
            else:
                parts.append(bytes([Node.OUTSIDE if key in self._outside else Node.BOUNDED]))
        return b"".join(parts)


def _keys(lower: FloatArray, upper: FloatArray) -> list[bytes]:
    """Return a text of each box (B, 6)."""
    ends = np.ascontiguousarray(np.concatenate([lower, upper], axis=1))
    return [row.tobytes() for row in ends]


@dataclass(frozen=True, eq=False)
class ProgramRecord:
    """The search of one number by the rules of ``certify``.

    Attributes:
        nlp: its program.
        bound: upper bound of the value that is maximised.
        tree: its nodes, open boxes being leaves; None without a bound.
    """

    nlp: Nlp
    bound: float
    tree: bytes | None


@dataclass(eq=False)
class PaperRecord:
    """Records of all searches about one machine.

    Attributes:
        programs: of numbers, by name and sense.
        boxes: of searches of their own, by name.
        firsts: bounds of the errors of the pose to first order, for legs that are one unit off, by name.
        elsewhere: names and senses of limits that are proved in home's assembly, and not in every one as on paper.
        rests: bounds of terms of second order by which numbers of machines are bounded, by their name and sense.
        directions: fixed directions of a leg, by the name of lengths of one machine.
    """

    programs: dict[tuple[str, str], ProgramRecord] = field(default_factory=dict)
    boxes: dict[str, TreeRecord] = field(default_factory=dict)
    firsts: dict[str, float] = field(default_factory=dict)
    elsewhere: set[tuple[str, str]] = field(default_factory=set)
    rests: dict[tuple[str, str], float] = field(default_factory=dict)
    directions: dict[str, Directions] = field(default_factory=dict)

    def own(self, name: str) -> TreeRecord:
        """Return the record of a search of its own."""
        return self.boxes.setdefault(name, TreeRecord())

    def constant(self, claim: Claim, nlp: Nlp, value: float) -> None:
        """Record a number that does not depend on the pose."""
        bound = -nlp.sign * value
        tree = bytes([Node.BOUNDED])
        self._keep(claim, ProgramRecord(nlp, bound + _FOLDED * abs(bound), tree))

    def program(self, claim: Claim, found: Certificate, writer: ProofWriter, *, again: bool = False) -> None:
        """Record a search of a number, or a finer one again, of which the better one is kept."""
        has_bound = found.status in (CertificateStatus.PROVED, CertificateStatus.INCOMPLETE) and math.isfinite(
            found.bound
        )
        tree = writer.tree(with_open=True) if has_bound else None
        bound = -found.nlp.sign * found.bound
        record = ProgramRecord(found.nlp, bound, tree)
        key = claim.name, claim.sense.value
        before = self.programs.get(key)
        if again and (before is None or before.tree is None or (tree is not None and bound <= before.bound)):
            self.programs[key] = record
        else:
            self._keep(claim, record)

    def _keep(self, claim: Claim, record: ProgramRecord) -> None:
        """Keep the record of a number; of two of one name that of the first, as in :mod:`.expected`."""
        self.programs.setdefault((claim.name, claim.sense.value), record)
