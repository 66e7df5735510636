"""Formulation of the schedule problem of a case: expressions of F, limits and loops at one point of its path.

Design and settings are symbols, and so are the numbers of a point: pose, feed and margin of the limits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, Model, RobotInstance, Substitution, homogenised, instantiate
from ....models.joints.model.closedform import closed_form, eliminated_form
from ....models.rotation import matrix_from_axis_angle
from ....models.statics import posed_statics
from ...case.case import Case
from ...case.choices import check_no_catalogue
from ...case.forces import forces_at
from ...case.limits.constraint import NUMBER, BoundedConstraint, Extent, Reading
from ...case.limits.limit import Design, Plate, PlateJoint, PosedRobot
from ...case.limits.singular_values import smallest_eigenvalue
from ...case.pathfile import TURN
from ...case.pose import Free
from ...case.task import LEG_LENGTH, SMALLEST, Task
from ...errors import CaseError
from ...path.reader import path_without_settings
from ...path.settings import changing_of
from ...path.waypoints import Waypoints, waypoints
from ...program.actuators import signed_values
from ...program.layout import reference_of
from ...proof.statement.fixed_robot import check_home, check_moving
from .problem import CLOSED, ROUNDING, ScheduleProblem, Variable, ends

#: First words of the name of a limb's reach among the limits.
REACH = "reach limb "
#: Numbers of a point: position, rotation matrix column by column, unit vector of the feed, margin of the limits.
_POINT = 16
#: Number of designs and settings at which loops are tested along the path.
_TESTED, _SEED = 12, 0


class _Stated(NamedTuple):
    """Constraint of the case at one point: name, expression with its bounds, reading, and whether it is no estimate."""

    name: str
    expression: SX
    lower: float
    upper: float
    reading: Reading
    is_exact: bool = True


class _Row(NamedTuple):
    """One side of a constraint: name, excess relative to the size of the bound, and whether it is no estimate."""

    name: str
    excess: SX
    is_exact: bool


def schedule_problem(case: Case) -> ScheduleProblem:
    """Return the schedule problem of a case.

    Args:
        case: case with an objective over its path.

    Raises:
        CaseError: a limit, a direction or the robot is not supported along a path, or a rate needs times of the path.
        InputError: the path cannot be read.
    """
    check_no_catalogue(case)
    case.require_motion()
    if case.limits_over:
        check_moving(case, tuple(changing_of(case).own.values()))
    points = waypoints(path_without_settings(case))
    _check_times(case, points)
    closed = closed_form(case.model)
    if closed.model.unknowns:
        closed = eliminated_form(case.model)
    model = closed.model
    if model.unknowns:
        limbs = _limbs_of_unknowns(case.model, model)
        fault = (
            f"is not supported along a path for {case.model.name!r}: no closed form of the passive joints of {limbs}"
        )
        raise CaseError("objective.as", fault, case.over_path and case.over_path.value, source=case.source)
    _check_feeds(case, points)
    design, settings, parameters, d, s = _variables(case)
    check_home(case, [each.name for each in settings if each.name != TURN])
    point = SX.sym("point", _POINT)
    position, rotation, feed = point[:3], ca.reshape(point[3:12], 3, 3), point[12:15]
    turned, axis, changing = rotation, SX([0.0, 0.0, 1.0]), changing_of(case)
    if changing.axis is not None:
        local = SX(changing.axis.tolist())
        axis = rotation @ local
        angle = s[[each.name for each in settings].index(TURN)] if TURN in case.settings else SX(changing.turn)
        turned = rotation @ matrix_from_axis_angle(local, angle)
    substitution = Substitution(parameters, SX(0, 1), turned, position, reference_of(case))
    twists = [_twist(task, position, feed, axis) for task in case.tasks]
    length = SX(case.characteristic_length)
    robot = instantiate(model, substitution, length, twists)
    stated = [
        _Stated(item.constraint.name, item.constraint.expression, item.lower, item.upper, item.constraint.reading,
                is_exact=item.constraint.spectral is None)
        for item in _limits(case, robot, parameters)
    ]  # fmt: skip
    for reach in closed.reaches:
        value = ca.Function("reach", Substitution.identity(model).all, [reach.value]).call(substitution.all)[0]
        stated.append(_Stated(f"{REACH}{reach.limb}", value, 0.0, math.inf, NUMBER))
    rows = [row for each in stated for row in _rows(each, case.characteristic_length)]
    rows = [row for row in rows if not _is_bound(row.excess, d, s, [*design, *settings])]
    varying = [bool(ca.depends_on(row.excess, ca.vertcat(s, point))) for row in rows]
    at_points = [row for row, own in zip(rows, varying, strict=True) if own]
    lengths, extents = _extents(case, robot)
    matrix = _matrix(case, robot)
    values = _values(case, model, robot) if matrix is None else ca.sqrt(smallest_eigenvalue(matrix.T @ matrix))
    weights = [1.0] * values.numel() if case.tasks[0].measure else [task.weight for task in case.tasks]
    problem = ScheduleProblem(
        case=case,
        points=points,
        design=design,
        settings=settings,
        weights=np.array(weights),
        symbols=(d, s, point),
        objective=case.tasks[0].sense.sign * values,
        limits=ca.vertcat(SX(0, 1), *[row.excess + point[15] for row in at_points]),
        of_design=ca.vertcat(SX(0, 1), *[row.excess for row, own in zip(rows, varying, strict=True) if not own]),
        loops=robot.loops if model.loops else robot.closure,
        names=tuple(row.name for row in at_points),
        lengths=lengths,
        extents=extents,
        are_exact=tuple(row.is_exact for row in at_points),
        matrix=matrix,
    )
    _check_poses(problem)
    return problem


def _limbs_of_unknowns(model: Model, left: Model) -> str:
    """Return the limbs with unknowns that are left, in words.

    Args:
        model: the robot, whose unknowns are in the order of its chains.
        left: the robot without the unknowns that have a closed form.
    """
    owners = [each.limb for each in model.structure for _ in range(each.unknowns)]
    names = {each.name for each in left.unknowns}
    found = dict.fromkeys(limb for each, limb in zip(model.unknowns, owners, strict=True) if each.name in names)
    return f"limb{'s' * (len(found) > 1)} {', '.join(found)}"


def _check_poses(problem: ScheduleProblem) -> None:
    """Refuse a path with a pose that the robot takes with no tested design and settings within its reach.

    Raises:
        CaseError: the loop equations exclude a pose.
    """
    count, (low, high, first) = len(problem.points), ends([*problem.design, *problem.settings])
    if not problem.loops.numel():
        return
    rng, n = np.random.default_rng(_SEED), len(problem.design)
    reach = [k for k, name in enumerate(problem.names) if name.startswith(REACH)]
    least, within = np.full(count, math.inf), np.zeros(count, dtype=bool)
    for values in (first, *(rng.uniform(low, high) for _ in range(_TESTED))):
        d, s = values[:n], np.repeat(values[None, n:], count, axis=0)
        is_within = (problem.at(d, s).excess[:, reach] <= 0).all(axis=1)
        least[is_within] = np.minimum(least, problem.gaps(d, s))[is_within]
        within |= is_within
    wrong = np.flatnonzero(within & ~(least <= CLOSED))
    if len(wrong):
        x, y, z = problem.points.positions[wrong[0]].tolist()
        fault = f"{problem.case.model.name!r} cannot take the pose at ({x:.7g}, {y:.7g}, {z:.7g}): its joints constrain"
        raise CaseError("path.file", f"{fault} the platform to other poses", source=problem.case.source)


def _check_times(case: Case, points: Waypoints) -> None:
    """Refuse a finite rate along a path with a segment without a time."""
    limited = [name for name, value in case.settings.items() if value.rate is not None and math.isfinite(value.rate)]
    untimed = np.flatnonzero(~np.isfinite(points.seconds))
    if limited and len(untimed):
        fault = f"needs the time of every segment, which the path does not state; give {limited[0]} the rate inf,"
        raise CaseError(f"{limited[0]}.rate", f"{fault} or state t or feed in the path", source=case.source)


def _check_feeds(case: Case, points: Waypoints) -> None:
    """Refuse a motion along the feed at a point where the platform does not translate."""
    still = np.flatnonzero(~points.feeds.any(axis=1))
    for index, task in enumerate(case.tasks):
        if task.follows == "feed" and len(still):
            x, y, z = points.positions[still[0]].tolist()
            fault = f"has no direction at ({x:.7g}, {y:.7g}, {z:.7g}), where the platform rests or only rotates"
            raise CaseError(f"task[{index}].follows", f"{fault}; use 'tool' or 'thrust', or divide the path", "feed")


def _variables(case: Case) -> tuple[tuple[Variable, ...], tuple[Variable, ...], SX, SX, SX]:
    """Return design, settings, the parameters (n, 1) of the robot as expressions, and symbols of both."""
    design: list[Variable] = []
    settings: list[Variable] = []
    places: list[tuple[str, float | int]] = []
    for item in case.model.parameters:
        names = case.component_names(item)
        for name, value in zip(names, case.components(item.name), strict=True):
            if not isinstance(value, Free):
                places.append(("", float(value)))
                continue
            if item.is_direction:
                raise CaseError(f"robot.parameters.{item.name}", "must be fixed with objective.as: it is a direction")
            found = Variable(name, item.dimension, value.lower, value.upper, value.first, value.rate)
            into, kind = (design, "d") if value.rate is None else (settings, "s")
            places.append((kind, len(into)))
            into.append(found)
    turn = case.settings.get(TURN)
    if turn is not None:
        settings.append(Variable(TURN, Dimension.ANGLE, turn.lower, turn.upper, turn.first, turn.rate))
    d, s = SX.sym("d", len(design)), SX.sym("s", len(settings))
    symbols = {"d": d, "s": s}
    parts = [symbols[kind][int(place)] if kind else SX(place) for kind, place in places]
    return tuple(design), tuple(settings), ca.vertcat(SX(0, 1), *parts), d, s


def _twist(task: Task, position: SX, feed: SX, axis: SX) -> SX:
    """Return the twist (6, 1) of a task at a point."""
    if task.follows == "feed":
        return ca.vertcat(SX.zeros(3), feed)
    if task.follows == "thrust":
        return ca.vertcat(SX.zeros(3), axis)
    if task.follows == "tool":
        return ca.vertcat(axis, ca.cross(position, axis))
    return SX([float(part) for part in np.asarray(task.twist)])


def _values(case: Case, model: Model, robot: RobotInstance) -> SX:
    """Return F (T, 1) of the tasks at a point, or the quantities of legs or actuators that are minimised."""
    measure = case.tasks[0].measure
    if not measure:
        return robot.F
    if measure == LEG_LENGTH:
        if not robot.legs:
            raise CaseError("objective.minimise", f"needs legs, but {case.model.name!r} has none", LEG_LENGTH)
        return ca.vertcat(*[ca.norm_2(leg.span) for leg in robot.legs])
    forces = forces_at(model, posed_statics(model, robot), robot.rotation, case.loading, robot.size)
    return ca.vertcat(*[each.value for each in signed_values(case, forces)])


def _extents(case: Case, robot: RobotInstance) -> tuple[SX, tuple[tuple[Extent, ...], ...]]:
    """Return the values (l, 1) at a point that limits compare between points, and the limits on each of them."""
    pair = Design(case.as_limited, (robot, robot), {})
    families = [family for limit in case.limits for family in limit.on_pairs(pair)]
    return ca.vertcat(SX(0, 1), *[each.values[0] for each in families]), tuple(each.extents for each in families)


def _matrix(case: Case, robot: RobotInstance) -> SX | None:
    """Return the homogenised J (m, 6) at a point, if its smallest singular value is the objective; otherwise None.

    Raises:
        CaseError: J has fewer than six rows, so its smallest singular value is 0.
    """
    task = case.tasks[0]
    if task.measure != SMALLEST or task.length is None:
        return None
    found = ca.horzcat(*homogenised(robot.jacobian, robot.position, task.length))
    if found.shape[0] < found.shape[1]:
        fault = f"is 0 for {case.model.name!r}: its J has {found.shape[0]} rows, fewer than six"
        raise CaseError(task.objective_key, fault, task.measure, case.source)
    return found


def _limits(case: Case, robot: RobotInstance, parameters: SX) -> list[BoundedConstraint]:
    """Return the limits of a case at one point."""
    stated = [*case.position, case.rotation.angle]
    numbers = ca.vertsplit(ca.vertcat(parameters, *[SX(float(each)) for each in stated])) if case.limits else []  # type: ignore[arg-type]
    design = Design(case.as_limited, (robot,), dict(zip(case.scalars, numbers, strict=False)))
    pose = PosedRobot(case.model, robot, tuple(task.name for task in case.tasks), "", case.loading)
    plates = [
        Plate("base", tuple(PlateJoint(leg.name, leg.base) for leg in robot.legs)),
        Plate("platform", tuple(PlateJoint(leg.name, leg.platform) for leg in robot.legs)),
    ]
    found: list[BoundedConstraint] = []
    for limit in sorted(case.limits, key=attrgetter("order")):
        found += [item for plate in plates for item in limit.on_plate(plate)]
        found += [*limit.of_design(design), *limit.at_pose(pose)]
    return found


def _rows(stated: _Stated, length: float) -> Iterator[_Row]:
    """Yield the sides of a constraint, with the characteristic length of the robot."""
    name, expression, lower, upper, reading, is_exact = stated
    if math.isfinite(upper):
        yield _Row(name, (expression - upper) / reading.size(upper, length), is_exact)
    if math.isfinite(lower):
        yield _Row(name, (lower - expression) / reading.size(lower, length), is_exact)


def _is_bound(row: SX, d: SX, s: SX, variables: Sequence[Variable]) -> bool:
    """Return whether a row ``row <= 0`` holds within the range of its only variable, as the limit on a joint does.

    Args:
        row: (1, 1) row.
        d: (n, 1) symbols of the design.
        s: (k, 1) symbols of the settings.
        variables: variables of both.
    """
    symbols = ca.vertcat(d, s)
    own = ca.symvar(row)
    hashes = [each.element_hash() for each in ca.vertsplit(symbols)] if symbols.numel() else []
    if len(own) != 1 or own[0].element_hash() not in hashes:
        return False
    variable = variables[hashes.index(own[0].element_hash())]
    if ca.depends_on(ca.jacobian(row, own[0]), own[0]):
        return False
    ends_of_row = ca.Function("row", own, [row]).map(2)([variable.lower, variable.upper]).full()
    return bool((ends_of_row <= ROUNDING).all())
