"""Proof file of a judgement: the claims that the recorded searches prove."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

import numpy as np

from ..checker.proof_file import Premises, Proof, ProofClaim, ProofError, Unproved, set_premise, workspace_premise
from ..checker.workspace.statement import expected_claims, legs_premise, robot_claims
from ..statement.claims import ERRORS, REACH, REGULAR, Claim, ClaimKind, one_robot_name
from ..statement.fixed_robot import INSIDE, legs_of, workspace_of_case
from ..statement.tolerance import second_order_name
from .judgement import Judgement
from .proof_record import Key, ProofRecord
from .robot.pose_box import PoseNumbers, pose_box
from .verdict import Outcome, Verdict

#: Relative outward shift of the bound of a first-order pose error; the check of boxes at the worst pose needs this
#: margin.
_OUTWARDS = 1e-6
#: Outward shift of the bound of an actuator quantity, relative to the gap; first-order forms need this margin on the
#: same boxes.
_ROOM = 0.25
#: Reason for claims about robots within the tolerance if errors cannot be modelled.
_AS_BUILT = "the robot cannot be assembled with joint-centre errors"
#: Reason for quantities of robots within the tolerance with dependent coordinates or kinks.
_BY_BOXES = "proved by one search of boxes for all robots within the tolerance, which proof files do not support"
#: Reason for claims of kinds that the checker does not know.
_NO_RULES = "proof files do not support claims of this kind"
NOT_JUDGED = "no search for this claim was made"
_NO_BOUND = "the search found no bound"
_ONE_ASSEMBLY = "proved for the home assembly mode; proof files support only claims about all assembly modes"
_NO_REACH = "the claim assumes that all limbs reach every pose, which is not proved"
NO_LENGTHS = "the claim needs bounds of leg lengths, which are not proved"


def proof_of(
    judged: Judgement, record: ProofRecord, text: str, *, quantities: Sequence[str] = (), leg_error: float = 0.0
) -> Proof:
    """Return the proof of the claims that are proved, or refuted by two poses; and the other claims with reasons.

    Args:
        judged: the verdicts.
        record: recorder of the searches.
        text: text of the case file.
        quantities: names of the requested quantities.
        leg_error: largest leg-length error, length.
    """
    writer = _Writer(judged, record)
    expected = expected_claims(judged.case, writer.robot, quantities, leg_error)
    unproved = write_each(writer, expected, writer.extremes, _NO_RULES)
    # The full pose errors follow from all first-order errors together, and from the leg lengths.
    missing = [each for each in ERRORS if each.label not in writer.proved]
    for other in ERRORS if len(missing) == 1 else ():
        if writer.proved.pop(other.label, None):
            unproved.append(Unproved(*other.label, f"the {missing[0].name} has no proof"))
    workspace = workspace_of_case(judged.case)
    premises = Premises(
        workspace=workspace_premise(workspace),
        legs=legs_premise(legs_of(judged.case)),
        quantities=tuple(quantities),
        leg_error=leg_error,
        joint_centre=judged.case.joint_centre_tolerance or 0.0,
        position_set=set_premise(workspace),
    )
    claims, lemmas = tuple(writer.proved.values()), tuple(writer.lemmas())
    return Proof(text, judged.case.name, premises, claims, lemmas, tuple(unproved))


class ClaimWriter(Protocol):
    """Interface of classes that build the proofs of claims.

    Attributes:
        proved: claims that have a proof so far, by label.
    """

    proved: dict[Key, ProofClaim]

    def proof(self, each: Claim) -> ProofClaim:
        """Return a claim with its proof.

        Raises:
            ProofError: the claim has no proof; the message is the reason.
        """


def write_each(writer: ClaimWriter, expected: Sequence[Claim], judged: Iterable[Key], no_rules: str) -> list[Unproved]:
    """Write the claims with a proof, and return the claims without a proof.

    Args:
        writer: writer of the claims.
        expected: claims that the checker knows.
        judged: labels of the quantities that were judged.
        no_rules: reason for claims that the checker does not know.
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
    """Builder of one proof for each claim that the recorded searches prove.

    Args:
        judged: the verdicts.
        record: recorder of the searches.

    Attributes:
        robot: the robot as the checker models it, with the symbols of the searches.
        extremes: verdicts on quantities by label; of two verdicts with the same label, the first.
        proved: claims that have a proof so far, by label.
    """

    def __init__(self, judged: Judgement, record: ProofRecord) -> None:
        self._case, self._judged, self._record = judged.case, judged, record
        self._reaches = [each for each in judged.extremes if each.key == REACH]
        reached = {each.name for each in self._reaches if each.outcome is Outcome.PROVED}
        self.robot = robot_claims(judged.case, judged.workspace, reached)
        self.extremes = {(each.name, each.sense.value): each for each in reversed(judged.extremes)}
        self.proved: dict[Key, ProofClaim] = {}

    def proof(self, each: Claim) -> ProofClaim:
        """Return a claim with its proof; the claims on which it depends must have been proved before.

        Raises:
            ProofError: the claim has no proof; the message is the reason.
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
        """Return the proved claim about the rank of J, or of the constraint wrenches.

        The claim is that the rank is kept everywhere, or that it is lost at some pose.
        """
        found = self._judged.regularity if name == REGULAR else self._judged.constraints
        if found is None:
            raise ProofError(NOT_JUDGED)
        if found.outcome is Outcome.REFUTED and found.pose is not None:
            return self._singular(name, found, found.pose)
        if found.outcome is not Outcome.PROVED:
            raise ProofError(words_of(found))
        return ProofClaim(name, "", "regular", tree=self._record.tree(name).tree(with_open=True))

    def _singular(self, name: str, found: Verdict, pose: PoseNumbers) -> ProofClaim:
        """Return the negation of a claim about a rank that is refuted at a pose."""
        if found.sides is not None:
            return ProofClaim(name, "", "singular", sides=tuple(map(tuple, found.sides.tolist())))
        robots = self.robot.within_tolerance
        if robots is None or found.reason:
            raise ProofError(f"{words_of(found)}; the pose was only computed in floating point, so it is not proved")
        # With the largest errors in these directions, the determinant keeps the opposite sign and is farther from 0.
        if found.errors is None:
            raise ProofError(words_of(found))
        errors = found.errors.vectors.copy()
        errors *= INSIDE * robots.symbols.tolerance / np.linalg.norm(errors, axis=1).max()
        y = pose_box(self._judged.workspace).coordinates(pose)
        sides = [np.concatenate([y, each.ravel()]) for each in (np.zeros_like(errors), errors)]
        return ProofClaim(name, "", "singular", sides=tuple(tuple(side.tolist()) for side in sides))

    def _program(self, found: Verdict) -> ProofClaim:
        """Return the proof of a claim by the recorded tree of the search of ``certify``."""
        # Closed forms require the reach of all limbs, in the search and in the proof file.
        is_reached = all(each.outcome is Outcome.PROVED for each in self._reaches) and not self.robot.dependent
        if found.key != REACH and is_reached and any((each.name, "min") not in self.proved for each in self._reaches):
            raise ProofError(_NO_REACH)
        program = self._record.programs.get((found.name, found.sense.value))
        if program is None:
            raise ProofError(_BY_BOXES if self._case.joint_centre_tolerance else _ONE_ASSEMBLY)
        return program

    def _of_lengths(self, found: Verdict) -> ProofClaim:
        """Return a claim about a telescoping leg, from its longest and shortest length.

        The lengths are proved over all robots, or for one robot at two poses.
        """
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
        """Return the proof of a claim by the recorded tree of its search of boxes."""
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
        """Refuse a claim that depends on leg lengths without a proof.

        Raises:
            ProofError: a length has no proof.
        """
        if any((f"leg_length limb {leg}", sense) not in self.proved for leg in legs for sense in senses):
            raise ProofError(NO_LENGTHS)

    def lemmas(self) -> Iterator[ProofClaim]:
        """Yield the lemmas of the claims about every robot within the tolerance."""
        robots = dict.fromkeys(name for (name, _), each in self.proved.items() if each.reason == "one machine")
        lengths = [(one_robot_name(name), sense) for name in robots for sense in ("min", "max")]
        yield from (self._record.programs[key] for key in lengths if key in self._record.programs)
        for name, sense in [key for key, each in self.proved.items() if each.reason == "program"] + lengths:
            rest = self._record.rests.get((second_order_name(name), sense))
            if rest is not None:
                yield ProofClaim(second_order_name(name), sense, "second order", rest)


def bound_on_record(claim: Claim, found: Verdict) -> float:
    """Return the bound that a proof states for a quantity that is not a single expression.

    For a quantity with a limit, the stated bound is the limit, because the bound of the search is often just inside
    the limit and takes longer to check. For an actuator, it is the bound of the search, from which a motor can be
    chosen.

    Raises:
        ProofError: there is no bound.
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
    """Return the outcome of a verdict and its reason as text."""
    return f"{found.outcome.value}: {found.reason}" if found.reason else found.outcome.value
