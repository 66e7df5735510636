"""Robots within the joint-centre tolerance: their model, their expressions of pose and joint-centre errors, and claims.

A robot within the tolerance is the nominal robot with each joint centre displaced by a vector of at most the tolerance.
Its quantities are expressions of these errors and of the pose. The pose has the coordinates of a search: three for the
position and three for the rotation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray, Model, matrix_from_axis_angle
from ....models.catalog import definition_of
from ....models.displaced import DisplacedRobot, displaced_legs
from ....models.joints import RobotError
from ....models.joints.model.closedform import Reach, closed_form
from ...case.case import Case
from ...case.limits.constraint import LENGTH, BoundedConstraint, Constraint, Reading
from ...case.limits.joints import BaseJointAngle, JointAngle, MountingPose, unit_axes
from ...case.limits.limit import Limit
from ...case.limits.limits import Limits
from ...case.pose import NO_DISPLACEMENT, Free, Pose, Rotation, Value
from ...case.task import Sense
from ...program.layout import Layout, StatedPoseSymbols, lay_out
from ...program.places import SymbolTable
from .claims import Claim, claims_of, one_robot_name
from .fixed_robot import joint_centres
from .posed_layout import at_one_pose, reach_claims_on, without_loops

#: Fraction of the norm of a derivative below which the norm is smoothed; and relative position in the ranges of the
#: pose at which this norm is evaluated.
_PART, _PLACE = 0.03, 0.75
#: Operations that are smooth wherever their derivatives exist.
_SMOOTH = (
    *(ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_ASSIGN, ca.OP_NEG, ca.OP_TWICE, ca.OP_SQ, ca.OP_SQRT, ca.OP_INV),
    *(ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_ATAN, ca.OP_ASIN, ca.OP_ACOS, ca.OP_EXP, ca.OP_LOG, ca.OP_ADD, ca.OP_SUB),
    *(ca.OP_MUL, ca.OP_DIV, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_HYPOT),
)


class BuiltModel(NamedTuple):
    """A robot with joint-centre errors.

    Attributes:
        model: model with closed forms in place of unknowns; the errors are its last parameters.
        names: names of the joint centres.
        reaches: boundaries of the reach of the limbs, with joint-centre errors.
    """

    model: Model
    names: tuple[str, ...]
    reaches: tuple[Reach, ...]


def built_model(model: Model, *, extended: bool = False, with_angles: bool = True) -> BuiltModel:
    """Return a robot with joint-centre errors as parameters.

    Args:
        model: the robot.
        extended: If true, closed forms also have values for poses out of reach.
        with_angles: If true, closed forms replace joint angles too.

    Raises:
        RobotError: the joint centres are not known, or the robot cannot be assembled with errors.
    """
    displaced = _displaced(model)
    closed = closed_form(displaced.model, extended=extended, with_angles=with_angles)
    if _kinds_of(closed_form(model, with_angles=with_angles).model) != _kinds_of(closed.model):
        raise RobotError(
            "",
            "joint-centre errors remove degrees of freedom from this overconstrained robot: "
            "the tolerance cannot be verified",
        )
    return BuiltModel(closed.model, tuple(each.name for each in displaced.centres), closed.reaches)


def _kinds_of(model: Model) -> tuple[object, ...]:
    """Return the properties that joint-centre errors must not change: unknowns, members, rows, equations and ranks."""
    members = [(item.rank, item.screws.shape, item.is_pinned) for item in model.members]
    rows, equations = [item.label for item in model.wrenches], [item.name for item in model.closure]
    return [item.name for item in model.unknowns], members, rows, equations, model.generic


def _displaced(model: Model) -> DisplacedRobot:
    """Return a robot with joint-centre errors as parameters; raises the errors of :func:`built_model`."""
    if not model.structure:
        if not model.built or model.members or model.unknowns:
            raise RobotError("", "the joint centres of this robot are not known")
        return displaced_legs(model)
    # Only robots given joint by joint need the language of robot files.
    from ....models.joints.model.centres import displaced_robot  # noqa: PLC0415

    try:
        return displaced_robot(model, definition_of(model))
    except RobotError as error:
        raise RobotError("", f"the robot cannot be assembled with joint-centre errors: {error}") from None


class PoseCoordinates(NamedTuple):
    """Coordinates of the poses of a workspace.

    Attributes:
        values: three values of position and three of rotation. A fixed rotation is an angle. A varying rotation is a
            range: of the tangent of half an angle, or of a component of a Cayley vector.
        rotation: function that returns the rotation (3, 3) with coordinates (3, 1).
        ball: largest squared norm of a Cayley vector; infinite if rotations are not in a ball.
    """

    values: Sequence[Value]
    rotation: Callable[[SX], SX]
    ball: float


def coordinate_layout(case: Case, at: PoseCoordinates) -> Layout:
    """Return a case as expressions of one pose in the coordinates of a search.

    The poses stated in the case are ignored.
    """
    one = at_one_pose(case, tuple(at.values[:3]), Rotation(None, 0.0))

    def add_pose(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
        placed, turns = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position)), []
        for k, value in enumerate(at.values[3:]):
            kind = Dimension.NUMBER if isinstance(value, Free) else Dimension.ANGLE
            symbol = table.add(f"{prefix}turn{k + 1}", kind, value).symbols
            turns.append(symbol if isinstance(value, Free) else ca.tan(symbol / 2))
        turn = ca.vertcat(*turns)
        ball = Constraint(f"{prefix}turn", ca.sumsqr(turn), Reading(Dimension.NUMBER))
        held = [BoundedConstraint(ball, -math.inf, at.ball)] if at.ball < math.inf else []
        return StatedPoseSymbols(
            at.rotation(turn), placed.symbols, placed.places, placed.symbols, None, held, (NO_DISPLACEMENT,)
        )

    return lay_out(one, one.tasks, add_pose)


class ToleranceLayout(NamedTuple):
    """All robots within the tolerance of a case, as expressions of one pose and of joint-centre errors.

    Attributes:
        layout: the case as expressions; the variables are the joint-centre errors, 3 for each centre, then the pose
            coordinates.
        built: the robot with joint-centre errors.
        tolerance: largest norm of each joint-centre error, length.
        posed: number of coordinates of the pose that vary.
        settings: number of dimensions that change along a path. They are the first variables, but follow the pose among
            the coordinates of a search.
    """

    layout: Layout
    built: BuiltModel
    tolerance: float
    posed: int = 0
    settings: int = 0

    @property
    def errors(self) -> SX:
        """Symbols (3 m, 1) of the joint-centre errors."""
        return self.layout.table.variables_vector[self.settings : self.settings + 3 * len(self.built.names)]

    @property
    def pose(self) -> SX:
        """Symbols (n, 1) of the pose and of the unknowns, for a robot whose dimensions are fixed."""
        return self.layout.table.variables_vector[3 * len(self.built.names) :]

    def of(self, expression: SX, errors: SX, pose: SX) -> SX:
        """Return an expression (k, 1) with other symbols or values for the errors and the coordinates of a search."""
        table, first, last = self.layout.table, self.posed, self.posed + self.settings
        function = ca.Function("numbers", [table.variables_vector, table.arguments_vector], [expression])
        numbers = ca.vertcat(SX(0, 1), *[SX(each) for each in table.values])
        # With rows alone, an empty part of a single symbol would have one row.
        parts = pose[first:last, :], errors, pose[:first, :], pose[last:, :]
        return function.call([ca.vertcat(*parts), numbers])[0]

    def near_zero(self, expression: SX, design: Layout) -> FloatArray:
        """Return smoothing terms (m,) for the norms of the derivatives g_j of an expression (1, 1).

        The derivative g_j is with respect to the error of joint centre j.

        ``sqrt(|g_j|^2 + term^2)`` is at least ``|g_j|``, close to ``|g_j|`` where that is large, and smooth where
        ``|g_j|`` is 0. Each term is a small part of ``|g_j|`` at one pose of the nominal robot.
        """
        at = ca.DM([each.lower + _PLACE * (each.upper - each.lower) for each in design.table.bounds])
        slopes = ca.densify(ca.gradient(expression, self.errors))
        values = np.array(ca.evalf(self.of(slopes, SX.zeros(self.errors.numel()), SX(at)))).reshape(-1, 3)
        return np.asarray(_PART * np.nan_to_num(np.linalg.norm(values, axis=1), posinf=0.0))

    def claims(self, quantities: Sequence[str], *, with_objective: bool = True) -> tuple[list[Claim], list[Claim]]:
        """Return the claims that limbs reach every pose, and the claims about quantities that depend on this reach.

        Raises:
            InputError: the robot has no quantity of a given name.
        """
        reaches = reach_claims_on(self.layout, self.built.reaches)
        return list(reaches), claims_of(self.layout, quantities, with_objective=with_objective)


def tolerance_layout(case: Case, built: BuiltModel, tolerance: float, at: PoseCoordinates) -> ToleranceLayout:
    """Return all robots within a tolerance of a case with fixed dimensions, as expressions of one pose and errors."""
    parameters = {name: case.parameters[name] for name in case.parameters}
    size = Free(-tolerance, tolerance)
    own = {item.name: (size, size, size) for item in built.model.parameters if item.name not in parameters}
    # Joints keep the mounting axes of the nominal robot.
    limits = Limits(*(_mounted(case, each) for each in case.limits))
    robots = replace(case, model=built.model, parameters=parameters | own, limits=limits, joint_centre_tolerance=None)
    posed = sum(isinstance(value, Free) for value in at.values)
    changing = sum(isinstance(value, Free) for name in parameters for value in case.components(name))
    return ToleranceLayout(coordinate_layout(robots, at), built, tolerance, posed, changing)


def _mounted(case: Case, limit: Limit[Any]) -> Limit[Any]:
    """Return a limit on joint angles with the nominal robot's mounting axes as constants; other limits unchanged."""
    if not (case.model.legs and isinstance(limit, JointAngle) and isinstance(limit.about, MountingPose)):
        return limit
    home, legs = limit.about, joint_centres(case)
    axis = SX(unit_axes((home.axis,), 1)[0].tolist())
    R = np.array(ca.evalf(matrix_from_axis_angle(axis, SX(home.angle))))
    n = np.array(home.position) + legs.platform @ R.T - legs.base
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    own = n if isinstance(limit, BaseJointAngle) else n @ R
    return replace(limit, about=tuple((float(x), float(y), float(z)) for x, y, z in own))


