"""CasADi functions evaluated on NumPy arrays in place.

A call through CasADi's general interface converts every argument and result, which takes twenty times as long as
evaluating the functions of a parallel robot does. A kernel keeps the memory that the function reads and writes.
"""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any, Generic, TypeVar

import casadi as ca
import numpy as np

from ...models import FloatArray

T = TypeVar("T")


def tuple_of(*outputs: FloatArray) -> tuple[FloatArray, ...]:
    """Return the outputs of a function as they are."""
    return outputs


def the_only(output: FloatArray) -> FloatArray:
    """Return the output of a function that has one."""
    return output


class Kernel(Generic[T]):
    """A function of vectors with dense results, called with and returning NumPy arrays.

    Args:
        function: any number of dense inputs and outputs.
        result: makes what a call returns from one new (rows, columns) array for each output.
    """

    def __init__(self, function: ca.Function, result: Callable[..., T]) -> None:
        self._result = result
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        # The buffer must outlive the trigger that belongs to it, and the function both.
        self._function = function
        self._buffer: Any
        self._buffer, self._evaluate = function.buffer()
        for index, array in enumerate(self._inputs):
            if array.size:
                self._buffer.set_arg(index, array.data)
        for index, array in enumerate(self._outputs):
            if array.size:
                self._buffer.set_res(index, array.data)
        self._lock = Lock()

    def __call__(self, *arguments: FloatArray | float) -> T:
        """Evaluate the function."""
        with self._lock:
            for memory, argument in zip(self._inputs, arguments, strict=True):
                memory[:] = argument
            self._evaluate()
            results = zip(self._outputs, self._shapes, strict=True)
            arrays = [memory.reshape(shape, order="F").copy() for memory, shape in results]
        return self._result(*arrays)
