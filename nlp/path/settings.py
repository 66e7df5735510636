"""Settings along a path: the turn about the tool's axis and dimensions, with one value at each knot.

Between two knots a setting changes linearly with the path parameter, so that it is affine in time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...models import Dimension, FloatArray
from ...models.model import joint_parameter
from ..case.pathfile import TURN
from ..case.pose import Free
from ..case.task import ALONG, Task
from ..errors import InputError
from ..units import Units

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..case.case import Case
    from ..case.csvrows import NumberTable

#: Relative rounding of digits and unit conversions that is not a violation of a rate or range.
_ROUNDING = 1e-9, 1e-14


@dataclass(frozen=True, eq=False)
class ToolTurn:
    """Turn of the platform about an axis of its own, in addition to the orientations of the path.

    Attributes:
        axis: (3,) unit vector in the platform frame.
        angles: (N + 1,) angles at the knots, radians.
    """

    axis: FloatArray
    angles: FloatArray

    @property
    def is_constant(self) -> bool:
        """Whether the angle is the same at all knots."""
        return not np.ptp(self.angles)

    def quaternions(self, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
        """Return the quaternions (k, 4) at parameters (k,) of segments (k,)."""
        start = self.angles[segments]
        half = 0.5 * (start + s * (self.angles[segments + 1] - start))
        return np.hstack([np.cos(half)[:, None], np.sin(half)[:, None] * self.axis])


@dataclass(frozen=True, eq=False)
class Settings:
    """Values of dimensions that change along a path.

    Attributes:
        names: (k,) components of the robot's parameters, as the robot names them.
        values: (N + 1, k) values at the knots, length or radians.
    """

    names: tuple[str, ...] = ()
    values: FloatArray | None = None

    def by_name(self, segments: NDArray[np.intp], s: FloatArray) -> dict[str, FloatArray]:
        """Return the values (k,) of each dimension at parameters (k,) of segments (k,)."""
        return dict(zip(self.names, self.at(segments, s).T, strict=True))

    def changes(self, segments: NDArray[np.intp]) -> FloatArray:
        """Return the changes (k, d) of the values over whole segments (k,)."""
        return np.zeros((len(segments), 0)) if self.values is None else np.diff(self.values, axis=0)[segments]

    def at(self, segments: NDArray[np.intp], s: FloatArray) -> FloatArray:
        """Return the values (k, d) at parameters (k,) of segments (k,)."""
        if self.values is None:
            return np.zeros((len(segments), 0))
        start = self.values[segments]
        return np.asarray(start + s[:, None] * (self.values[segments + 1] - start))


@dataclass(frozen=True, eq=False)
class Changing:
    """Quantities of a case that change along its path, or are fixed there.

    Attributes:
        axis: (3,) unit vector of the tool's axis in the platform frame; None without a tool.
        turn: fixed turn about the axis, radians; 0 if the turn changes.
        ranges: range and rate of each setting, by name of its column.
        own: name of each dimension in the robot, by name of its column.
        dimensions: dimension of each setting.
        fixed: names of columns of quantities that the case fixes.
        joints: names of the columns of actuated joints.
    """

    axis: FloatArray | None
    turn: float
    ranges: Mapping[str, Free]
    own: Mapping[str, str]
    dimensions: Mapping[str, Dimension]
    fixed: tuple[str, ...]
    joints: tuple[str, ...] = ()

    @property
    def unread(self) -> Changing:
        """The same quantities for a path without its settings and without the turn: their columns are not used."""
        return Changing(None, 0.0, {}, {}, {}, (*self.fixed, *self.ranges))

    def values_of(self, table: NumberTable, units: Units) -> dict[str, FloatArray]:
        """Return the checked values (N + 1,) of each setting from the columns of a table.

        Args:
            table: table with the columns of all settings, and column ``t`` if it states times.
            units: units of the case.

        Raises:
            InputError: a value is outside of its range, or changes faster than its rate.
        """
        found = {}
        for name, allowed in self.ranges.items():
            written, dimension = table.columns[name], self.dimensions[name]
            found[name] = written * units.to_internal(1.0, dimension)
            self._check_range(name, table, found[name], written, allowed, units)
            if "t" in table.columns:
                self._check_rate(name, table, found[name], allowed, units)
        return found

    def _check_range(
        self, name: str, table: NumberTable, values: FloatArray, written: FloatArray, allowed: Free, units: Units
    ) -> None:
        for end, side, is_out in (
            (allowed.lower, "below its min", values < allowed.lower - _ROUNDING[1] * abs(allowed.lower)),
            (allowed.upper, "above its max", values > allowed.upper + _ROUNDING[1] * abs(allowed.upper)),
        ):
            if is_out.any():
                k = int(np.argmax(is_out))
                limit = units.shown(end, self.dimensions[name])
                raise InputError(
                    f"{table.source}: row {table.rows[k]}, column {name}: {written[k]:.10g} is {side} {limit:.10g}"
                )

    def _check_rate(self, name: str, table: NumberTable, values: FloatArray, allowed: Free, units: Units) -> None:
        times, rate = table.columns["t"], allowed.rate
        if rate is None or math.isinf(rate):
            return
        seconds, change = np.diff(times), np.abs(np.diff(values))
        # Both differences carry the rounding of their terms.
        slack = _ROUNDING[0] * rate * seconds + _ROUNDING[1] * (np.abs(values[1:]) + rate * np.abs(times[1:]))
        is_fast = change > rate * seconds + slack
        if is_fast.any():
            k, dimension = int(np.argmax(is_fast)), self.dimensions[name]
            raise InputError(
                f"{table.source}: row {table.rows[k + 1]}: {name} changes by {units.shown(change[k], dimension):.6g} "
                f"in {seconds[k]:.6g} s, more than its rate {units.shown(rate, dimension):.10g}"
            )

    def check_columns(self, names: Sequence[str], source: str) -> None:
        """Refuse a table without a column of a setting, or without the times that a rate needs.

        Raises:
            InputError: a column is missing.
        """
        for name, allowed in self.ranges.items():
            if name not in names:
                raise InputError(
                    f"{source}: column {name!r} is missing: {name} changes along the path; "
                    f"add the column, or fix the value with --set {name}=.."
                )
            if "feed" in names:
                raise InputError(f"{source}: column 'feed' gives no time to a change of {name}; state t instead")
            if "t" not in names and not math.isinf(allowed.rate or 0.0):
                raise InputError(f"{source}: column 't' is missing: the rate of {name} needs times")

    def refuse_without_table(self, source: str) -> None:
        """Refuse a file that cannot state settings.

        Raises:
            InputError: there is a setting.
        """
        for name in self.ranges:
            raise InputError(
                f"{source}: states no {name}, which changes along the path; give --along a table (.csv) "
                f"with a column {name}, or fix the value with --set {name}=.."
            )


def case_along(case: Case, settings: Settings) -> Case:
    """Return a case whose dimensions have their ranges along a path, and no objective along the path.

    Such an objective, and its motions, are about schedules; a proof is about one of them.
    """
    if case.over_path is None:
        return case
    parameters: dict[str, Any] = dict(case.parameters)
    for item in case.model.parameters:
        values = list(case.components(item.name))
        for k, name in enumerate(item.components):
            if name in settings.names and settings.values is not None:
                own = settings.values[:, settings.names.index(name)]
                low, high = float(own.min()), float(own.max())
                values[k] = Free(low, high) if low < high else low
        parameters[item.name] = values if len(values) > 1 else values[0]
    stated = tuple(task for task in case.tasks if not (task.follows or task.measure in ALONG))
    tasks = stated or (replace(Task.translation((0.0, 0.0, 1.0)), is_stated=False),)
    return replace(case, parameters=parameters, tasks=tasks, over_path=None, path=None)


#: No tool, and no quantity that changes.
UNCHANGED = Changing(None, 0.0, {}, {}, {}, ())


def changing_of(case: Case) -> Changing:
    """Return the quantities of a case that change along a path, or that its tool fixes."""
    ranges, own, dimensions, fixed = dict(case.settings), {}, {}, list[str]()
    for item in case.model.parameters:
        for name, column in zip(item.components, case.component_names(item), strict=True):
            if column in ranges:
                own[column], dimensions[column] = name, item.dimension
            else:
                fixed.append(column)
    tool = None if case.path is None else case.path.tool
    joints = tuple(map(joint_parameter, case.model.locked))
    if tool is None:
        return Changing(None, 0.0, ranges, own, dimensions, tuple(fixed), joints)
    if TURN in ranges:
        dimensions[TURN] = Dimension.ANGLE
    else:
        fixed.append(TURN)
    turn = 0.0 if isinstance(tool.turn, Free) else tool.turn
    axis = np.array(tool.axis, dtype=np.float64)
    # Division by the largest component first: squares neither overflow nor vanish.
    axis = axis / np.abs(axis).max()
    return Changing(axis / np.linalg.norm(axis), turn, ranges, own, dimensions, tuple(fixed), joints)
