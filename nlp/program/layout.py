"""Case as symbols (variables, arguments, expressions of the robot), and its nonlinear program.

The variables are the free components of the parameters, of the position ``p``, and of the rotation:

* axis and angle fixed: none;
* axis fixed, angle free: the angle;
* axis free: the vector part ``q`` of the unit quaternion, with ``|q|^2`` between the squared sines of half of the
  smallest and of the largest allowed angle, one smooth constraint named ``angle``.

A direction parameter has three components as variables and its unit length as an equation, so that the coordinates have
no poles. Its components have bounds beyond -1 and 1, so that these are never active together with the equation.

Dimensions and poses that change from task to task are variables of one task: the robot at a pose of the task has these
values and only the twist of the task.

Several poses share the robot's dimensions. Each stated pose has its own position and rotation; the poses of a
trajectory or a grid follow from it by fixed displacements.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np
from casadi import SX

from ...models import (
    Dimension,
    Displacement,
    Model,
    Parameter,
    RobotInstance,
    Substitution,
    Unknown,
    frozen_vector,
    instantiate,
    matrix_from_axis_angle,
    matrix_from_quaternion_vector,
    reason_for_zero_row,
)
from ...models.instance import length_of, sizes_at
from ...models.model import joint_parameter
from ...models.values import dataclass
from ..case.case import Case
from ..case.choices import check_no_catalogue
from ..case.limits.constraint import BoundedConstraint, Call, Constraint, PairFamily, Reading, squared
from ..case.names import name_of_task
from ..case.pertask import Station
from ..case.pose import Free, Pose, Value, sizes_of_turn
from ..case.task import Sense, Task
from ..errors import CaseError
from .free_joints import set_ranges
from .limits import NamedSymbols, limit_constraints
from .loops import needed_equations
from .nlp import Nlp
from .places import Epigraph, FreeRotation, HeldRotation, Place, Places, RotationPlaces, SymbolTable
from .program import Program


def _angle_from(value: float) -> float:
    """Return the angle from ``sin^2(angle / 2)``."""
    return 2 * math.asin(math.sqrt(min(max(value, 0.0), 1.0)))


def _angle_slope(value: float) -> float:
    """Return the derivative of ``sin^2(angle / 2)`` with respect to the angle, at a given value."""
    return math.sqrt(max(value * (1 - value), 0.0))


#: Conversion of the constraint ``|q|^2 = sin^2(angle / 2)`` to the angle.
ROTATION_ANGLE = Reading(Dimension.ANGLE, from_value=_angle_from, slope=_angle_slope)
#: Conversion of the constraint ``|u|^2 = 1`` to the length.
_LENGTH_OF_DIRECTION = replace(squared(Dimension.NUMBER), to_value=Reading(Dimension.NUMBER).to_value)
#: Largest absolute value of a component of a free unit vector, or of a rotation's ``q`` in radii of its ball, as a
#: variable.
WIDENING = 1.25
#: Largest residual of an equation of fixed parameters that counts as satisfied: files state a dozen digits.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Layout:
    """Case as symbols, before an objective is chosen.

    Attributes:
        case: the case.
        table: symbols of the variables and arguments.
        places: typed places of the variables and arguments.
        robots: the robot at each pose.
        constraints: constraints that depend on a variable, and violated limits.
        constant_limits: satisfied limits that depend on no variable.
        families: limits on many pairs of values, such as two lengths of a leg at two poses; not yet constraints.
        implied: equations that the fixed parameters already satisfy: dependent loop equations, and lengths of fixed
            directions. These equations are not constraints.
        fixed_families: limits on many pairs of fixed values, each represented by its tightest pair.
    """

    case: Case
    table: SymbolTable
    places: Places
    robots: tuple[RobotInstance, ...]
    constraints: tuple[BoundedConstraint, ...]
    constant_limits: tuple[BoundedConstraint, ...] = ()
    families: tuple[PairFamily, ...] = ()
    implied: tuple[BoundedConstraint, ...] = ()
    fixed_families: tuple[PairFamily, ...] = ()


class StatedPoseSymbols(NamedTuple):
    """Stated pose as symbols.

    Attributes:
        rotation: (3, 3) ``R``, platform to world coordinates.
        position: (3, 1) ``p``, origin of the platform frame, length.
        numbers: places (indices among variables or arguments) of the case's parameters of the pose.
        symbols: symbols of these parameters.
        places: places of the rotation's variables.
        constraints: constraints on the rotation.
        displacements: displacements from the pose.
    """

    rotation: SX
    position: SX
    numbers: tuple[Place, ...]
    symbols: SX
    places: RotationPlaces
    constraints: list[BoundedConstraint]
    displacements: tuple[Displacement, ...]


#: Function that adds a stated pose, with a prefix of its names, to a symbol table.
AddPose: TypeAlias = Callable[[Pose, str, SymbolTable], StatedPoseSymbols]


def lay_out(case: Case, tasks: Sequence[Task], add_pose: AddPose | None = None) -> Layout:
    """Return symbols of all fixed and free parameters of a case, and the robot as expressions of these symbols.

    Args:
        case: the case.
        tasks: one or more tasks, with twists as arguments.
        add_pose: function that adds a stated pose in other coordinates than those of this module.

    Raises:
        CaseError: an equation of fixed parameters is violated, or a dimension has a list of values to choose from.
    """
    check_no_catalogue(case)
    if case.changes and len(tasks) < len(case.tasks):
        fault = "changes from task to task, but this command takes one robot and pose for all tasks"
        key = case.changing_key
        raise CaseError(
            key, f"{fault}; use solve, report, certify or export, or a case for each task", source=case.source
        )
    refuse_over_path(case)
    table, model = SymbolTable(), case.model
    owners = _Owners(table)
    parameters = [_add_parameter(case, item, owners) for item in model.parameters]
    add = _add_pose if add_pose is None else add_pose
    stated = []
    task_of_stated = {station.pose: station.task for station in case.stations} if case.pose_per_task else {}
    for k, (prefix, pose) in enumerate(zip(case.pose_prefixes, case.poses, strict=True)):
        stated.append(add(pose, prefix, table))
        owners.belong(task_of_stated.get(k))
    reference = reference_of(case)
    ranges = _ranges_of_unknowns(model, reference)
    unknowns = []
    for k, station in enumerate(case.stations):
        number = 0 if case.pose_count == 1 else k + 1
        pairs = zip(model.unknowns, ranges, strict=True)
        unknowns.append([table.add(_name_of(item, number), item.dimension, own) for item, own in pairs])
        owners.belong(station.task)
    joints = [
        [each.places[0].index for each, item in zip(at_pose, model.unknowns, strict=True) if item.is_free]
        for at_pose in unknowns
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
        _unit_length(item.name, placed.of_task[0])
        for item, placed in zip(model.parameters, parameters, strict=True)
        if item.is_direction
    ]
    values = [
        ca.vertcat(SX(0, 1), *[placed.of_task[k] for placed in parameters])
        for k in range(len(case.tasks) if case.changes else 1)
    ]
    robots: list[RobotInstance] = []
    loops: list[BoundedConstraint] = []
    following: list[BoundedConstraint] = []
    for k, (task, at, step) in enumerate(_stations(case, stated)):
        rotation, position = _displace(stated[at].rotation, stated[at].position, step)
        own_unknowns = ca.vertcat(SX(0, 1), *[each.symbols for each in unknowns[k]])
        substitution = Substitution(values[task or 0], own_unknowns, rotation, position, reference)
        own_twists = twists if task is None else [twists[task]]
        robot = instantiate(model, substitution, length, [twist.symbols for twist in own_twists])
        robots.append(robot)
        where = f" pose {k + 1}" if len(unknowns) > 1 else ""
        loops += [
            BoundedConstraint(
                Constraint(f"{equation.name}{where}", robot.closure[i], Reading(Dimension.NUMBER)), 0.0, 0.0
            )
            for i, equation in enumerate(model.closure)
        ]
    if model.loops:
        own = [each.places[0].index for at_pose in unknowns for each in at_pose]
        needed = needed_equations([item.constraint.expression for item in loops], table, own)
        following = [item for k, item in enumerate(loops) if k not in needed]
        loops = [loops[k] for k in needed]
    varying, fixed = _divided(case, [*constraints, *loops], table)
    limits = limit_constraints(case, robots, _named(case, values, [pose.symbols for pose in stated]), table)
    set_ranges(table, [index for at_pose in joints for index in at_pose], limits.varying)
    places = Places(
        numbers=(
            *(place for placed in parameters for place in placed.places),
            *(place for pose in stated for place in pose.numbers),
        ),
        rotations=tuple(pose.places for pose in stated),
        unknowns=tuple(tuple(each.places[0].index for each in at_pose) for at_pose in unknowns),
        joints=tuple(map(tuple, joints)),
        twists=tuple(range(placed.places[0].index, placed.places[-1].index + 1) for placed in twists),
        dimensions=sum(len(placed.places) for placed in parameters),
        owners=tuple(owners.found) if case.changes else (),
        tasks=tuple(station.task for station in case.stations if station.task is not None),
        directions=tuple(
            (x.index, y.index, z.index)
            for item, placed in zip(model.parameters, parameters, strict=True)
            if item.is_direction and all(place.vector == "x" for place in placed.places)
            for x, y, z in [placed.places]
        ),
    )
    return Layout(
        case,
        table,
        places,
        tuple(robots),
        (*varying, *limits.varying),
        limits.constant,
        limits.families,
        (*following, *fixed),
        limits.fixed_families,
    )


def refuse_over_path(case: Case) -> None:
    """Refuse a case that is optimised along its path: it has no pose of its own.

    Raises:
        CaseError: the case is optimised along its path.
    """
    if case.over_path is None:
        return
    fault = "optimises along the path, but this command takes one pose; use solve"
    if case.settings:
        name = next(iter(case.settings))
        fault = f"{name} changes along the path, but this command takes one robot; use solve"
    raise CaseError("objective.as", fault, case.over_path.value, source=case.source)


class _Parameter(NamedTuple):
    """Symbols (n, 1) of a parameter, one vector for each task if dimensions change with it, and all their places."""

    of_task: tuple[SX, ...]
    places: tuple[Place, ...]


class _Owners:
    """Task of each variable of a symbol table under construction; None for variables of all tasks."""

    def __init__(self, table: SymbolTable) -> None:
        self.table = table
        self.found: list[int | None] = []

    def belong(self, task: int | None) -> None:
        """Record the task of the variables that were added last."""
        self.found += [task] * (len(self.table.x) - len(self.found))


def _add_parameter(case: Case, item: Parameter, owners: _Owners) -> _Parameter:
    """Add the components of a parameter, those that change from task to task once for each task."""
    names, values, own = case.component_names(item), _component_values(case, item), case.dimensions_per_task
    if not case.changes:
        placed = owners.table.add_each(names, item.dimension, values)
        owners.belong(None)
        return _Parameter((placed.symbols,), placed.places)
    symbols: list[list[SX]] = [[] for _ in case.tasks]
    places: list[Place] = []
    for key, name, value in zip(item.components, names, values, strict=True):
        given = own[key].values if key in own else [value]
        for task, each in enumerate(given):
            shown = name_of_task(name, task) if key in own else name
            placed = owners.table.add(shown, item.dimension, each)
            owners.belong(task if key in own else None)
            places += placed.places
            for column in [symbols[task]] if key in own else symbols:
                column.append(placed.symbols)
    return _Parameter(tuple(ca.vertcat(SX(0, 1), *column) for column in symbols), tuple(places))


def _stations(case: Case, stated: Sequence[StatedPoseSymbols]) -> list[Station]:
    """Return the poses of the robot; their displacements are those of the poses as they were added."""
    if case.changes:
        return list(case.stations)
    return [Station(None, k, step) for k, pose in enumerate(stated) for step in pose.displacements]


def _named(case: Case, values: Sequence[SX], poses: Sequence[SX]) -> list[NamedSymbols]:
    """Return the symbols of the case's parameters by name: for each task its own, if these change with the task.

    Args:
        case: the case.
        values: symbols of the robot's parameters, for each task.
        poses: symbols of each stated pose.
    """
    if not case.changes:
        numbers = ca.vertsplit(ca.vertcat(values[0], *poses))
        return [NamedSymbols(case, dict(zip(case.scalars, numbers, strict=True)), range(case.pose_count))]
    found, stations = [], case.stations
    for task in range(len(case.tasks)):
        own = [k for k, station in enumerate(stations) if station.task == task]
        stated = dict.fromkeys(stations[k].pose for k in own)
        numbers = ca.vertsplit(ca.vertcat(values[task], *[poses[k] for k in stated]))
        alone = case.of_task(task)
        found.append(NamedSymbols(alone, dict(zip(alone.scalars, numbers, strict=True)), own, case.tasks[task].name))
    return found


def reference_of(case: Case) -> tuple[float, ...]:
    """Return the mid-range value of each parameter component, for the sizes of equations.

    The values are in the unit of the case, so that its equations do not depend on the unit of length.
    """
    values = [value for item in case.model.parameters for value in case.components(item.name)]
    return tuple((each.lower + each.upper) / 2 if isinstance(each, Free) else float(each) for each in values)


def robot_length(case: Case) -> float:
    """Return the characteristic size of a case's robot, length, at the middle of each range of its parameters."""
    return length_of(case.model, reference_of(case))


