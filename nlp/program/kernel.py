"""CasADi functions evaluated on NumPy arrays in place.

A call through CasADi's general interface converts every argument and result, which takes twenty times as long as
evaluating the functions of a parallel robot. A kernel keeps the memory that the function reads and writes.
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
    """Return the outputs of a function unchanged, as a tuple."""
    return outputs


def single_output(output: FloatArray) -> FloatArray:
    """Return the output of a function with a single output, unchanged."""
    return output


class Kernel(Generic[T]):
    """A CasADi function with NumPy arrays as arguments and results; calls from several threads are safe.

    Args:
        function: any number of dense inputs and outputs.
        result: makes the value of a call from new arrays (rows, columns), one for each output.
    """

    def __init__(self, function: ca.Function, result: Callable[..., T]) -> None:
        self._result = result
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        self._shapes = [function.size_out(i) for i in range(function.n_out())]
        # The buffer must outlive the evaluation handle that belongs to it, and the function must outlive both.
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
        """Return the function's value.

        Args:
            arguments: one for each input: a number, or a vector with as many numbers as the input has.

        Raises:
            ValueError: the number or a size of the arguments is wrong.
        """
        with self._lock:
            for memory, argument in zip(self._inputs, arguments, strict=True):
                memory[:] = argument
            self._evaluate()
            results = zip(self._outputs, self._shapes, strict=True)
            arrays = [memory.reshape(shape, order="F").copy() for memory, shape in results]
        return self._result(*arrays)
