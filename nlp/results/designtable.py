"""The design as a table of text: what is free and active first, then what is free, then what is fixed."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ...models import Dimension, component_names
from ..case.case import Case
from ..case.pose import Free, Value, sizes_of_turn
from ..units import Units, slope_unit
from .rounding import STATED, TURNED, listed, number, ordered, robot_size, settled, size_of_F
from .text import FEWEST_FOLDED, TextTable

if TYPE_CHECKING:
    from .data import ActiveData, CombinedData, SolveResult
    from .parts import PoseData, RobotData, SensitivityData

#: So many fixed numbers are shown where others are free; those that F feels most, where that is known.
_FIXED = 6


class _Place(enum.IntEnum):
    """Place of a row in the table: lower first."""

    ACTIVE = 0
    FREE = 1
    FIXED = 2


class _Row(NamedTuple):
    """A row of the table.

    Attributes:
        place: in the table.
        cells: name, value, unit, range, and the reason that holds the number.
        felt: change of F by a change of the number by its own size; 0 where that is not known.
    """

    place: _Place
    cells: tuple[str, ...]
    felt: float = 0.0


class _Reasons:
    """What holds each number: an active bound with its multiplier, or that it is fixed.

    Args:
        units: of the case.
        size: of the robot, beside which a length of 0 has its error.
        F: size of the terms of F, of which a derivative has its error.
        active: bounds and limits that hold the point.
        sensitivity: of the optimal F to fixed numbers.
    """

    def __init__(
        self, units: Units, size: float, F: float, active: Sequence[ActiveData], sensitivity: Sequence[SensitivityData]
    ) -> None:
        self._units, self._size, self._F = units, size, F
        # Variables' bounds come first among the active ones, so that a constraint of the same name hides none of them.
        self._active = {side.name: side for side in reversed(active)}
        self._fixed: Mapping[str, SensitivityData] = {row.name: row for row in sensitivity}
        self.any = bool(active or sensitivity)

    def row(self, name: str, value: float, given: Value, dimension: Dimension, beside: float) -> _Row:
        """Return the row of a number.

        Args:
            name: of the number.
            value: of the number, in the case's units.
            given: the number in the case.
            dimension: of the number.
            beside: largest of the numbers that were stated with it, in the case's units.
        """
        label = self._units.label(dimension)
        if isinstance(given, Free):
            lower, upper = (self._units.shown(end, dimension) for end in (given.lower, given.upper))
            shown, between = number(value, upper - lower), f"{lower:g} .. {upper:g}"
        else:
            lower, upper = value, value
            shown, between = number(value, beside, part=STATED), ""
        side, fixed = self._active.get(name), self._fixed.get(name)
        place, why, felt = _Place.FREE if between else _Place.FIXED, "", 0.0
        if side is not None:
            place = _Place.ACTIVE
            cost = settled(side.multiplier, self._F / ((upper - lower) or 1.0))
            why = f"{side.bound}, {cost:.4g} {slope_unit(label)}"
        elif fixed is not None and fixed.derivative is None:
            why = f"fixed: {fixed.hindrance}"
        elif fixed is not None and fixed.derivative is not None:
            natural = {Dimension.LENGTH: self._size, Dimension.ANGLE: self._units.shown(1.0, dimension)}
            size = max(abs(value), natural.get(dimension, 1.0))
            slope = settled(fixed.derivative, self._F / size)
            why = f"fixed, {f'{slope:+.4g}' if slope else '0'} {slope_unit(label)}"
            felt = abs(slope) * size
        return _Row(place, (name, shown, label, between, *((why,) if self.any else ())), felt)


def design_table(
    case: Case,
    robot: RobotData,
    *,
    reached: bool = False,
    active: Sequence[ActiveData] = (),
    sensitivity: Sequence[SensitivityData] = (),
    F: float | None = None,
) -> TextTable:
    """Return every dimension and the pose: value, unit, the range it was free in, and the limit that holds it.

    Args:
        case: the case.
        robot: at the point.
        reached: whether the point is merely where a failed solve ended.
        active: bounds and limits that hold the point.
        sensitivity: of the optimal F to fixed numbers.
        F: objective; None where there is none.
    """
    reasons = _Reasons(case.units, robot_size(robot), size_of_F(robot, F or 0.0), active, sensitivity)
    rows: list[_Row] = []
    for parameter in case.model.parameters:
        shown = robot.parameters[parameter.name]
        values = shown if isinstance(shown, tuple) else (shown,)
        names, largest = case.component_names(parameter), max(map(abs, values))
        for name, value, given in zip(names, values, case.components(parameter.name), strict=True):
            rows.append(reasons.row(name, value, given, parameter.dimension, largest))
    stated = (robot.pose,) if robot.several is None else robot.several.stated_poses
    for k, found in enumerate(stated):
        rows += _pose_rows(case, k, found, reasons)
    rows.sort(key=lambda row: row.place)
    fixed = [row for row in rows if row.place is _Place.FIXED]
    folded = len(fixed) - _FIXED if len(fixed) < len(rows) else 0
    folded = folded if folded >= FEWEST_FOLDED else 0
    if folded:
        fixed.sort(key=lambda row: -ordered(row.felt))
        rows[len(rows) - len(fixed) :] = fixed
    headers = ("", "reached" if reached else "value", "unit", "free between", *(("held by",) if reasons.any else ()))
    cells = tuple(row.cells for row in rows)
    return TextTable(headers, cells, "design", folded=folded, folded_words="more fixed numbers")


def _pose_rows(case: Case, k: int, found: PoseData, reasons: _Reasons) -> list[_Row]:
    """Return the rows of a stated pose: position, axis and angle."""
    prefix, pose = case.pose_prefixes[k], case.poses[k]
    largest = max(map(abs, found.position))
    rows = [
        reasons.row(f"{prefix}{name}", value, given, Dimension.LENGTH, largest)
        for name, value, given in zip(component_names("p", 3), found.position, pose.position, strict=True)
    ]
    angle, is_held = pose.rotation.angle, pose.rotation.axis is not None
    turned = abs(case.units.to_internal(found.angle, Dimension.ANGLE)) > TURNED
    if not is_held and isinstance(angle, Free):
        # The sign of the angle means nothing then: its size is limited.
        angle = Free(*sizes_of_turn(angle))
    last = reasons.row(
        f"{prefix}angle", found.angle, angle, Dimension.ANGLE, case.units.shown(math.pi, Dimension.ANGLE)
    )
    axis = listed(found.axis) if turned or is_held else "none"
    cells = (f"{prefix}axis", axis, "", "" if is_held else "any direction", *(("",) if reasons.any else ()))
    return [*rows, _Row(last.place, cells, last.felt), last]


def solved_design_table(case: Case, result: SolveResult, robot: RobotData) -> TextTable:
    """Return the design of a solve, with its active bounds where the point is an answer."""
    reached = result.reached is not None
    active = () if reached or result.optimality is None else result.optimality.active
    return design_table(case, robot, reached=reached, active=active, sensitivity=result.sensitivity or (), F=result.F)


def combined_design_table(case: Case, combined: CombinedData, robot: RobotData) -> TextTable:
    """Return the design that several tasks were combined to."""
    reached = combined.method_point is None
    active = () if reached or combined.optimality is None else combined.optimality.active
    return design_table(case, robot, reached=reached, active=active, F=combined.value)
