"""Engines that examine boxes: the C kernel where it was built, and NumPy, which is always there."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..enclosure.engine import chosen_kernel, kernel
from ..enclosure.quadratic_models import Ends, QuadraticModel
from ..enclosure.squared_quotients import search_rows
from ..enclosure.tangent_bounds import tangent_rows
from ..enclosure.tape import Tape
from ..statement.standard_form import StandardForm
from .bounding import NumpyEngine
from .examination import Examination, Verdict
from .first_pass import value_tape
from .limbs.models import LimbEngine, LimbModels, NumpyLimbEngine, models_from_rows, rows_of_models
from .tapes import objective_tape, search_tape
from .threads import Threads, pieces

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
        """Examine boxes: see :meth:`screwsynth.nlp.proof.boxes.bounding.NumpyEngine.examine`."""

    def close(self) -> None:
        """Stop its threads."""


#: Half of the kernel's block: large enough that Python's work between blocks takes no noticeable part of the time.
_BOXES_PER_JOB = 2048


class KernelEngine:
    """The C kernel on several threads. The results do not depend on their number.

    Args:
        form: the form whose box is searched.
        module: the kernel.
        jobs: threads; one for each processor when left out.
        shared: number of the first variables that the form, a limb's, shares with others; None for a whole form.
        tangents: whether the first pass has tangents to the squares of a minimum.
    """

    name = "c"

    def __init__(
        self,
        form: StandardForm,
        module: ModuleType,
        jobs: int | None = None,
        shared: int | None = None,
        *,
        tangents: bool = True,
    ) -> None:
        self._module, self._shared = module, shared or 0
        self._threads = Threads(jobs)
        # The size of a block decides the order of the search, so it must not depend on the number of threads.
        self.block = 2 * _BOXES_PER_JOB
        functions = len(form.functions)
        rows = search_rows(form, apart=shared is not None)
        squares = tangent_rows(form) if tangents and shared is None else None
        tape, values = search_tape(form, rows), None if shared is not None else value_tape(form, squares)
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
            np.array(() if squares is None else squares.functions, dtype=np.int32),
        )

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examination:
        """Examine boxes: see :meth:`screwsynth.nlp.proof.boxes.bounding.NumpyEngine.examine`."""
        return self._examine(lower, upper, threshold, ())

    def limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None = None) -> LimbModels:
        """Return upper models: see :class:`screwsynth.nlp.proof.boxes.limbs.models.LimbEngine`."""
        n, m = lower.shape[0], self._shared
        rows = np.empty((rows_of_models(n, m), lower.shape[1]))
        matters = () if least is None else (np.ascontiguousarray(least),)
        found = self._examine(lower, upper, -np.inf, (m, rows, *matters))
        flags, L, sides = models_from_rows(rows, n, m)
        closed = (found.verdict != Verdict.OPEN) & (found.verdict != Verdict.BOUNDED)
        found.lower[:m], found.upper[:m] = lower[:m], upper[:m]
        return LimbModels(
            is_possible=~closed,
            defined=(flags == 1) | (flags == 3),
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

    def bound(self, L: QuadraticModel) -> FloatArray:
        """Return upper bounds (B,): see :class:`~..enclosure.quadratic_models.QuadraticModel`."""
        bound = np.empty(L.middle.size)
        self._module.models(len(L.b), _kernel_models(L), bound.size, bound)
        return bound

    def ends_reaching(self, L: QuadraticModel, level: FloatArray) -> Ends:
        """Return ends for levels (B,): see ``ends_reaching`` of :class:`.quadratic.QuadraticModel`."""
        low, high = np.empty(L.b.shape), np.empty(L.b.shape)
        self._module.models(len(L.b), _kernel_models(L), level.size, np.ascontiguousarray(level), low, high)
        return Ends(low, high)

    def _examine(self, lower: FloatArray, upper: FloatArray, threshold: float, models: tuple[Any, ...]) -> Examination:
        """Examine boxes on all threads; with ``models`` the number of shared variables and an array for the models."""
        n, count = lower.shape
        verdict, reason, split = (np.empty(count, dtype=np.int32) for _ in range(3))
        cut_lower, cut_upper = np.empty((n, count), dtype=np.int32), np.empty((n, count), dtype=np.int32)
        bound, value = np.empty(count), np.empty(count)
        left_lower, left_upper, centre = np.empty((n, count)), np.empty((n, count)), np.empty((n, count))
        ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
        found = (verdict, reason, bound, left_lower, left_upper, cut_lower, cut_upper, split, value, centre)

        def examine_piece(piece: tuple[int, int]) -> None:
            self._module.examine(self._form, (*ends, *found), count, *piece, threshold, *models)

        self._threads.map(examine_piece, pieces(count, self._threads.jobs))
        return Examination(*found)

    def close(self) -> None:
        """Stop the threads."""
        self._threads.close()


def _kernel_tape(tape: Tape) -> tuple[Any, ...]:
    """Return a tape as the kernel reads it: code, constants, and the numbers of instructions, registers and results."""
    code = np.stack([tape.op, tape.to, tape.a, tape.b, tape.first, tape.last], axis=1).astype(np.int32)
    return np.ascontiguousarray(code), tape.k, len(tape), tape.registers, tape.outputs


def _kernel_models(L: QuadraticModel) -> tuple[FloatArray, ...]:
    """Return models as the kernel reads them."""
    arrays = (L.middle, L.b, L.H, L.w, L.slope_lo, L.slope_hi, L.rounding)
    return tuple(np.ascontiguousarray(each) for each in arrays)


def engine_for(
    form: StandardForm, name: str | None = None, jobs: int | None = None, *, tangents: bool = True
) -> Engine:
    """Return an engine for a form.

    Args:
        form: the form whose box is searched.
        name: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.
        jobs: threads of the C kernel.
        tangents: whether the first pass has tangents to the squares of a minimum.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: there is no engine of that name here.
    """
    module = chosen_kernel(name, kernel)
    if module is None:
        return NumpyEngine(form, tangents=tangents)
    return KernelEngine(form, module, jobs, tangents=tangents)


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
