"""Check of a proof about a workspace or a path, without trust in its author.

Everything is built again from the case: the box of poses, the robot, the expressions of quantities, and the expected
claims. Poses of a path come from its file. Trees of ``certify`` are checked by its checker. Every leaf of the other
trees is proved again with affine forms (:mod:`.forms`), and signs of determinants with fractions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from casadi import SX

from .....models import Dimension, rate_relations
from ....case.case import Case
from ....case.limits.constraint import LENGTH
from ....case.motors import Motor
from ....case.task import Sense
from ....case.workspace import Workspace
from ....errors import InputError, UncoveredError
from ....path.path import ProgrammedPath
from ....program.layout import Layout
from ...statement.claims import ERRORS, REACH, Claim, ClaimKind
from ...statement.fixed_robot import Legs, check_leg_error, legs_of, workspace_of_case
from ...statement.motors import actuator_coordinates, in_path_motion
from ...statement.posed_layout import extreme_program
from ...statement.tolerance import Directions, length_of_one_robot, second_order_name
from ..check import check_proof
from ..proof_file import PathPremises, Premises, Proof, ProofClaim, ProofError
from ..tree import Node
from .loop_claims import PosedLoops, posed_loops
from .motion_matrix import PosedRobot, Root
from .motor_claims import MotorClaims
from .number_claims import (
    ClearanceClaim,
    ErrorClaim,
    NumberClaim,
    SecondOrderClaim,
    SingularClaim,
    change_of_jacobian,
    whole_errors,
)
from .path_root import PathRoot
from .pose_boxes import BoxClaim, pose_root
from .ranks import rank_claim
from .statement import (
    RobotClaims,
    RobotsWithinTolerance,
    case_along_path,
    expected_along_path,
    expected_claims,
    leg_error_of,
    refuse_other_lemmas,
    refuse_other_premises,
    refuse_other_robot,
    robot_along_path,
    robot_claims,
)

#: Relative amount by which a root, or a sum of two lengths, is moved outwards: more than the rounding error.
_ROUNDING = 1e-15
#: Fraction of a limit by which a bound may exceed the limit and still count as equal, because of rounding in the
#: search.
ON_LIMIT = 1e-9
#: Names of the pose errors; a proof states bounds of their first-order parts.
_FIRSTS = tuple(each.name for each in ERRORS)
#: Reasons of claims about a path.
_ALONG_PATH = ("regular", "singular", "boxes", "lengths")
#: Beginning of the message for a kind of proof that does not fit a claim.
_WRONG_REASON = "a claim of this kind cannot be proved by the reason"
#: A tree with a single leaf.
WHOLE = bytes([Node.BOUNDED])
#: Message about a proof with displaced joint centres of a claim about the nominal robot.
_WITHOUT_TOLERANCE = "the proof is for robots within a joint-centre tolerance, but the case has no tolerance"


@dataclass(frozen=True)
class CheckedClaim:
    """Claim that the checker accepted.

    Attributes:
        name, sense: name and sense of the claim.
        bound: proven bound of the quantity as shown in results, radians for angles; None without a quantity.
        limit: limit of the case that the quantity satisfies, in the unit of ``bound``; None without a limit.
        is_refuted: whether the opposite of a rank claim is proved: there is a singular pose.
        by_machine: whether the singular pose belongs to another robot within the tolerance, not to the nominal robot.
        dimension: length, angle, or another dimension of the quantity.
    """

    name: str
    sense: str
    dimension: Dimension = Dimension.NUMBER
    bound: float | None = None
    limit: float | None = None
    is_refuted: bool = False
    is_within_tolerance: bool = False


@dataclass(frozen=True)
class VerifiedWorkspace:
    """Result of the check of a valid proof of a workspace or a path.

    Attributes:
        claims: proved claims.
        numbers_at: assembly modes that claims about quantities cover. Claims about ranks, and about actuators under
            loads, cover the home assembly mode. Empty for a robot without loops.
        workspace: workspace of the proof, or a box about its path, with the dependent coordinates of the robot.
        leaves: number of claims about boxes.
        pieces: number of boxes evaluated for their proof.
    """

    claims: tuple[CheckedClaim, ...]
    numbers_at: str
    workspace: Workspace
    leaves: int
    pieces: int


def check_workspace_proof(proof: Proof, case: Case, *, leg_error: float = 0.0) -> VerifiedWorkspace:
    """Check a proof of a workspace, by proving each of its claims again.

    Args:
        proof: the proof.
        case: case of the proof.
        leg_error: largest error of a leg's length, length.

    Raises:
        ProofError: the proof is for another case, or a claim could not be proved; the message names the claim.
        CaseError: the case has no workspace, or a free dimension.
        InputError: the leg error is negative, or the robot does not have six straight legs.
    """
    check_leg_error(case, leg_error)
    return _check(proof, lambda: WorkspaceChecker(proof, case, leg_error))


def check_path_proof(proof: Proof, case: Case, path: ProgrammedPath) -> VerifiedWorkspace:
    """Check a proof of a path, by proving each of its claims again.

    Args:
        proof: proof whose path premises were compared with the path, see :func:`.path_premises.check_path_premises`.
        case: case of the proof.
        path: the path.

    Raises:
        ProofError: the proof is for another case, or a claim could not be proved; the message names the claim.
        CaseError: a dimension of the case is free, or limits need a motion that neither case nor path states.
        InputError: the path has no motion.
    """
    return _check(proof, lambda: _PathChecker(proof, case, path))


def _check(proof: Proof, begun: Callable[[], WorkspaceChecker]) -> VerifiedWorkspace:
    """Check all claims of a proof, with a checker that ``begun`` creates."""
    if not proof.claims:
        raise ProofError("the proof has no claims")
    checker = begun()
    given = {(each.name, each.sense): each for each in proof.claims}
    expected = {each.label: each for each in checker.expected}
    # Claims that the proof lists as unproved may be more than the expected claims.
    named = [*given, *(key for each in proof.unproved if (key := (each.name, each.sense)) in expected)]
    if sorted(named) != sorted(expected) or len(given) != len(proof.claims):
        wrong = [*(set(expected) - set(named)), *(set(given) - set(expected))]
        name = " ".join(min(wrong)).strip() if wrong else ""
        fault = "lacks the claim" if wrong and min(wrong) in expected else "has the additional claim"
        found = f"the proof {fault} {name}" if wrong else "a claim occurs twice in the proof"
        raise ProofError(f"{found}; a proof must have each claim of its case exactly once")
    refuse_other_lemmas(proof.lemmas, checker.expected)
    claims = []
    for key in (each for each in expected if each in given):
        try:
            claims.append(checker.check(expected[key], given[key]))
        except ProofError as error:
            raise ProofError(f"{' '.join(key).strip()}: {error}") from None
    return VerifiedWorkspace(tuple(claims), checker.robot.numbers_at, checker.workspace, checker.leaves, checker.pieces)


class WorkspaceChecker:
    """Check of claims one after another; later claims use the bounds of earlier claims."""

    def __init__(self, proof: Proof, case: Case, leg_error: float) -> None:
        workspace, premises = workspace_of_case(case), proof.premises
        if not isinstance(premises, Premises):
            raise ProofError("the proof is not about a workspace")
        robot = robot_claims(case, workspace, {each.name for each in proof.claims})
        refuse_other_premises(case, workspace, robot.legs, leg_error, premises)
        self._begin(proof, case, pose_root(workspace), robot, workspace)
        self._eps = leg_error_of(case, leg_error)
        try:
            self.expected: list[Claim] = expected_claims(case, robot, premises.quantities, leg_error)
        except InputError as error:
            raise ProofError(f"the proof names a quantity that the case does not have: {error}") from None

    def _begin(self, proof: Proof, case: Case, root: Root, robot: RobotClaims, workspace: Workspace) -> None:
        """Store the case, the box of poses, the robot, and the claims and lemmas of the proof, before any check."""
        self.robot, self.workspace, self._case, self._root = robot, workspace, case, root
        self._tolerance = case.joint_centre_tolerance or 0.0
        self._given = {(each.name, each.sense): each for each in proof.claims}
        self._firsts = {
            each.name: each.bound for each in proof.claims if each.name in _FIRSTS and each.bound is not None
        }
        self._lemmas = {(each.name, each.sense): each for each in proof.lemmas}
        self._bounds: dict[tuple[str, str], float] = {}
        self._shown: set[tuple[str, str]] = set()
        self.leaves = self.pieces = 0

    def check(self, each: Claim, given: ProofClaim) -> CheckedClaim:
        """Check one claim."""
        rules: dict[tuple[ClaimKind, str], Callable[[Claim, ProofClaim], float]] = {
            (ClaimKind.EXPRESSION, "program"): self._number,
            (ClaimKind.EXPRESSION, "boxes"): self._followed,
            (ClaimKind.LENGTHS, "lengths"): self._lengths,
            (ClaimKind.LENGTHS, "one machine"): self._lengths,
            (ClaimKind.ERROR, "boxes"): self._error,
            (ClaimKind.CLEARANCE, "boxes"): self._clearance,
            (ClaimKind.SPECTRUM, "boxes"): self._singular,
            (ClaimKind.MOTOR, "boxes"): self._motor,
        }
        if self._tolerance and self.robot.within_tolerance is None:
            raise ProofError(
                "joint-centre errors remove degrees of freedom from this overconstrained robot: "
                "the tolerance cannot be verified"
            )
        if each.kind is ClaimKind.RANK and given.reason in ("regular", "singular"):
            return self._rank(each, given)
        if (each.kind, given.reason) not in rules:
            raise ProofError(f"{_WRONG_REASON} '{given.reason}'")
        _stated(given)
        bound, limit, read = rules[each.kind, given.reason](each, given), each.limit, each.reading.from_value
        if limit is not None:
            beyond = bound - limit if each.sense is Sense.MAX else limit - bound
            if not beyond <= ON_LIMIT * max(abs(limit), abs(bound)):
                raise ProofError(
                    f"the bound {bound:.10g} of the proof does not satisfy the limit {limit:.10g} of the case"
                )
        self._bounds[each.label] = bound
        kept = None if limit is None else read(limit)
        return CheckedClaim(*each.label, each.reading.dimension, read(bound), kept)

    def _show(self, claim: BoxClaim, tree: bytes) -> None:
        """Prove a claim on every final box (leaf) of a tree."""
        leaves, pieces = self._root.show_on_leaves(claim, tree)
        self.leaves += leaves
        self.pieces += pieces

    def _rank(self, each: Claim, given: ProofClaim) -> CheckedClaim:
        """Check that J, or the constraint wrenches, keep their rank, or that J is singular between two points."""
        is_refuted, robots = given.reason == "singular", self.robot.within_tolerance
        is_within_tolerance = is_refuted and any(len(side) > self._root.coordinates for side in given.sides)
        if is_within_tolerance and robots is None:
            raise ProofError(_WITHOUT_TOLERANCE)
        tolerance = self._tolerance if is_within_tolerance or not is_refuted else 0.0
        # For six straight legs, bounds of the changes of rows prove larger boxes than error coordinates do.
        has_errors = is_within_tolerance or self.robot.legs is None
        built = robots.symbols.built if robots is not None and tolerance and has_errors else None
        claim = rank_claim(self._case, self.robot.model, self._root, each.name, tolerance, built)
        if is_refuted:
            claim.show_sign_change(self._root, given.sides)
        else:
            self._show(claim, given.unpacked())
            claim.finish()
        return CheckedClaim(*each.label, is_refuted=is_refuted, is_within_tolerance=is_within_tolerance)

    def _program(self, expression: SX, sense: Sense, given: ProofClaim, layout: Layout) -> float:
        """Check a tree of boxes in the format of ``certify``; return the bound that it proves.

        Args:
            expression: (1, 1) expression in the symbols of ``layout``.
            sense: whether the tree bounds the largest or the smallest value.
            given: claim of the proof file, with the tree.
            layout: robot over the poses, with the symbols of the expression.
        """
        nlp = extreme_program(layout, expression, sense)
        _stated(given)
        checked = check_proof(given, nlp)
        self.leaves += checked.leaves
        self.pieces += checked.pieces
        return -nlp.sign * checked.bound

    def _number(self, claim: Claim, given: ProofClaim) -> float:
        """Return the proved bound of a quantity, from a tree of boxes in the format of ``certify``.

        With a joint-centre tolerance, the proof has a lemma, too.
        """
        layout = self.robot.place if claim.key == REACH else self.robot.layout
        if self.robot.dependent:
            raise ProofError(
                "the proof has no tree of boxes for this claim; a robot with dependent pose coordinates needs one"
            )
        if self.robot.within_tolerance is None:
            return self._program(claim.expression, claim.sense, given, layout)
        if claim.key != REACH and any(reach.label not in self._bounds for reach in self.robot.reaches):
            raise ProofError(
                "the proof does not show that, in every robot within the tolerance, all limbs reach every pose"
            )
        return self._within_tolerance(self.robot.within_tolerance, claim, given)

    def _followed(self, claim: Claim, given: ProofClaim) -> float:
        """Return the proved bound of a quantity from a tree of boxes in which the checker closes the loops itself."""
        symbols = self.robot.followed
        if symbols is None:
            raise ProofError(f"{_WRONG_REASON} 'boxes'")
        bound, loops = _stated(given), self._loops
        expression = symbols.of(claim.expression, loops.robot.of_errors, loops.robot.varying)
        number = NumberClaim(loops, expression, claim.sense, bound)
        self._show(number, given.unpacked())
        number.finish()
        return bound

    def _within_tolerance(self, robots: RobotsWithinTolerance, claim: Claim, given: ProofClaim) -> float:
        """Return the bound of a quantity over all robots within the tolerance, from a program's tree and a lemma."""
        if not robots.varies(claim):
            return self._program(robots.number(claim, 0.0), claim.sense, given, robots.design)
        lemma = self._lemma(second_order_name(claim.name), claim.sense)
        rest = _stated(lemma)
        bound = self._program(robots.number(claim, rest), claim.sense, given, robots.design)
        try:
            self._show(SecondOrderClaim(robots, claim.expression, rest), WHOLE)
        except UncoveredError as error:
            raise ProofError(f"the checker has no rule for {error.operation}") from None
        except ProofError as error:
            raise ProofError(f"{lemma.name}: {error}") from None
        return bound

    def _lemma(self, name: str, sense: Sense) -> ProofClaim:
        """Return the lemma of the proof with a name and a sense; refuse a proof without this lemma."""
        if (name, sense.value) not in self._lemmas:
            raise ProofError(f"the proof lacks the lemma {name} {sense.value}")
        return self._lemmas[name, sense.value]

    def _length(self, leg: str, sense: Sense) -> float:
        """Return the proven shortest or longest length of a leg, over all robots within the tolerance."""
        key = f"leg_length limb {leg}", sense.value
        if key not in self._bounds:
            raise ProofError(f"the proof has no bound of the leg length of limb {leg}, which this claim needs")
        outwards = _ROUNDING if sense is Sense.MAX else -_ROUNDING
        return math.sqrt(max(self._bounds[key], 0.0)) * (1 + outwards)

    def _of_legs(self) -> tuple[Legs, float]:
        """Return the joint centres of six straight legs, and a lower bound of their lengths within the tolerance."""
        if self.robot.legs is None:
            raise ProofError("this claim needs six straight legs, which the robot of the case does not have")
        return self.robot.legs, min(self._length(leg.name, Sense.MIN) for leg in self._case.model.legs)

    def _lengths(self, each: Claim, given: ProofClaim) -> float:
        """Return the bound of a quantity, such as a stroke, from the proved longest and shortest length of a leg."""
        senses, robots = (Sense.MAX, Sense.MIN), self.robot.within_tolerance
        left, (leg,) = 0.0, each.legs
        if given.reason == "lengths":
            lengths = [self._length(self._case.model.legs[leg].name, sense) for sense in senses]
        else:
            # Leg lengths of one robot at two poses, without the components of the joint-centre errors along c_b and
            # c_p.
            about = [np.array(side, dtype=float) for side in given.sides]
            if robots is None:
                raise ProofError(_WITHOUT_TOLERANCE)
            if len(about) != 2 or any(side.shape != (3,) or not np.isfinite(side).all() for side in about):
                raise ProofError(
                    "the proof must state two directions for this claim, each with three finite components"
                )
            directions = Directions(each.name, *about)
            claims = [length_of_one_robot(robots.symbols, leg, sense, directions) for sense in senses]
            lengths = [self._within_tolerance(robots, one, self._lemma(one.name, one.sense)) for one in claims]
            # These components are the same at both poses, so they count with the sum of the weights.
            left = abs(sum(each.weights)) * self._tolerance * sum(float(np.linalg.norm(side)) for side in about)
        parts = [weight * length for weight, length in zip(each.weights, lengths, strict=True)]
        off = left + 16 * _ROUNDING * (abs(parts[0]) + abs(parts[1]) + left)
        return sum(parts) + (off if each.sense is Sense.MAX else -off)

    def _clearance(self, each: Claim, given: ProofClaim) -> float:
        """Return the bound of a distance between two legs.

        Joint-centre errors reduce a distance by at most twice the tolerance.
        """
        bound, nearer = _stated(given), 2 * self._tolerance
        least = bound + nearer + _ROUNDING * (abs(bound) + nearer) if nearer else bound
        self._show(ClearanceClaim(self._posed, each.legs, least), given.unpacked())
        return bound

    def _singular(self, each: Claim, given: ProofClaim) -> float:
        """Check the bound of the smallest singular value of J, or of its condition number; return the bound."""
        bound, change = _stated(given), 0.0
        if self._tolerance:
            legs, shortest = self._of_legs()
            change = change_of_jacobian(legs, self._tolerance, each.length, shortest)
        is_condition = each.sense is Sense.MAX
        self._show(
            SingularClaim(self._posed, each.length, bound, is_condition=is_condition, change=change), given.unpacked()
        )
        return bound

    def _error(self, each: Claim, given: ProofClaim) -> float:
        """Return the bound of a pose error; trees prove the first-order parts, and these bound the whole error."""
        if len(self._firsts) < len(_FIRSTS):
            raise ProofError(
                "the proof must have a bound of the position error and of the rotation error, but one is missing"
            )
        position, rotation = (self._firsts[name] for name in _FIRSTS)
        is_rotation = each.reading is not LENGTH
        self._show(ErrorClaim(self._posed, self._firsts[each.name], is_rotation=is_rotation), given.unpacked())
        legs, shortest = self._of_legs()
        # The reach of the nominal robot.
        shortest = (shortest + 2 * self._tolerance) * (1 - _ROUNDING)
        reach = float(np.linalg.norm(legs.platform, axis=1).max()) * (1 + _ROUNDING)
        whole = whole_errors(position, rotation, self._eps * (1 + _ROUNDING), shortest, reach)[is_rotation]
        if not math.isfinite(whole):
            raise ProofError(
                "the leg-length errors are too large: the second-order part of the pose error has no bound"
            )
        return whole

    def _motor(self, each: Claim, given: ProofClaim) -> float:
        """Return the bound of an actuator quantity; quantities with one tree are proved together."""
        if rate_relations(self.robot.model.actuators).shape[0]:
            raise ProofError(
                "the actuator rates of this robot are not independent, because its loops impose equations on them; "
                "forces and speeds cannot be proved for such a robot"
            )
        if each.label not in self._shown:
            # Quantities of an actuator under one load share the tree of one search.
            motors = ((one, one.motor) for one in self.expected if one.label in self._given)
            same = {
                one.label: (motor, one.sense, _stated(self._given[one.label]))
                for one, motor in motors
                if motor and each.motor and motor.whose == each.motor.whose
                if self._given[one.label].has_tree_of(given)
            }
            coordinate = self._coordinate(each.motor)
            claims = MotorClaims(self._case, self._loops, self._root, list(same.values()), coordinate)
            self._show(claims, given.unpacked())
            claims.finish()
            self._shown |= same.keys()
        return _stated(given)

    def _coordinate(self, motor: Motor | None) -> SX | None:  # noqa: ARG002 - of a path with times
        """Return the actuator coordinate whose rate is the claimed speed; None for speeds in any motion of the case."""
        return None

    @cached_property
    def _loops(self) -> PosedLoops:
        """Robots within the tolerance as expressions of the pose, with closed loops and joint-centre errors."""
        robots = self.robot.within_tolerance
        built = None if robots is None else robots.symbols.built
        return posed_loops(self._case, self.robot.model, self._root, self._tolerance, built)

    @cached_property
    def _posed(self) -> PosedRobot:
        """The robot as expressions of the pose."""
        return PosedRobot(self._case, self.robot.model, self._root)


