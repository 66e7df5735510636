"""Proof file of a judgement along a path: the claims that the recorded searches prove."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..checker.proof_file import PathPremises, Proof, ProofClaim, ProofError, Unproved
from ..checker.workspace.path_root import PathRoot
from ..checker.workspace.statement import case_along_path, expected_along_path, robot_along_path
from ..statement.claims import Claim, ClaimKind
from .path_closing import closed_form_along
from .proof_writer import NO_LENGTHS, NOT_JUDGED, bound_on_record, words_of, write_each
from .verdict import Outcome

if TYPE_CHECKING:
    from ...case.case import Case
    from .judgement import Judgement
    from .proof_record import Key, ProofRecord

#: Reasons for claims without a proof: claims of this kind have no proof record, or the singular pose is only computed.
_NO_RECORD = "proof files do not support claims of this kind along a tool path"
_COMPUTED = "the pose was only computed in floating point, so it is not proved"


def path_proof_of(case: Case, judged: Judgement, record: ProofRecord, text: str, premises: PathPremises) -> Proof:
    """Return the proof of all claims along a path that are proved, or refuted by two points; and the other claims.

    Args:
        case: the case before the judgement, as read from its file.
        judged: the verdicts.
        record: recorder of the searches.
        text: text of the case file.
        premises: premises about the path.
    """
    premises = replace(premises, with_angles=closed_form_along(case, judged.path).has_angles)
    own, path = case_along_path(case, judged.path), judged.path
    writer = _Writer(judged, record)
    try:
        robot = robot_along_path(own, PathRoot(own, path), with_angles=premises.with_angles)
        expected = expected_along_path(own, robot, is_timed=path.is_timed)
    except ProofError as error:
        every = [*writer.ranks, *writer.numbers]
        return Proof(text, case.name, premises, (), (), tuple(Unproved(*key, str(error)) for key in every))
    unproved = write_each(writer, expected, writer.numbers, _NO_RECORD)
    return Proof(text, case.name, premises, tuple(writer.proved.values()), (), tuple(unproved))


class _Writer:
    """Writer of the proofs of claims along a path.

    Args:
        judged: the verdicts.
        record: recorder of the searches.

    Attributes:
        ranks, numbers: verdicts by label; of two verdicts with the same label, the first one is kept.
        proved: claims with a proof so far, by label.
    """

    def __init__(self, judged: Judgement, record: ProofRecord) -> None:
        self._record = record
        self.ranks = {(each.name, ""): each for each in judged.ranks}
        self.numbers = {(each.name, each.sense.value): each for each in reversed(judged.extremes)}
        self.proved: dict[Key, ProofClaim] = {}

    def proof(self, each: Claim) -> ProofClaim:
        """Return a claim with its proof; the claims on which it depends must have been proved before.

        Raises:
            ProofError: the claim has no proof; the message is the reason.
        """
        if each.kind is ClaimKind.RANK:
            return self._rank(each.name)
        if each.label not in self.numbers:
            raise ProofError(NOT_JUDGED)
        found = self.numbers[each.label]
        if each.kind is ClaimKind.EXPRESSION:
            # A bound counts even if its gap is too wide, because other claims depend on leg lengths.
            is_bounded = found.limit is None and found.outcome is not Outcome.REFUTED
            if found.outcome is not Outcome.PROVED and not is_bounded:
                raise ProofError(words_of(found))
            if each.label not in self._record.programs:
                raise ProofError(words_of(found) if found.reason else _NO_RECORD)
            return self._record.programs[each.label]
        if found.outcome is not Outcome.PROVED:
            raise ProofError(words_of(found))
        if each.kind is ClaimKind.LENGTHS:
            self._need_lengths(found.name.partition(" limb ")[2])
            return ProofClaim(*each.label, "lengths", found.bound)
        if each.name not in self._record.boxes:
            raise ProofError(_NO_RECORD)
        tree = self._record.nodes(self._record.tree(each.name))
        return ProofClaim(*each.label, "boxes", bound_on_record(each, found), tree=tree)

    def _rank(self, name: str) -> ProofClaim:
        """Return the proved claim about the rank of J, or of the constraint wrenches.

        The claim is that the rank is kept everywhere, or that it is lost at some point.
        """
        found = self.ranks.get((name, ""))
        if found is None:
            raise ProofError(NOT_JUDGED)
        if found.sides is not None:
            return ProofClaim(name, "", "singular", sides=tuple(map(tuple, found.sides.tolist())))
        if found.outcome is not Outcome.PROVED:
            computed = f"; {_COMPUTED}" if found.outcome is Outcome.REFUTED else ""
            raise ProofError(f"{words_of(found)}{computed}")
        return ProofClaim(name, "", "regular", tree=self._record.nodes(self._record.tree(name)))

    def _need_lengths(self, leg: str) -> None:
        """Refuse a claim whose leg lengths have no proof.

        Raises:
            ProofError: a length has no proof.
        """
        if any((f"leg_length limb {leg}", sense) not in self.proved for sense in ("min", "max")):
            raise ProofError(NO_LENGTHS)
