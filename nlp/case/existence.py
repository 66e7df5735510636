"""Dimensions of a case with which its robot does not exist, as a sentence that names the place in the robot's file.

The equations of a robot are expressions of its dimensions. At dimensions such as a rod that is too short for the
distance that it spans, they give no number, and nothing that follows says why. The file of the robot does.
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

#: Robots and dimensions that are remembered: as many as the cases that one program has at a time.
_REMEMBERED = 64


def fault_of_dimensions(
    model: Model, parameters: Mapping[str, Value | Sequence[Value] | FloatArray], units: Units
) -> str:
    """Return why a robot does not exist with some dimensions, as a clause; empty where no reason is known.

    Args:
        model: the robot; one that is given by its rows has no place without a value.
        parameters: values of the components of each parameter; what depends on free ones is not examined.
        units: for the message.
    """
    if not model.structure:
        return ""
    flat = {name: np.ravel(np.asarray(given, dtype=object)).tolist() for name, given in parameters.items()}
    known = [(name, values[0]) for name, values in flat.items() if len(values) == 1]
    error = _undefined_place(model, tuple((name, float(at)) for name, at in known if not isinstance(at, Free)))
    return "" if error is None else _sentence(error, model, units)


@lru_cache(maxsize=_REMEMBERED)
def _undefined_place(model: Model, values: tuple[tuple[str, float], ...]) -> UndefinedError | None:
    """Return the first place of a robot's file that has no finite value; None where there is none."""
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
    """Return the fault of a place, with the values of the names in it."""
    dimensions = {each.name: each.dimension for each in model.parameters}
    values = []
    for name, numbers in error.values.items():
        if name in dimensions:
            values.append(f"{name} = {units.text(numbers[0], dimensions[name])}")
        else:
            text = ", ".join(f"{number:.7g}" for number in numbers)
            values.append(f"{name} = {text if len(numbers) == 1 else f'({text})'}")
    here = f"; here {', '.join(values)}" if values else ""
    return f"the robot {model.name!r} does not exist with these dimensions: {error.place} {error.fault}{here}"
