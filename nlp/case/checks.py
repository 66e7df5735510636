"""Checks of a case's numbers: finite, not too large, inside their range. Faults are in the words of a case file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from ...models import Dimension, FloatArray, Model
from ..errors import CaseError
from ..units import Units
from .pose import LARGEST, Free, Value

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

#: A bound written in degrees may differ from the same bound in radians by rounding: by this part of the number.
_ROUNDING = 1e-12


def check_value(
    value: Value,
    key: str,
    dimension: Dimension,
    units: Units,
    domain: tuple[float, float] = (-math.inf, math.inf),
) -> Value:
    """Return a fixed or free number; one that leaves its domain by rounding only is moved back into it.

    Args:
        value: the number, radians for an angle.
        key: its dotted key, for messages.
        dimension: length, angle or plain number.
        units: units for people.
        domain: smallest and largest value.

    Raises:
        CaseError: a number is not finite, too large or outside the domain, or two bounds are crossed.
    """
    if not isinstance(value, Free):
        return _check_number(value, key, dimension, units, domain)
    if value.values:
        return _check_values(value, key, dimension, units, domain)
    lower = _check_number(value.lower, f"{key}.min", dimension, units, domain)
    upper = _check_number(value.upper, f"{key}.max", dimension, units, domain)
    if not lower < upper:
        fault = f"must be below max = {units.text(upper, dimension)}; a fixed value is a number alone"
        raise CaseError(f"{key}.min", fault, units.shown(lower, dimension))
    start = value.start
    if start is not None:
        start = _check_number(start, f"{key}.start", dimension, units, (lower, upper))
    return Free(lower, upper, start)


def _check_values(value: Free, key: str, dimension: Dimension, units: Units, domain: tuple[float, float]) -> Free:
    """Return a number that has one of a few values; the arguments and errors are those of :func:`check_value`."""
    listed = [
        _check_number(each, f"{key}.values[{k}]", dimension, units, domain) for k, each in enumerate(value.values)
    ]
    found = Free.among(listed)
    for one, other in pairwise(found.values):
        if one == other:
            raise CaseError(f"{key}.values", "must not have a value twice", units.shown(one, dimension))
    if len(listed) < 2:
        raise CaseError(f"{key}.values", "must have at least 2 entries; a fixed value is a number alone")
    return found


def _check_number(value: float, key: str, dimension: Dimension, units: Units, domain: tuple[float, float]) -> float:
    """Return a number; the arguments and errors are those of :func:`check_value`."""
    number = check_real(value, key)
    if not math.isfinite(number):
        raise CaseError(key, "must be finite", number)
    check_size(number, key)
    lower, upper = domain
    slack = _ROUNDING * max(1.0, abs(number))
    if not lower - slack <= number <= upper + slack:
        least, most = (units.text(end, dimension) for end in domain)
        allowed = f"between {least} and {most}"
        if math.isinf(upper):
            allowed = f"at least {least}"
        elif math.isinf(lower):
            allowed = f"at most {most}"
        raise CaseError(key, f"must be {allowed}", units.shown(number, dimension))
    return min(max(number, lower), upper)


def check_real(value: object, key: str) -> float:
    """Return a number as a float; text, truth values and what is no number are refused.

    Args:
        value: the number.
        key: its dotted key, for messages.

    Raises:
        CaseError: it is no number.
    """
    is_number = hasattr(value, "__float__") and not isinstance(value, bool | np.bool_ | str | bytes)
    try:
        return float(value) if is_number else _refuse_number(value, key)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return _refuse_number(value, key)


def _refuse_number(value: object, key: str) -> NoReturn:
    raise CaseError(key, f"must be a number, got {type(value).__name__} {value!r:.60}") from None


def check_size(number: float, key: str) -> None:
    """Refuse a number larger than any number of a case may be.

    Args:
        number: the number.
        key: its dotted key, for messages.

    Raises:
        CaseError: it is larger.
    """
    if abs(number) > LARGEST:
        raise CaseError(key, f"must be at most {LARGEST:g} in size", number)


def check_vector(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    """Return three finite numbers as an array (3,).

    Args:
        values: the numbers.
        key: their dotted key, for messages.

    Raises:
        CaseError: they are not three finite numbers.
    """
    vector = check_reals(values, key)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise CaseError(key, "must be three finite numbers")
    return vector


def check_reals(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    """Return numbers as an array; text, truth values and what is no number are refused.

    Args:
        values: the numbers, in any shape.
        key: their dotted key, for messages.

    Raises:
        CaseError: one is no number, or they have no common shape.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # rows of different lengths
        raise CaseError(key, "must be numbers in rows of one length") from None
    parts = values if isinstance(values, list | tuple) and given.ndim == 1 else given.ravel().tolist()
    numbers = [check_real(part, f"{key}[{index}]" if given.ndim == 1 else key) for index, part in enumerate(parts)]
    return np.array(numbers, dtype=np.float64).reshape(given.shape)


def check_direction(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    """Return a direction of any length but zero as an array (3,).

    Args:
        values: its components.
        key: its dotted key, for messages.

    Raises:
        CaseError: the components are not three finite numbers, or all zero.
    """
    vector = check_vector(values, key)
    if not vector.any():
        raise CaseError(key, "must not be zero: it gives no direction", vector.tolist())
    return vector


def check_statics(model: Model, key: str, value: str | None = None) -> None:
    """Refuse a robot whose actuators' forces no load determines.

    Args:
        model: the robot.
        key: dotted key of what needs them, for the message.
        value: its value there; None where the message does not show it.

    Raises:
        CaseError: in the words of a case file.
    """
    from ...models.statics import statics_hindrance  # noqa: PLC0415 - a case without loads starts without it

    hindrance = statics_hindrance(model)
    if hindrance:
        raise CaseError(key, f"is not for {model.name!r}: {hindrance}", value)


def check_determined_joints(model: Model, key: str, source: str | None = None) -> None:
    """Refuse a robot with driven joints that the pose does not determine, where poses are judged.

    Args:
        model: the robot.
        key: dotted key of what is judged, for the message.
        source: name of the case's file.

    Raises:
        CaseError: the robot has such joints.
    """
    if joints := model.free_joints:
        several = len(joints) > 1
        who = f"driven joint{'s' * several} {', '.join(joints)} of {model.name!r}"
        fault = f"is not possible: the pose does not determine the position{'s' * several} of {who}"
        raise CaseError(key, f"{fault}; use a robot file without {'them' if several else 'it'}", source=source)
