"""Fast searches from many starting points, by sequential quadratic programming in C on several threads.

The search is that of generated C (``nlp/embedding/c``), compiled as an extension of this package; CasADi evaluates the
program's functions. Each start is searched separately, so results do not depend on the threads.

CasADi exports ``void casadi::_function_buffer_eval(void *)`` for calls without overhead; its Python interface calls the
same function. Its symbol is that of the C++ ABI of GCC and Clang. If the symbol is missing, as in a library of another
compiler, there is no screening.

An alternative interpreter in C took as long for an evaluation (2.2 and 14 microseconds for the derivatives and the
Hessian of Section 4.1), and 44 ms to write down the instructions.
"""

from __future__ import annotations

import ctypes
import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import casadi as ca
import numpy as np

from ...models.arrays import FloatArray, buffer_on
from ..interruption import is_requested
from ..program.nlp import Nlp

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SYMBOL = "_ZN6casadi21_function_buffer_evalEPv"


class Buffer(NamedTuple):
    """Buffer of a CasADi function.

    Attributes:
        capsule: buffer for C.
        outputs: memory of each result, column after column.
        kept: objects that must live as long as the capsule.
    """

    capsule: object
    outputs: tuple[FloatArray, ...]
    kept: tuple[object, ...]


@cache
def evaluator() -> int | None:
    """Return the address of the C function that evaluates a buffer; None if CasADi's library does not export it."""
    interface: Any = ca
    try:
        # The library of the Python interface is loaded already; symbols are also searched in its dependencies.
        found: Any = getattr(ctypes.CDLL(interface._casadi.__file__), _SYMBOL)
    except (OSError, AttributeError):
        return None
    return ctypes.cast(found, ctypes.c_void_p).value


def buffer_of(function: ca.Function, *inputs: FloatArray) -> Buffer:
    """Return a new buffer of a function with dense inputs and outputs.

    Args:
        function: the function, made of ``SX``.
        inputs: memory of each input, read at evaluation.
    """
    outputs = tuple(np.zeros(function.numel_out(i)) for i in range(function.n_out()))
    buffer, _ = buffer_on(function, inputs, outputs)
    return Buffer(buffer._self(), outputs, (function, buffer, inputs))


#: Largest numbers of variables and constraints: the search has dense matrices, and beyond these Ipopt's sparse ones
#: win.
_MOST_VARIABLES = 60
_MOST_CONSTRAINTS = 600
#: Largest number of iterations of a search, as in generated C. The shipped cases need 5 to 40.
_ITERATIONS = 100
#: Largest number of starts of one call: with more, threads would wait for each other.
_CHUNK = 8
#: Seconds between two checks for a request to stop.
_LOOK = 0.05


class Screened(NamedTuple):
    """Results of searches from k points.

    Attributes:
        x: (k, n) end points, in the program's units.
        multipliers: (k, n + c) multipliers of the scaled objective: of the variables' bounds, per half range, then of
            the constraints, per unit of their expressions; positive at an upper bound and negative at a lower one.
        converged: (k,) True if the search ended at a strict or weak local optimum by its own conditions.
        iterations: (k,) number of iterations.
    """

    x: FloatArray
    multipliers: FloatArray
    converged: NDArray[np.bool_]
    iterations: NDArray[np.intc]


@cache
def extension() -> ModuleType | None:
    """Return the search in C; None if it was not built."""
    try:
        return import_module("screwsynth.nlp.screening._screen")
    except ImportError:
        return None


def can_screen(nlp: Nlp) -> bool:
    """Return True if a program can be screened: it is small, the extension was built, and CasADi can be called."""
    small = 0 < nlp.n <= _MOST_VARIABLES and len(nlp.program.constraints) <= _MOST_CONSTRAINTS
    return small and extension() is not None and evaluator() is not None


def screen(nlp: Nlp, points: FloatArray, sizes: FloatArray, max_iterations: int, jobs: int | None = None) -> Screened:
    """Search a program from each of several points.

    A request to stop ends a search at once, as not converged.

    Args:
        nlp: program for which :func:`can_screen` returns True.
        points: (k, n) starting points, in the program's units.
        sizes: (c,) typical lengths of the constraints' gradients in scaled variables, used as divisors.
        max_iterations: largest number of iterations of each search.
        jobs: number of threads; None for as many as there are processors and work.
    """
    module, address = extension(), evaluator()
    if module is None or address is None:
        raise RuntimeError("the search in C was not built: call can_screen first")
    count, n, c = len(points), nlp.n, len(nlp.program.constraints)
    ends, multipliers = np.array(points, dtype=np.float64, order="C"), np.zeros((count, n + c))
    converged, iterations = np.zeros(count, dtype=np.intc), np.zeros(count, dtype=np.intc)
    stop = np.zeros(1, dtype=np.intc)
    chunks = [(first, min(first + _CHUNK, count)) for first in range(0, count, _CHUNK)]
    threads = max(1, min(jobs if jobs is not None else os.cpu_count() or 1, len(chunks)))
    programs = [_Program(nlp, sizes, address, min(max_iterations, _ITERATIONS)) for _ in range(threads)]
    # Even a single thread leaves this thread free to see a request to stop.
    pool = ThreadPoolExecutor(threads)

    def search(thread: int) -> None:
        for first, last in chunks[thread::threads]:
            found = (ends, multipliers, converged, iterations)
            module.search_each(programs[thread].packed, found, stop, count, first, last)

    try:
        for future in [pool.submit(search, thread) for thread in range(threads)]:
            while True:
                try:
                    future.result(timeout=_LOOK)
                    break
                except TimeoutError:
                    if future.done():
                        raise
                    stop[0] = is_requested()
    finally:
        stop[0] = 1
        pool.shutdown()
    return Screened(ends, multipliers, converged.astype(bool), iterations)


class _Program:
    """Program for one thread of the extension.

    Args:
        nlp: the program.
        sizes: (c,) typical lengths of the constraints' gradients.
        address: address of the function that evaluates CasADi's buffers.
        max_iterations: largest number of iterations of each search.
    """

    def __init__(self, nlp: Nlp, sizes: FloatArray, address: int, max_iterations: int) -> None:
        n, c = nlp.n, len(nlp.program.constraints)
        x, factor, multipliers = np.zeros(n), np.zeros(1), np.zeros(c)
        arguments = np.array(nlp.arguments, dtype=np.float64)
        self.kept = (
            buffer_of(nlp.program.derivatives, x, arguments),
            buffer_of(nlp.program.hessian, x, arguments, factor, multipliers),
        )
        derivatives, hessian = self.kept
        constants = (nlp.centre, nlp.scale, nlp.lower, nlp.upper, sizes, nlp.g_lower / sizes, nlp.g_upper / sizes)
        weight = nlp.sign / nlp.objective_scale
        self.packed: tuple[Any, ...] = (
            *(address, derivatives.capsule, hessian.capsule, n, c, max_iterations, weight),
            tuple(np.ascontiguousarray(each, dtype=np.float64) for each in constants),
            (x, *derivatives.outputs, factor, multipliers, *hessian.outputs),
        )