def _name_of(unknown: Unknown, pose: int) -> str:
    """Return the name of an unknown's variable at a pose, counted from 1; 0 for a single pose."""
    if unknown.is_free:
        return f"{joint_parameter(unknown.joint)}{f' pose {pose}' if pose else ''}"
    return f"at{pose}_{unknown.name}" if pose else unknown.name


def _ranges_of_unknowns(model: Model, reference: tuple[float, ...]) -> list[Free]:
    """Return the range of each unknown of a model for values of the parameters."""
    sizes = sizes_at(model, model.unknowns, reference, SX.ones(len(model.unknowns)))
    values = [float(size) for size in ca.vertsplit(sizes)] if model.unknowns else []
    pairs = zip(model.unknowns, values, strict=True)
    return [Free(size * item.lower, size * item.upper) for item, size in pairs]


def _unit_length(name: str, direction: SX) -> BoundedConstraint:
    """Return the unit-length equation of a direction (3, 1)."""
    return BoundedConstraint(Constraint(f"|{name}|", ca.sumsqr(direction), _LENGTH_OF_DIRECTION), 1.0, 1.0)


def _displace(rotation: SX, position: SX, step: Displacement) -> tuple[SX, SX]:
    """Return ``R`` (3, 3) and ``p`` (3, 1) of a stated pose after one of its displacements."""
    if step.is_identity:
        return rotation, position
    Q, t = SX(step.rotation.tolist()), SX(step.translation.tolist())
    return Q @ rotation, Q @ position + t


