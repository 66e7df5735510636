"""Proof file of a judgement: the claims that the records of its searches prove."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

import numpy as np

from ..checker.proof_file import Premises, Proof, ProofClaim, ProofError, Unproved, workspace_numbers
from ..checker.workspace.statement import expected_claims, legs_numbers, robot_claims
from ..statement.claims import ERRORS, REACH, REGULAR, Claim, ClaimKind, one_robot_name
from ..statement.machine import INSIDE, legs_of, workspace_of_case
from ..statement.tolerance import second_order_name
from .judgement import Judgement
from .proof_record import Key, ProofRecord
from .robot.pose_box import PoseNumbers, pose_box
from .verdict import Outcome, Verdict

#: Part by which the bound of an error of first order is moved outwards, so that boxes at the worst pose have room.
_OUTWARDS = 1e-6
#: The same of a number of an actuator, in parts of the gap: forms of first order need smaller boxes for the same bound.
_ROOM = 0.25
#: Reason of claims about machines within a tolerance that are not known.
_AS_BUILT = "the robot cannot be assembled with errors of its joint centres"
#: Reason of numbers of machines whose coordinates follow from others, or that have kinks.
_BY_BOXES = "it is proved by a search of boxes for all machines together, which has no proof on paper"
#: Reason of claims of kinds that the checker does not know.
_NO_RULES = "claims of this kind have no proof on paper"
NOT_JUDGED = "it was not judged"
_NO_BOUND = "its search has no bound"
_ONE_ASSEMBLY = "it is proved in home's assembly of the joints, and proofs on paper are about all assemblies"
_NO_REACH = "the reach of limbs that it needs has no proof"
NO_LENGTHS = "the lengths of legs that it needs have no proof"


def proof_of(
    judged: Judgement, record: ProofRecord, text: str, *, quantities: Sequence[str] = (), leg_error: float = 0.0
) -> Proof:
    """Return the proof of what is proved, or refuted by two poses, and the claims that have none.

    Args:
        judged: the verdicts.
        record: record of their searches.
        text: the case file's text.
        quantities: measures that were asked for.
        leg_error: largest error of a leg's length.
    """
    writer = _Writer(judged, record)
    expected = expected_claims(judged.case, writer.robot, quantities, leg_error)
    unproved = write_each(writer, expected, writer.extremes, _NO_RULES)
    # The whole errors follow from those of first order together, and from the lengths of legs.
    missing = [each for each in ERRORS if each.label not in writer.proved]
    for other in ERRORS if len(missing) == 1 else ():
        if writer.proved.pop(other.label, None):
            unproved.append(Unproved(*other.label, f"the {missing[0].name} has no proof"))
    premises = Premises(
        workspace=workspace_numbers(workspace_of_case(judged.case)),
        legs=legs_numbers(legs_of(judged.case)),
        quantities=tuple(quantities),
        leg_error=leg_error,
        joint_centre=judged.case.joint_centre_tolerance or 0.0,
    )
    claims, lemmas = tuple(writer.proved.values()), tuple(writer.lemmas())
    return Proof(text, judged.case.name, premises, claims, lemmas, tuple(unproved))


class ClaimWriter(Protocol):
    """Writer of the proofs of claims.

    Attributes:
        proved: the claims so far, by label.
    """

    proved: dict[Key, ProofClaim]

    def proof(self, each: Claim) -> ProofClaim:
        """Return a claim with its proof.

        Raises:
            ProofError: it has none, with the reason.
        """


def write_each(writer: ClaimWriter, expected: Sequence[Claim], judged: Iterable[Key], no_rules: str) -> list[Unproved]:
    """Write the claims with a proof, and return those without one.

    Args:
        writer: writer of the claims.
        expected: claims that the checker knows.
        judged: labels of the numbers that were judged.
        no_rules: reason for those that the checker does not know.
    """
    unproved = []
    for each in expected:
        try:
            writer.proved[each.label] = writer.proof(each)
        except ProofError as error:
            unproved.append(Unproved(*each.label, str(error)))
    known = {each.label for each in expected}
    return unproved + [Unproved(*key, no_rules) for key in judged if key not in known]


class _Writer:
    """Writer of the proofs of claims.

    Args:
        judged: the verdicts.
        record: record of their searches.

    Attributes:
        robot: the robot as the check has it, with the symbols in which its numbers were bounded.
        extremes: the verdicts on numbers; of two of one name the first.
        proved: the claims so far.
    """

    def __init__(self, judged: Judgement, record: ProofRecord) -> None:
        self._case, self._judged, self._record = judged.case, judged, record
        self._reaches = [each for each in judged.extremes if each.key == REACH]
        reached = {each.name for each in self._reaches if each.outcome is Outcome.PROVED}
        self.robot = robot_claims(judged.case, judged.workspace, reached)
        self.extremes = {(each.name, each.sense.value): each for each in reversed(judged.extremes)}
        self.proved: dict[Key, ProofClaim] = {}

    def proof(self, each: Claim) -> ProofClaim:
        """Return a claim with its proof; one that rests on others comes after them.

        Raises:
            ProofError: it has none, with the reason.
        """
        if self._case.joint_centre_tolerance and self.robot.within_tolerance is None:
            raise ProofError(_AS_BUILT)
        if each.kind is ClaimKind.RANK:
            return self._rank(each.name)
        if each.label not in self.extremes:
            raise ProofError(NOT_JUDGED)
        found = self.extremes[each.label]
        if found.outcome is not Outcome.PROVED:
            raise ProofError(words_of(found))
        if each.kind is ClaimKind.EXPRESSION:
            return self._program(found)
        if each.kind is ClaimKind.LENGTHS:
            return self._of_lengths(found)
        return self._boxes(each, found)

    def _rank(self, name: str) -> ProofClaim:
        """Return the claim that J, or the constraint wrenches, keep their rank, or the opposite."""
        found = self._judged.regularity if name == REGULAR else self._judged.constraints
        if found is None:
            raise ProofError(NOT_JUDGED)
        if found.outcome is Outcome.REFUTED and found.pose is not None:
            return self._singular(name, found, found.pose)
        if found.outcome is not Outcome.PROVED:
            raise ProofError(words_of(found))
        return ProofClaim(name, "", "regular", tree=self._record.tree(name).tree(with_open=True))

    def _singular(self, name: str, found: Verdict, pose: PoseNumbers) -> ProofClaim:
        """Return the opposite of a claim about a rank, which is refuted at a pose."""
        if found.sides is not None:
            return ProofClaim(name, "", "singular", sides=tuple(map(tuple, found.sides.tolist())))
        robots = self.robot.within_tolerance
        if robots is None or found.reason:
            raise ProofError(f"{words_of(found)}; a computed pose has no proof")
        # The determinant has the other sign for the largest errors in these directions too, and is farther from 0.
        if found.errors is None:
            raise ProofError(words_of(found))
        errors = found.errors.vectors.copy()
        errors *= INSIDE * robots.symbols.tolerance / np.linalg.norm(errors, axis=1).max()
        y = pose_box(self._judged.workspace).coordinates(pose)
        sides = [np.concatenate([y, each.ravel()]) for each in (np.zeros_like(errors), errors)]
        return ProofClaim(name, "", "singular", sides=tuple(tuple(side.tolist()) for side in sides))

    def _program(self, found: Verdict) -> ProofClaim:
        """Return a claim with a tree of the search of ``certify``."""
        # The search needs the reach of all limbs for the closed forms, and so do the claims on paper.
        is_reached = all(each.outcome is Outcome.PROVED for each in self._reaches) and not self.robot.dependent
        if found.key != REACH and is_reached and any((each.name, "min") not in self.proved for each in self._reaches):
            raise ProofError(_NO_REACH)
        program = self._record.programs.get((found.name, found.sense.value))
        if program is None:
            raise ProofError(_BY_BOXES if self._case.joint_centre_tolerance else _ONE_ASSEMBLY)
        return program

    def _of_lengths(self, found: Verdict) -> ProofClaim:
        """Return a claim about a telescoping leg, from its lengths or from those of one machine."""
        directions = self._record.directions.get(one_robot_name(found.name))
        if directions is None and self._case.model.unknowns:
            raise ProofError(_ONE_ASSEMBLY)
        if directions is None:
            self._need_lengths([found.name.partition(" limb ")[2]], ("min", "max"))
            return ProofClaim(found.name, found.sense.value, "lengths", found.bound)
        if any((one_robot_name(found.name), sense) not in self._record.programs for sense in ("min", "max")):
            raise ProofError(_BY_BOXES)
        sides = tuple(directions.base.tolist()), tuple(directions.platform.tolist())
        return ProofClaim(found.name, found.sense.value, "one machine", found.bound, sides=sides)

    def _boxes(self, each: Claim, found: Verdict) -> ProofClaim:
        """Return a claim with a tree of a search of its own."""
        if each.name not in self._record.boxes:
            raise ProofError(_ONE_ASSEMBLY)
        record = self._record.tree(each.name)
        of_legs = self._case.joint_centre_tolerance and each.kind is ClaimKind.SPECTRUM
        if each.kind is ClaimKind.ERROR or of_legs:
            self._need_lengths([leg.name for leg in self._case.model.legs], ("min",))
        if each.kind is ClaimKind.ERROR:
            bound = self._record.firsts[each.name] * (1 + _OUTWARDS)
        else:
            bound = bound_on_record(each, found)
        return ProofClaim(*each.label, "boxes", bound, tree=record.tree(with_open=True))

    def _need_lengths(self, legs: Sequence[str], senses: Sequence[str]) -> None:
        """Refuse a claim where the shortest, or longest, lengths of legs that it rests on have no proof.

        Raises:
            ProofError: they have none.
        """
        if any((f"leg_length limb {leg}", sense) not in self.proved for leg in legs for sense in senses):
            raise ProofError(NO_LENGTHS)

    def lemmas(self) -> Iterator[ProofClaim]:
        """Yield the claims that those about every machine rest on."""
        robots = dict.fromkeys(name for (name, _), each in self.proved.items() if each.reason == "one machine")
        lengths = [(one_robot_name(name), sense) for name in robots for sense in ("min", "max")]
        yield from (self._record.programs[key] for key in lengths if key in self._record.programs)
        for name, sense in [key for key, each in self.proved.items() if each.reason == "program"] + lengths:
            rest = self._record.rests.get((second_order_name(name), sense))
            if rest is not None:
                yield ProofClaim(second_order_name(name), sense, "second order", rest)


def bound_on_record(claim: Claim, found: Verdict) -> float:
    """Return the bound that a proof of a number that is no single expression states.

    A proof of the limit is enough: the bound reached is often just beyond it, and takes longer to check. Of a number of
    an actuator the bound says which motor is needed.

    Raises:
        ProofError: there is none.
    """
    sign, is_motor = found.sense.sign, claim.kind is ClaimKind.MOTOR
    room = _ROOM * abs(found.bound - found.reached) if is_motor else 0.0
    beyond = sign * found.bound + _OUTWARDS * abs(found.bound) + room
    limit = math.inf if claim.limit is None else sign * claim.limit
    bound = sign * max(min(beyond, limit) if is_motor or claim.limit is None else limit, sign * found.bound)
    if not math.isfinite(bound) or not (is_motor or claim.limit is not None or bound > 0):
        raise ProofError(_NO_BOUND)
    return bound


def words_of(found: Verdict) -> str:
    """Return an outcome and its reason."""
    return f"{found.outcome.value}: {found.reason}" if found.reason else found.outcome.value
