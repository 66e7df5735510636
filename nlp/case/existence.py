"""Explanation of dimensions with which a robot cannot be assembled, with the place in the robot file.

The equations of a robot are expressions of its dimensions. A rod that is too short for the distance between its joints
gives an undefined value, such as the root of a negative number. Only the robot file shows which joint or point this is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray, Model
from ..units import Units
from .pose import Free, Value

if TYPE_CHECKING:
    from ...models.joints.written.forms import UndefinedError

#: Number of cached results: as many as the cases that one program has at a time.
_REMEMBERED = 64


def assembly_fault(model: Model, parameters: Mapping[str, Value | Sequence[Value] | FloatArray], units: Units) -> str:
    """Return the reason why a robot cannot be assembled with some dimensions, as a clause; empty for no known reason.

    Args:
        model: the robot; robots defined by rows of J are not examined.
        parameters: values of the components of each parameter; expressions of free parameters are not examined.
        units: units of the message.
    """
    if not model.structure:
        return ""
    flat = {name: np.ravel(np.asarray(given, dtype=object)).tolist() for name, given in parameters.items()}
    known = [(name, values[0]) for name, values in flat.items() if len(values) == 1]
    error = _undefined_place(model, tuple((name, float(at)) for name, at in known if not isinstance(at, Free)))
    return "" if error is None else _sentence(error, model, units)


@lru_cache(maxsize=_REMEMBERED)
def _undefined_place(model: Model, values: tuple[tuple[str, float], ...]) -> UndefinedError | None:
    """Return the first expression of a robot file without a finite value, as an error; None if all are finite."""
    from ...models.catalog import definition_of  # noqa: PLC0415 - most robots need no reading of their file
    from ...models.joints.home.chain import home_of  # noqa: PLC0415
    from ...models.joints.written.forms import UndefinedError  # noqa: PLC0415
    from ...models.joints.written.words import read_robot  # noqa: PLC0415

    tables = definition_of(model)
    if not tables:
        return None
    try:
        home_of(read_robot(tables), dict(values))
    except UndefinedError as error:
        return error.with_traceback(None)
    return None


def _sentence(error: UndefinedError, model: Model, units: Units) -> str:
    """Return the message of an undefined expression, with the values of its names."""
    dimensions = {each.name: each.dimension for each in model.parameters}
    values = []
    for name, numbers in error.values.items():
        if name in dimensions:
            values.append(f"{name} = {units.text(numbers[0], dimensions[name])}")
        else:
            text = ", ".join(f"{number:.7g}" for number in numbers)
            values.append(f"{name} = {text if len(numbers) == 1 else f'({text})'}")
    here = f"; here {', '.join(values)}" if values else ""
    return f"the robot {model.name!r} cannot be assembled with these dimensions: {error.place} {error.fault}{here}"
