"""Tables of the design and the robot: variables, fixed values, limbs, quantities by pose and limb, the Jacobian."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...models import Dimension, Model, WrenchKind, component_names
from ..case.case import Case
from ..case.names import name_of_task
from ..case.pose import Free, RotationForm, Value, sizes_of_turn
from ..case.task import Method, Sense
from ..results.poses import rotation_numbers
from ..results.rounding import (
    FLAT,
    NOISE,
    STATED,
    TURNED,
    ordered,
    rate_sizes,
    robot_size,
    settled,
    settled_F,
    settled_rates,
    size_of,
    size_of_F,
)
from ..units import Units, rate_unit
from .loads import loading_tables
from .numbers import listed, number
from .text import FEWEST_FOLDED, Figure, TextTable

if TYPE_CHECKING:
    from ..evidence.optimality import ActiveSide
    from ..evidence.sensitivity import Sensitivity
    from ..evidence.state import PlatformPose
    from ..program.free_joints import FreeJoint
    from ..results.data import CombinedData, SolveResult
    from ..results.parts import ByOwner, PosesData, PoseStateData, RobotData, TaskData

#: Number of fixed values that are shown with the variables: the values with the largest relative sensitivity of F.
_FIXED = 6
#: Number of free actuator coordinates that are shown among the variables; all others come last.
_JOINTS = 12
#: Number of listed values that are shown; of a longer list, the first two and the last.
_LISTED = 5


class _Place(enum.IntEnum):
    """Place of a row in the table: lower first."""

    ACTIVE = 0
    FREE = 1
    FIXED = 2


class _Row(NamedTuple):
    """Row of the design table.

    Attributes:
        place: place in the table.
        cells: texts of name, value, unit, bounds, status, and derivative of the optimal F.
        sensitivity: change of F per 100 % change of the value; 0 if unknown.
    """

    place: _Place
    cells: tuple[str, ...]
    sensitivity: float = 0.0


#: Sides of a bound or limit in words.
_SIDES = {"min": "at lower bound", "max": "at upper bound", "equal": "fixed by a limit"}


class _Rows:
    """Rows of the design table: values, their status, and derivatives of the optimal F.

    Args:
        units: units of the case.
        size: length of the robot, to which the rounding errors of lengths are relative.
        F: magnitude of the terms of F, to which the rounding errors of derivatives are relative.
        active: active bounds and limits.
        sensitivity: derivatives of the optimal F with respect to the fixed values.
        sense: sense of the objective.
    """

    def __init__(
        self,
        units: Units,
        size: float,
        F: float,
        active: Sequence[ActiveSide],
        sensitivity: Sequence[Sensitivity],
        sense: Sense,
    ) -> None:
        self._units, self._size, self._F, self._sense = units, size, F, sense
        # Bounds of variables come first in the active set: a constraint of the same name must not hide them.
        self._active = {side.name: side for side in reversed(active)}
        self._fixed: Mapping[str, Sensitivity] = {row.name: row for row in sensitivity}

    def row(
        self,
        name: str,
        value: float,
        given: Value,
        dimension: Dimension,
        beside: float,
        limits: Sequence[str] = (),
    ) -> _Row:
        """Return the row of a value.

        Args:
            name: name of the variable or fixed value.
            value: value, in the case's units.
            given: bounds or fixed value in the case.
            dimension: kind of the value.
            beside: largest component of the vector with this value, in the case's units.
            limits: names of limits of the case on this variable only.
        """
        label = self._units.label(dimension)
        if isinstance(given, Free):
            lower, upper = (self._units.shown(end, dimension) for end in (given.lower, given.upper))
            # A bound holds a value exactly.
            part = NOISE if name in self._active else FLAT
            shown, between = number(value, upper - lower, part=part), free_words(given, self._units, dimension)
        else:
            lower, upper = value, value
            shown, between = number(value, beside, part=STATED), ""
        fixed = self._fixed.get(name)
        side = next((self._active[each] for each in (name, *limits) if each in self._active), None)
        place, status, slope, change = _Place.FREE if between else _Place.FIXED, "", None, 0.0
        held = "fixed" if not isinstance(given, Free) else "chosen" if given.values else "rounded"
        if side is not None:
            place, status = _Place.ACTIVE, _SIDES[side.bound]
            # A multiplier is an improvement of F by relaxing a bound: upwards for an upper one, downwards for a lower.
            sign = self._sense.sign * (-1.0 if side.bound == "min" else 1.0)
            slope = sign * settled(side.multiplier, self._F / ((upper - lower) or 1.0))
        elif fixed is not None and fixed.derivative is None:
            status = "" if fixed.hindrance is None else f"{held}: {fixed.hindrance.value}"
        elif fixed is not None and fixed.derivative is not None:
            natural = {Dimension.LENGTH: self._size, Dimension.ANGLE: self._units.shown(1.0, dimension)}
            size = max(abs(value), natural.get(dimension, 1.0))
            status, slope = held, settled(fixed.derivative, self._F / size)
            change = abs(slope) * size
        derivative = "" if slope is None else number(slope, digits=4, signed=True)
        return _Row(place, (name, shown, label, between, status, derivative), change)


def free_words(value: Free, units: Units, dimension: Dimension, digits: int = 6) -> str:
    """Return the allowed values of a variable: its bounds, or its listed values."""
    if not value.values:
        return " .. ".join(f"{units.shown(end, dimension):.{digits}g}" for end in (value.lower, value.upper))
    shown = [f"{units.shown(each, dimension):.{digits}g}" for each in value.values]
    if len(shown) > _LISTED:
        return f"{shown[0]}, {shown[1]}, .. {shown[-1]} ({len(shown)} values)"
    return f"{', '.join(shown[:-1])} or {shown[-1]}"


def design_table(
    case: Case,
    robot: RobotData,
    *,
    reached: bool = False,
    active: Sequence[ActiveSide] = (),
    sensitivity: Sequence[Sensitivity] = (),
    F: float | None = None,
    combined: bool = False,
    settings: Sequence[RobotData] = (),
) -> TextTable:
    """Return every dimension and the pose: value, unit, bounds, status, and derivative of the optimal objective.

    Args:
        case: the case.
        robot: robot at the point.
        reached: If true, the point is the end of a failed solve.
        active: active bounds and limits.
        sensitivity: derivatives of the optimal F with respect to the fixed values.
        F: objective; None if F is unknown.
        combined: If true, the objective combines several tasks.
        settings: robot of each task, if dimensions or the pose change from task to task.
    """
    reasons = _Rows(case.units, robot_size(robot), size_of_F(robot, F or 0.0), active, sensitivity, _sense(case))
    rows: list[_Row] = []
    for parameter in case.model.parameters:
        shown = robot.parameters[parameter.name]
        values = shown if isinstance(shown, tuple) else (shown,)
        names, largest = case.component_names(parameter), max(map(abs, values))
        for name, value, given in zip(names, values, case.components(parameter.name), strict=True):
            rows.append(reasons.row(name, value, given, parameter.dimension, largest))
    stated = stated_poses_of(robot)
    if settings:
        rows = list(_rows_of_tasks(case, settings, reasons))
        stated = tuple(pose for each in settings for pose in stated_poses_of(each))[: len(case.poses)]
    for k, found in enumerate(stated):
        rows += _pose_rows(case, k, found, reasons)
    joints = _free_joint_rows(case, robot.free_joints or (), reasons)
    rows += joints[:_JOINTS]
    rows.sort(key=lambda row: row.place)
    fixed = [row for row in rows if row.place is _Place.FIXED]
    folded = len(fixed) - _FIXED if len(fixed) < len(rows) else 0
    folded = folded if folded >= FEWEST_FOLDED else 0
    if folded:
        fixed.sort(key=lambda row: -ordered(row.sensitivity))
        rows[len(rows) - len(fixed) :] = fixed
    words, named, more = "more fixed values", len(fixed), joints[_JOINTS:]
    if more:
        rows += more
        words, named, folded = "more values", len(rows), folded + len(more)
    slope = "derivative" if combined else "dF/dx"
    headers = ("", "reached" if reached else "value", "unit", "bounds", "status", slope)
    columns = len(headers) if any(row.cells[4] for row in rows) else 4
    cells = tuple(row.cells[:columns] for row in rows)
    return TextTable(headers[:columns], cells, "design", folded=folded, folded_words=words, named=named, with_unit=(1,))


def stated_poses_of(robot: RobotData) -> tuple[PlatformPose, ...]:
    """Return the stated poses of a robot."""
    return (robot.pose,) if robot.several is None else robot.several.stated_poses


def _rows_of_tasks(case: Case, settings: Sequence[RobotData], reasons: _Rows) -> Iterator[_Row]:
    """Yield the rows of the dimensions; of those that change from task to task, one row for each task."""
    for parameter in case.model.parameters:
        shown = [each.parameters[parameter.name] for each in settings]
        values = [each if isinstance(each, tuple) else (each,) for each in shown]
        largest = max(abs(part) for each in values for part in each)
        names, ranges = case.component_names(parameter), case.components(parameter.name)
        for k, (key, name, given) in enumerate(zip(parameter.components, names, ranges, strict=True)):
            own = case.dimensions_per_task.get(key)
            if own is None:
                yield reasons.row(name, values[0][k], given, parameter.dimension, largest)
                continue
            for task, value in enumerate(own.values):
                yield reasons.row(name_of_task(name, task), values[task][k], value, parameter.dimension, largest)


def _pose_rows(case: Case, k: int, found: PlatformPose, reasons: _Rows) -> list[_Row]:
    """Return the rows of a stated pose: the position, and the rotation in the form of the case."""
    prefix, pose = case.pose_prefixes[k], case.poses[k]
    largest = max(map(abs, found.position))
    rows = [
        reasons.row(f"{prefix}{name}", value, given, Dimension.LENGTH, largest)
        for name, value, given in zip(component_names("p", 3), found.position, pose.position, strict=True)
    ]
    form = pose.rotation.form
    if form is not RotationForm.AXIS_ANGLE:
        names = ("roll", "pitch", "yaw") if form is RotationForm.RPY else ("q_w", "q_x", "q_y", "q_z")
        dimension = Dimension.ANGLE if form is RotationForm.RPY else Dimension.NUMBER
        stated = zip(names, rotation_numbers(case, found.axis, found.angle, form)[form.value], strict=True)
        return [*rows, *(reasons.row(f"{prefix}{name}", each, each, dimension, 1.0) for name, each in stated)]
    angle, is_held = pose.rotation.angle, pose.rotation.axis is not None
    turned = abs(case.units.to_internal(found.angle, Dimension.ANGLE)) > TURNED
    if not is_held and isinstance(angle, Free):
        # About a free axis the sign of the angle has no meaning: only its size has bounds.
        angle = Free(*sizes_of_turn(angle))
    last = reasons.row(
        f"{prefix}angle", found.angle, angle, Dimension.ANGLE, case.units.shown(math.pi, Dimension.ANGLE)
    )
    axis = listed(found.axis) if turned or is_held else "none"
    cells = (f"{prefix}axis", axis, "", "" if is_held else "free", "", "")
    return [*rows, _Row(last.place, cells, last.sensitivity), last]


def _free_joint_rows(case: Case, joints: Sequence[FreeJoint], reasons: _Rows) -> list[_Row]:
    """Return the rows of the actuator coordinates that the pose does not determine."""
    rows = []
    for each in joints:
        dimension = Dimension(each.kind)
        lower, upper = (case.units.to_internal(end, dimension) for end in (each.lower, each.upper))
        given = Free(lower, upper)
        rows.append(reasons.row(each.name, each.value, given, dimension, abs(each.value), each.limits))
    return rows


def _sense(case: Case) -> Sense:
    """Return the sense of the objective; for tasks of both senses: maximum of a sum, minimum of the worst loss."""
    senses = {task.sense for task in case.tasks}
    if len(senses) == 1:
        return senses.pop()
    return Sense.MIN if case.method is Method.WORST_CASE else Sense.MAX


def solved_design_table(case: Case, result: SolveResult, robot: RobotData) -> TextTable:
    """Return the design of a solve; active bounds are shown only if the point is an answer."""
    reached = result.reached is not None
    active = () if reached or result.optimality is None else result.optimality.active
    return design_table(case, robot, reached=reached, active=active, sensitivity=result.sensitivity or (), F=result.F)


def combined_design_table(case: Case, combined: CombinedData, robot: RobotData) -> TextTable:
    """Return the design of a combined solve of several tasks."""
    reached = combined.method_point is None
    active = () if reached or combined.optimality is None else combined.optimality.active
    settings = combined.settings or ()
    return design_table(case, robot, reached=reached, active=active, F=combined.value, combined=True, settings=settings)


#: Largest relative difference from the worst F at which a pose also counts as worst.
_AS_BAD = 1e-6
#: Number of poses in tables by limb on a terminal.
_POSES = 12
#: Largest component of the difference of two unit axes that count as equal.
_SAME_AXIS = 1e-6


class _Measure(NamedTuple):
    """Quantity of the robot's limbs.

    Attributes:
        name: name of the quantity.
        dimension: kind of its values.
        words: name for people.
        reference: direction from which an angle is measured, if a limit of the case states one; otherwise empty.
        unit: unit of the values; for an angle, after the reference direction.
    """

    name: str
    dimension: Dimension
    words: str
    reference: str
    unit: str

    def of(self, robot: RobotData | PoseStateData) -> ByOwner:
        """Return the values by limb, as the limits of the case define them."""
        return (robot.limited_quantities or {}).get(self.name, robot.quantities.get(self.name, {}))


def plural_name(quantity: str) -> str:
    """Return the name of the table of a quantity by pose and limb."""
    return quantity.replace("_", "-") + "s"


def _measures(case: Case, robot: RobotData) -> list[_Measure]:
    """Return the quantities of a robot's limbs."""
    references = {limit.name: limit.reference for limit in case.limits}

    def measure(name: str, dimension: Dimension) -> _Measure:
        reference = references.get(name, "")
        parts = (f"from {reference}" if reference else "", case.units.label(dimension))
        unit = ", ".join(part for part in parts if part)
        return _Measure(name, dimension, name.replace("_", " "), reference, unit)

    found = {item.name: item.dimension for item in case.model.quantities if item.name in robot.quantities}
    # Leg lengths of a robot defined by joints are no quantity of its model.
    limited = robot.limited_quantities or {}
    found |= {each.name: each.numbers["max"].dimension for each in case.limits if each.name in limited.keys() - found}
    return [measure(*item) for item in found.items()]