def _component_values(case: Case, parameter: Parameter) -> tuple[Value, ...]:
    """Return the values of a parameter's components.

    Components of a free direction get bounds beyond -1 and 1, and a nonzero start.
    """
    values = case.components(parameter.name)
    if not (parameter.is_direction and any(isinstance(value, Free) for value in values)):
        return values
    widened: list[Value] = []
    without_start = all(isinstance(value, Free) and value.start is None for value in values)
    for value, typical in zip(values, parameter.typical, strict=True):
        if isinstance(value, Free):
            start = min(max(typical, value.lower), value.upper) if without_start else value.start
            lower = -WIDENING if value.lower == -1.0 else value.lower
            upper = WIDENING if value.upper == 1.0 else value.upper
            widened.append(Free(lower, upper, start))
        else:
            widened.append(value)
    return tuple(widened)


def _divided(
    case: Case, constraints: Sequence[BoundedConstraint], table: SymbolTable
) -> tuple[list[BoundedConstraint], list[BoundedConstraint]]:
    """Divide constraints into those with and those without variables; refuse a violated constraint without variables.

    Raises:
        CaseError: a constraint of fixed parameters only is violated.
    """
    x, p = table.variables_vector, table.arguments_vector
    variable: list[BoundedConstraint] = []
    fixed: list[BoundedConstraint] = []
    for item in constraints:
        expression = item.constraint.expression
        if x.numel() and any(ca.which_depends(expression, x, 1, True)):
            variable.append(item)
            continue
        value = float(ca.Function("constant", [x, p], [expression])(0, table.values))
        if not item.lower - _ROUNDING <= value <= item.upper + _ROUNDING:
            fault = f"is {value:.6g} with these fixed parameters, but must be {item.lower:g}"
            raise CaseError(f"robot.parameters: {item.constraint.name}", fault, source=case.source)
        fixed.append(item)
    return variable, fixed


