"""Examination of boxes by the C kernel: bounds, impossible conditions, monotonicity, contraction, next bisection."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..enclosure.engine import kernel
from ..enclosure.squared_quotients import search_rows, tangent_rows
from ..statement.standard_form import StandardForm
from .examination import Examination, Verdict
from .limbs.models import LimbModels, models_from_rows, rows_of_models
from .tapes import objective_tape, search_tape, value_tape
from .threads import Threads, pieces

if TYPE_CHECKING:
    from ....models import FloatArray


#: Half of the kernel's block: large enough that Python's work between blocks takes no noticeable part of the time.
_BOXES_PER_JOB = 2048


class Engine:
    """The C kernel on several threads. The results do not depend on their number.

    Args:
        form: the form whose box is searched.
        jobs: threads; one for each processor when left out.
        shared: number of the first variables that the form, a limb's, shares with others; None for a whole form.
        tangents: whether the first pass has tangents to the squares of a minimum.

    Attributes:
        block: number of boxes to examine at once.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        InputError: the kernel was not built.
    """

    def __init__(
        self,
        form: StandardForm,
        jobs: int | None = None,
        shared: int | None = None,
        *,
        tangents: bool = True,
    ) -> None:
        self._module, self._shared = kernel(), shared or 0
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
            tape.head,
            None if values is None else values.head,
            None if values is None or objective is None else objective.head,
            np.array(() if squares is None else squares.functions, dtype=np.int32),
        )

    def examine(self, lower: FloatArray, upper: FloatArray, threshold: float) -> Examination:
        """Examine boxes, and close those whose bounds do not exceed a threshold.

        Args:
            lower: (n, B) lower ends.
            upper: (n, B) upper ends.
            threshold: boxes whose bound is at most this are closed.
        """
        return self._examine(lower, upper, threshold, ())

    def limb_models(self, lower: FloatArray, upper: FloatArray, least: FloatArray | None = None) -> LimbModels:
        """Return upper models of a limb over boxes with ends (n, B).

        Args:
            lower: lower ends; those of shared variables come first.
            upper: upper ends.
            least: (B,) points whose values are less do not matter; None where all do.
        """
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
