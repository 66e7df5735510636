"""Dimensions of a case that have one of a few values, as parts from a catalogue have, and cases with some of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, NamedTuple, TypeAlias

from ...models import Dimension
from ..errors import CaseError
from ..system.jsonvalues import Absent, Hidden, JsonObject, Known, Measure, Vector
from .case import Case
from .pose import Free, Value

#: For each such dimension, a range of its values: the place of the first one, and the place behind the last one.
Ranges: TypeAlias = tuple[tuple[int, int], ...]


class ListedNumber(NamedTuple):
    """A dimension that has one of a few values.

    Attributes:
        parameter: name that the robot gives the parameter.
        component: index within the parameter.
        name: of the number in the case.
        dimension: length, angle or plain number.
        values: ascending, radians for angles.
    """

    parameter: str
    component: int
    name: str
    dimension: Dimension
    values: tuple[float, ...]


class ChosenNumber(JsonObject):
    """A number whose value was chosen.

    Attributes:
        name: of the number.
        value: that was chosen.
        unit: of its numbers.
        values: of which one was chosen; absent for a rounded number.
        before: value before it was rounded; else absent.
        dimension: of its numbers, in radians for angles.
    """

    name: str
    value: Annotated[Known, Measure.NUMBER]
    unit: str
    values: Annotated[Absent[Vector], Measure.NUMBER]
    before: Annotated[Absent[float], Measure.NUMBER]
    dimension: Hidden[Dimension] = Dimension.NUMBER


def listed_numbers(case: Case) -> tuple[ListedNumber, ...]:
    """Return the dimensions of a case that have one of a few values, in the robot's order."""
    return tuple(
        ListedNumber(item.name, k, name, item.dimension, value.values)
        for item in case.model.parameters
        for k, (name, value) in enumerate(zip(case.component_names(item), case.components(item.name), strict=True))
        if isinstance(value, Free) and value.values
    )


def all_values(numbers: Sequence[ListedNumber]) -> Ranges:
    """Return the ranges of all values."""
    return tuple((0, len(each.values)) for each in numbers)


def within_ranges(case: Case, numbers: Sequence[ListedNumber], ranges: Ranges) -> Case:
    """Return a case whose listed numbers are between the ends of ranges of their values; fixed where there is one."""
    given: dict[tuple[str, int], Value] = {}
    for number, (first, behind) in zip(numbers, ranges, strict=True):
        low, high = number.values[first], number.values[behind - 1]
        given[number.parameter, number.component] = low if behind - first == 1 else Free(low, high)
    parameters = {
        item.name: [given.get((item.name, k), value) for k, value in enumerate(case.components(item.name))]
        for item in case.model.parameters
    }
    return replace(case, parameters=parameters)


def chosen_settings(case: Case, fixed: Case) -> Mapping[str, float]:
    """Return the listed numbers of a case as another one fixes them, by name and in the case's units."""
    return {
        each.name: case.units.shown(value, each.dimension)
        for each in listed_numbers(case)
        if not isinstance(value := fixed.components(each.parameter)[each.component], Free)
    }


def check_no_choice(case: Case) -> None:
    """Refuse a case with listed numbers, where one robot with continuous numbers is needed.

    Raises:
        CaseError: there is one.
    """
    for each in listed_numbers(case):
        fault = "has values, of which solve, report, export and certify choose one: give one with --set"
        raise CaseError(f"robot.parameters.{each.name}", fault, source=case.source)
