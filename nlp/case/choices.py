"""Dimensions with catalogue values: a list of discrete values of which a solve chooses one."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, NamedTuple, TypeAlias

from ...models import Dimension, Parameter
from ..errors import CaseError
from ..system.jsonvalues import Absent, Hidden, JsonObject, Known, Measure, Vector
from .case import Case
from .names import name_of_task
from .pose import Free, PerTask, Value

#: For each such dimension, a slice of its values: index of the first value, and index behind the last value.
Ranges: TypeAlias = tuple[tuple[int, int], ...]


class CatalogueDimension(NamedTuple):
    """Dimension with catalogue values.

    Attributes:
        parameter: name of the parameter in the robot.
        component: index of the component within the parameter.
        name: name of the component in the case.
        dimension: length, angle or plain number.
        values: allowed values, ascending, radians for angles.
        task: index of the task with this value; None for a value of all tasks.
    """

    parameter: str
    component: int
    name: str
    dimension: Dimension
    values: tuple[float, ...]
    task: int | None = None


class ChosenDimension(JsonObject):
    """Dimension with a chosen catalogue value, or with a rounded value.

    Attributes:
        name: name of the dimension.
        value: chosen or rounded value.
        unit: unit of the values.
        values: catalogue values; absent for a rounded dimension.
        before: value before rounding; absent for catalogue values.
        dimension: physical dimension of the values, in radians for angles.
    """

    name: str
    value: Annotated[Known, Measure.NUMBER]
    unit: str
    values: Annotated[Absent[Vector], Measure.NUMBER]
    before: Annotated[Absent[float], Measure.NUMBER]
    dimension: Hidden[Dimension] = Dimension.NUMBER


def catalogue_dimensions(case: Case) -> tuple[CatalogueDimension, ...]:
    """Return the dimensions of a case with catalogue values, in the robot's order."""
    return tuple(
        CatalogueDimension(item.name, k, name, item.dimension, value.values, task)
        for item in case.model.parameters
        for k in range(len(item.components))
        for task, name, value in values_of_component(case, item, k)
        if isinstance(value, Free) and value.values
    )


class ComponentValue(NamedTuple):
    """Name and value of a component of a parameter; with the index of the task, if it changes from task to task."""

    task: int | None
    name: str
    value: Value


def values_of_component(case: Case, item: Parameter, component: int) -> list[ComponentValue]:
    """Return the value of a component of a parameter by its index; for each task, if it changes from task to task."""
    name = case.component_names(item)[component]
    own = case.dimensions_per_task.get(item.components[component])
    if own is None:
        return [ComponentValue(None, name, case.components(item.name)[component])]
    return [ComponentValue(task, name_of_task(name, task), value) for task, value in enumerate(own.values)]


def all_values(numbers: Sequence[CatalogueDimension]) -> Ranges:
    """Return the slices of all values."""
    return tuple((0, len(each.values)) for each in numbers)


def within_ranges(case: Case, numbers: Sequence[CatalogueDimension], ranges: Ranges) -> Case:
    """Return a case in which each catalogue dimension is free between two of its values, or fixed at a single value.

    Args:
        case: the case with catalogue values.
        numbers: its dimensions with catalogue values.
        ranges: slice of the values of each dimension.
    """
    given: dict[tuple[str, int, int | None], Value] = {}
    for number, (first, behind) in zip(numbers, ranges, strict=True):
        low, high = number.values[first], number.values[behind - 1]
        given[number.parameter, number.component, number.task] = low if behind - first == 1 else Free(low, high)
    return with_values(case, given)


def with_values(case: Case, given: Mapping[tuple[str, int, int | None], Value]) -> Case:
    """Return a case with other values of some components of its parameters.

    Args:
        case: the case.
        given: value by parameter, index of the component, and index of the task, which is None for a value of all
            tasks.
    """

    def within(item: Parameter, k: int) -> Value | PerTask:
        values = [
            (task, given.get((item.name, k, task), value)) for task, _, value in values_of_component(case, item, k)
        ]
        return values[0][1] if values[0][0] is None else PerTask(tuple(value for _, value in values))

    parameters = {item.name: [within(item, k) for k in range(len(item.components))] for item in case.model.parameters}
    return replace(case, parameters=parameters)


def chosen_settings(case: Case, fixed: Case) -> Mapping[str, float]:
    """Return the chosen value of each catalogue dimension by name, in the case's units.

    Args:
        case: the case with catalogue values.
        fixed: the same case with values chosen.
    """
    items = {item.name: item for item in case.model.parameters}
    return {
        each.name: case.units.shown(value, each.dimension)
        for each in catalogue_dimensions(case)
        for task, _, value in values_of_component(fixed, items[each.parameter], each.component)
        if task == each.task and not isinstance(value, Free)
    }


def check_no_catalogue(case: Case) -> None:
    """Refuse a case with catalogue values, for commands that need continuous dimensions.

    Raises:
        CaseError: a dimension has catalogue values.
    """
    for each in catalogue_dimensions(case):
        fault = "has catalogue values, and only solve, report, export and certify choose one: set a value with --set"
        raise CaseError(f"robot.parameters.{each.name}", fault, source=case.source)
