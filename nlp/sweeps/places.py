"""Places of the varied values of a sweep in the arrays of one nonlinear program, which then covers all points.

A varied value is a parameter, a bound of a variable, a limit, or a number of the task, from which the twist follows.
The places are checked against cases that are read and formulated again at a few points; if anything differs, the
sweep does not use them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...models import FloatArray
from ..case.case import Case
from ..case.overrides import task_numbers
from ..case.task import unit_twist
from ..embedding.runtimelimits import RunTimeLimits, run_time_limits
from ..errors import CaseError, NoRobotError
from ..evidence.many import Numbers
from ..program.formulation import formulate
from ..program.layout import WIDENING
from ..program.nlp import Nlp
from ..program.pairs import with_all_pairs
from .points import CaseSource, Points

#: Largest relative difference of a placed value and a read value: rounding of a unit conversion.
_SAME = 1e-12
#: Largest relative difference of function values of two programs: rounding of a thousand operations.
_SAME_VALUE = 1e-9
#: Number of points of the box at which function values of two programs are compared.
_SHARES = 3
_LIMITS = "limits."
_ENDS = ("min", "max")


class NotPlacedError(Exception):
    """Error of a sweep whose points a single nonlinear program does not cover, with the reason."""


class Block(NamedTuple):
    """Data of the nonlinear program at N points of a sweep.

    Attributes:
        numbers: parameters and bounds of the nonlinear program.
        limits: (N,) values of the varied limits by key, for the compiled C.
        is_placed: (N,) True if the case allows the values of the point; other points have the values of the case.
    """

    numbers: Numbers
    limits: Mapping[str, FloatArray]
    is_placed: np.ndarray[Any, np.dtype[np.bool_]]


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the varied values of a sweep.

    Attributes:
        nlp: nonlinear program at the values of the case, with all constraints of limits on pairs.
        limits: limits that the compiled C can change.
        arguments: index of a parameter, and factor of its value, by column of the points.
        bounds: index of a variable, True for its upper bound, and factor of the value, by column.
        limited: index in ``limits``, and factor of the value, by column.
        task: for each column, key of a task entry and index in the entry; None for a scalar.
        written: table of the task in the case.
    """

    nlp: Nlp
    limits: RunTimeLimits
    arguments: Mapping[int, tuple[int, float]]
    bounds: Mapping[int, tuple[int, bool, float]]
    limited: Mapping[int, tuple[int, float]]
    task: Mapping[int, tuple[str, int | None]]
    written: Mapping[str, Any]

    def block(self, values: FloatArray) -> Block:
        """Return the data of the nonlinear program at points with values (N, m)."""
        nlp, count = self.nlp, len(values)
        arguments, lower, upper, g_lower, g_upper = (
            np.repeat(each[None], count, axis=0)
            for each in (nlp.arguments, nlp.lower, nlp.upper, nlp.g_lower, nlp.g_upper)
        )
        is_placed = np.ones(count, dtype=bool)
        for column, (index, factor) in self.arguments.items():
            arguments[:, index] = values[:, column] * factor
        for column, (index, is_upper, factor) in self.bounds.items():
            (upper if is_upper else lower)[:, index] = values[:, column] * factor
        crossed = ~(lower < upper).all(axis=1)
        is_placed &= ~crossed
        lower[crossed], upper[crossed] = nlp.lower, nlp.upper
        if self.task:
            (twist,) = nlp.program.places.twists
            for k in range(count):
                try:
                    arguments[k, twist] = self._twist(values[k])
                except CaseError:
                    is_placed[k] = False
        limits: dict[str, FloatArray] = {}
        if self.limited:
            for column, (index, factor) in self.limited.items():
                limits[self.limits.limits[index].key] = values[:, column] * factor
            for key, column_values in limits.items():
                each = next(item for item in self.limits.limits if item.key == key)
                allowed = (each.above < column_values) & (column_values <= each.most)
                is_placed &= allowed
                column_values[~allowed] = each.default
            self._set_limits(limits, count, Numbers(arguments, lower, upper, g_lower, g_upper))
        return Block(Numbers(arguments, lower, upper, g_lower, g_upper), limits, is_placed)

    def _twist(self, values: FloatArray) -> FloatArray:
        """Return the task's twist (6,) at one point.

        Raises:
            CaseError: the task does not allow these values.
        """
        written = {key: list(each) if isinstance(each, list) else each for key, each in self.written.items()}
        for column, (key, index) in self.task.items():
            if index is None:
                written[key] = float(values[column])
            else:
                written[key][index] = float(values[column])
        if "twist" in written:
            return np.array(written["twist"], dtype=np.float64)
        pitch: Any = written.get("pitch")
        return unit_twist(written.get("axis"), written.get("point"), pitch, "task")

    def _set_limits(self, limits: Mapping[str, FloatArray], count: int, numbers: Numbers) -> None:
        """Write the bounds that follow from limits into the data of a program, like the compiled C."""
        function = self.limits.function
        if function is None:
            return
        rows = [limits.get(each.key, np.full(count, each.default)) for each in self.limits.limits]
        converted = function(np.array(rows)).full()
        changed = {k for k, each in enumerate(self.limits.limits) if each.key in limits}
        for side in self.limits.sides:
            if self.limits.owners[side.converted] in changed:
                (numbers.g_upper if side.is_upper else numbers.g_lower)[:, side.constraint] = converted[side.converted]
        for widened in self.limits.widenings:
            if self.limits.owners[widened.converted] in changed:
                bound = np.minimum(WIDENING * np.sqrt(converted[widened.converted]), 1.0)
                numbers.lower[:, widened.variable], numbers.upper[:, widened.variable] = -bound, bound


