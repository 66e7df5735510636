"""Laying a case out as symbols: what is free, what is fixed, and the robot's expressions in them.

The variables are the free components of the parameters, of the position ``p``, and of the rotation:

* axis and angle fixed: none;
* axis held, angle free: the angle;
* axis free: the vector part ``q`` of the unit quaternion, with ``|q|^2`` between the squared sines of half of the
  smallest and half of the largest allowed angle, one smooth constraint named ``angle``.

A parameter that is a direction has its three components as variables and its unit length as an equation: the sphere
then has no poles. Its bounds of -1 and 1, which the length implies, are moved outwards so that they never hold a point
that the length already holds.

Several poses share the robot's dimensions; each stated pose has its own position and rotation, and the poses along a
trajectory or a grid follow from it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np
from casadi import SX

from ...models import (
    Dimension,
    LegInstance,
    Model,
    Parameter,
    RobotInstance,
    WrenchKind,
    component_names,
    matrix_from_axis_angle,
    matrix_from_quaternion_vector,
)
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..case.pose import Free, OverPoses, Pose, Step, Value, sizes_of_turn
from ..case.task import Task
from ..errors import CaseError
from .limits import ProgramNumbers, limit_constraints
from .program import Scalar

#: The constraint ``|q|^2 = sin^2(angle / 2)`` read as the angle itself.
ROTATION_ANGLE = Reading(
    Dimension.ANGLE,
    from_value=lambda value: 2 * math.asin(math.sqrt(min(max(value, 0.0), 1.0))),
    slope=lambda value: math.sqrt(max(value * (1 - value), 0.0)),
)
#: The constraint ``|u|^2 = 1`` read as the length itself.
_LENGTH_OF_DIRECTION = Reading(
    Dimension.NUMBER, from_value=lambda value: math.sqrt(max(value, 0.0)), slope=lambda value: 2 * math.sqrt(value)
)
#: How far a component of a free unit vector, or of a rotation's ``q`` beside its ball's radius, may go as a variable.
_ROOM = 1.25
#: How well an equation among fixed numbers must hold: they are written with a dozen digits.
_ROUNDING = 1e-9


@dataclass
class SymbolTable:
    """What is being laid out: free variables and fixed arguments in the order they are met."""

    variables: list[Scalar] = field(default_factory=list)
    x: list[SX] = field(default_factory=list)
    bounds: list[Free] = field(default_factory=list)
    arguments: list[Scalar] = field(default_factory=list)
    p: list[SX] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def place(self, name: str, dimension: Dimension, value: Value) -> SX:
        """The symbol of a number, which becomes a variable or an argument as the case has it."""
        symbol = SX.sym(name)
        scalar = Scalar(name, dimension)
        if isinstance(value, Free):
            self.variables.append(scalar)
            self.x.append(symbol)
            self.bounds.append(value)
        else:
            self.arguments.append(scalar)
            self.p.append(symbol)
            self.values.append(value)
        return symbol

    def place_all(self, name: str, dimension: Dimension, values: Sequence[Value]) -> SX:
        """The (n, 1) vector of several numbers."""
        names = component_names(name, len(values)) if len(values) <= 3 else [f"{name}_{i}" for i in range(len(values))]
        return ca.vertcat(*[self.place(part, dimension, value) for part, value in zip(names, values, strict=True)])


@dataclass(frozen=True, eq=False)
class Layout:
    """A case laid out as symbols, before it is said what the objective is.

    Attributes:
        case: the case.
        sheet: its numbers as symbols.
        robots: the robot at each pose.
        constraints: what the variables can change.
        met: limits that hold whatever is chosen.
    """

    case: Case
    sheet: SymbolTable
    robots: tuple[RobotInstance, ...]
    constraints: tuple[BoundedConstraint, ...]
    met: tuple[BoundedConstraint, ...] = ()

    @property
    def F(self) -> SX:  # noqa: N802 - the objective's name
        """(tasks, 1) objective of each task: the sum or the mean over the poses."""
        if len(self.robots) == 1:
            return self.robots[0].F
        total = sum((robot.F for robot in self.robots), SX(0))
        return total / len(self.robots) if self.case.over_poses is OverPoses.MEAN else total


def lay_out(case: Case, tasks: Sequence[Task]) -> Layout:
    """Symbols for everything that the case fixes and frees, and the robot's expressions in them."""
    sheet = SymbolTable()
    model = case.model
    placed = [sheet.place_all(item.name, item.dimension, _components(case, item)) for item in model.parameters]
    stated = []
    constraints: list[BoundedConstraint] = []
    for prefix, pose in zip(case.pose_prefixes, case.poses, strict=True):
        position = sheet.place_all(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
        rotation, held = _rotation(pose, prefix, sheet)
        stated += [(rotation, position, step) for step in pose.steps]
        constraints += held
    unknowns = [
        ca.vertcat(
            SX(0, 1),
            *[sheet.place(f"{at}{u.name}", u.dimension, Free(u.lower, u.upper)) for u in model.unknowns],
        )
        for at in (f"at{k + 1}_" if len(stated) > 1 else "" for k in range(len(stated)))
    ]
    length = sheet.place("characteristic_length", Dimension.LENGTH, case.characteristic_length)
    twists = [
        sheet.place_all(
            f"twist{index}" if index else "twist", Dimension.NUMBER, [float(c) for c in np.asarray(t.twist)]
        )
        for index, t in enumerate(tasks)
    ]
    parameters = ca.vertcat(SX(0, 1), *placed)
    robots = []
    constraints += [
        BoundedConstraint(Constraint(f"|{item.name}|", ca.sumsqr(symbol), _LENGTH_OF_DIRECTION), 1.0, 1.0)
        for item, symbol in zip(model.parameters, placed, strict=True)
        if item.is_direction
    ]
    for k, (rotation, position, step) in enumerate(stated):
        symbols = _Symbols(parameters, unknowns[k], *_displaced(rotation, position, step))
        robot, closure = _robot(model, symbols, length, twists)
        robots.append(robot)
        where = f" pose {k + 1}" if len(stated) > 1 else ""
        constraints += [
            BoundedConstraint(
                Constraint(f"{equation.name}{where}", closure[index], Reading(Dimension.NUMBER)), 0.0, 0.0
            )
            for index, equation in enumerate(model.closure)
        ]
    constraints = _varying(case, constraints, sheet)
    names = [scalar.name for scalar in (*sheet.variables, *sheet.arguments)]
    x, p = ca.vertcat(SX(0, 1), *sheet.x), ca.vertcat(SX(0, 1), *sheet.p)
    numbers = ProgramNumbers(x, p, sheet.bounds, sheet.values)
    limits = limit_constraints(case, robots, dict(zip(names, (*sheet.x, *sheet.p), strict=True)), numbers)
    return Layout(case, sheet, tuple(robots), (*constraints, *limits.varying), limits.constant)


def _displaced(rotation: SX, position: SX, step: Step) -> tuple[SX, SX]:
    """A stated pose after one of its displacements."""
    if step.is_identity:
        return rotation, position
    Q, t = SX(step.rotation.tolist()), SX(step.translation.tolist())
    return Q @ rotation, Q @ position + t


def _components(case: Case, parameter: Parameter) -> tuple[Value, ...]:
    """Values of a parameter; those of a free direction with room beyond -1 and 1 and a start that is not zero."""
    values = case.components(parameter.name)
    if not (parameter.is_direction and any(isinstance(value, Free) for value in values)):
        return values
    roomy: list[Value] = []
    undecided = all(isinstance(value, Free) and value.start is None for value in values)
    for value, typical in zip(values, parameter.typical, strict=True):
        if isinstance(value, Free):
            start = min(max(typical, value.lower), value.upper) if undecided else value.start
            lower = -_ROOM if value.lower == -1.0 else value.lower
            upper = _ROOM if value.upper == 1.0 else value.upper
            roomy.append(Free(lower, upper, start))
        else:
            roomy.append(value)
    return tuple(roomy)


def free_directions(model: Model, variables: Sequence[Scalar]) -> tuple[tuple[int, int, int], ...]:
    """Indices of the components of each direction that is wholly free."""
    names = [variable.name for variable in variables]
    found = []
    for parameter in model.parameters:
        if parameter.is_direction and all(component in names for component in parameter.components):
            x, y, z = (names.index(component) for component in parameter.components)
            found.append((x, y, z))
    return tuple(found)


def _varying(case: Case, constraints: Sequence[BoundedConstraint], sheet: SymbolTable) -> list[BoundedConstraint]:
    """The constraints that the variables can change; one that they cannot must hold.

    Raises:
        CaseError: one that they cannot change does not hold.
    """
    x, p = ca.vertcat(SX(0, 1), *sheet.x), ca.vertcat(SX(0, 1), *sheet.p)
    varying = []
    for item in constraints:
        expression = item.constraint.expression
        if x.numel() and any(ca.which_depends(expression, x, 1, True)):
            varying.append(item)
            continue
        value = float(ca.Function("constant", [x, p], [expression])(0, sheet.values))
        if not item.lower - _ROUNDING <= value <= item.upper + _ROUNDING:
            fault = f"is {value:.6g} with these parameters, which are all fixed, and must be {item.lower:g}"
            raise CaseError(f"robot.parameters: {item.constraint.name}", fault, source=case.source)
    return varying


def _rotation(pose: Pose, prefix: str, sheet: SymbolTable) -> tuple[SX, list[BoundedConstraint]]:
    axis, angle = pose.rotation.axis, pose.rotation.angle
    if axis is not None:
        n = sheet.place_all(f"{prefix}axis", Dimension.NUMBER, [float(c) for c in np.asarray(axis)])
        return matrix_from_axis_angle(n, sheet.place(f"{prefix}angle", Dimension.ANGLE, angle)), []
    smallest, largest = sizes_of_turn(angle)
    radius = math.sin(largest / 2)
    if radius == 0:
        q = sheet.place_all(f"{prefix}q", Dimension.NUMBER, (0.0, 0.0, 0.0))
        return matrix_from_quaternion_vector(q), []
    inner = math.sin(smallest / 2)
    start = angle.start if isinstance(angle, Free) and angle.start is not None else smallest
    # The ball implies |q_x| <= radius and so on: bounds that touched it would share its multiplier where it binds.
    room = min(_ROOM * radius, 1.0)
    along_z = Free(-room, room, math.sin(start / 2))
    q = sheet.place_all(f"{prefix}q", Dimension.NUMBER, (Free(-room, room), Free(-room, room), along_z))
    ball = Constraint(f"{prefix}angle", ca.sumsqr(q), ROTATION_ANGLE)
    return matrix_from_quaternion_vector(q), [BoundedConstraint(ball, inner**2 if inner else -math.inf, radius**2)]


@dataclass(frozen=True, eq=False)
class _Symbols:
    """What the program puts in place of a model's symbols."""

    parameters: SX
    unknowns: SX
    rotation: SX
    position: SX


def _robot(model: Model, put: _Symbols, length: SX, twists: Sequence[SX]) -> tuple[RobotInstance, SX]:
    """The model's expressions with its symbols replaced by the program's, and the closure equations likewise."""
    force = ca.horzcat(*[row.force for row in model.wrenches])
    moment = ca.horzcat(*[row.moment for row in model.wrenches])
    square = ca.vertcat(*[row.square for row in model.wrenches])
    closure = ca.vertcat(SX(0, 1), *[equation.expression for equation in model.closure])
    symbols = [
        ca.vertcat(SX(0, 1), *[item.symbol for item in model.parameters]),
        ca.vertcat(SX(0, 1), *[item.symbol for item in model.unknowns]),
        model.pose.rotation,
        model.pose.position,
    ]
    quantities = [quantity.values for quantity in model.quantities]
    joints = [joint for leg in model.legs for joint in (leg.base, leg.platform)]
    inlined = ca.Function("model", symbols, [force, moment, square, closure, *quantities, *joints])
    force, moment, square, closure, *others = inlined.call([put.parameters, put.unknowns, put.rotation, put.position])
    quantities, joints = others[: len(quantities)], others[len(quantities) :]
    couple_scale = [length if row.kind is WrenchKind.COUPLE else SX(1) for row in model.wrenches]
    rows, rates, objectives, magnitudes = [], [], [], []
    for i, scale in enumerate(couple_scale):
        rows.append(scale * ca.vertcat(force[:, i], moment[:, i]).T / ca.sqrt(square[i]))
    for twist in twists:
        omega, v = twist[:3], twist[3:]
        # (m . omega + f . v)^2 / square, rather than the square of a normalised product: smoother, tighter enclosures.
        products = [s * (ca.dot(moment[:, i], omega) + ca.dot(force[:, i], v)) for i, s in enumerate(couple_scale)]
        rates.append(ca.vertcat(*[product / ca.sqrt(square[i]) for i, product in enumerate(products)]))
        objectives.append(sum((product**2 / square[i] for i, product in enumerate(products)), SX(0)))
        magnitudes.append(
            sum(
                (
                    scale**2
                    * (
                        ca.norm_2(moment[:, i] - ca.cross(put.position, force[:, i])) * ca.norm_2(omega)
                        + ca.norm_2(force[:, i]) * ca.norm_2(v + ca.cross(omega, put.position))
                    )
                    ** 2
                    / square[i]
                    for i, scale in enumerate(couple_scale)
                ),
                SX(0),
            )
        )
    robot = RobotInstance(
        parameters=put.parameters,
        rotation=put.rotation,
        position=put.position,
        jacobian=ca.vertcat(*rows),
        rates=ca.horzcat(*rates),
        F=ca.vertcat(*objectives),
        squares=square,
        magnitude=ca.vertcat(*magnitudes),
        quantities=tuple(quantities),
        legs=tuple(
            LegInstance(leg.name, base, platform, put.position + put.rotation @ platform - base)
            for leg, base, platform in zip(model.legs, joints[::2], joints[1::2], strict=True)
        ),
    )
    return robot, closure