def _add_pose(pose: Pose, prefix: str, table: SymbolTable) -> StatedPoseSymbols:
    """Add the parameters of a stated pose, position, then rotation, and return its symbols.

    Args:
        pose: the pose.
        prefix: prefix of the parameters' names.
        table: the symbols of the program.
    """
    position = table.add_vector(f"{prefix}p", Dimension.LENGTH, tuple(pose.position))
    axis, angle = pose.rotation.axis, pose.rotation.angle
    if axis is not None:
        n = table.add_vector(f"{prefix}axis", Dimension.NUMBER, [float(c) for c in np.asarray(axis)])
        size = table.add(f"{prefix}angle", Dimension.ANGLE, angle)
        rotation = matrix_from_axis_angle(n.symbols, size.symbols)
        symbols, places = ca.vertcat(position.symbols, size.symbols), (*position.places, *size.places)
        unit = [_unit_length(f"{prefix}axis", n.symbols)]
        return StatedPoseSymbols(
            rotation, position.symbols, places, symbols, HeldRotation(size.places[0]), unit, pose.displacements
        )
    smallest, largest = sizes_of_turn(angle)
    radius = math.sin(largest / 2)
    if radius == 0:
        q = table.add_vector(f"{prefix}q", Dimension.NUMBER, (0.0, 0.0, 0.0)).symbols
        rotation = matrix_from_quaternion_vector(q)
        return StatedPoseSymbols(
            rotation, position.symbols, position.places, position.symbols, None, [], pose.displacements
        )
    inner = math.sin(smallest / 2)
    start = angle.start if isinstance(angle, Free) and angle.start is not None else smallest
    # The ball implies |q_x| <= radius and so on: a bound tangent to the ball would share its multiplier where the ball
    # constraint is active.
    bound = min(WIDENING * radius, 1.0)
    along_z = Free(-bound, bound, math.sin(start / 2))
    vector = table.add_vector(f"{prefix}q", Dimension.NUMBER, (Free(-bound, bound), Free(-bound, bound), along_z))
    ball = Constraint(f"{prefix}angle", ca.sumsqr(vector.symbols), ROTATION_ANGLE)
    x, y, z = (place.index for place in vector.places)
    return StatedPoseSymbols(
        matrix_from_quaternion_vector(vector.symbols),
        position.symbols,
        position.places,
        position.symbols,
        FreeRotation((x, y, z), ball),
        [BoundedConstraint(ball, inner**2 if inner else -math.inf, radius**2)],
        pose.displacements,
    )