class _PathChecker(WorkspaceChecker):
    """Check of claims along a path."""

    def __init__(self, proof: Proof, case: Case, path: ProgrammedPath) -> None:
        premises = proof.premises
        if not isinstance(premises, PathPremises):
            raise ProofError("the proof is not about a tool path")
        refuse_other_robot(case, legs_of(case), premises)
        case = case_along_path(case, path)
        root = PathRoot(case, path)
        robot = robot_along_path(case, root, with_angles=premises.with_angles)
        self._is_timed = path.is_timed
        self._begin(proof, case, root, robot, root.workspace)
        self.expected = expected_along_path(case, robot, is_timed=path.is_timed)
        if path.is_timed:
            self._case = in_path_motion(case)

    def check(self, each: Claim, given: ProofClaim) -> CheckedClaim:
        """Check one claim; trees of ``certify`` are refused, as their boxes do not cover the whole path."""
        if given.reason not in _ALONG_PATH:
            raise ProofError(f"{_WRONG_REASON} '{given.reason}' along a tool path")
        return super().check(each, given)

    def _coordinate(self, motor: Motor | None) -> SX | None:
        """Return the actuator coordinate whose rate is the claimed speed; None for speeds in any motion of the case."""
        symbols = self.robot.followed
        if motor is None or symbols is None or not self._is_timed:
            return None
        known, robot = actuator_coordinates(symbols.layout), self._loops.robot
        if motor.actuator not in known:
            fault = f"the checker knows no formula for the coordinate of actuator {motor.actuator}"
            raise ProofError(f"{fault}, so the speed of this actuator cannot be checked")
        return symbols.of(known[motor.actuator], robot.of_errors, robot.varying)


def _stated(given: ProofClaim) -> float:
    """Return the bound of a claim, or refuse a claim without a bound."""
    if given.bound is None or not math.isfinite(given.bound):
        raise ProofError("the proof states no finite bound for this claim")
    return given.bound
