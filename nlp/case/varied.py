"""Values of quantities of a case by name, as arguments of sweeps and trade-off curves in Python."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TypeAlias

import numpy as np

from ...models import FloatArray
from ..errors import InputError

#: Values of each quantity, in the units of the case, by its name for ``--set``.
Over: TypeAlias = Mapping[str, Iterable[float]]


def axes_of(over: Over, argument: str = "over", *, repeated: bool = False) -> dict[str, FloatArray]:
    """Return the values (k,) of each quantity.

    Args:
        over: values by name.
        argument: name of the argument in Python, for messages.
        repeated: If true, a value may appear twice.

    Raises:
        InputError: the argument is not a mapping, a quantity has no values, or a value is not finite or appears twice.
    """
    if not isinstance(over, Mapping):
        fault = "must be a mapping from names to values, such as {'x1': [10, 12, 14]}"
        raise InputError(f"{argument}: {fault}, got {type(over).__name__}")
    axes = {name: _values(name, values, argument) for name, values in over.items()}
    for name, values in axes.items():
        if not repeated and len(np.unique(values)) < len(values):
            raise InputError(f"{argument} {name}: contains a value twice; the values must be different")
    return axes


def _values(name: str, values: Iterable[float], argument: str) -> FloatArray:
    """Return the values (k,) of a quantity; the errors are those of :func:`axes_of`."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise InputError(f"{argument} {name}: must be a list of numbers, got {type(values).__name__} {values!r:.60}")
    found = list(values)
    for value in found:
        if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
            raise InputError(f"{name} = {value}: must be a finite number")
    if not found:
        raise InputError(f"{name}: has no values")
    return np.array(found, dtype=np.float64)
