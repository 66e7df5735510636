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
    from .regular.regularity import RankExamination

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

    def ranks(self, lower: FloatArray, upper: FloatArray, found: RankExamination) -> None:
        """Record boxes (B, 6) that were examined for regular rows.

        Args:
            lower: their lower ends before the examination.
            upper: their upper ends.
            found: its results; an open box is cut next.
        """
        # The numbers of ``Rank``: open boxes are cut, and those outside are leaves of their own kind.
        outside, open_ = found.verdict == 2, found.verdict == 0
        self._add(lower, upper, found.lower, found.upper, found.split, open_, outside)

    def cuts(self, lower: FloatArray, upper: FloatArray, split: NDArray[np.signedinteger]) -> None:
        """Record boxes (B, 6) that are cut in the middle of a coordinate each, (B,)."""
        every = np.ones(len(lower), dtype=bool)
        self._add(lower, upper, lower, upper, split, every, ~every)

    def contractions(
        self, before: tuple[FloatArray, FloatArray], after: tuple[FloatArray, FloatArray], outside: NDArray[np.bool_]
    ) -> None:
        """Record boxes that were moved to the ball of rotations: ends before and after, and where none is left."""
        for k, (old, new) in enumerate(zip(_keys(*before), _keys(*after), strict=True)):
            if outside[k]:
                self._outside.add(old)
            elif old != new:
                self._moved[old] = new

    def _add(
        self,
        lower: FloatArray,
        upper: FloatArray,
        low: FloatArray,
        high: FloatArray,
        split: NDArray[np.signedinteger],
        cut: NDArray[np.bool_],
        outside: NDArray[np.bool_],
    ) -> None:
        """Record boxes with ends before and after their contraction."""
        keys = _keys(lower, upper)
        if not self._root:
            self._root = keys[0]
        self._outside.update(keys[k] for k in np.flatnonzero(outside))
        rows = np.flatnonzero(cut)
        part_low, part_high, along = low[rows], high[rows], split[rows]
        every = np.arange(rows.size)
        middle = 0.5 * part_low[every, along] + 0.5 * part_high[every, along]
        below, above = part_high.copy(), part_low.copy()
        below[every, along] = above[every, along] = middle
        for k, one, other, i, value in zip(
            rows.tolist(), _keys(part_low, below), _keys(above, part_high), along.tolist(), middle.tolist(), strict=True
        ):
            self._cuts[keys[k]] = node_bytes(Node.CUT, i, value=value), one, other

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
        rank: of the search of singular poses.
        programs: of numbers, by name and sense.
        boxes: of searches of their own, by name.
        firsts: bounds of the errors of the pose to first order, for legs that are one unit off, by name.
        elsewhere: names and senses of limits that are proved in home's assembly, and not in every one as on paper.
        directions: fixed directions (3,) of a leg, in the world frame and in the platform frame, by the name of lengths
            of one machine.
    """

    rank: TreeRecord = field(default_factory=TreeRecord)
    programs: dict[tuple[str, str], ProgramRecord] = field(default_factory=dict)
    boxes: dict[str, TreeRecord] = field(default_factory=dict)
    firsts: dict[str, float] = field(default_factory=dict)
    elsewhere: set[tuple[str, str]] = field(default_factory=set)
    directions: dict[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)

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
