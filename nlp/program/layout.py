"""A case as symbols: free variables, fixed arguments, and the robot's expressions in them.

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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ...models import (
    Dimension,
    FloatArray,
    Parameter,
    RobotInstance,
    Substitution,
    instantiate,
    matrix_from_axis_angle,
    matrix_from_quaternion_vector,
)
from ..case.case import Case
from ..case.limits.constraint import BoundedConstraint, Constraint, Reading
from ..case.pose import Free, Pose, Step, Value, sizes_of_turn
from ..case.task import Task
from ..errors import CaseError
from .buildable import distinct, limits_of
from .places import FreeRotation, HeldRotation, Place, Places, RotationPlaces, SymbolTable

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


@dataclass(frozen=True, eq=False)
class Layout:
    """A case as symbols, before an objective is chosen.

    Attributes:
        case: the case.
        table: its numbers as symbols.
        places: where they stand.
        robots: the robot at each pose.
        constraints: constraints that depend on a variable, or that do not hold.
        met: limits that depend on no variable and hold.
    """

    case: Case
    table: SymbolTable
    places: Places
    robots: tuple[RobotInstance, ...]
    constraints: tuple[BoundedConstraint, ...]
    met: tuple[BoundedConstraint, ...] = ()


class _StatedPose(NamedTuple):
    """A pose that a case states, as symbols: its numbers' places, its constraints, and its displacements."""

    rotation: SX
    position: SX
    numbers: tuple[Place, ...]
    symbols: SX
    places: RotationPlaces
    constraints: list[BoundedConstraint]
    steps: tuple[Step, ...]


def lay_out(case: Case, tasks: Sequence[Task]) -> Layout:
    """Return symbols for every number that a case fixes or frees, and the robot's expressions in them."""
    table, model = SymbolTable(), case.model
    parameters = [
        table.add_each(case.component_names(item), item.dimension, _components(case, item)) for item in model.parameters
    ]
    stated = [_add_pose(pose, prefix, table) for prefix, pose in zip(case.pose_prefixes, case.poses, strict=True)]
    unknowns = [
        [table.add(f"{at}{item.name}", item.dimension, Free(item.lower, item.upper)) for item in model.unknowns]
        for at in _pose_marks(case)
    ]
    length = table.add("characteristic_length", Dimension.LENGTH, case.characteristic_length).symbols
    twists = [
        table.add_vector(
            f"twist{index}" if index else "twist", Dimension.NUMBER, [float(c) for c in np.asarray(t.twist)]
        )
        for index, t in enumerate(tasks)
    ]
    constraints = [item for pose in stated for item in pose.constraints]
    constraints += [
        BoundedConstraint(Constraint(f"|{item.name}|", ca.sumsqr(placed.symbols), _LENGTH_OF_DIRECTION), 1.0, 1.0)
        for item, placed in zip(model.parameters, parameters, strict=True)
        if item.is_direction
    ]
    values = ca.vertcat(SX(0, 1), *[placed.symbols for placed in parameters])
    robots = []
    displaced = [_displaced(pose.rotation, pose.position, step) for pose in stated for step in pose.steps]
    for k, (rotation, position) in enumerate(displaced):
        put = Substitution(values, ca.vertcat(SX(0, 1), *[each.symbols for each in unknowns[k]]), rotation, position)
        robot = instantiate(model, put, length, [twist.symbols for twist in twists])
        robots.append(robot)
        where = f" pose {k + 1}" if len(displaced) > 1 else ""
        constraints += [
            BoundedConstraint(
                Constraint(f"{equation.name}{where}", robot.closure[i], Reading(Dimension.NUMBER)), 0.0, 0.0
            )
            for i, equation in enumerate(model.closure)
        ]
    constraints = _varying(case, constraints, table)
    numbers = ca.vertsplit(ca.vertcat(values, *[pose.symbols for pose in stated]))
    limits, met = (
        _limits(case, robots, table, dict(zip(case.scalars, numbers, strict=True))) if case.limits else ([], [])
    )
    places = Places(
        numbers=(
            *(place for placed in parameters for place in placed.places),
            *(place for pose in stated for place in pose.numbers),
        ),
        rotations=tuple(pose.places for pose in stated),
        unknowns=tuple(tuple(each.places[0].index for each in at_pose) for at_pose in unknowns),
        twists=tuple(range(placed.places[0].index, placed.places[-1].index + 1) for placed in twists),
        directions=tuple(
            (x.index, y.index, z.index)
            for item, placed in zip(model.parameters, parameters, strict=True)
            if item.is_direction and all(place.vector == "x" for place in placed.places)
            for x, y, z in [placed.places]
        ),
    )
    return Layout(case, table, places, tuple(robots), (*constraints, *limits), tuple(met))


def _pose_marks(case: Case) -> list[str]:
    """Return what stands before the names of the unknowns at each pose: nothing for a single one."""
    count = case.pose_count
    return [f"at{k + 1}_" for k in range(count)] if count > 1 else [""]


