"""Check of a proof, without trust in who made it.

The boxes of the tree start from the program's own bounds, so that the leaves cover them by construction. Every leaf
and every face is a *claim* about one box, and the check shows each claim again with the polynomials of
:mod:`screwsynth.nlp.proof.checker.polynomials`; it bisects the box where their balls are too large. It uses neither
the arithmetic of the search nor its multipliers. Search and check share the case's expressions, and CasADi's
derivatives of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....models import FloatArray
from ...program.nlp import Nlp
from ..statement.piecewise_derivatives import refuse_jumps
from ..statement.standard_form import StandardForm, standard_form
from .bisection import Shown, show
from .fingerprint import fingerprint, is_same_program
from .limbs.limbpart import ClaimChecker, LimbPartChecker, is_one_square
from .limbs.sharedcheck import check_shared
from .optimum import BoundClaim, InfeasibleClaim, MonotoneClaim, boxes_at_once
from .parts import Claim, read_parts
from .proof_file import Proof, ProofError
from .tree import FACES, Node
from .wrongclaims import Centres

#: Number of claims whose boxes wait at a time.
_CLAIMS = 4096
#: Largest number of pieces of a claim's box.
_MOST_PIECES = 5_000
#: Callback with the number of claims checked, and of those to be checked.
CheckProgress = Callable[[int, int], None]


@dataclass(frozen=True)
class VerifiedProof:
    """A proof that holds.

    Attributes:
        leaves: number of claims in the tree.
        pieces: number of boxes that were evaluated to show them.
        bound: upper bound of the maximised value over the feasible part of the root; -inf without a feasible point.
    """

    leaves: int
    pieces: int
    bound: float


def check_proof(proof: Proof, nlp: Nlp, progress: CheckProgress | None = None) -> VerifiedProof:
    """Check a proof, by showing each of its claims again.

    Args:
        proof: the proof.
        nlp: the program that it is about, built from the case.
        progress: called after each group of claims.

    Raises:
        ProofError: the proof is for another program, its bytes are no tree, or a claim could not be shown.
    """
    if not is_same_program(fingerprint(nlp), proof.graph):
        raise ProofError("the proof is for other expressions or bounds than this case's")
    form = standard_form(nlp)
    bound = -np.inf if proof.bound is None else proof.bound
    if proof.tree[:1] == bytes([Node.SHARED]):
        shared = check_shared(proof.tree, form, bound, progress)
        return VerifiedProof(shared.leaves, shared.pieces, bound)
    parts = read_parts(proof.tree, form, bound)
    leaves, pieces, done = sum(len(part.claims) for part in parts), 0, 0
    for part in parts:
        checker: ClaimChecker = _Checker(part.form, part.bound)
        if part.form is not form or is_one_square(form):
            checker = LimbPartChecker(part.form, part.bound, checker)
        groups: dict[tuple[Node, int], list[Claim]] = {}
        for claim in part.claims:
            groups.setdefault((claim.kind, claim.index), []).append(claim)
        for (kind, index), group in groups.items():
            for start in range(0, len(group), _CLAIMS):
                some = group[start : start + _CLAIMS]
                pieces += checker.show(kind, index, some)
                done += len(some)
                if progress is not None:
                    progress(done, leaves - done)
    return VerifiedProof(leaves, pieces, bound)


class _Checker:
    """A check of claims about boxes of one form.

    Args:
        form: the form.
        bound: the proven bound of the value that is maximised.
    """

    def __init__(self, form: StandardForm, bound: float) -> None:
        self._form, self._bound = form, bound
        self.width, self.block, self.most_pieces = form.upper - form.lower, boxes_at_once(form.n), _MOST_PIECES
        refuse_jumps(form.expressions, form.x)

    def _claim(self, kind: Node, index: int) -> BoundClaim | InfeasibleClaim | MonotoneClaim:
        """Return what shows claims of one kind."""
        if kind == Node.BOUNDED:
            return BoundClaim(self._form, self._bound)
        if kind == Node.INFEASIBLE:
            return InfeasibleClaim(self._form, index)
        return MonotoneClaim(self._form, kind, index)

    def show(self, kind: Node, index: int, claims: list[Claim]) -> int:
        """Show claims of one kind, bisecting boxes until each holds, and return the number of boxes evaluated.

        Raises:
            ProofError: a claim could not be shown.
        """
        if kind in FACES:
            self._check_faces(kind, index, claims)
        lower = np.stack([claim.lower for claim in claims], axis=1)
        upper = np.stack([claim.upper for claim in claims], axis=1)
        self._claims, self._claimed = claims, self._claim(kind, index)
        self._centres = Centres(self._form, self._bound, kind, index)
        return show(self, lower, upper)

    def examine(self, lower: FloatArray, upper: FloatArray, _: NDArray[np.intp]) -> Shown:
        """Examine pieces with ends (n, N)."""
        shown = self._claimed.show(lower, upper)
        shown.is_wrong = self._centres.are_wrong(shown.lower, shown.upper)
        return shown

    def sentence(self, claim: int) -> str:
        """Return the sentence that a claim could not be shown."""
        given = self._claims[claim]
        ends = ", ".join(
            f"{name} in [{x:.6g}, {y:.6g}]"
            for name, x, y in zip(self._form.names, given.lower, given.upper, strict=True)
        )
        return f"the reason '{given.kind.name.lower()} {given.index}' could not be shown for the box {ends}"

    def _check_faces(self, kind: Node, i: int, claims: list[Claim]) -> None:
        """Check that boxes collapse on faces of the root only.

        Raises:
            ProofError: a box collapses on another face.
        """
        for claim in claims:
            end, whole = (claim.upper, self._form.upper) if kind == Node.FACE_UPPER else (claim.lower, self._form.lower)
            if end[i] != whole[i]:
                raise ProofError(f"a box is collapsed on a face of {self._form.names[i]} that is not the case's")
