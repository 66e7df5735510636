"""Every machine within a tolerance on joint centres: its robot, the case in symbols of pose and errors, and claims.

A machine is the design with the centre of each joint off by a vector of at most the tolerance. Numbers of machines are
expressions of the errors, and of the pose in the coordinates of a search: three of position, three of rotation.
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
from ...case.pose import HERE, Free, Pose, Rotation, Value
from ...case.task import Sense
from ...program.layout import Layout, StatedPoseSymbols, lay_out
from ...program.places import SymbolTable
from .claims import Claim, claims_of, one_robot_name
from .machine import joint_centres
from .posed_layout import at_one_pose, reach_claims_on, without_loops

#: Part of a derivative below which its size is smoothed, and place of the pose in its ranges at which it is taken.
_PART, _PLACE = 0.03, 0.75
#: Operations that are smooth wherever their derivatives have values.
_SMOOTH = (
    *(ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_ASSIGN, ca.OP_NEG, ca.OP_TWICE, ca.OP_SQ, ca.OP_SQRT, ca.OP_INV),
    *(ca.OP_SIN, ca.OP_COS, ca.OP_TAN, ca.OP_ATAN, ca.OP_ASIN, ca.OP_ACOS, ca.OP_EXP, ca.OP_LOG, ca.OP_ADD, ca.OP_SUB),
    *(ca.OP_MUL, ca.OP_DIV, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_HYPOT),
)


class BuiltModel(NamedTuple):
    """A robot with errors of its joint centres.

    Attributes:
        model: without unknowns in closed form; the errors are its last parameters.
        names: of the centres.
        reaches: edges of the reach of limbs with errors.
    """

    model: Model
    names: tuple[str, ...]
    reaches: tuple[Reach, ...]


def built_model(model: Model, *, extended: bool = False, with_angles: bool = True) -> BuiltModel:
    """Return a robot with errors of its joint centres.

    Args:
        model: the robot.
        extended: whether closed forms have values out of reach too.
        with_angles: whether angles have closed forms.

    Raises:
        RobotError: its joint centres are not known, or it cannot be assembled with errors.
    """
    displaced = _displaced(model)
    closed = closed_form(displaced.model, extended=extended, with_angles=with_angles)
    if _kinds_of(closed_form(model, with_angles=with_angles).model) != _kinds_of(closed.model):
        raise RobotError("", "errors of joint centres take freedoms from the robot: its limbs or loops change")
    return BuiltModel(closed.model, tuple(each.name for each in displaced.centres), closed.reaches)


def _kinds_of(model: Model) -> tuple[object, ...]:
    """Return what is the same for all machines of a robot: unknowns, members, rows, equations and ranks."""
    members = [(item.rank, item.screws.shape, item.is_pinned) for item in model.members]
    rows, equations = [item.label for item in model.wrenches], [item.name for item in model.closure]
    return [item.name for item in model.unknowns], members, rows, equations, model.generic


def _displaced(model: Model) -> DisplacedRobot:
    """Return a robot with errors of its joint centres as parameters; raises as :func:`built_model` does."""
    if not model.structure:
        if not model.built or model.members or model.unknowns:
            raise RobotError("", "the joint centres of this robot are not known")
        return displaced_legs(model)
    # Only robots given joint by joint need the language of robot files.
    from ....models.joints.model.centres import displaced_robot  # noqa: PLC0415

    try:
        return displaced_robot(model, definition_of(model))
    except RobotError as error:
        raise RobotError("", f"the robot cannot be assembled with errors of its joint centres: {error}") from None


class PoseCoordinates(NamedTuple):
    """Coordinates of the poses of a workspace.

    Attributes:
        values: three of position, and three of rotation: the range of the tangent of half an angle, or of a component
            of a Cayley vector, where it varies, and else the angle.
        rotation: returns the rotation (3, 3) with three coordinates (3, 1).
        ball: largest squared size of a Cayley vector; infinite where rotations are no ball.
    """

    values: Sequence[Value]
    rotation: Callable[[SX], SX]
    ball: float


def coordinate_layout(case: Case, at: PoseCoordinates) -> Layout:
    """Return a case, whose own poses are not used, as symbols of one pose in the coordinates of a search."""
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
        return StatedPoseSymbols(at.rotation(turn), placed.symbols, placed.places, placed.symbols, None, held, (HERE,))

    return lay_out(one, one.tasks, add_pose)


class ToleranceLayout(NamedTuple):
    """Every machine of a case as symbols of one pose.

    Attributes:
        layout: whose first variables are the errors, 3 for each centre; the others are those of the pose.
        built: the robot.
        tolerance: largest size of each error, length.
    """

    layout: Layout
    built: BuiltModel
    tolerance: float

    @property
    def errors(self) -> SX:
        """Symbols (3 m, 1) of the errors."""
        return self.layout.table.variables_vector[: 3 * len(self.built.names)]

    @property
    def pose(self) -> SX:
        """Symbols (n, 1) of the pose, and of unknowns."""
        return self.layout.table.variables_vector[3 * len(self.built.names) :]

    def of(self, expression: SX, errors: SX, pose: SX) -> SX:
        """Return an expression (k, 1) with other symbols or numbers in the place of these."""
        table = self.layout.table
        function = ca.Function("numbers", [table.variables_vector, table.arguments_vector], [expression])
        numbers = ca.vertcat(SX(0, 1), *[SX(each) for each in table.values])
        return function.call([ca.vertcat(errors, pose), numbers])[0]

    def near_zero(self, expression: SX, design: Layout) -> FloatArray:
        """Return small sizes (m,) for the derivatives g_j of an expression (1, 1) by the errors of the centres.

        ``sqrt(|g_j|^2 + size^2)`` is at least ``|g_j|``, little more where that is large, and smooth where it is 0.
        Each is a part of ``|g_j|`` at one pose of the design.
        """
        at = ca.DM([each.lower + _PLACE * (each.upper - each.lower) for each in design.table.bounds])
        slopes = ca.densify(ca.gradient(expression, self.errors))
        values = np.array(ca.evalf(self.of(slopes, SX.zeros(self.errors.numel()), SX(at)))).reshape(-1, 3)
        return np.asarray(_PART * np.nan_to_num(np.linalg.norm(values, axis=1), posinf=0.0))

    def claims(self, quantities: Sequence[str], *, with_objective: bool = True) -> tuple[list[Claim], list[Claim]]:
        """Return the claims that limbs reach every pose, and those about numbers, which rest on them.

        Raises:
            InputError: the robot has no measure of a name.
        """
        reaches = reach_claims_on(self.layout, self.built.reaches)
        return list(reaches), claims_of(self.layout, quantities, with_objective=with_objective)


def tolerance_layout(case: Case, built: BuiltModel, tolerance: float, at: PoseCoordinates) -> ToleranceLayout:
    """Return every machine within a tolerance of a case with fixed dimensions as symbols of one pose."""
    parameters = {name: case.parameters[name] for name in case.parameters}
    size = Free(-tolerance, tolerance)
    own = {item.name: (size, size, size) for item in built.model.parameters if item.name not in parameters}
    # The mounting axes of joints are those of the design.
    limits = Limits(*(_mounted(case, each) for each in case.limits))
    robots = replace(case, model=built.model, parameters=parameters | own, limits=limits, joint_centre_tolerance=None)
    return ToleranceLayout(coordinate_layout(robots, at), built, tolerance)


def _mounted(case: Case, limit: Limit[Any]) -> Limit[Any]:
    """Return a limit on angles of joints with the mounting axes of the design as numbers; another one as it is."""
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
    """Return the design, a case with a model without unknowns, as symbols of one pose: those of its machines.

    Equations of loops are left out, which hold at every pose by themselves: a bound without one is over more poses.
    """
    return coordinate_layout(replace(case, model=without_loops(model)), at)


def is_smooth(number: SX) -> bool:
    """Return whether derivatives of an expression (1, 1) bound its change: it has smooth operations alone.

    The angle of a vector jumps by a turn, where its derivatives are smooth, unless its sine is a length.
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
    """Return the name of the bound of the terms of second order by which a number of machines is bounded."""
    return f"{claim}, terms of second order"


