"""Record of searches over a workspace, from which the proof on paper is made."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..boxes.tree import TreeRecord
from ..certificate.certificate import CertificateStatus
from ..checker.premises import fingerprint
from ..checker.tree import Node

if TYPE_CHECKING:
    from ...program.nlp import Nlp
    from ..certificate.certificate import Certificate
    from ..statement.claims import Claim
    from ..statement.tolerance import Directions

#: Part of itself by which the bound of a number that is the same at every pose moves outwards, as that of a search.
_FOLDED = 1e-12


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

    def program(self, claim: Claim, found: Certificate, writer: TreeRecord) -> None:
        """Record a search of a number."""
        has_bound = found.status in (CertificateStatus.PROVED, CertificateStatus.INCOMPLETE) and math.isfinite(
            found.bound
        )
        tree = writer.tree(with_open=True) if has_bound else None
        self._keep(claim, ProgramRecord(found.nlp, -found.nlp.sign * found.bound, tree))

    def _keep(self, claim: Claim, record: ProgramRecord) -> None:
        """Keep the record of a number: the better one of two of one program, else the first of two of one name."""
        key = claim.name, claim.sense.value
        before = self.programs.get(key)
        is_same = before is not None and fingerprint(before.nlp) == fingerprint(record.nlp)
        if before is None or (
            is_same and (before.tree is None or (record.tree is not None and record.bound <= before.bound))
        ):
            self.programs[key] = record
