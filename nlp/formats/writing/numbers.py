"""Numbers as the shortest text that reads as the same double, and names that are valid in XML."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ....models import FloatArray

#: Largest rounding error of a zero entry of a unit vector or rotation.
_NOISE = 1e-16


def number(value: float) -> str:
    """Return a number as text; minus zero is zero, and a whole number has no point."""
    text = repr(float(value) + 0.0)
    return text.removesuffix(".0")


def numbers(values: Iterable[float]) -> str:
    """Return numbers as text, separated by spaces."""
    return " ".join(number(value) for value in values)


def direction(vector: FloatArray) -> str:
    """Return a unit vector (3,) as text, with 0 for rounding errors."""
    return numbers(np.where(np.abs(vector) < _NOISE, 0.0, vector))


def plain_name(name: str) -> str:
    """Return a robot's name with underscores for characters that are not allowed in XML."""
    return "".join(char if char.isprintable() else "_" for char in name)