def robot_table(case: Case, robot: RobotData) -> TextTable:
    """Return a table with a row for each pose; for one pose, with a row for each limb."""
    return _limb_table(case, robot) if robot.several is None else _pose_table(case, robot, robot.several)


def robot_tables(case: Case, robot: RobotData) -> Iterator[TextTable]:
    """Yield the table of limbs, or of several poses; then actuator forces and constraint wrenches."""
    yield robot_table(case, robot)
    yield from robot_tables_by_limb(case, robot)
    yield from loading_tables(case, robot)


def robot_tables_by_limb(case: Case, robot: RobotData) -> Iterator[TextTable]:
    """Yield rates and quantities by pose and limb; nothing for one pose."""
    if robot.several is not None:
        yield from _tables_by_limb(case, robot, robot.several)


def _pose_table(case: Case, robot: RobotData, several: PosesData) -> TextTable:
    """Return a row for each pose: F, position, angle, and the range of each quantity over the limbs."""
    measures, units = _measures(case, robot), case.units
    labels = [f"{each.words.removesuffix(' angle')}\n{each.unit}" for each in measures]
    values = [_settled_pose_F(pose, robot.task) for pose in several.poses]
    is_worst = _worst(values, robot.task)
    reach = max(abs(part) for pose in several.poses for part in pose.pose.position)
    half_turn = units.shown(math.pi, Dimension.ANGLE)
    rows = []
    for k, pose in enumerate(several.poses):
        ranges = [_range_text(each.of(pose), each, case) for each in measures]
        at = [number(value, reach, digits=6) for value in pose.pose.position]
        angle = number(_signed_angle(case, k, pose), half_turn, digits=6)
        mark = "worst" if is_worst[k] else ""
        rows.append((str(k + 1), number(values[k]), mark, *at, angle, *ranges, str(pose.rank)))
    position = [f"{name}\n{units.length}" for name in component_names("p", 3)]
    headers = ("pose", "F", "", *position, f"angle\n{units.angle}", *labels, "rank")
    return TextTable(headers, tuple(rows), "poses")


