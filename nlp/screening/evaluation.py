"""CasADi's functions for C: a pointer that evaluates, and buffers that it takes.

CasADi exports ``void casadi::_function_buffer_eval(void *)`` for calls without overhead; its Python interface calls the
same function. Its name in the library is that of the C++ ABI of GCC and Clang. Where it is not found, as with another
compiler's library, there is no pointer, and nothing else is tried.

An interpreter of our own in C was measured beside it: an evaluation took as long (2.2 and 14 microseconds for the
derivatives and the Hessian of Section 4.1), and writing down the instructions first took 44 ms.
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from ...models import FloatArray

_SYMBOL = "_ZN6casadi21_function_buffer_evalEPv"


class Buffer(NamedTuple):
    """A function's buffer.

    Attributes:
        capsule: the buffer for C.
        outputs: memory of each result, column after column.
        kept: what must live as long as the capsule.
    """

    capsule: object
    outputs: tuple[FloatArray, ...]
    kept: tuple[object, ...]


@cache
def evaluator() -> int | None:
    """Return the address of the C function that evaluates a buffer; None where CasADi's library does not export it."""
    interface: Any = ca
    try:
        # The library of the Python interface is loaded already; a symbol is also looked for in those that it needs.
        found: Any = getattr(ctypes.CDLL(interface._casadi.__file__), _SYMBOL)
    except (OSError, AttributeError):
        return None
    return ctypes.cast(found, ctypes.c_void_p).value


def buffer_of(function: ca.Function, *inputs: FloatArray) -> Buffer:
    """Return a new buffer of a function with dense inputs and outputs.

    Args:
        function: the function, made of ``SX``.
        inputs: memory of each input, which the function reads when it is evaluated.
    """
    buffer: Any
    buffer, _ = function.buffer()
    outputs = tuple(np.zeros(function.numel_out(i)) for i in range(function.n_out()))
    for index, array in enumerate(inputs):
        if array.size:
            buffer.set_arg(index, array.data)
    for index, array in enumerate(outputs):
        if array.size:
            buffer.set_res(index, array.data)
    return Buffer(buffer._self(), outputs, (function, buffer, inputs))
