"""Check of a proof of a workspace, without trust in who made it.

Everything is built again from the case: the box of poses, the robot, the expressions of numbers, and the claims that
there must be. Trees of ``certify`` are checked by its checker. Every leaf of the other trees is shown again with affine
forms (:mod:`.forms`), and signs of determinants with fractions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from casadi import SX

from .....models import Dimension
from ....case.case import Case
from ....case.task import Sense
from ....errors import InputError, UncoveredError
from ....program.layout import Layout
from ...statement.claims import REACH, Claim
from ...statement.machine import Legs, check_leg_error, workspace_of_case
from ...statement.posed_layout import extreme_program
from ...statement.tolerance import Directions, length_of_one_machine, second_order_name
from ..check import check_proof
from ..proof_file import Proof, ProofClaim, ProofError, Statement, Unproved, WorkspaceProof
from ..tree import Node
from .leg_claims import ClearanceClaim, ErrorClaim, SingularClaim, whole_errors
from .motion_matrix import PosedRobot, posed_robot
from .pose_boxes import COORDINATES, BoxClaim, pose_root, show_on_leaves
from .ranks import rank_claim
from .statement import ERRORS, ExpectedClaim, expected_claims, hold_premises, leg_error_of, robot_claims
from .tolerance import Machines, change_of_jacobian, refuse_unless_singular

#: Part of itself by which a root, or a sum of two lengths, is moved outwards: more than its rounding.
_ROUNDING = 1e-15
#: The tree of one leaf.
_WHOLE = bytes([Node.BOUNDED])


@dataclass(frozen=True)
class CheckedClaim:
    """A claim that holds.

    Attributes:
        name, sense: of the claim.
        bound: proven bound of the number as it reads in results, radians for angles; None without a number.
        limit: limit of the case that it keeps, read in the same way; None without one.
        is_refuted: whether the opposite is shown: a singular pose.
        by_machine: whether that is a pose of another machine within the tolerance.
        dimension: of the number.
    """

    name: str
    sense: str
    dimension: Dimension = Dimension.NUMBER
    bound: float | None = None
    limit: float | None = None
    is_refuted: bool = False
    by_machine: bool = False


@dataclass(frozen=True)
class VerifiedWorkspace:
    """A proof that holds.

    Attributes:
        claims: what it proves.
        unproved: claims of the case that it does not prove, with the reasons that the file gives.
        numbers_at: assemblies that the claims about numbers cover; empty for a robot without loops.
        leaves: number of claims about boxes in it.
        pieces: number of boxes that were evaluated to show them.
    """

    claims: tuple[CheckedClaim, ...]
    unproved: tuple[Unproved, ...]
    numbers_at: str
    leaves: int
    pieces: int


def check_workspace_proof(proof: WorkspaceProof, case: Case, *, leg_error: float = 0.0) -> VerifiedWorkspace:
    """Check a proof of a workspace, by showing each of its claims again.

    Args:
        proof: the proof.
        case: the case that it is about.
        leg_error: largest error of a leg's length, length.

    Raises:
        ProofError: the proof is for another case, or a claim could not be shown; the message names the claim.
        CaseError: the case has no workspace, or a free dimension.
        InputError: the error of legs is negative, or the robot is not six straight legs.
    """
    if not proof.claims:
        raise ProofError("the proof claims nothing")
    check_leg_error(case, leg_error)
    checker = _Checker(proof, case, leg_error)
    given = {(each.name, each.sense): each for each in proof.claims}
    expected = {each.key: each for each in checker.expected}
    # What a proof does not claim may be more than the claims that have proofs at all.
    named = [*given, *(key for each in proof.unproved if (key := (each.name, each.sense)) in expected)]
    if sorted(named) != sorted(expected) or len(given) != len(proof.claims):
        wrong = [*(set(expected) - set(named)), *(set(given) - set(expected))]
        name = " ".join(min(wrong)).strip() if wrong else "one of them"
        raise ProofError(f"the claims are not those of the case, each once: see {name}")
    claims = []
    for key in (each for each in expected if each in given):
        try:
            claims.append(checker.check(expected[key], given[key]))
        except ProofError as error:
            raise ProofError(f"{' '.join(key).strip()}: {error}") from None
    return VerifiedWorkspace(tuple(claims), proof.unproved, checker.numbers_at, checker.leaves, checker.pieces)


class _Checker:
    """A check of claims one after the other; later ones use the bounds of earlier ones.

    Args:
        proof: the proof.
        case: the case.
        leg_error: largest error of a leg's length, length.

    Raises:
        ProofError: the proof is for another workspace, other joint centres or other errors.
    """

    def __init__(self, proof: WorkspaceProof, case: Case, leg_error: float) -> None:
        workspace = workspace_of_case(case)
        robot = robot_claims(case, workspace, {each.name for each in proof.claims})
        hold_premises(case, workspace, robot.legs, leg_error, proof)
        self._tolerance = case.joint_centre_tolerance or 0.0
        self._case, self._proof, self._legs = case, proof, robot.legs
        self._layout, self._model, self._root = robot.layout, robot.model, pose_root(workspace)
        self._eps, self.numbers_at = leg_error_of(case, leg_error), robot.numbers_at
        self._bounds: dict[tuple[str, str], float] = {}
        self.leaves = self.pieces = 0
        try:
            self.expected = expected_claims(case, robot, proof.quantities, leg_error)
        except InputError as error:
            raise ProofError(f"the proof names a measure that the case does not have: {error}") from None
        self._machines = robot.machines
        self._lemmas = {(each.name, each.sense): each for each in proof.lemmas}

    def check(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check one claim.

        Raises:
            ProofError: it could not be shown.
        """
        rules = {
            ("regular", "regular"): self._check_rank,
            ("regular", "singular"): self._check_sides,
            ("regular", "singular machine"): self._check_machine,
            ("constraints", "regular"): self._check_rank,
            ("number", "program"): self._check_program,
            ("stroke", "lengths"): self._check_stroke,
            ("stroke", "one machine"): self._check_stroke,
            ("dead length", "lengths"): self._check_stroke,
            ("dead length", "one machine"): self._check_stroke,
            ("error", "boxes"): self._check_error,
            ("clearance", "boxes"): self._check_clearance,
            ("singular value", "boxes"): self._check_singular,
            ("condition", "boxes"): self._check_singular,
        }
        if (each.kind, given.reason) not in rules:
            raise ProofError(f"'{given.reason}' is no reason of this claim")
        if self._tolerance and self._machines is None:
            raise ProofError("errors of joint centres take freedoms from this robot")
        if each.kind not in ("regular", "constraints") and (given.bound is None or not math.isfinite(given.bound)):
            raise ProofError("the claim has no bound")
        return rules[each.kind, given.reason](each, given)

    @cached_property
    def _robot(self) -> PosedRobot:
        """The robot as expressions of the pose."""
        return posed_robot(self._case, self._model, self._root)

    @property
    def _joints(self) -> Legs:
        """Joint centres of the case's legs.

        Raises:
            ProofError: the robot is not six straight legs.
        """
        if self._legs is None:
            raise ProofError("the case's robot is not six straight legs")
        return self._legs

    def _show(self, claim: BoxClaim, tree: bytes) -> None:
        """Show a claim on every leaf of a tree."""
        leaves, pieces = show_on_leaves(claim, self._root, tree)
        self.leaves += leaves
        self.pieces += pieces

    def _check_rank(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check that J, or the constraint wrenches, keep their rank."""
        built = None if self._machines is None or self._legs is not None else self._machines.symbols.built
        claim = rank_claim(self._case, self._model, self._root, each.name, self._tolerance, built)
        self._show(claim, given.tree)
        claim.finish()
        return CheckedClaim(each.name, each.sense)

    def _check_sides(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check that two poses of the workspace have determinants of opposite signs."""
        sides = [np.array(side, dtype=float) for side in given.sides]
        if len(sides) != 2 or any(side.shape != (COORDINATES,) or not np.isfinite(side).all() for side in sides):
            raise ProofError("the claim has no two poses")
        if not all(self._root.holds(side) for side in sides):
            raise ProofError("a pose is not one of the workspace")
        rank_claim(self._case, self._model, self._root, each.name).show_sign_change(self._root, *sides)
        return CheckedClaim(each.name, each.sense, is_refuted=True)

    def _check_machine(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check that a machine within the tolerance is singular at a pose of the workspace."""
        if not self._tolerance:
            raise ProofError("the claim is about the exact machine")
        refuse_unless_singular(self._root, self._joints, given.sides)
        return CheckedClaim(each.name, each.sense, is_refuted=True, by_machine=True)

    def _bound_of(self, expression: SX, sense: Sense, given: ProofClaim, layout: Layout | None = None) -> float:
        """Return the bound of an expression that a tree of ``certify`` proves, in a layout or that of the case."""
        if given.reason != "program" or given.bound is None or not math.isfinite(given.bound):
            raise ProofError("the claim has no bound")
        nlp = extreme_program(layout or self._layout, expression, sense)
        checked = check_proof(Proof("", given.name, Statement(), given.graph, given.bound, given.tree), nlp)
        self.leaves += checked.leaves
        self.pieces += checked.pieces
        return -nlp.sign * checked.bound

    def _check_program(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check a tree of ``certify`` for a number."""
        claim = each.claim
        if claim is None:
            raise ProofError("the claim has no number")
        if self._machines is None:
            bound = self._bound_of(claim.expression, claim.sense, given, each.layout or self._layout)
        else:
            bound = self._bound_of_machines(self._machines, claim, given)
        each.keep_limit(bound)
        self._bounds[each.key] = bound
        read = claim.reading.from_value
        limit = None if claim.limit is None else read(claim.limit)
        return CheckedClaim(each.name, each.sense, claim.reading.dimension, read(bound), limit)

    def _bound_of_machines(self, machines: Machines, claim: Claim, given: ProofClaim) -> float:
        """Return the bound of a number over all machines that a tree of ``certify``, and a lemma, prove.

        Raises:
            ProofError: the lemma is missing, one of them could not be shown, or a limb has no proof of its reach.
        """
        reaches = [each for each in self.expected if each.claim is not None and each.claim.key == REACH]
        if claim.key != REACH and any(each.key not in self._bounds for each in reaches):
            raise ProofError("the reach of limbs of every machine has no proof")
        if not machines.varies(claim):
            return self._bound_of(machines.number(claim, 0.0), claim.sense, given, machines.design)
        lemma = self._lemmas.get((second_order_name(claim.name), claim.sense.value))
        if lemma is None or lemma.bound is None or not math.isfinite(lemma.bound):
            raise ProofError("the terms of second order have no bound")
        bound = self._bound_of(machines.number(claim, lemma.bound), claim.sense, given, machines.design)
        try:
            self._show(machines.second_order(claim, lemma.bound), _WHOLE)
        except UncoveredError as error:
            raise ProofError(f"the check has no rule for {error}") from None
        except ProofError as error:
            raise ProofError(f"{lemma.name}: {error}") from None
        return bound

    def _length(self, leg: str, sense: str) -> float:
        """Return the proven shortest or longest length of a leg, of all machines that are meant.

        Raises:
            ProofError: there is no proof of it.
        """
        key = f"leg_length limb {leg}", sense
        if key not in self._bounds:
            raise ProofError(f"the lengths of limb {leg} have no proof")
        outwards = _ROUNDING if sense == Sense.MAX.value else -_ROUNDING
        return math.sqrt(max(self._bounds[key], 0.0)) * (1 + outwards)

    def _shortest(self) -> float:
        """Return a length than which no leg of the machines that are meant is shorter.

        Raises:
            ProofError: there is no proof of it.
        """
        return min(self._length(leg.name, "min") for leg in self._case.model.legs)

    def _check_stroke(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check a limit on a telescoping leg from the lengths of the leg."""
        leg, is_stroke = each.legs[0], each.kind == "stroke"
        if given.reason == "one machine":
            weights = {Sense.MAX: 1.0, Sense.MIN: -1.0} if is_stroke else {Sense.MAX: -1.0, Sense.MIN: 2.0}
            bound = self._lengths_of_one_machine(each, leg, weights, given)
        else:
            name = self._case.model.legs[leg].name
            short, long = self._length(name, "min"), self._length(name, "max")
            off = 8 * _ROUNDING * long
            bound = long - short + off if is_stroke else 2 * short - long - off
        return self._limited(each, Dimension.LENGTH, bound)

    def _lengths_of_one_machine(
        self, each: ExpectedClaim, leg: int, weights: Mapping[Sense, float], given: ProofClaim
    ) -> float:
        """Return the bound of a number made from the lengths of a leg at two poses, whose errors are the same.

        Args:
            each: the claim.
            leg: index of the leg.
            weights: of the longest and of the shortest length.
            given: the claim with the directions c_b and c_p.

        Raises:
            ProofError: the directions or the lengths are missing, or a length could not be shown.
        """
        if self._machines is None:
            raise ProofError("the claim is about the exact machine")
        sides = [np.array(side, dtype=float) for side in given.sides]
        if len(sides) != 2 or any(side.shape != (3,) or not np.isfinite(side).all() for side in sides):
            raise ProofError("the claim has no two directions")
        parts = []
        for sense, weight in weights.items():
            claim = length_of_one_machine(self._machines.symbols, leg, sense, Directions(each.name, *sides))
            lemma = self._lemmas.get((claim.name, sense.value))
            if lemma is None:
                raise ProofError("the lengths of the leg of one machine have no proof")
            parts.append(weight * self._bound_of_machines(self._machines, claim, lemma))
        # The part of the errors that is the same at both poses, of as many lengths as are left.
        left = abs(sum(weights.values())) * self._tolerance * sum(float(np.linalg.norm(side)) for side in sides)
        off = left + 16 * _ROUNDING * (abs(parts[0]) + abs(parts[1]) + left)
        return sum(parts) + (off if each.sense == Sense.MAX.value else -off)

    def _check_clearance(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check a distance between two legs, which are nearer by twice the tolerance."""
        bound, nearer = float(given.bound or 0.0), 2 * self._tolerance
        least = bound + nearer + _ROUNDING * (abs(bound) + nearer) if nearer else bound
        self._show(ClearanceClaim(self._robot, (each.legs[0], each.legs[1]), least), given.tree)
        return self._limited(each, Dimension.LENGTH, bound)

    def _check_singular(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check the smallest singular value of J, or its condition number."""
        bound, is_condition = float(given.bound or 0.0), each.kind == "condition"
        change = 0.0
        if self._tolerance:
            change = change_of_jacobian(self._joints, self._tolerance, each.length, self._shortest())
        self._show(SingularClaim(self._robot, each.length, bound, is_condition=is_condition, change=change), given.tree)
        return self._limited(each, Dimension.NUMBER, bound)

    def _limited(self, each: ExpectedClaim, dimension: Dimension, bound: float) -> CheckedClaim:
        """Return a claim whose bound keeps its limit."""
        each.keep_limit(bound)
        return CheckedClaim(each.name, each.sense, dimension, bound, each.limit)

    def _check_error(self, each: ExpectedClaim, given: ProofClaim) -> CheckedClaim:
        """Check an error of the pose: its part of first order by a tree, the whole from both parts and the lengths."""
        firsts = {one.name: one.bound for one in self._proof.claims if one.name in ERRORS}
        position, rotation = (firsts.get(name) for name in ERRORS)
        if position is None or rotation is None:
            raise ProofError("one of the two errors has no proof")
        is_rotation = each.name == ERRORS[1]
        most = rotation if is_rotation else position
        self._show(ErrorClaim(self._robot, most, is_rotation=is_rotation), given.tree)
        # That of the design.
        shortest = (self._shortest() + 2 * self._tolerance) * (1 - _ROUNDING)
        reach = float(np.linalg.norm(self._joints.platform, axis=1).max()) * (1 + _ROUNDING)
        whole = whole_errors(position, rotation, self._eps * (1 + _ROUNDING), shortest, reach)[is_rotation]
        if not math.isfinite(whole):
            raise ProofError("the errors are too large for a bound of their part of second order")
        return CheckedClaim(each.name, each.sense, Dimension.ANGLE if is_rotation else Dimension.LENGTH, whole)
