"""Schedule problem: F and limits at each point of a path, as one function of design, settings and the point.

    maximise  sum_i w_i sum_j F_j(d, s_i, point_i)   or   min_ij F_j(d, s_i, point_i)

over the design d and the settings s_i at N points, within limits at each point and ``|s_(i+1) - s_i| <= rate dt_i``. F
is negative for a minimum. A quantity of the legs or actuators has the largest one as value of a point: ``min_j`` takes
the place of the sum. The function is mapped over the points, so its expressions do not grow with the path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, lru_cache
from operator import attrgetter
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import Dimension, FloatArray, Model, RobotInstance, Substitution, homogenised, instantiate
from ....models.joints.model.closedform import closed_form, eliminated_form
from ....models.rotation import matrix_from_axis_angle
from ....models.statics import posed_statics
from ....models.values import dataclass
from ...case.case import Case
from ...case.choices import check_no_catalogue
from ...case.forces import forces_at
from ...case.limits.constraint import NUMBER, BoundedConstraint, Extent, Reading
from ...case.limits.limit import Design, Plate, PlateJoint, PosedRobot
from ...case.limits.singular_values import smallest_eigenvalue
from ...case.pathfile import TURN
from ...case.pose import Free, OverPoses
from ...case.task import LEG_LENGTH, SMALLEST, Task
from ...errors import CaseError
from ...path.reader import path_without_settings
from ...path.settings import changing_of
from ...path.waypoints import Waypoints, waypoints
from ...program.actuators import signed_values
from ...program.layout import reference_of
from ...proof.statement.fixed_robot import check_moving

#: First words of the name of a limb's reach among the limits.
REACH = "reach limb "
#: Numbers of a point: position, rotation matrix column by column, unit vector of the feed, margin of the limits.
_POINT = 16
#: Number of mapped functions that are kept: their construction takes longer than a call with few points.
_MAPS = 4
#: Part by which steps between points are smaller than the rates allow, so that written values keep the rates too.
INSIDE = 1e-9
#: Rounding of a difference of two settings, relative to the largest setting.
_ROUNDING = 2.0**-50
#: Largest residual of closed loops, which have magnitudes of about 1. At the edge of the reach it is as large as the
#: excess over a limit that counts as rounding.
_CLOSED = 1e-6
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


class Variable(NamedTuple):
    """Free value of a schedule problem: a dimension of the design, or a setting.

    Attributes:
        name: name in the case, or ``turn``.
        dimension: physical dimension.
        lower, upper, first: bounds, and value at the first starting point.
        rate: largest change per second of a setting; None for the design.
    """

    name: str
    dimension: Dimension
    lower: float
    upper: float
    first: float
    rate: float | None = None


class Values(NamedTuple):
    """Values at points of the path.

    Attributes:
        objective: (N, T) signed F of each task, or negative quantities of legs or actuators.
        excess: (N, c) amounts by which limits are exceeded, relative to their sizes; negative within a limit.
    """

    objective: FloatArray
    excess: FloatArray


@dataclass(frozen=True, eq=False)
class ScheduleProblem:
    """Design and schedule of a case along its path.

    Attributes:
        case: the case.
        points: points of the path.
        design, settings: free values of the design, and settings.
        weights: (T,) weight of each objective at a point.
        symbols: symbols ``d``, ``s`` and of the numbers of a point.
        objective: (T, 1) signed objectives.
        limits: (c, 1) limits as expressions that must be at most 0.
        of_design: (b, 1) limits of the design alone, at most 0.
        loops: (e, 1) left sides of the loop equations, scaled to values of about 1; 0 at poses that the robot can take.
        names: names of the limits.
        lengths: (l, 1) values at a point of which a limit compares the smallest with the largest one, such as a stroke.
        extents: limits on each of these values.
        are_exact: (c,) whether each limit is on the quantity of the case; false for a limit on a stricter estimate.
        matrix: (m, 6) homogenised J, if its smallest singular value is the objective; otherwise None.
        margins: (N,) margins by which limits are tighter at the points, relative to their sizes; 0 if left out.
        extent_margin: margin by which limits that compare points are tighter, relative to their sizes.
    """

    case: Case
    points: Waypoints
    design: tuple[Variable, ...]
    settings: tuple[Variable, ...]
    weights: FloatArray
    symbols: tuple[SX, SX, SX]
    objective: SX
    limits: SX
    of_design: SX
    loops: SX
    names: tuple[str, ...]
    lengths: SX
    extents: tuple[tuple[Extent, ...], ...]
    are_exact: tuple[bool, ...]
    matrix: SX | None = None
    margins: FloatArray | None = None
    extent_margin: float = 0.0

    @property
    def sign(self) -> float:
        """1 for a maximum, -1 for a minimum."""
        return self.case.tasks[0].sense.sign

    @property
    def is_worst(self) -> bool:
        """True if the worst value over the points is optimised, false for the mean."""
        return self.case.over_path is OverPoses.WORST

    @property
    def has_levels(self) -> bool:
        """True if the value of a point is the worst of its objectives: quantities of legs or actuators."""
        return bool(self.case.tasks[0].measure) and self.matrix is None

    @property
    def is_periodic(self) -> bool:
        """True if settings are equal at the first and the last point."""
        return self.case.path is not None and self.case.path.periodic

    @cached_property
    def numbers(self) -> FloatArray:
        """Numbers (m, N) of the points."""
        points = self.points
        rotations = points.rotations.transpose(0, 2, 1).reshape(len(points), 9)
        margins = np.zeros(len(points)) if self.margins is None else self.margins
        return np.ascontiguousarray(np.hstack([points.positions, rotations, points.feeds, margins[:, None]]).T)

    @cached_property
    def steps(self) -> FloatArray:
        """Largest change (N - 1, k) of each setting from each point to the next; infinite without a rate."""
        rates = np.array([each.rate for each in self.settings], dtype=np.float64)
        found = np.full((len(self.points) - 1, len(rates)), math.inf)
        for k, rate in enumerate(rates):
            if math.isfinite(rate):
                found[:, k] = rate * self.points.seconds
        return found

    @cached_property
    def function(self) -> ca.Function:
        """Function of design, settings and the numbers of a point, with objectives and limits."""
        return ca.Function("point", list(self.symbols), [ca.densify(self.objective), ca.densify(self.limits)])

    @cached_property
    def _mapped(self) -> Callable[[int], ca.Function]:
        """The function mapped over a number of points; the last maps are kept."""
        return lru_cache(_MAPS)(self.function.map)

    @cached_property
    def matrix_function(self) -> ca.Function | None:
        """Function of design, settings and the numbers of a point, with the homogenised J (m, 6); None without it."""
        if self.matrix is None:
            return None
        return ca.Function("matrix", list(self.symbols), [ca.densify(self.matrix)])

    def matrices(self, d: FloatArray, s: FloatArray, numbers: FloatArray) -> FloatArray | None:
        """Return the homogenised J (N, m, 6) for a design (n,) and settings (N, k) at points with numbers (16, N)."""
        if self.matrix_function is None or self.matrix is None:
            return None
        count = numbers.shape[1]
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        rows, columns = self.matrix.shape
        found = self.matrix_function.map(count)(design, np.reshape(s, (count, -1)).T, numbers).full()
        return np.asarray(found.reshape(rows, count, columns).transpose(1, 0, 2))

    @cached_property
    def lengths_function(self) -> ca.Function:
        """Function of design, settings and the numbers of a point, with the lengths that limits compare."""
        return ca.Function("lengths", list(self.symbols), [ca.densify(self.lengths)])

    def compared(self, d: FloatArray, s: FloatArray) -> FloatArray:
        """Return the lengths (N, l) that limits compare, for a design (n,) and settings (N, k)."""
        count = len(self.points)
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        return np.asarray(self.lengths_function.map(count)(design, s.T, self.numbers).full().T)

    def extent_excess(self, d: FloatArray, s: FloatArray) -> float:
        """Return the largest relative excess over a limit that compares two points; minus infinity without any."""
        if not self.extents:
            return -math.inf
        lengths = self.compared(d, s)
        excess = [
            (largest - each.ratio * smallest - each.most) / abs(each.most) + self.extent_margin
            for own, smallest, largest in zip(
                self.extents, lengths.min(axis=0).tolist(), lengths.max(axis=0).tolist(), strict=True
            )
            for each in own
        ]
        return float(max(excess))

    def at(
        self, d: FloatArray, s: FloatArray, which: Sequence[int] | None = None, *, estimated: bool = False
    ) -> Values:
        """Return the values for a design (n,) and settings (N, k) at the points, or at some of the points.

        Args:
            d: (n,) design.
            s: (N, k) settings.
            which: indices of the points; all if left out.
            estimated: If true, the smallest singular value is the smooth estimate of the program, not above it.
        """
        numbers = self.numbers if which is None else self.numbers[:, list(which)]
        count = numbers.shape[1]
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        objective, limits = self._mapped(count)(design, np.reshape(s, (count, -1)).T, numbers)
        values, matrices = objective.full().T, None if estimated else self.matrices(d, s, numbers)
        if matrices is not None:
            regular = np.isfinite(matrices).all(axis=(1, 2))
            values = np.full((count, 1), math.nan)
            values[regular] = np.linalg.svd(matrices[regular], compute_uv=False)[:, -1:]
        return Values(values, limits.full().T)

    def gaps(self, d: FloatArray, s: FloatArray) -> FloatArray:
        """Return the largest residual (N,) of the loop equations at the points, for a design (n,) and settings."""
        function = ca.Function("loops", list(self.symbols), [ca.densify(self.loops)])
        count = len(self.points)
        design = np.repeat(np.reshape(d, (-1, 1)), count, axis=1)
        found = function.map(count)(design, np.reshape(s, (count, -1)).T, self.numbers)
        return np.asarray(np.abs(found.full()).max(axis=0, initial=0.0))

    def combined(self, objective: FloatArray) -> FloatArray:
        """Return the value of each point from its objectives (..., T): their sum, or the worst."""
        weighted = objective * self.weights
        is_worst = self.is_worst or self.has_levels
        return np.asarray(weighted.min(axis=-1) if is_worst else weighted.sum(axis=-1))

    def value(self, d: FloatArray, s: FloatArray, *, estimated: bool = False) -> float:
        """Return the signed objective of a design (n,) and a schedule (N, k); see :meth:`at`."""
        per_point = self.combined(self.at(d, s, estimated=estimated).objective)
        return float(per_point.min()) if self.is_worst else math.fsum((self.points.weights * per_point).tolist())

    def is_feasible(self, d: FloatArray, s: FloatArray, slack: float = 1e-7) -> bool:
        """Return whether a schedule keeps all limits, its ranges and its rates, up to a relative slack."""
        values = self.at(d, s)
        low, high, _ = ends(self.settings)
        # Differences of settings carry the rounding of the settings.
        rounding = _ROUNDING * np.maximum(np.abs(low), np.abs(high))
        steps = np.abs(np.diff(s, axis=0)) - self.steps * (1 + slack)
        closing = np.abs(s[-1] - s[0]) if self.is_periodic else np.zeros(s.shape[1])
        own = ca.Function("own", [self.symbols[0]], [self.of_design])(d).full()
        return bool(
            np.isfinite(values.objective).all()
            and (values.excess <= slack).all()
            and (self.gaps(d, s) <= _CLOSED).all()
            and (own <= slack).all()
            and self.extent_excess(d, s) <= slack
            and (s >= low - rounding).all()
            and (s <= high + rounding).all()
            and (steps <= rounding).all()
            and (closing <= slack * (high - low)).all()
        )


def ends(variables: Sequence[Variable]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return lower bounds, upper bounds and first values (n,) of variables."""
    rows = [(each.lower, each.upper, each.first) for each in variables]
    low, high, first = np.array(rows, dtype=np.float64).reshape(-1, 3).T
    return low, high, first


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
    _check_home(case, settings)
    point = SX.sym("point", _POINT)
    position, rotation, feed = point[:3], ca.reshape(point[3:12], 3, 3), point[12:15]
    turned, axis = rotation, SX([0.0, 0.0, 1.0])
    if case.path is not None and case.path.tool is not None:
        local = np.array(case.path.tool.axis) / np.linalg.norm(case.path.tool.axis)
        axis = rotation @ SX(local.tolist())
        turn = case.path.tool.turn
        angle = s[[each.name for each in settings].index(TURN)] if isinstance(turn, Free) else SX(turn)
        turned = rotation @ matrix_from_axis_angle(SX(local.tolist()), angle)
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
    wrong = np.flatnonzero(within & ~(least <= _CLOSED))
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


def _check_home(case: Case, settings: Sequence[Variable]) -> None:
    """Refuse a limit on angles from home while a dimension changes, because home states no value of it."""
    names = [each.name for each in settings if each.name != TURN]
    for limit in case.limits:
        if names and limit.reference == "home":
            fault = f"home has no {names[0]}, which changes along the path; state mounting axes"
            raise CaseError(f"limits.{limit.name}.about", fault, "home", case.source)


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
    return bool((ends_of_row <= _ROUNDING).all())