def _settled_pose_F(pose: PoseStateData, task: TaskData | None) -> float:  # noqa: N802 - the objective's name
    """Return F at a pose; an F within its rounding error is 0."""
    if task is None:
        return pose.F
    return settled_F(pose.F, rate_sizes(pose.jacobian, task.motion.twist, pose.pose.position))


def _worst(values: Sequence[float], task: TaskData | None) -> list[bool]:
    """Return for each pose whether its F is the worst; all false if F is equal or the sense is unknown."""
    low, high = min(values), max(values)
    if task is None or high - low <= _AS_BAD * abs(high):
        return [False] * len(values)
    worst = low if task.sense is Sense.MAX else high
    return [abs(value - worst) <= _AS_BAD * abs(high) for value in values]


def _range_text(values: ByOwner, measure: _Measure, case: Case) -> str:
    """Return the range of a quantity over the limbs; for an angle, only the largest value."""
    size = size_of(measure.dimension, values.values(), case.units)
    low, high = (number(end(values.values()), size, digits=5) for end in (min, max))
    return high if measure.dimension is Dimension.ANGLE else f"{low} .. {high}"


def _signed_angle(case: Case, index: int, pose: PoseStateData) -> float:
    """Return the angle of a pose, negative for a rotation against the stated axis or the axis of a task."""
    counts = np.cumsum([len(each.displacements) for each in case.poses])
    stated = case.poses[int(np.searchsorted(counts, index, side="right"))]
    axis = np.asarray(pose.pose.axis)
    known = [] if stated.rotation.axis is None else [np.asarray(stated.rotation.axis, dtype=np.float64)]
    known += [np.asarray(task.twist, dtype=np.float64)[:3] for task in case.tasks]
    for other in known:
        size = float(np.linalg.norm(other))
        if size and np.max(np.abs(axis + other / size)) < _SAME_AXIS:
            return -pose.pose.angle
        if size and np.max(np.abs(axis - other / size)) < _SAME_AXIS:
            return pose.pose.angle
    return pose.pose.angle