def design_layout(case: Case, model: Model, at: PoseCoordinates) -> Layout:
    """Return the nominal robot as expressions of one pose, from a model without unknowns.

    Loop equations that hold at every pose are left out; a bound without an equation covers more poses.
    """
    return coordinate_layout(replace(case, model=without_loops(model)), at)


def is_smooth(number: SX) -> bool:
    """Return whether an expression (1, 1) has only smooth operations, so that derivatives bound its change.

    The angle of a vector jumps by a full turn although its derivatives are smooth, unless its sine is a norm.
    """
    function, last = ca.Function("number", ca.symvar(number), [number]), dict[int, int]()
    for k in range(function.n_instructions()):
        op, places = function.instruction_id(k), function.instruction_input(k)
        if op not in _SMOOTH and not (op == ca.OP_ATAN2 and last[places[0]] == ca.OP_SQRT):
            return False
        if op != ca.OP_OUTPUT:
            last[function.instruction_output(k)[0]] = op
    return True


def second_order_name(claim: str) -> str:
    """Return the name of the bound of the second-order terms of a claim about robots within the tolerance."""
    return f"{claim}, terms of second order"


class Directions(NamedTuple):
    """Fixed vectors near a leg's direction over a workspace.

    Attributes:
        claim: name of the claim that uses these vectors.
        base: (3,) vector in the world frame, for the base joint.
        platform: (3,) vector in the platform frame, for the platform joint.
    """

    claim: str
    base: FloatArray
    platform: FloatArray


def length_of_one_robot(robots: ToleranceLayout, leg: int, sense: Sense, about: Directions) -> Claim:
    """Return the claim about the length of a leg minus ``f.c_p - e.c_b``, a term that is the same at every pose.

    e and f are the errors of the leg's joints on base and platform. In the difference of two leg lengths of one robot,
    this term cancels. If the leg's direction changes little, the remaining error is small.

    Args:
        robots: robots within the tolerance, with two joint-centre errors for each leg.
        leg: index of the leg.
        sense: ``MIN`` for the smallest length, ``MAX`` for the largest.
        about: the vectors c_b and c_p.
    """
    places = (3 * robots.built.names.index(each) for each in robots.built.model.legs[leg].centres)
    e, f = (robots.errors[k : k + 3] for k in places)
    same = ca.dot(f, SX(about.platform.tolist())) - ca.dot(e, SX(about.base.tolist()))
    length = ca.norm_2(robots.layout.robots[0].legs[leg].span)
    return Claim(one_robot_name(about.claim), sense, length - same, LENGTH, legs=(leg,))
