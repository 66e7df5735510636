"""Records of the searches of a judgement, from which its proof is written."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ...program.nlp import Nlp
from ..boxes.tree import TreeRecord
from ..certificate.certificate import Certificate, CertificateStatus
from ..checker.premises import fingerprint
from ..checker.proof_file import ProofClaim
from ..checker.tree import Node
from ..statement.claims import Claim
from ..statement.tolerance import Directions
from .verdict import slack_of

#: Name and sense of a claim.
Key = tuple[str, str]
#: Part of itself by which the bound of a number that is the same at every pose moves outwards, as that of a search.
_FOLDED = 1e-12
#: Part of a gap, and part of itself, by which the bound of a search of boxes moves outwards.
_ROOM, _OUTWARDS = 0.25, 1e-6


@dataclass(eq=False)
class ProofRecord:
    """Records of the searches of one judgement.

    Attributes:
        programs: bounds of numbers by the rules of ``certify``, with their trees.
        boxes: trees of other searches, by name of the claim.
        firsts: bounds of the first-order pose error, for leg-length errors of one unit, by name.
        rests: bounds of the terms of second order of numbers of all robots within a tolerance.
        directions: fixed directions of a leg, by the name of the leg lengths of one robot at two poses.
    """

    programs: dict[Key, ProofClaim] = field(default_factory=dict)
    boxes: dict[str, TreeRecord] = field(default_factory=dict)
    firsts: dict[str, float] = field(default_factory=dict)
    rests: dict[Key, float] = field(default_factory=dict)
    directions: dict[str, Directions] = field(default_factory=dict)

    def tree(self, name: str) -> TreeRecord:
        """Return the tree of the search of a claim."""
        return self.boxes.setdefault(name, TreeRecord())

    def constant(self, claim: Claim, nlp: Nlp, value: float) -> None:
        """Record a number that does not depend on the pose."""
        bound = -nlp.sign * value
        self._keep(claim, nlp, bound + _FOLDED * abs(bound), bytes([Node.BOUNDED]))

    def program(self, claim: Claim, found: Certificate, tree: TreeRecord) -> None:
        """Record a search of a number, if it has a bound, open boxes being leaves, that keeps the number's limit."""
        is_bounded = found.status in (CertificateStatus.PROVED, CertificateStatus.INCOMPLETE)
        sign = claim.sense.sign
        most = math.inf if claim.limit is None else sign * claim.limit + slack_of(claim.limit)
        bound = found.bound_of_tree
        if is_bounded and math.isfinite(bound) and sign * -found.nlp.sign * bound <= most:
            self._keep(claim, found.nlp, bound, tree.tree(with_open=True))

    def followed(self, claim: Claim, bound: float, reached: float, tree: TreeRecord) -> None:
        """Record a search of boxes in which the loops are followed: the bound of a number, and its best value known."""
        sign, key = claim.sense.sign, (claim.name, claim.sense.value)
        if not math.isfinite(bound):
            return
        # Forms of first order need smaller boxes for the same bound.
        room = _ROOM * abs(bound - reached) if math.isfinite(reached) else 0.0
        beyond = sign * bound + max(room, _OUTWARDS * abs(bound))
        most = math.inf if claim.limit is None else sign * claim.limit
        bound = sign * max(min(beyond, most), sign * bound)
        self.programs.setdefault(key, ProofClaim(*key, "boxes", bound, tree=tree.tree(with_open=True)))

    def _keep(self, claim: Claim, nlp: Nlp, bound: float, tree: bytes) -> None:
        """Keep the best bound of a program; of two programs of one name the first, as the check has it."""
        found = ProofClaim(claim.name, claim.sense.value, "program", bound, fingerprint(nlp), tree)
        before = self.programs.setdefault((found.name, found.sense), found)
        if before.graph == found.graph and bound <= (before.bound or 0.0):
            self.programs[found.name, found.sense] = found
