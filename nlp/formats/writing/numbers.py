"""Numbers as the shortest text from which the same double is read again, and names that XML has a place for."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ....models import FloatArray

#: Entries of a unit vector or rotation below this are rounding errors of zero.
_NOISE = 1e-16


def number(value: float) -> str:
    """Return a number as text; minus zero is zero, and a whole number has no point."""
    text = repr(float(value) + 0.0)
    return text.removesuffix(".0")


def numbers(values: Iterable[float]) -> str:
    """Return numbers with spaces between them."""
    return " ".join(number(value) for value in values)


def direction(vector: FloatArray) -> str:
    """Return a unit vector (3,) as text, without entries that are rounding errors."""
    return numbers(np.where(np.abs(vector) < _NOISE, 0.0, vector))


def plain_name(name: str) -> str:
    """Return a robot's name without the characters that XML has no place for."""
    return "".join(char if char.isprintable() else "_" for char in name)
