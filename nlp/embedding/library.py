"""Generated C as a Python object, compiled once and called for many problems at a time."""

from __future__ import annotations

import contextlib
import ctypes
import os
import queue
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from ...models import FloatArray
from ..case.task import Sense
from ..errors import InputError, listing, nearest
from ..system.programs import shared_library
from .codegen import budget_files
from .manifest import CompiledLimit, CompiledNumber, Manifest, read_manifest

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Fields of the results that are whole numbers.
COUNTS = ("status", "runs", "converged", "iterations")


class Rows(ctypes.Structure):
    """Rows of numbers, laid out as the struct in C."""

    _fields_: ClassVar = [("values", ctypes.c_void_p), ("length", ctypes.c_int), ("is_shared", ctypes.c_int)]


class Options(ctypes.Structure):
    """Budget of a solve, laid out as the struct in C; with 0 or a null pointer the solve has no budget."""

    _fields_: ClassVar = [
        ("max_iterations", ctypes.c_int),
        ("deadline", ctypes.c_void_p),
        ("user", ctypes.c_void_p),
    ]


class Batch(ctypes.Structure):
    """Problems and results, laid out as the struct in C."""

    _fields_: ClassVar = [
        *((name, Rows) for name in ("p", "x0", "lower", "upper", "g_lower", "g_upper", "limits")),
        *((name, ctypes.c_int) for name in ("maximise", "seeds")),
        ("options", Options),
        *((name, ctypes.c_void_p) for name in COUNTS),
        *((name, ctypes.c_void_p) for name in ("F", "x", "R", "axis", "angle", "violation", "residual")),
        *((name, ctypes.c_void_p) for name in ("lower_multipliers", "upper_multipliers")),
        *((name, ctypes.c_void_p) for name in ("g_lower_multipliers", "g_upper_multipliers", "limit_multipliers")),
    ]
    maximise: int
    seeds: int
    kept: tuple[Any, ...]


#: Largest number of problems in one call of the C: Ctrl-C works between calls, and threads share work evenly.
_CHUNK = 32


class CompiledSolutions(NamedTuple):
    """Results of the solver in C for n problems, one row for each; a row is 0 for the status ``BAD_INPUT``.

    Attributes:
        F: (n,) objective.
        x: (n, variables) free variables, radians for angles.
        status: (n,) status codes, named in ``CompiledCase.statuses``; 0 is an optimum.
        R: (n, 3, 3) rotation of the platform.
        axis: (n, 3) unit axis of the rotation.
        angle: (n,) angle of the rotation in ``[0, pi]``.
        violation: (n,) largest violation of a constraint, in half ranges of the case's variables.
        residual: (n,) KKT residual; infinite if the point is not the end of a search.
        runs: (n,) number of searches.
        converged: (n,) number of searches that ended at an optimum.
        iterations: (n,) number of iterations of all searches.
        lower_multipliers: (n, variables) improvement of F per unit by which only this variable's lower bound is moved
            outwards; 0 for an inactive bound, and for all if the point is not an optimum.
        upper_multipliers: (n, variables) multipliers of the variables' upper bounds, in the same form.
        g_lower_multipliers: (n, constraints) multipliers of the constraints' lower bounds, per unit of the constraint.
        g_upper_multipliers: (n, constraints) multipliers of the constraints' upper bounds, per unit of the constraint.
        limit_multipliers: (n, limits) improvement of F per unit by which only this limit is relaxed, in the order of
            ``CompiledCase.limits``.
    """

    F: FloatArray
    x: FloatArray
    status: NDArray[np.intc]
    R: FloatArray
    axis: FloatArray
    angle: FloatArray
    violation: FloatArray
    residual: FloatArray
    runs: NDArray[np.intc]
    converged: NDArray[np.intc]
    iterations: NDArray[np.intc]
    lower_multipliers: FloatArray
    upper_multipliers: FloatArray
    g_lower_multipliers: FloatArray
    g_upper_multipliers: FloatArray
    limit_multipliers: FloatArray

    @property
    def ok(self) -> NDArray[np.bool_]:
        """(n,) True for an optimum."""
        return np.equal(self.status, 0)