def existing_cases(source: CaseSource, points: Points) -> Iterator[tuple[int, Case]]:
    """Yield indices and cases of points, without points at which the robot does not exist.

    Raises:
        CaseError: a name is unknown in the case, or a value is not allowed.
    """
    for k in range(len(points)):
        with suppress(NoRobotError):
            yield k, source.case_at(points.settings(k))


def place(source: CaseSource, chosen: Points) -> Places:
    """Return the places of the varied values of a sweep, checked against newly read cases.

    Args:
        source: case as text.
        chosen: points at which nonlinear programs are compared, at least one; see :meth:`.Points.chosen`.

    Raises:
        NotPlacedError: a single nonlinear program does not cover all points, or the case is not supported.
        CaseError: a name is unknown in the case, or a value is not allowed.
    """
    tables = tomllib.loads(source.text)
    programs = {k: _program(case) for k, case in existing_cases(source, chosen)}
    if not programs:
        raise NotPlacedError(
            "the robot cannot be assembled at any of the points that the sweep tests before it compiles the case"
        )
    nlp = next(iter(programs.values()))
    program = nlp.program
    limits = run_time_limits(nlp, "sweep")
    arguments: dict[int, tuple[int, float]] = {}
    bounds: dict[int, tuple[int, bool, float]] = {}
    limited: dict[int, tuple[int, float]] = {}
    task: dict[int, tuple[str, int | None]] = {}
    of_task = {f"task.{name.partition('.')[2]}": found for name, found in task_numbers(tables).items()}
    written = tables["task"][0]
    keys = [each.key for each in limits.limits]
    for column, name in enumerate(chosen.names):
        plain = name.replace("task[0].", "task.")
        whole, _, end = name.rpartition(".")
        key = name.removeprefix(_LIMITS)
        if plain in of_task and plain != "task.weight":
            part = plain.removeprefix("task.")
            table, where = of_task[plain]
            if table is written:
                task[column] = (part, None)
            else:
                task[column] = (part.rpartition("_")[0], int(where))
        elif name in [each.name for each in program.arguments]:
            index = [each.name for each in program.arguments].index(name)
            arguments[column] = (index, nlp.case.units.to_internal(1.0, program.arguments[index].dimension))
        elif end in _ENDS and whole in [each.name for each in program.variables]:
            index = [each.name for each in program.variables].index(whole)
            factor = nlp.case.units.to_internal(1.0, program.variables[index].dimension)
            bounds[column] = (index, end == "max", factor)
        elif key in keys or f"{key}.max" in keys:
            k = keys.index(key) if key in keys else keys.index(f"{key}.max")
            limited[column] = (k, nlp.case.units.to_internal(1.0, limits.limits[k].dimension))
        else:
            raise NotPlacedError(f"compiled C cannot vary {name}, which changes the structure of the nonlinear program")
    found = Places(nlp, limits, arguments, bounds, limited, task, written)
    for k, other in programs.items():
        _compare(found, other, chosen.values[[k]])
    return found


def _program(case: Case) -> Nlp:
    """Return the nonlinear program of a case.

    Raises:
        NotPlacedError: the case is not supported by the compiled engine.
        CaseError: the case contradicts itself.
    """
    if len(case.tasks) > 1:
        raise NotPlacedError("compiled C supports one task, but the case has several")
    nlp = formulate(case)
    if not nlp.n:
        raise NotPlacedError("compiled C needs one variable or more, but the case has none")
    if nlp.program.places.epigraph is not None:
        raise NotPlacedError("compiled C does not support the worst F of several poses")
    if nlp.program.model.closure or nlp.program.model.loops:
        raise NotPlacedError("compiled C does not support robots with loop equations")
    if nlp.program.model.unknowns:
        raise NotPlacedError("compiled C does not support robots with free actuator coordinates")
    if nlp.constant_limits:
        raise NotPlacedError("compiled C does not support limits that involve only fixed parameters")
    return with_all_pairs(nlp)


def _compare(places: Places, other: Nlp, values: FloatArray) -> None:
    """Compare data and function values with a program that is formulated at one point with values (1, m).

    Raises:
        NotPlacedError: data or function values differ.
    """
    block = places.block(values)
    placed = block.numbers.put_into(places.nlp, 0)
    names = [
        [*(each.name for each in nlp.program.variables), *(each.name for each in nlp.program.constraints)]
        + [each.name for each in nlp.program.arguments]
        for nlp in (placed, other)
    ]
    pairs = [
        (getattr(placed, name), getattr(other, name)) for name in ("arguments", "lower", "upper", "g_lower", "g_upper")
    ]
    is_same = names[0] == names[1] and bool(block.is_placed.all()) and placed.sense is other.sense
    is_same = is_same and all(np.allclose(one, two, rtol=_SAME, atol=_SAME) for one, two in pairs)
    for share in other.shares[:_SHARES] if is_same else ():
        x = other.centre + 0.5 * share * other.scale
        one, two = placed.evaluate(x), other.evaluate(x)
        close = np.allclose([one.F, *one.g], [two.F, *two.g], rtol=_SAME_VALUE, atol=_SAME_VALUE, equal_nan=True)
        is_same = is_same and bool(close)
    if not is_same:
        raise NotPlacedError("compiled C needs the same structure of the nonlinear program at all points")
