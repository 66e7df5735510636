"""Checks of the values of a robot's parameters in a case, and of their catalogue values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...models import Dimension, Model, Parameter, unit_vector
from ..errors import CaseError, nearest
from ..units import Units
from .checks import check_direction, check_real, check_value
from .pose import Free, PerTask, Value
from .task import Method, Task


def check_parameters(
    given: Mapping[str, Value | PerTask | Sequence[Value | PerTask]], model: Model, tasks: int, units: Units
) -> dict[str, tuple[Value | PerTask, ...]]:
    """Return the components of every parameter in the model's order, a fixed direction as a unit vector.

    Args:
        given: value of each parameter by name.
        model: the robot.
        tasks: number of tasks.
        units: units of messages.

    Raises:
        CaseError: a parameter is unknown or missing, or a value is not allowed.
    """
    known = {parameter.name: parameter for parameter in model.parameters}
    for name in given:
        if name not in known:
            raise CaseError(f"robot.parameters.{name}", f"no such parameter; {nearest(name, known)}")
    components: dict[str, tuple[Value | PerTask, ...]] = {}
    for name, parameter in known.items():
        key = f"robot.parameters.{name}"
        if name not in given:
            raise CaseError(key, f"is missing: {parameter.description}; give {_allowed_form(parameter)}")
        stated = given[name]
        if isinstance(stated, str | bytes):  # a sequence too, but of no numbers
            check_real(stated, key)
        values: tuple[Value | PerTask, ...] = tuple(stated) if isinstance(stated, Sequence) else (stated,)
        if len(values) != len(parameter.typical):
            raise CaseError(key, f"must be {_allowed_form(parameter)}")
        if parameter.is_direction and any(isinstance(value, PerTask) for value in values):
            raise CaseError(key, "must be the same for every task: a direction cannot change from task to task")
        if parameter.is_direction and not any(isinstance(value, Free) for value in values):
            components[name] = tuple(float(part) for part in unit_vector(check_direction(values, key)))  # type: ignore[arg-type]
            continue
        keys = [key] if len(values) == 1 else [f"{key}[{index}]" for index in range(len(values))]
        domain = (parameter.lower, parameter.upper)
        components[name] = tuple(
            _check_each(value, place, parameter.dimension, tasks, units, domain)
            for value, place in zip(values, keys, strict=True)
        )
    return components


def _check_each(
    value: Value | PerTask, key: str, dimension: Dimension, tasks: int, units: Units, domain: tuple[float, float]
) -> Value | PerTask:
    """Return a checked value, or the checked value for each task; arguments and errors are those of ``check_value``."""
    if not isinstance(value, PerTask):
        return check_value(value, key, dimension, units, domain)
    given = tuple(value.values)
    given = given * tasks if len(given) == 1 else given
    if len(given) != tasks:
        raise CaseError(f"{key}.tasks", f"must have one value for each of the {tasks} tasks, got {len(given)}")
    keys = [key if len(value.values) == 1 else f"{key}.tasks[{k}]" for k in range(len(given))]
    return PerTask(
        tuple(check_value(each, place, dimension, units, domain) for each, place in zip(given, keys, strict=True))
    )


def _allowed_form(parameter: Parameter) -> str:
    """Return the form of a parameter's value in a case file, for messages."""
    one = "a number or { min, max } or { values }"
    return one if len(parameter.typical) == 1 else f"a list of {len(parameter.typical)}, each {one}"


def check_choices(
    parameters: Mapping[str, Sequence[Value | PerTask]], model: Model, tasks: Sequence[Task], method: Method
) -> None:
    """Refuse catalogue values of directions, and combinations of tasks that do not allow catalogue values.

    Args:
        parameters: checked components of each parameter by name.
        model: the robot.
        tasks: tasks of the case.
        method: method that combines the tasks.

    Raises:
        CaseError: a parameter or the combination is not allowed.
    """
    for item in model.parameters:
        stated = parameters[item.name]
        values = [value.whole if isinstance(value, PerTask) else value for value in stated]
        if not any(isinstance(value, Free) and value.values for value in values):
            continue
        key = f"robot.parameters.{item.name}"
        if item.is_direction:
            raise CaseError(key, "must be numbers or { min, max }: a direction cannot have { values }")
        if len(tasks) > 1 and method is Method.AVERAGE:
            fault = f"must be 'weighted-sum' or 'worst-case': {key} has catalogue values"
            is_shared = not any(isinstance(value, PerTask) for value in stated)
            fault += ", and an average of catalogue values need not be a catalogue value" if is_shared else ""
            raise CaseError("combine.method", fault, method.value)
        if method is Method.WORST_CASE and len({task.sense for task in tasks}) > 1:
            fault = f"must be 'weighted-sum': {key} has catalogue values, and tasks have both senses"
            raise CaseError("combine.method", fault, method.value)