def assemble(
    layout: Layout,
    objective: SX | Call,
    sense: Sense,
    constraints: Sequence[BoundedConstraint] = (),
    epigraph: Epigraph | None = None,
    weights: tuple[int, ...] = (),
) -> Nlp:
    """Return the nonlinear program of a case, from its symbols and an objective.

    Args:
        layout: case as symbols.
        objective: (1, 1) expression of the symbols, or the call that returns it.
        sense: maximisation or minimisation of the objective.
        constraints: constraints in addition to those of the layout.
        epigraph: places of the epigraph, if the objective is an epigraph variable.
        weights: indices in ``p`` of the tasks' weights; empty for one task.

    Raises:
        CaseError: a limb has zero length at every point of the box.
    """
    case, table = layout.case, layout.table
    bounded = (*layout.constraints, *constraints)
    program = Program(
        variables=tuple(table.variables),
        arguments=tuple(table.arguments),
        x=table.variables_vector,
        p=table.arguments_vector,
        objective=objective.value if isinstance(objective, Call) else objective,
        constraints=tuple(item.constraint for item in bounded),
        robots=layout.robots,
        model=case.model,
        places=replace(layout.places, epigraph=epigraph, weights=weights),
        objective_call=objective if isinstance(objective, Call) else None,
    )
    nlp = Nlp(
        program=program,
        case=case,
        sense=sense,
        arguments=frozen_vector(table.values),
        lower=frozen_vector([bound.lower for bound in table.bounds]),
        upper=frozen_vector([bound.upper for bound in table.bounds]),
        start=frozen_vector([bound.first for bound in table.bounds]),
        g_lower=frozen_vector([item.lower for item in bounded]),
        g_upper=frozen_vector([item.upper for item in bounded]),
        constant_limits=layout.constant_limits,
        families=layout.families,
        implied=layout.implied,
        fixed_families=layout.fixed_families,
    )
    _check_limbs(nlp)
    return nlp


def _check_limbs(nlp: Nlp) -> None:
    """Refuse a limb with zero or undefined direction at every point of the box.

    Raises:
        CaseError: the robot has such a limb.
    """
    program = nlp.program
    for robot, kernel in zip(program.robots, program.kernels.robot_states, strict=True):
        values = kernel(nlp.start, nlp.arguments).squares.ravel()
        free = ca.which_depends(robot.squares, program.x, 1, True) if nlp.n else [False] * len(values)
        for row, value, varies in zip(program.model.wrenches, values, free, strict=True):
            if not varies and not value > 0:
                undefined = f"limb {row.limb!r} has no finite wrench at any pose with these dimensions"
                reason = undefined if np.isnan(value) else reason_for_zero_row(row)
                raise CaseError("robot.parameters", reason, source=nlp.case.source)