def _tables_by_limb(case: Case, robot: RobotData, several: PosesData) -> Iterator[TextTable]:
    """Yield the rates, then the quantities, with a row for each pose and a column for each limb."""
    rows, task = case.model.rows, robot.task
    folded = len(several.poses) - _POSES
    folded = folded if folded >= FEWEST_FOLDED else 0
    if task is not None:
        values = [_settled_pose_F(pose, task) for pose in several.poses]
        marks = ["worst" if worst else "" for worst in _worst(values, task)]
        couples = any(row.kind is not WrenchKind.FORCE for row in rows)
        unit = rate_unit(task.motion.twist, case.units)
        labels = [f"{row.member} {row.kind.value}\n{unit}" if couples else f"{row.member}\n{unit}" for row in rows]
        cells = []
        for k, pose in enumerate(several.poses):
            sizes = rate_sizes(pose.jacobian, task.motion.twist, pose.pose.position)
            rates = settled_rates(pose.rates, sizes, is_free=values[k] == 0)
            cells.append((str(k + 1), *(number(rate, digits=6, signed=True) for rate in rates), marks[k]))
        title = f"{rate_word(case.model)} by pose and limb"
        yield TextTable(("pose", *labels, ""), tuple(cells), "rates", title, folded, "more poses")
    for measure in _measures(case, robot):
        owners = list(measure.of(several.poses[0]))
        cells = [
            (str(k + 1), *_measure_cells(measure.of(pose), owners, measure, case))
            for k, pose in enumerate(several.poses)
        ]
        label = case.units.label(measure.dimension)
        headers = [f"{owner}\n{label}" if label else owner for owner in owners]
        title = f"{measure.words}{f' from {measure.reference}' if measure.reference else ''} by pose and limb"
        yield TextTable(("pose", *headers), tuple(cells), plural_name(measure.name), title, folded, "more poses")


