"""Engines that examine boxes: the C kernel where it was built, and NumPy, which is always there."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..enclosing.quotients import search_rows
from ..enclosing.tape import Tape
from ..limbs.limbmodels import LimbEngine, LimbModels, NumpyLimbEngine, models_from_rows, rows_of_models
from ..standardform import StandardForm
from .bounding import NumpyEngine, objective_tape, search_tape
from .examination import Examination, Verdict
from .firstpass import value_tape

if TYPE_CHECKING:
    from ....models import FloatArray


class Engine(Protocol):
    """Examination of boxes, block by block."""

    @property
    def name(self) -> str:
        """``c`` or ``numpy``."""

    @property
    def block(self) -> int:
        """Number of boxes that it examines at once."""

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examination:
        """Examine boxes: see :meth:`screwsynth.nlp.certificate.boxes.bounding.NumpyEngine.examine`."""

    def close(self) -> None:
        """Stop its threads."""


#: Half of the kernel's block: large enough that Python's work between blocks takes no noticeable part of the time.
_BOXES_PER_JOB = 2048
#: Boxes for each thread below which starting threads costs more than it saves.
_WORTH_A_THREAD = 64
#: Boxes that a thread takes at once: a whole number of the kernel's blocks of 32.
_PIECE = 512


class KernelEngine:
    """The C kernel on several threads. The results do not depend on their number.

    Args:
        form: the form whose box is searched.
        module: the kernel.
        jobs: threads; one for each processor when left out.
        shared: number of the first variables that the form, a limb's, shares with others; None for a whole form.
    """

    name = "c"

    def __init__(
        self, form: StandardForm, module: ModuleType, jobs: int | None = None, shared: int | None = None
    ) -> None:
        self._module, self._shared = module, shared or 0
        self._jobs = max(1, jobs if jobs is not None else os.cpu_count() or 1)
        # The size of a block decides the order of the search, so it must not depend on the number of threads.
        self.block = 2 * _BOXES_PER_JOB
        self._pool = ThreadPoolExecutor(self._jobs) if self._jobs > 1 else None
        functions = len(form.functions)
        rows = search_rows(form, apart=shared is not None)
        tape, values = search_tape(form, rows), None if shared is not None else value_tape(form)
        objective = objective_tape(form, len(tape))
        equation = np.where(form.follows, 2, form.is_equation).astype(np.int32)
        depends = np.array(form.dependence, dtype=np.int32)
        self._form = (
            form.n,
            functions,
            equation,
            depends,
            form.lower,
            form.upper,
            np.array([(each.function, each.sign) for each in rows.quotients], dtype=np.int32).ravel(),
            _kernel_tape(tape),
            None if values is None else _kernel_tape(values),
            None if values is None or objective is None else _kernel_tape(objective),
        )

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examination:
        """Examine boxes: see :meth:`screwsynth.nlp.certificate.boxes.bounding.NumpyEngine.examine`."""
        return self._examine(lower, upper, threshold, ())

    def limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None = None) -> LimbModels:
        """Return upper models: see :class:`screwsynth.nlp.certificate.limbs.limbmodels.LimbEngine`."""
        n, m = lower.shape[0], self._shared
        rows = np.empty((rows_of_models(n, m), lower.shape[1]))
        matters = () if least is None else (np.ascontiguousarray(least),)
        found = self._examine(lower, upper, -np.inf, (m, rows, *matters))
        flags, L, sides = models_from_rows(rows, n, m)
        closed = np.isin(found.verdict, (Verdict.INFEASIBLE, Verdict.MONOTONE, Verdict.EMPTIED))
        found.lower[:m], found.upper[:m] = lower[:m], upper[:m]
        return LimbModels(
            is_possible=~closed,
            defined=np.isin(flags, (1, 3)),
            holds=flags >= 2,
            lower=found.lower,
            upper=found.upper,
            L=L,
            slope_lo=sides[:, 0],
            slope_hi=sides[:, 1],
            stops_up=sides[:, 2] > 0,
            stops_down=sides[:, 3] > 0,
            high=found.bound,
            value=found.value,
        )

    def _examine(self, lower: FloatArray, upper: FloatArray, threshold: float, models: tuple[Any, ...]) -> Examination:
        """Examine boxes on all threads; with ``models`` the number of shared variables and an array for the models."""
        n, count = lower.shape
        verdict, reason, split = (np.empty(count, dtype=np.int32) for _ in range(3))
        cut_lower, cut_upper = np.empty((n, count), dtype=np.int32), np.empty((n, count), dtype=np.int32)
        bound, value = np.empty(count), np.empty(count)
        left_lower, left_upper, centre = np.empty((n, count)), np.empty((n, count)), np.empty((n, count))
        ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
        found = (verdict, reason, bound, left_lower, left_upper, cut_lower, cut_upper, split, value, centre)

        def examine_part(begin: int, finish: int) -> None:
            self._module.examine(self._form, (*ends, *found), count, begin, finish, threshold, *models)

        if self._pool is None or count < _WORTH_A_THREAD * self._jobs:
            examine_part(0, count)
        else:
            # Boxes cost differently, by what closes them: a thread that is done takes the next piece.
            size = max(_WORTH_A_THREAD // 2, min(_PIECE, count // (2 * self._jobs)))
            edges = [*range(0, count, size), count]
            for each in [self._pool.submit(examine_part, *edge) for edge in itertools.pairwise(edges)]:
                each.result()
        return Examination(*found)

    def close(self) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()


def _kernel_tape(tape: Tape) -> tuple[Any, ...]:
    """Return a tape as the kernel reads it: code, constants, and the numbers of instructions, registers and results."""
    code = np.stack([tape.op, tape.to, tape.a, tape.b, tape.first, tape.last], axis=1).astype(np.int32)
    return np.ascontiguousarray(code), tape.k, len(tape), tape.registers, tape.outputs


def kernel() -> ModuleType | None:
    """Return the C kernel, or None where it was not built."""
    try:
        return import_module("screwsynth.nlp.certificate._bounds")
    except ImportError:
        return None


def engine_name(name: str | None) -> str:
    """Return the name of the engine that :func:`engine_for` takes."""
    return name or ("numpy" if kernel() is None else "c")


def chosen_kernel(name: str | None, built: Callable[[], ModuleType | None]) -> ModuleType | None:
    """Return the C kernel that an engine's name asks for; None for NumPy.

    Args:
        name: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        built: gives the kernel, or None where it was not built.

    Raises:
        ValueError: there is no engine of that name here.
    """
    if name not in (None, "c", "numpy"):
        raise ValueError(f"there is no engine {name!r}: c or numpy")
    module = None if name == "numpy" else built()
    if module is None and name == "c":
        raise ValueError("the C kernel was not built: numpy is there")
    return module


def engine_for(form: StandardForm, name: str | None = None, jobs: int | None = None) -> Engine:
    """Return an engine for a form.

    Args:
        form: the form whose box is searched.
        name: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        jobs: threads of the C kernel.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: there is no engine of that name here.
    """
    module = chosen_kernel(name, kernel)
    return NumpyEngine(form) if module is None else KernelEngine(form, module, jobs)


def limb_engine_for(form: StandardForm, shared: int, name: str | None = None, jobs: int | None = None) -> LimbEngine:
    """Return an engine for the form of a limb, of whose variables the first ``shared`` are shared with others.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: there is no engine of that name here.
    """
    module = chosen_kernel(name, kernel)
    if module is None:
        return NumpyLimbEngine(NumpyEngine(form, apart=True), shared)
    return KernelEngine(form, module, jobs, shared)
