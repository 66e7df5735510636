"""Recorder of the searches of a judgement: bounds and trees of boxes from which a proof file is written."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ....models import FloatArray
from ...program.nlp import Nlp
from ..boxes.tree import TreeRecord
from ..certificate.certificate import Certificate, CertificateStatus
from ..checker.premises import fingerprint
from ..checker.proof_file import ProofClaim
from ..checker.tree import Node
from ..statement.claims import Claim
from ..statement.tolerance import Directions
from .path_trees import tree_of_path
from .verdict import slack_of

#: Name and sense of a claim.
Key = tuple[str, str]
#: Relative outward shift of the bound of a quantity that is the same at every pose.
_FOLDED = 1e-12
#: Outward shift of the bound of a search of boxes: as a fraction of its gap, and of the bound.
_ROOM, _OUTWARDS = 0.25, 1e-6


@dataclass(eq=False)
class ProofRecord:
    """Bounds and trees of the searches of one judgement, recorded for a proof file.

    Attributes:
        programs: bounds of quantities that the search of ``certify`` proved, with their trees.
        boxes: trees of searches of boxes, by name of the claim.
        firsts: bounds of the first-order pose error for leg-length errors of one unit, by name of the claim.
        rests: for quantities of all robots within the tolerance, bounds of their second-order terms.
        directions: fixed directions of a leg, by the name of the leg lengths of one robot at two poses.
        pieces: (M, 3) first pieces of the searches along a path; None for a box of poses.
    """

    programs: dict[Key, ProofClaim] = field(default_factory=dict)
    boxes: dict[str, TreeRecord] = field(default_factory=dict)
    firsts: dict[str, float] = field(default_factory=dict)
    rests: dict[Key, float] = field(default_factory=dict)
    directions: dict[str, Directions] = field(default_factory=dict)
    pieces: FloatArray | None = None
    _nodes: dict[TreeRecord, bytes] = field(default_factory=dict)

    def nodes(self, tree: TreeRecord) -> bytes:
        """Return the tree of a completed search of boxes as bytes; open boxes are leaves."""
        if tree not in self._nodes:
            pieces = self.pieces
            self._nodes[tree] = tree.tree(with_open=True) if pieces is None else tree_of_path(tree, pieces)
        return self._nodes[tree]

    def tree(self, name: str) -> TreeRecord:
        """Return the recorder for the tree of a claim's search, by the name of the claim."""
        return self.boxes.setdefault(name, TreeRecord())

    def constant(self, claim: Claim, nlp: Nlp, value: float) -> None:
        """Record a quantity that does not depend on the pose."""
        bound = -nlp.sign * value
        self._keep(claim, nlp, bound + _FOLDED * abs(bound), bytes([Node.BOUNDED]))

    def program(self, claim: Claim, found: Certificate, tree: TreeRecord) -> None:
        """Record the search of a quantity if its bound keeps the limit; open boxes are leaves."""
        is_bounded = found.status in (CertificateStatus.PROVED, CertificateStatus.INCOMPLETE)
        sign = claim.sense.sign
        most = math.inf if claim.limit is None else sign * claim.limit + slack_of(claim.limit)
        bound = found.bound_of_tree
        if is_bounded and math.isfinite(bound) and sign * -found.nlp.sign * bound <= most:
            self._keep(claim, found.nlp, bound, tree.tree(with_open=True))

    def followed(self, claim: Claim, bound: float, reached: float, tree: TreeRecord) -> None:
        """Record a search of boxes that follows closed loops: the bound of a quantity, and its best known value."""
        sign, key = claim.sense.sign, (claim.name, claim.sense.value)
        if not math.isfinite(bound):
            return
        # First-order forms need smaller boxes for the same bound.
        room = _ROOM * abs(bound - reached) if math.isfinite(reached) else 0.0
        beyond = sign * bound + max(room, _OUTWARDS * abs(bound))
        most = math.inf if claim.limit is None else sign * claim.limit
        bound = sign * max(min(beyond, most), sign * bound)
        self.programs.setdefault(key, ProofClaim(*key, "boxes", bound, tree=self.nodes(tree)))

    def _keep(self, claim: Claim, nlp: Nlp, bound: float, tree: bytes) -> None:
        """Store the bound and the tree of a claim, if the bound is better than the stored bound of the same program."""
        found = ProofClaim(claim.name, claim.sense.value, "program", bound, fingerprint(nlp), tree)
        before = self.programs.setdefault((found.name, found.sense), found)
        if before.graph == found.graph and bound <= (before.bound or 0.0):
            self.programs[found.name, found.sense] = found