def _measure_cells(values: ByOwner, owners: Sequence[str], measure: _Measure, case: Case) -> list[str]:
    size = size_of(measure.dimension, values.values(), case.units)
    return [number(values[owner], size, digits=5) for owner in owners]


def rate_word(model: Model) -> str:
    """Return the name of the rate of a row of J: rate of a leg length, or work rate of a wrench."""
    return "work rate" if model.structure else "rate"


def _limb_table(case: Case, robot: RobotData) -> TextTable:
    """Return the rows of the Jacobian with the quantities of their limbs; for one task, also rate and share of F."""
    model, task = case.model, robot.task
    rates: Sequence[float] = ()
    if task is not None and robot.rates is not None:
        sizes = rate_sizes(robot.jacobian, task.motion.twist, robot.pose.position)
        rates = settled_rates(robot.rates, sizes, is_free=bool(robot.task_is_free))
    couples = any(row.kind is not WrenchKind.FORCE for row in model.rows)
    measures = _measures(case, robot)
    found: list[Mapping[str, str]] = [
        dict(zip(each.of(robot), _measure_cells(each.of(robot), list(each.of(robot)), each, case), strict=True))
        for each in measures
    ]
    total = sum(rate**2 for rate in rates)
    rows = []
    for k, row in enumerate(model.rows):
        cells = [row.member, *([row.kind.value] if couples else [])]
        if rates:
            part = 100 * rates[k] ** 2 / total if total > 0 else 0.0
            cells += [number(rates[k], digits=6, signed=True), Figure(f"{part:.1f}", part) if total > 0 else ""]
        rows.append((*cells, *(column.get(row.limb, "") for column in found)))
    labels = [f"{each.words}\n{each.unit}" for each in measures]
    headers = ["limb", *(["wrench"] if couples else [])]
    if task is not None and rates:
        headers += [f"{rate_word(model)}\n{rate_unit(task.motion.twist, case.units)}", "share of F\n%"]
    return TextTable((*headers, *labels), tuple(rows), "limbs")


def jacobian_table(case: Case, robot: RobotData) -> TextTable:
    """Return the table of the Jacobian; rounding errors of moments are relative to the longest moment arm."""
    arm = max((abs(value) for row in robot.jacobian for value in row[3:]), default=0.0)
    rows = []
    for row, values in zip(case.model.rows, robot.jacobian, strict=True):
        cells = [number(value, 1.0, digits=6, signed=True) for value in values[:3]]
        cells += [number(value, arm, digits=6, signed=True) for value in values[3:]]
        rows.append((row.member, *cells))
    return TextTable(("J", "f_x", "f_y", "f_z", "m_x", "m_y", "m_z"), tuple(rows), "jacobian")
