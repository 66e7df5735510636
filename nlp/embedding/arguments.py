"""Arguments of a compiled solver: arrays of finite numbers in the shapes that the C reads."""

from __future__ import annotations

from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from ...models import FloatArray
from ..errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def checked_rows(name: str, given: ArrayLike | None, length: int) -> FloatArray | None:
    """Return an array (length,) or (n, length) of finite numbers.

    Raises:
        InputError: the shape is another one, or a number is not finite.
    """
    if given is None:
        return None
    array = checked_numbers(name, given)
    if array.ndim not in (1, 2) or array.shape[-1] != length:
        raise InputError(f"{name}: must have the shape ({length},) or (n, {length}), got {array.shape}")
    return array


def checked_numbers(name: str, given: ArrayLike) -> FloatArray:
    """Return an array of finite numbers, contiguous. Texts are no numbers, nor are complex ones.

    Raises:
        InputError: something in it is no number, or not finite.
    """
    try:
        found = np.array(given)
        is_real = found.dtype.kind in "biuf" or all(isinstance(each, Real) for each in found.ravel().tolist())
        array = np.array(found, dtype=np.float64, order="C") if is_real else None
    except (ValueError, TypeError, OverflowError):
        array = None
    if array is None:
        raise InputError(f"{name}: must be an array of numbers, and no texts or complex ones")
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        place = ", ".join(str(index) for index in wrong[0])
        where = f"{name}[{place}]" if place else name
        raise InputError(f"{where} = {array[tuple(wrong[0])]}: must be finite")
    return array


def checked_budget(name: str, given: ArrayLike | None, *, is_whole: bool) -> FloatArray | None:
    """Return a budget, () or (n,) numbers above 0.

    Raises:
        InputError: the shape is another one, or a number is not allowed.
    """
    if given is None:
        return None
    array = checked_numbers(name, given)
    if array.ndim > 1:
        raise InputError(f"{name}: must be a number or one for each problem, got {array.shape}")
    largest = np.iinfo(np.intc).max if is_whole else np.inf
    is_wrong = ~((array > 0) & (array <= largest)) | (is_whole & (array != np.floor(array)))
    if is_wrong.any():
        words = f"a whole number from 1 to {largest}" if is_whole else "above 0"
        raise InputError(f"{name} = {array[is_wrong].flat[0]:.10g}: must be {words}")
    return array


def is_between(value: object, least: int, most: int | None) -> bool:
    """Return whether a value is a whole number within bounds."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool):
        return False
    return bool(least <= value and (most is None or value <= most))