def _displaced(rotation: SX, position: SX, step: Step) -> tuple[SX, SX]:
    """A stated pose after one of its displacements."""
    if step.is_identity:
        return rotation, position
    Q, t = SX(step.rotation.tolist()), SX(step.translation.tolist())
    return Q @ rotation, Q @ position + t


def _limits(
    case: Case, robots: Sequence[RobotInstance], table: SymbolTable, numbers: Mapping[str, SX]
) -> tuple[list[BoundedConstraint], list[BoundedConstraint]]:
    """The case's limits: those that the variables can change or that do not hold, and those that hold anyway."""
    x, p = table.variables_vector, table.arguments_vector
    limits = limits_of(case, robots, numbers)
    limits = distinct(limits, x, p, table.values, _somewhere(table.bounds))
    expressions = ca.vertcat(*[item.constraint.expression for item in limits])
    free = ca.which_depends(expressions, x, 1, True) if len(table.x) else [False] * len(limits)
    values = ca.Function("limits", [x, p], [ca.densify(expressions)])(_somewhere(table.bounds)[0], table.values)
    varying: list[BoundedConstraint] = []
    met: list[BoundedConstraint] = []
    for item, varies, value in zip(limits, free, values.full().ravel(), strict=True):
        holds = item.lower - _ROUNDING <= value <= item.upper + _ROUNDING
        (met if holds and not varies else varying).append(item)
    return varying, met


def _somewhere(bounds: Sequence[Free]) -> FloatArray:
    """(3, n) points of the box that no symmetry singles out."""
    parts = np.modf(np.outer(np.arange(1, 4), np.sqrt(2.0 + np.arange(len(bounds)))))[0]
    lower, upper = np.array([[bound.lower, bound.upper] for bound in bounds]).reshape(-1, 2).T
    return np.asarray(lower + (0.1 + 0.8 * parts) * (upper - lower), dtype=np.float64)


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


def _varying(case: Case, constraints: Sequence[BoundedConstraint], table: SymbolTable) -> list[BoundedConstraint]:
    """The constraints that the variables can change; one that they cannot must hold.

    Raises:
        CaseError: one that they cannot change does not hold.
    """
    x, p = table.variables_vector, table.arguments_vector
    varying = []
    for item in constraints:
        expression = item.constraint.expression
        if x.numel() and any(ca.which_depends(expression, x, 1, True)):
            varying.append(item)
            continue
        value = float(ca.Function("constant", [x, p], [expression])(0, table.values))
        if not item.lower - _ROUNDING <= value <= item.upper + _ROUNDING:
            fault = f"is {value:.6g} with these parameters, which are all fixed, and must be {item.lower:g}"
            raise CaseError(f"robot.parameters: {item.constraint.name}", fault, source=case.source)
    return varying


def _add_pose(pose: Pose, prefix: str, table: SymbolTable) -> _StatedPose:
    """Add the numbers of a stated pose: its position, then its rotation."""
    position = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
    axis, angle = pose.rotation.axis, pose.rotation.angle
    if axis is not None:
        n = table.add_vector(f"{prefix}axis", Dimension.NUMBER, [float(c) for c in np.asarray(axis)])
        turn = table.add(f"{prefix}angle", Dimension.ANGLE, angle)
        rotation = matrix_from_axis_angle(n.symbols, turn.symbols)
        symbols, places = ca.vertcat(position.symbols, turn.symbols), (*position.places, *turn.places)
        return _StatedPose(rotation, position.symbols, places, symbols, HeldRotation(turn.places[0]), [], pose.steps)
    smallest, largest = sizes_of_turn(angle)
    radius = math.sin(largest / 2)
    if radius == 0:
        q = table.add_vector(f"{prefix}q", Dimension.NUMBER, (0.0, 0.0, 0.0)).symbols
        rotation = matrix_from_quaternion_vector(q)
        return _StatedPose(rotation, position.symbols, position.places, position.symbols, None, [], pose.steps)
    inner = math.sin(smallest / 2)
    start = angle.start if isinstance(angle, Free) and angle.start is not None else smallest
    # The ball implies |q_x| <= radius and so on: bounds that touched it would share its multiplier where it binds.
    room = min(_ROOM * radius, 1.0)
    along_z = Free(-room, room, math.sin(start / 2))
    placed = table.add_vector(f"{prefix}q", Dimension.NUMBER, (Free(-room, room), Free(-room, room), along_z))
    ball = Constraint(f"{prefix}angle", ca.sumsqr(placed.symbols), ROTATION_ANGLE)
    x, y, z = (place.index for place in placed.places)
    return _StatedPose(
        matrix_from_quaternion_vector(placed.symbols),
        position.symbols,
        position.places,
        position.symbols,
        FreeRotation((x, y, z), ball),
        [BoundedConstraint(ball, inner**2 if inner else -math.inf, radius**2)],
        pose.steps,
    )