class Directions(NamedTuple):
    """Vectors that stand for a leg's direction over a workspace.

    Attributes:
        claim: name of the claim that they serve.
        base: (3,) in the world frame.
        platform: (3,) in the platform frame.
    """

    claim: str
    base: FloatArray
    platform: FloatArray


def length_of_one_robot(robots: ToleranceLayout, leg: int, sense: Sense, about: Directions) -> Claim:
    """Return the claim about the length of a leg less ``f.c_p - e.c_b``, which is the same at every pose.

    In the difference of two lengths of one machine, with errors e and f of the leg's joints on base and platform, the
    part with the fixed vectors c_p and c_b cancels; little is left of it where the leg's direction changes little.

    Args:
        robots: robots within the tolerance, with two joint-centre errors for each leg.
        leg: index of the leg.
        sense: whether the smallest or the largest value is meant.
        about: c_b and c_p.
    """
    places = (3 * robots.built.names.index(each) for each in robots.built.model.legs[leg].centres)
    e, f = (robots.errors[k : k + 3] for k in places)
    same = ca.dot(f, SX(about.platform.tolist())) - ca.dot(e, SX(about.base.tolist()))
    length = ca.norm_2(robots.layout.robots[0].legs[leg].span)
    return Claim(one_robot_name(about.claim), sense, length - same, LENGTH, legs=(leg,))
