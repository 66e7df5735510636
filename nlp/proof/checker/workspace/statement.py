"""Claims that a workspace proof must contain, and comparison of a proof with its case."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import SX

from .....models import Model, WrenchKind
from .....models.joints import RobotError
from .....models.joints.model.closedform import closed_form
from ....case.case import Case
from ....case.checks import check_determined_joints
from ....case.limits.legs import LegLength
from ....case.motors import ActuatorQuantity
from ....case.task import Sense
from ....case.workspace import Workspace
from ....errors import InputError
from ....path.path import ProgrammedPath
from ....path.settings import case_along
from ....program.layout import Layout
from ...statement.claims import (
    ACTUATED,
    CONSTRAINTS,
    ERRORS,
    RANKS,
    REGULAR,
    SPECTRAL,
    Claim,
    ClaimKind,
    claims_of,
    dependent_claims,
    length_claims,
    one_robot_name,
    searched_claims,
)
from ...statement.fixed_robot import Legs, check_changing, has_straight_legs, legs_of
from ...statement.motors import in_motion, in_path_motion, motor_claims, speed_claims
from ...statement.posed_layout import closed_layout, posed_layout, reach_claims
from ...statement.tolerance import (
    BuiltModel,
    PoseCoordinates,
    ToleranceLayout,
    built_model,
    design_layout,
    second_order_name,
    tolerance_layout,
)
from ..premises import exact
from ..proof_file import PathPremises, Premises, ProofClaim, ProofError, set_premise, workspace_premise
from .motion_matrix import Root, turned_rotation
from .path_root import PathRoot
from .pose_boxes import pose_root

#: Fraction of the largest coordinate by which joint centres may differ: the last digits depend on the computer.
_SAME = 1e-9


class RobotsWithinTolerance:
    """All robots within a joint-centre tolerance, as the checker models them.

    Let g_j be the derivative of a quantity g with respect to the error of centre j, and H_jk the blocks of the second
    derivatives of g. A robot within the tolerance t differs from the nominal robot in this quantity by at most

        t sum_j |g_j| + t^2 / 2 sum_jk |H_jk|

    at each pose. The first sum is an expression of the pose. The second sum is proved to be at most the bound in the
    proof, over all poses and errors (:class:`~.number_claims.SecondOrderClaim`).

    Attributes:
        model: model of a case with fixed dimensions, without the unknowns in closed form.
        root: box of coordinates.
        symbols: robots within the tolerance as symbols at one pose.

    Raises:
        RobotError: the robot cannot be assembled with joint-centre errors.
    """

    def __init__(self, case: Case, model: Model, root: Root, *, with_angles: bool = True) -> None:
        self._case, self.model, self.root, self._at = case, model, root, coordinates_of(root)
        tolerance = case.joint_centre_tolerance or 0.0
        self.symbols: ToleranceLayout = tolerance_layout(
            case, built_model(case.model, with_angles=with_angles), tolerance, self._at
        )

    @cached_property
    def design(self) -> Layout:
        """Nominal design as expressions of the pose; raises an error for a robot with dependent coordinates."""
        if self.model.unknowns:
            raise ProofError(
                "the proof has no tree of boxes for this claim; a robot with a tolerance and with loops without a "
                "closed form needs one"
            )
        return design_layout(self._case, self.model, self._at)

    def varies(self, claim: Claim) -> bool:
        """Return whether a quantity depends on the joint-centre errors."""
        errors = self.symbols.errors
        return bool(errors.numel()) and any(ca.which_depends(claim.expression, errors, 1, True))

    def number(self, claim: Claim, rest: float) -> SX:
        """Return an expression (1, 1) of the pose that bounds a quantity over all robots within the tolerance.

        ``rest`` bounds the second-order terms.
        """
        errors, pose = self.symbols.errors, self.design.table.variables_vector
        slopes, sign = ca.densify(ca.gradient(claim.expression, errors)), claim.sense.sign
        squares = [ca.sumsqr(slopes[k : k + 3]) for k in range(0, errors.numel(), 3)]
        small = self.symbols.near_zero(claim.expression, self.design).tolist()
        first = sum((ca.sqrt(each + size**2) for each, size in zip(squares, small, strict=True)), SX(0))
        whole = claim.expression + sign * (self.symbols.tolerance * first + rest)
        return self.symbols.of(whole, SX.zeros(errors.numel()), pose)


@dataclass(frozen=True, eq=False)
class RobotClaims:
    """Robot of the claims about a workspace or a path.

    Attributes:
        legs: joint centres of six straight legs; None for another robot.
        layout: case as expressions of the pose, for bounds of quantities. If all limbs reach every pose, unknowns with
            a closed form are replaced.
        place: case as expressions of the pose, for claims about reach.
        model: model without the unknowns that have a closed form, for claims about ranks.
        reaches: claims that limbs reach every pose.
        numbers_at: assembly modes that claims about quantities cover, in words; claims about actuators under loads are
            excepted. Empty for a robot without unknowns.
        within_tolerance: robots within the tolerance, whose symbols replace those of quantities and ``reaches``. None
            for the nominal robot, or if robots with errors cannot be assembled.
        dependent: claims about dependent coordinates of the pose.
        followed: symbols of quantities of a robot whose loops are followed in the home assembly mode: a robot with
            dependent coordinates, a set of positions, or a tolerance. None for other robots.
    """

    legs: Legs | None
    layout: Layout
    model: Model
    place: Layout
    reaches: tuple[Claim, ...] = ()
    numbers_at: str = ""
    within_tolerance: RobotsWithinTolerance | None = None
    dependent: tuple[Claim, ...] = ()
    followed: ToleranceLayout | None = None


def robot_claims(case: Case, workspace: Workspace, reached: Collection[str]) -> RobotClaims:
    """Return the robot of a case with fixed dimensions and the claims about its reach.

    ``reached`` names the proved claims.
    """
    legs, closed, is_open = legs_of(case), closed_form(case.model), bool(case.model.unknowns)
    if case.joint_centre_tolerance:
        try:
            robots = RobotsWithinTolerance(case, closed.model, pose_root(workspace))
        except RobotError:
            pass
        else:
            return _followed(legs, closed.model, workspace, robots.symbols, is_open=is_open, within_tolerance=robots)
    if workspace.dependent or workspace.position_set is not None:
        return followed_claims(case, workspace)
    layout = posed_layout(case, workspace)
    place, every = reach_claims(case, closed, workspace) if closed.reaches else (layout, ())
    if every and all(each.name in reached for each in every):
        partly = "every assembly mode in which limbs with a closed form have the home working mode"
        numbers_at = partly if closed.model.unknowns else "the home assembly mode"
        return RobotClaims(legs, closed_layout(case, closed, workspace), closed.model, place, every, numbers_at)
    numbers_at = "every assembly mode" if is_open else ""
    return RobotClaims(legs, layout, closed.model, place, every, numbers_at)


def followed_claims(case: Case, workspace: Workspace) -> RobotClaims:
    """Return the nominal robot of a case with fixed dimensions, with its loops followed from the workspace centre."""
    closed = closed_form(case.model)
    symbols = tolerance_layout(
        case, BuiltModel(closed.model, (), closed.reaches), 0.0, coordinates_of(pose_root(workspace))
    )
    return _followed(legs_of(case), closed.model, workspace, symbols, is_open=bool(case.model.unknowns))


def case_along_path(case: Case, path: ProgrammedPath) -> Case:
    """Return a case with claims about a path; limits on speeds and powers refer to the path's motion if it has times.

    Raises:
        CaseError: a dimension is free or may not change, the pose does not determine driven joints, or limits need a
            motion that neither case nor path states.
        InputError: the path has no motion.
    """
    if not len(path):
        raise InputError(f"{path.source}: has no motion")
    case = case_along(case, path.settings)
    check_changing(case, path.settings.names)
    check_determined_joints(case.model, "path", case.source)
    if not path.is_timed:
        case.require_motion(", or a path that states times")
    return in_motion(case) if case.without_motion else case


def robot_along_path(case: Case, root: PathRoot, *, with_angles: bool) -> RobotClaims:
    """Return the robot of a case with fixed dimensions along a path; its loops are followed from the first point.

    Args:
        case: the case.
        root: poses of the path.
        with_angles: If true, closed forms replace joint angles. These forms jump if a joint makes a full turn.

    Raises:
        ProofError: the robot cannot be assembled with joint-centre errors.
    """
    closed, robots = closed_form(case.model, with_angles=with_angles), None
    if case.joint_centre_tolerance:
        try:
            robots = RobotsWithinTolerance(case, closed.model, root, with_angles=with_angles)
        except RobotError as error:
            raise ProofError(str(error)) from None
    symbols = (
        tolerance_layout(case, BuiltModel(closed.model, (), closed.reaches), 0.0, coordinates_of(root))
        if robots is None
        else robots.symbols
    )
    is_open = bool(case.model.unknowns)
    return _followed(legs_of(case), closed.model, root.workspace, symbols, is_open=is_open, within_tolerance=robots)


def _followed(
    legs: Legs | None,
    model: Model,
    workspace: Workspace,
    symbols: ToleranceLayout,
    *,
    is_open: bool,
    within_tolerance: RobotsWithinTolerance | None = None,
) -> RobotClaims:
    """Return the robot and the claims for a robot whose loops are followed in the home assembly mode."""
    home = "the home assembly mode" if is_open else ""
    reaches, dependent = symbols.claims(())[0], tuple(dependent_claims(symbols.layout.robots[0], workspace))
    whole = RobotClaims(legs, symbols.layout, model, symbols.layout, tuple(reaches), home, within_tolerance)
    return replace(whole, dependent=dependent, followed=symbols)


def coordinates_of(root: Root) -> PoseCoordinates:
    """Return the coordinates of a box as symbols of a layout."""

    def rotation(turn: SX) -> SX:
        """Return the rotation (3, 3) with coordinates (3, 1)."""
        turned, scale = turned_rotation(root, ca.vertsplit(turn))
        return turned / scale

    return PoseCoordinates(root.values[: root.of_pose], rotation, root.ball)


def expected_claims(case: Case, robot: RobotClaims, quantities: Sequence[str], leg_error: float) -> list[Claim]:
    """Return the claims about a case over its workspace, including requested quantities.

    Raises:
        InputError: the robot has no quantity of a requested name.
    """
    ranks = [REGULAR, *([CONSTRAINTS] if _has_constraints(robot.model) else [])]
    claims = claims_of(robot.layout, [name for name in quantities if name not in SPECTRAL])
    every = [
        *(RANKS[name] for name in ranks),
        *robot.reaches,
        *robot.dependent,
        *claims,
    ]
    every += [*length_claims(case), *searched_claims(case, quantities), *motor_claims(case)]
    if robot.legs is None:
        return [each for each in every if each.kind is not ClaimKind.SPECTRUM]
    return [*every, *(ERRORS if leg_error_of(case, leg_error) > 0 else ())]


def expected_along_path(case: Case, robot: RobotClaims, *, is_timed: bool) -> list[Claim]:
    """Return the claims about a case along a path.

    A path with times also has claims about the speeds and powers of its motion.
    """
    ranks = [REGULAR, *([CONSTRAINTS] if _has_constraints(robot.model) else [])]
    names = [each.name for each in case.model.quantities if each.name in (*ACTUATED, LegLength.key)]
    every = [
        *(Claim(name, Sense.MIN, kind=ClaimKind.RANK) for name in ranks),
        *robot.reaches,
        *claims_of(robot.layout, names, with_objective=False),
        *robot.dependent,
        *length_claims(case),
        *searched_claims(case),
    ]
    if is_timed:
        of_loads = (each for each in motor_claims(in_path_motion(case)) if each.motor)
        every += [*speed_claims(case), *(each for each in of_loads if _number_of(each) is not ActuatorQuantity.SPEED)]
    else:
        every += motor_claims(case)
    is_of_legs = has_straight_legs(case.model)
    return [each for each in every if is_of_legs or each.kind is not ClaimKind.SPECTRUM]


def _number_of(claim: Claim) -> ActuatorQuantity | None:
    """Return the actuator quantity of a claim; None for another claim."""
    return None if claim.motor is None else claim.motor.number


def refuse_other_lemmas(lemmas: Sequence[ProofClaim], expected: Sequence[Claim]) -> None:
    """Refuse lemmas that no claim of a case can use."""
    claims = [each.label for each in expected]
    strokes = [(one_robot_name(each.name), sense.value) for each in expected for sense in Sense]
    allowed = {*strokes, *((second_order_name(name), sense) for name, sense in claims + strokes)}
    for each in lemmas:
        if (each.name, each.sense) not in allowed:
            raise ProofError(
                f"the proof has a lemma that no claim of this case uses: {each.name} {each.sense}".rstrip()
            )


def _has_constraints(model: Model) -> bool:
    """Return whether a robot has constraint wrenches whose rank is claimed."""
    if model.generic is not None:
        return 0 < model.generic.constraints < 6
    return not model.members and any(row.kind is WrenchKind.COUPLE for row in model.wrenches)


def leg_error_of(case: Case, leg_error: float) -> float:
    """Return the largest error of a leg's length: leg-length error plus the effect of joint-centre errors."""
    return leg_error + 2 * (case.joint_centre_tolerance or 0.0)


