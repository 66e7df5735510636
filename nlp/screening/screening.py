"""Quick searches from many starting points, by sequential quadratic programming in C on several threads.

The search is that of generated C (``nlp/embedding/c``), compiled as an extension of this package; the functions are the
program's own, which CasADi evaluates. Each start is searched by itself, so the results do not depend on the threads.

CasADi exports ``void casadi::_function_buffer_eval(void *)`` for calls without overhead; its Python interface calls the
same function. Its name in the library is that of the C++ ABI of GCC and Clang. Where it is not found, as with another
compiler's library, there is no pointer, and nothing else is tried.

An interpreter of our own in C was measured beside it: an evaluation took as long (2.2 and 14 microseconds for the
derivatives and the Hessian of Section 4.1), and writing down the instructions first took 44 ms.
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
    outputs = tuple(np.zeros(function.numel_out(i)) for i in range(function.n_out()))
    buffer, _ = buffer_on(function, inputs, outputs)
    return Buffer(buffer._self(), outputs, (function, buffer, inputs))


#: Largest numbers of variables and constraints. The search's matrices are dense: with more, Ipopt's sparse ones win.
_MOST_VARIABLES = 60
_MOST_CONSTRAINTS = 600
#: Iterations of a search: generated C has as many. Those of the shipped cases need 5 to 40.
_ITERATIONS = 100
#: Starts of one call: more threads than calls would wait.
_CHUNK = 8
#: Seconds between two looks at whether the work is requested to stop.
_LOOK = 0.05


class Screened(NamedTuple):
    """Ends of searches from k points.

    Attributes:
        x: (k, n) where they ended, in the program's units.
        multipliers: (k, n + c) of the variables' bounds, per half range, and of the constraints, per unit of their
            expressions, of the scaled objective: positive at an upper bound and negative at a lower one.
        converged: (k,) whether the search ended at a strict or weak local optimum by its own conditions.
        iterations: (k,) number of iterations.
    """

    x: FloatArray
    multipliers: FloatArray
    converged: NDArray[np.bool_]
    iterations: NDArray[np.intc]


@cache
def extension() -> ModuleType | None:
    """Return the search in C, or None where it was not built."""
    try:
        return import_module("screwsynth.nlp.screening._screen")
    except ImportError:
        return None


def can_screen(nlp: Nlp) -> bool:
    """Return whether a program can be screened here: it is small, the search was built, and CasADi can be called."""
    small = 0 < nlp.n <= _MOST_VARIABLES and len(nlp.program.constraints) <= _MOST_CONSTRAINTS
    return small and extension() is not None and evaluator() is not None


def screen(nlp: Nlp, points: FloatArray, sizes: FloatArray, max_iterations: int, jobs: int | None = None) -> Screened:
    """Search a program from each of several points.

    A search that is requested to stop ends at once, and counts as not converged.

    Args:
        nlp: the program, for which :func:`can_screen` holds.
        points: (k, n) starting points, in the program's units.
        sizes: (c,) typical lengths of the constraints' gradients in scaled variables, by which they are divided.
        max_iterations: largest number of iterations of each search.
        jobs: number of threads; left out, as many as there are processors and work.
    """
    module, address = extension(), evaluator()
    if module is None or address is None:
        raise RuntimeError("the search in C was not built: ask can_screen first")
    count, n, c = len(points), nlp.n, len(nlp.program.constraints)
    ends, multipliers = np.array(points, dtype=np.float64, order="C"), np.zeros((count, n + c))
    converged, iterations = np.zeros(count, dtype=np.intc), np.zeros(count, dtype=np.intc)
    stop = np.zeros(1, dtype=np.intc)
    chunks = [(first, min(first + _CHUNK, count)) for first in range(0, count, _CHUNK)]
    threads = max(1, min(jobs if jobs is not None else os.cpu_count() or 1, len(chunks)))
    programs = [_Program(nlp, sizes, address, min(max_iterations, _ITERATIONS)) for _ in range(threads)]
    # Also a single thread leaves this one free to see a request to stop.
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
    """A program as one thread of the extension reads it.

    Args:
        nlp: the program.
        sizes: (c,) those of the constraints.
        address: that of the function that evaluates CasADi's buffers.
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
