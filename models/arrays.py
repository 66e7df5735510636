"""Numeric arrays: their type, read-only copies, and values of CasADi functions at many points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import casadi as ca
import numpy as np

if TYPE_CHECKING:
    # Importing numpy.typing takes a fifth of the time that importing NumPy does, so only type checkers do it.
    from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = "NDArray[np.float64]"

#: Relative difference below which two values count as equal, so that rounding does not choose between them.
_TIE = 1e-6


def frozen_array(values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return a read-only copy of ``values`` as float64.

    Args:
        values: numbers that can be arranged as an array.
        shape: required shape of the array.

    Raises:
        ValueError: the values have another shape.
    """
    array = np.array(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"expected an array of shape {shape}, got {array.shape}")
    array.flags.writeable = False
    return array


def frozen_vector(values: Sequence[float] | FloatArray) -> FloatArray:
    """Return a read-only copy of a vector (n,) of any length as float64.

    Args:
        values: (n,) components of the vector.

    Raises:
        ValueError: the values do not form a vector.
    """
    return frozen_array(values, (len(values),))


def buffer_on(function: ca.Function, inputs: Sequence[FloatArray], outputs: Sequence[FloatArray]) -> tuple[Any, Any]:
    """Return CasADi's buffer of a dense function, and its evaluator.

    Function, buffer and arrays must stay alive while the evaluator is used.

    Args:
        function: the function.
        inputs: memory of each input, column after column.
        outputs: memory of each result, column after column.
    """
    buffer: Any
    buffer, evaluate = function.buffer()
    for place, arrays in ((buffer.set_arg, inputs), (buffer.set_res, outputs)):
        for index, array in enumerate(arrays):
            if array.size:
                place(index, array.data)
    return buffer, evaluate


def values_at(function: ca.Function, *points: FloatArray) -> list[FloatArray]:
    """Return the results (P, rows, columns) of a CasADi function, dense, at P points.

    The function reads and writes NumPy's memory, because CasADi's own matrices are converted through Python lists.

    Args:
        function: function of vectors, made of ``SX``.
        points: (P, n) values of each argument.
    """
    count = len(points[0])
    arguments = [np.ascontiguousarray(each, dtype=np.float64) for each in points]
    found = [np.zeros((count, *function.size_out(k)[::-1])) for k in range(function.n_out())]
    if count:
        mapped = function.map(count)
        buffer, evaluate = buffer_on(mapped, arguments, found)
        evaluate()
        del buffer
    return [each.transpose(0, 2, 1) for each in found]


def first_largest(sizes: FloatArray) -> NDArray[np.intp]:
    """Return the index along the last axis of the first entry that is largest up to rounding."""
    return np.asarray(np.argmax(sizes >= (1 - _TIE) * sizes.max(axis=-1, keepdims=True), axis=-1))