class CompiledCase:
    """Solver of a case in C, loaded from the folder written by ``screwsynth codegen``.

    Created by :func:`load_compiled`. Methods may be called from several threads.
    """

    def __init__(self, manifest: Manifest, library: ctypes.CDLL, folder: Path) -> None:
        self._manifest, self._library, self._folder = manifest, library, folder
        counts = (ctypes.c_int * 6)()
        self._function("sizes")(counts)
        *shape, self._work, self._iwork = list(counts)
        lengths = (manifest.variables, manifest.parameters, manifest.constraints, manifest.limits)
        if shape != [len(each) for each in lengths]:
            raise InputError(
                f"{manifest.name}: the manifest and the C files belong to different cases; generate the folder again"
            )

    def __reduce__(self) -> tuple[Callable[[str], CompiledCase], tuple[str]]:
        """Pickle only the folder, which is loaded again when the object is unpickled."""
        return load_compiled, (str(self._folder),)

    def __repr__(self) -> str:
        counts = f"{len(self.variables)} variables, {len(self.parameters)} parameters, {len(self.limits)} limits"
        return f"<CompiledCase {self.name!r}: {counts}>"

    @property
    def name(self) -> str:
        """Name of the case."""
        return self._manifest.name

    @property
    def variables(self) -> tuple[CompiledNumber, ...]:
        """Free variables, in the order of ``x``."""
        return self._manifest.variables

    @property
    def parameters(self) -> tuple[CompiledNumber, ...]:
        """Fixed parameters, in the order of ``p``."""
        return self._manifest.parameters

    @property
    def limits(self) -> tuple[CompiledLimit, ...]:
        """Limits that can be set at run time."""
        return self._manifest.limits

    @property
    def statuses(self) -> tuple[str, ...]:
        """Names of the statuses by code, such as ``OK`` for 0."""
        return self._manifest.statuses

    @property
    def status_texts(self) -> tuple[str, ...]:
        """Sentence for each status code, without a full stop, as in the C."""
        text: Any = self._function("status_text")
        text.restype = ctypes.c_char_p
        return tuple(text(code).decode("ascii") for code in range(len(self.statuses)))

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the constraints, in the order of their multipliers."""
        return self._manifest.constraints

    def solve(
        self,
        x0: ArrayLike | None = None,
        p: ArrayLike | None = None,
        *,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        limits: Mapping[str, ArrayLike] | None = None,
        sense: Sense | str | None = None,
        seeds: int | None = None,
        threads: int | None = None,
        max_iterations: ArrayLike | None = None,
        deadline_seconds: ArrayLike | None = None,
    ) -> CompiledSolutions:
        """Return the results of n problems; n is the number of rows of the two-dimensional arrays.

        Args:
            x0: (variables,) or (n, variables) start of the first search of each problem; None for no such search.
            p: (parameters,) or (n, parameters) values of the fixed parameters; None for the values of the case.
            lower: (variables,) or (n, variables) lower bounds; None for the bounds of the case. Equal bounds fix a
                variable.
            upper: (variables,) or (n, variables) upper bounds; None for the bounds of the case.
            limits: one or (n,) values for each key of ``limits``, lengths in the case's unit and angles in radians.
            sense: ``"max"`` or ``"min"``; None for the sense of the case.
            seeds: number of further searches from the table of starting points; None for all.
            threads: number of threads; None for the number of processors.
            max_iterations: one or (n,) values: largest number of iterations of all searches of a problem.
            deadline_seconds: one or (n,) values: seconds from the begin to the end of the solve of a problem. A problem
                that exceeds a budget has the status ``BUDGET`` and the best point so far.

        Raises:
            InputError: an array has a wrong shape or a number that is not finite, a limit is unknown or not allowed, or
                there is no starting point. Other faults of a problem are reported by its status.
        """
        manifest = self._manifest
        n, k = len(self.variables), len(self.parameters)
        arrays = {"x0": checked_rows("x0", x0, n), "p": checked_rows("p", p, k)}
        arrays |= {"lower": checked_rows("lower", lower, n), "upper": checked_rows("upper", upper, n)}
        arrays["limits"] = self._limit_rows(limits or {})
        budget = {"max_iterations": checked_budget("max_iterations", max_iterations, is_whole=True)}
        budget["deadline_seconds"] = checked_budget("deadline_seconds", deadline_seconds, is_whole=False)
        counts = {name: len(each) for name, each in arrays.items() if each is not None and each.ndim == 2}
        counts |= {name: len(each) for name, each in budget.items() if each is not None and each.ndim == 1}
        if len(set(counts.values())) > 1:
            said = ", ".join(f"{name} has {count}" for name, count in counts.items())
            raise InputError(f"arrays must have the same number of rows, but {said}")
        count = next(iter(counts.values()), 1)
        if sense not in ("max", "min", *Sense, None):
            raise InputError(f"sense = {sense!r}: must be 'max' or 'min'")
        if seeds is not None and not is_between(seeds, 0, manifest.seeds):
            raise InputError(f"seeds = {seeds!r}: must be a whole number from 0 to {manifest.seeds}")
        if seeds == 0 and x0 is None:
            raise InputError("seeds = 0 without x0: a search needs a starting point")
        if threads is not None and not is_between(threads, 1, None):
            raise InputError(f"threads = {threads!r}: must be a whole number of at least 1")
        batch, answers = self._batch(count, arrays)
        batch.maximise = -1 if sense is None else int(Sense(sense) is Sense.MAX)
        batch.seeds = -1 if seeds is None else seeds
        self._run(batch, count, threads or os.cpu_count() or 1, budget)
        return answers

    def _batch(self, count: int, arrays: Mapping[str, FloatArray | None]) -> tuple[Batch, CompiledSolutions]:
        """Return the problems in the form of the C, and the arrays of its results."""
        batch = Batch()
        for name, given in arrays.items():
            if given is not None:
                setattr(batch, name, Rows(given.ctypes.data, given.shape[-1], int(given.ndim == 1)))
        n, c = (len(self.variables),), (len(self.constraints),)
        shapes = {"x": n, "R": (3, 3), "axis": (3,), "lower_multipliers": n, "upper_multipliers": n}
        shapes |= {"g_lower_multipliers": c, "g_upper_multipliers": c, "limit_multipliers": (len(self.limits),)}
        made: dict[str, Any] = {
            name: np.zeros((count, *shapes.get(name, ())), dtype=np.intc if name in COUNTS else np.float64)
            for name in CompiledSolutions._fields
        }
        answers = CompiledSolutions(**made)
        for name, values in answers._asdict().items():
            setattr(batch, name, values.ctypes.data)
        # The C uses the memory of these arrays, so they must live as long as the batch.
        batch.kept = (*arrays.values(), answers)
        return batch, answers

    def _run(self, batch: Batch, count: int, threads: int, budget: Mapping[str, FloatArray | None]) -> None:
        """Solve the problems in chunks; ctypes releases the interpreter's lock during a call."""
        solve_within = self._function("solve_within")
        most, seconds = budget["max_iterations"], budget["deadline_seconds"]
        iterations = None if most is None else np.array(np.broadcast_to(most, count), dtype=np.intc)
        ends = None if seconds is None else np.array(np.broadcast_to(seconds, count))
        limits = tuple(None if each is None else _address(each) for each in (iterations, ends))
        share = max(1, min(_CHUNK, -(-count // threads)))
        waiting = queue.SimpleQueue[int]()
        for first in range(0, count, share):
            waiting.put(first)
        is_stopped = threading.Event()

        def work() -> None:
            reals, integers = np.empty(self._work), np.empty(self._iwork, dtype=np.intc)
            with contextlib.suppress(queue.Empty):
                while not is_stopped.is_set():
                    first = waiting.get_nowait()
                    last = min(first + share, count)
                    solve_within(ctypes.byref(batch), *limits, first, last, _address(reals), _address(integers))

        workers = min(threads, -(-count // share)) if count else 0
        if workers <= 1:
            work()
            return
        with ThreadPoolExecutor(workers) as pool:
            try:
                for each in [pool.submit(work) for _ in range(workers)]:
                    each.result()
            finally:
                # After Ctrl-C no thread begins another chunk.
                is_stopped.set()

    def _limit_rows(self, given: Mapping[str, ArrayLike]) -> FloatArray | None:
        """Return the values of all limits, (limits,) or (n, limits); None if none is given.

        Raises:
            InputError: a limit is unknown or not allowed.
        """
        if not given:
            return None
        columns: dict[str, FloatArray] = {each.key: np.array(each.default) for each in self.limits}
        for key, values in given.items():
            if key not in columns:
                raise InputError(f"limits: no limit {key!r} can be set; {nearest(str(key), columns)}")
            columns[key] = checked_numbers(f"limits[{key!r}]", values)
            if columns[key].ndim > 1:
                raise InputError(
                    f"limits[{key!r}]: must be one number, or one for each problem, got shape {columns[key].shape}"
                )
        for limit in self.limits:
            column = columns[limit.key]
            wrong = column[~((limit.above < column) & (column <= limit.most))]
            if wrong.size:
                allowed = [f"above {limit.above:.10g}"] if limit.above > -np.inf else []
                allowed += [f"at most {limit.most:.10g}"] if limit.most < np.inf else []
                unit = f" {limit.unit}" if limit.unit else ""
                raise InputError(f"limits[{limit.key!r}] = {wrong.flat[0]:.10g}{unit}: must be {' and '.join(allowed)}")
        for key, column in columns.items():
            upper = columns.get(f"{key.removesuffix('.min')}.max") if key.endswith(".min") else None
            if upper is not None and column.ndim == upper.ndim == 0 and column > upper:
                most = f"limits[{key.removesuffix('.min') + '.max'!r}] = {upper:.10g}"
                raise InputError(f"limits[{key!r}] = {column:.10g}: must be at most {most}")
        lengths = {key: len(column) for key, column in columns.items() if column.ndim}
        if len(set(lengths.values())) > 1:
            said = listing(f"{key} {length}" for key, length in lengths.items())
            raise InputError(f"limits: arrays must have the same length, got {said}")
        return np.ascontiguousarray(np.stack(np.broadcast_arrays(*columns.values()), axis=-1))

    def _function(self, name: str) -> Callable[..., Any]:
        """Return a function of the library."""
        function: Callable[..., Any] = getattr(self._library, f"{self._manifest.prefix}_{name}")
        return function


def load_compiled(folder: str | os.PathLike[str]) -> CompiledCase:
    """Return the solver of a folder of generated C, compiled when it is first loaded.

    The shared library is cached in the user's cache folder, by a hash of the C. Compilation needs a C compiler: ``cc``,
    ``gcc`` or ``clang``, or the compiler that the environment variable ``CC`` names.

    Args:
        folder: folder with the files of ``screwsynth codegen`` or :func:`~screwsynth.nlp.generate_c`. A pickle of the
            result contains only its absolute path.

    Raises:
        InputError: the folder has no generated C or one of another version, or there is no working C compiler.
    """
    manifest = read_manifest(Path(folder))
    path = shared_library({**manifest.files, **budget_files(manifest.prefix)})
    try:
        return CompiledCase(manifest, ctypes.CDLL(str(path)), Path(folder).absolute())
    except (OSError, AttributeError) as error:
        raise InputError(f"{folder}: the compiled library cannot be loaded: {error}") from None


def _address(array: NDArray[Any]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def checked_rows(name: str, given: ArrayLike | None, length: int) -> FloatArray | None:
    """Return an array (length,) or (n, length) of finite numbers.

    Raises:
        InputError: the shape is wrong, or a number is not finite.
    """
    if given is None:
        return None
    array = checked_numbers(name, given)
    if array.ndim not in (1, 2) or array.shape[-1] != length:
        raise InputError(f"{name}: must have the shape ({length},) or (n, {length}), got {array.shape}")
    return array


def checked_numbers(name: str, given: ArrayLike) -> FloatArray:
    """Return a contiguous array of finite numbers; texts and complex numbers are refused.

    Raises:
        InputError: an entry is not a number, or not finite.
    """
    try:
        found = np.array(given)
        is_real = found.dtype.kind in "biuf" or all(isinstance(each, Real) for each in found.ravel().tolist())
        array = np.array(found, dtype=np.float64, order="C") if is_real else None
    except (ValueError, TypeError, OverflowError):
        array = None
    if array is None:
        raise InputError(f"{name}: must be an array of numbers, without texts or complex numbers")
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        place = ", ".join(str(index) for index in wrong[0])
        where = f"{name}[{place}]" if place else name
        raise InputError(f"{where} = {array[tuple(wrong[0])]}: must be finite")
    return array


def checked_budget(name: str, given: ArrayLike | None, *, is_whole: bool) -> FloatArray | None:
    """Return a budget, () or (n,), of positive numbers.

    Raises:
        InputError: the shape is wrong, or a number is not allowed.
    """
    if given is None:
        return None
    array = checked_numbers(name, given)
    if array.ndim > 1:
        raise InputError(f"{name}: must be one number, or one for each problem, got shape {array.shape}")
    largest = np.iinfo(np.intc).max if is_whole else np.inf
    is_wrong = ~((array > 0) & (array <= largest)) | (is_whole & (array != np.floor(array)))
    if is_wrong.any():
        words = f"a whole number from 1 to {largest}" if is_whole else "above 0"
        raise InputError(f"{name} = {array[is_wrong].flat[0]:.10g}: must be {words}")
    return array


def is_between(value: object, least: int, most: int | None) -> bool:
    """Return True if a value is a whole number within bounds."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool):
        return False
    return bool(least <= value and (most is None or value <= most))