def legs_premise(legs: Legs | None) -> tuple[tuple[float, ...], ...]:
    """Return joint centres (12, 3) for proof files, base before platform; empty without six straight legs."""
    return () if legs is None else tuple(map(tuple, [*legs.base.tolist(), *legs.platform.tolist()]))


def refuse_other_premises(
    case: Case, workspace: Workspace, legs: Legs | None, leg_error: float, given: Premises
) -> None:
    """Refuse a proof whose file states premises that differ from the case.

    The check itself uses only the premises of the case.
    """
    if workspace_premise(workspace) != given.workspace or set_premise(workspace) != given.position_set:
        raise ProofError("the proof is for another workspace than that of this case")
    if given.leg_error != leg_error:
        stated = f"the proof is for leg-length errors of at most {exact(given.leg_error)} {case.units.length}"
        raise ProofError(f"{stated}, but --leg-error is {exact(leg_error)}")
    refuse_other_robot(case, legs, given)


def refuse_other_robot(case: Case, legs: Legs | None, given: Premises | PathPremises) -> None:
    """Refuse a proof whose file states joint centres or a joint-centre tolerance that differ from the case."""
    numbers = legs_premise(legs)
    same = list(map(len, numbers)) == list(map(len, given.legs))
    if not same or not np.allclose(given.legs, numbers, rtol=0.0, atol=_SAME * np.abs(numbers).max(initial=0.0)):
        raise ProofError("the proof is for other joint centres than those of this case")
    if (case.joint_centre_tolerance or 0.0) != given.joint_centre:
        raise ProofError("the proof is for another joint-centre tolerance than that of this case")
