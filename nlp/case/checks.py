"""Checks of values in a case: numbers, finite, not too large, within their range.

Messages name the key of the value in a case file.
"""

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

#: Relative rounding error between a bound in degrees and the same bound in radians.
_ROUNDING = 1e-12


def check_value(
    value: Value,
    key: str,
    dimension: Dimension,
    units: Units,
    domain: tuple[float, float] = (-math.inf, math.inf),
) -> Value:
    """Return a checked fixed or free value; a value outside its domain by a rounding error is moved onto the bound.

    Args:
        value: fixed or free value, radians for an angle.
        key: dotted key of the value, for messages.
        dimension: length, angle or plain number.
        units: units of messages.
        domain: smallest and largest allowed value.

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
        fault = f"must be below max = {units.text(upper, dimension)}; write a fixed value as a plain number"
        raise CaseError(f"{key}.min", fault, units.shown(lower, dimension))
    start = value.start
    if start is not None:
        start = _check_number(start, f"{key}.start", dimension, units, (lower, upper))
    return Free(
        lower,
        upper,
        start,
        rate=None if value.rate is None else check_rate(value.rate, f"{key}.rate", dimension, units),
    )


def check_rate(rate: float, key: str, dimension: Dimension, units: Units) -> float:
    """Return the checked rate of a setting along a path.

    Args:
        rate: largest change per second; infinite for no limit.
        key: dotted key of the rate, for messages.
        dimension: dimension of the setting.
        units: units of messages.

    Raises:
        CaseError: the rate is not positive, or too large.
    """
    number = check_real(rate, key)
    if not number > 0:
        raise CaseError(key, "must be positive, or inf for no limit", units.shown(number, dimension))
    if not math.isinf(number):
        check_size(number, key)
    return number


def _check_values(value: Free, key: str, dimension: Dimension, units: Units, domain: tuple[float, float]) -> Free:
    """Return checked catalogue values; the arguments and errors are those of :func:`check_value`."""
    listed = [
        _check_number(each, f"{key}.values[{k}]", dimension, units, domain) for k, each in enumerate(value.values)
    ]
    found = Free.among(listed)
    for one, other in pairwise(found.values):
        if one == other:
            fault = f"must not have a value twice, got {units.text(one, dimension)} twice"
            raise CaseError(f"{key}.values", fault)
    if len(listed) < 2:
        fault = f"must have at least 2 entries, got {len(listed)}; write a fixed value as a plain number"
        raise CaseError(f"{key}.values", fault)
    return found


def _check_number(value: float, key: str, dimension: Dimension, units: Units, domain: tuple[float, float]) -> float:
    """Return a checked number; the arguments and errors are those of :func:`check_value`."""
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
    """Return a number as a float; texts and truth values are refused.

    Args:
        value: value to check.
        key: dotted key of the value, for messages.

    Raises:
        CaseError: the value is not a real number.
    """
    is_number = hasattr(value, "__float__") and not isinstance(value, bool | np.bool_ | str | bytes)
    try:
        return float(value) if is_number else _refuse_number(value, key)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return _refuse_number(value, key)


def _refuse_number(value: object, key: str) -> NoReturn:
    raise CaseError(key, f"must be a number, got {type(value).__name__} {value!r:.60}") from None


def check_size(number: float, key: str) -> None:
    """Refuse a number of too large magnitude.

    Args:
        number: number to check.
        key: dotted key of the number, for messages.

    Raises:
        CaseError: the magnitude exceeds the largest one of any number in a case.
    """
    if abs(number) > LARGEST:
        raise CaseError(key, f"must be at most {LARGEST:g} in magnitude", number)


def check_vector(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    """Return three finite numbers as an array (3,).

    Args:
        values: numbers to check.
        key: dotted key of the numbers, for messages.

    Raises:
        CaseError: the values are not three finite numbers.
    """
    vector = check_reals(values, key)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise CaseError(key, "must be three finite numbers", vector.tolist())
    return vector


def check_reals(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    """Return numbers as an array; texts and truth values are refused.

    Args:
        values: numbers, in an array of any shape.
        key: dotted key of the numbers, for messages.

    Raises:
        CaseError: a value is not a real number, or rows have different lengths.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # rows of different lengths
        raise CaseError(key, "must be numbers in rows of equal length") from None
    parts = values if isinstance(values, list | tuple) and given.ndim == 1 else given.ravel().tolist()
    numbers = [check_real(part, f"{key}[{index}]" if given.ndim == 1 else key) for index, part in enumerate(parts)]
    return np.array(numbers, dtype=np.float64).reshape(given.shape)


def check_direction(values: ArrayLike | Sequence[Value], key: str) -> FloatArray:
    """Return a direction of any length but zero as an array (3,).

    Args:
        values: components of the direction.
        key: dotted key of the direction, for messages.

    Raises:
        CaseError: the components are not three finite numbers, or all zero.
    """
    vector = check_vector(values, key)
    if not vector.any():
        raise CaseError(key, "must not be zero: a zero vector has no direction", vector.tolist())
    return vector


def check_statics(model: Model, key: str, value: str | None = None) -> None:
    """Refuse a robot whose actuator forces do not follow from the loads.

    Args:
        model: the robot.
        key: dotted key of the load, limit or objective that needs actuator forces, for messages.
        value: value of this key for messages; None to leave it out.

    Raises:
        CaseError: the loads do not determine the actuator forces of this robot.
    """
    from ...models.statics import statics_hindrance  # noqa: PLC0415 - a case without loads starts without it

    hindrance = statics_hindrance(model)
    if hindrance:
        raise CaseError(key, f"is not supported for the robot {model.name!r}: {hindrance}", value)


def check_determined_joints(model: Model, key: str, source: str | None = None) -> None:
    """Refuse a robot with free actuator coordinates, for a verification over poses.

    Args:
        model: the robot.
        key: dotted key of the workspace or path, for messages.
        source: name of the case file.

    Raises:
        CaseError: the pose does not determine all actuator coordinates.
    """
    if joints := model.free_joints:
        several = len(joints) > 1
        names = f"actuated joint{'s' * several} {', '.join(joints)} of {model.name!r}"
        fault = f"is not possible: the pose does not determine the coordinate{'s' * several} of {names}"
        raise CaseError(
            key, f"{fault}; use a robot file without {'these joints' if several else 'this joint'}", source=source
        )


def check_tolerance(tolerance: float | None, model: Model, has_workspace: bool) -> None:
    """Refuse a tolerance that is not positive, or that is not supported for the robot.

    Args:
        tolerance: largest manufacturing error of each joint centre, length; None for no tolerance.
        model: the robot.
        has_workspace: True if a workspace is verified.

    Raises:
        CaseError: the tolerance is not allowed.
    """
    if tolerance is None:
        return
    if not 0 < check_real(tolerance, "tolerance.joint_centre") <= LARGEST:
        raise CaseError("tolerance.joint_centre", "must be positive and finite", tolerance)
    if model.structure and has_workspace:
        # The workspace is verified for all robots within the tolerance.
        return
    if not model.built or model.unknowns:
        reason = "add a [workspace] to verify it there" if model.structure else "its joint centres are not known"
        raise CaseError("tolerance.joint_centre", f"is not supported for the robot {model.name!r}: {reason}")
