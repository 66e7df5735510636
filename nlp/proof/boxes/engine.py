"""Examination of boxes by the C kernel: bounds, impossible conditions, monotonicity, contraction, next bisection."""

from __future__ import annotations

import enum
import os
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import casadi as ca
import numpy as np

from ...errors import UncoveredError
from ..enclosure.engine import kernel
from ..enclosure.forms import QuadraticModel
from ..enclosure.squared_quotients import Rows, search_rows, tangent_rows
from ..enclosure.tape import Tape, compile_tape
from ..statement.form import refuse_jumps, without_ties
from ..statement.standard_form import StandardForm

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray

#: Ratio of the length of the whole tape to that of the functions' tape, above which gradients of conditions are
#: computed later.
_MANY_CONDITIONS = 4
#: Largest number n of variables for the first pass; forms have about n^2 / 2 coefficients.
MOST_VARIABLES = 12
#: Number of boxes examined at once, so large that Python's work between blocks is negligible. The order of the search
#: depends on this number, so it must not depend on the number of threads.
BLOCK = 4096
#: Marks of a bound of a box: contraction did not move the bound, or monotonicity moved the bound to the opposite face.
UNMOVED, COLLAPSED = -2, -1
#: Smallest number of boxes of a piece: two of the kernel's blocks of 32. Starting a piece costs as much as a few boxes.
_LEAST_PIECE = 64


Item = TypeVar("Item")
Result = TypeVar("Result")


class Threads:
    """Threads that share the parts of one step of a search; they end with this object.

    Args:
        jobs: number of threads; if left out, one for each processor.

    Attributes:
        jobs: number of threads.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = max(1, jobs if jobs is not None else os.cpu_count() or 1)
        self._pool = ThreadPoolExecutor(self.jobs) if self.jobs > 1 else None

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
        """Return the results of a function for some items, in their order; a free thread takes the next item."""
        every = list(items)
        if self._pool is None or len(every) < 2:
            return [function(each) for each in every]
        return [each.result() for each in [self._pool.submit(function, each) for each in every]]


def pieces(count: int, jobs: int) -> Sequence[tuple[int, int]]:
    """Return the start and end of each piece of a block of boxes, for a number of threads.

    Boxes take different times, by the rule that closes them. So pieces become smaller: large pieces first, in which few
    lanes of the kernel stay empty, and small pieces last, so that no thread waits long for another one.
    """
    if jobs == 1:
        return [(0, count)]
    found, begin = [], 0
    while begin < count:
        size = max(_LEAST_PIECE, (count - begin) // (2 * jobs) // _LEAST_PIECE * _LEAST_PIECE)
        # A last piece below the smallest size is added to this one.
        end = begin + size if count - begin - size >= _LEAST_PIECE else count
        found.append((begin, end))
        begin = end
    return found


class BoxState(enum.IntEnum):
    """State of a box: open, or closed by a rule. The values are those of ``kernel/examination.h``."""

    OPEN = 0
    BOUNDED = 1  # the bound of the box does not exceed the threshold
    INFEASIBLE = 2  # a condition is violated everywhere in the box
    MONOTONE = 3  # the functions increase along a variable, towards a neighbouring part of the whole box
    EMPTIED = 4  # contraction along a variable made the box empty


@dataclass(frozen=True, eq=False)
class Examination:
    """Results of the examination of B boxes.

    Attributes:
        verdict: (B,) :class:`BoxState`.
        reason: (B,) index of the violated condition, or of the variable along which the functions increase or the
            contraction left nothing.
        bound: (B,) upper bound over the feasible part of the box; infinite where a value may be undefined.
        lower, upper: (n, B) bounds of the contracted box, or of the face to which the box collapsed.
        cut_lower, cut_upper: (n, B) index of the expression that moved this end of the box, or ``UNMOVED`` or
            ``COLLAPSED``.
        split: (B,) index of the variable to bisect next.
        value: (B,) lower bound of the maximised value at the centre; -inf where a condition may be violated.
        centre: (n, B) centres of the boxes.
    """

    verdict: NDArray[np.int32]
    reason: NDArray[np.int32]
    bound: FloatArray
    lower: FloatArray
    upper: FloatArray
    cut_lower: NDArray[np.int32]
    cut_upper: NDArray[np.int32]
    split: NDArray[np.int32]
    value: FloatArray
    centre: FloatArray


@dataclass(frozen=True, eq=False)
class LimbModels(Examination):
    """Results for B boxes of a limb with n variables, the first m of them shared with other limbs, and upper models.

    One limb cannot exclude values of shared variables. Monotonicity and contraction apply to the variables of this
    limb only; a limb without such variables applies them to the shared variables. The bound is the bound of the limb's
    function.

    Attributes:
        is_possible: (B,) whether an optimum may lie in the box.
        defined: (B,) whether the limb's function is defined in the whole box.
        holds: (B,) whether every condition of the limb is satisfied in the whole box.
        L: upper models of the Lagrangian, with multipliers that make the gradient along the limb's own variables small.
        slope_lo, slope_hi: (m, B) bounds of the gradient of the function along shared variables.
        stops_up, stops_down: (m, B) whether a condition may prevent a motion up or down along a shared variable.
    """

    is_possible: NDArray[np.bool_]
    defined: NDArray[np.bool_]
    holds: NDArray[np.bool_]
    L: QuadraticModel
    slope_lo: FloatArray
    slope_hi: FloatArray
    stops_up: NDArray[np.bool_]
    stops_down: NDArray[np.bool_]


class Engine:
    """Examination of boxes by the C kernel, on several threads. The results do not depend on the number of threads.

    Args:
        form: standard form of the program, or the form of one limb.
        jobs: number of threads; if left out, one for each processor.
        shared: number of variables that a limb's form shares with other limbs; these come first. None for a whole form.
        tangents: If true, the first pass of a minimum uses tangents to squares.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
        InputError: the kernel was not built.
    """

    def __init__(
        self, form: StandardForm, jobs: int | None = None, shared: int | None = None, *, tangents: bool = True
    ) -> None:
        self._module, self._shared, self._threads = kernel(), shared or 0, Threads(jobs)
        rows = search_rows(form, apart=shared is not None)
        squares = tangent_rows(form) if tangents and shared is None and form.n <= MOST_VARIABLES else None
        tape, values = search_tape(form, rows), None if shared is not None else value_tape(form, squares)
        objective = objective_tape(form, len(tape))
        parts = (
            np.where(form.follows, 2, form.is_equation).astype(np.int32),
            np.array(form.dependence, dtype=np.int32),
            form.lower,
            form.upper,
            np.array([(each.function, each.sign) for each in rows.quotients], dtype=np.int32),
            np.array(() if squares is None else squares.functions, dtype=np.int32),
        )
        self._form = (
            form.n,
            len(form.functions),
            len(rows.quotients),
            0 if squares is None else len(squares.quotients),
            parts,
            tape.head,
            None if values is None else values.head,
            None if values is None or objective is None else objective.head,
        )

    def examine(
        self, lower: FloatArray, upper: FloatArray, threshold: float, models: Sequence[Any] = (None,) * 3
    ) -> Examination:
        """Examine boxes, and close the boxes whose bound is at most a threshold.

        Args:
            lower: (n, B) lower ends.
            upper: (n, B) upper ends.
            threshold: largest bound of a box that is closed.
            models: arrays of the kernel for limbs.
        """
        n, count = lower.shape
        verdict, reason, split = (np.empty(count, dtype=np.int32) for _ in range(3))
        cut_lower, cut_upper = (np.empty((n, count), dtype=np.int32) for _ in range(2))
        left_lower, left_upper, centre = (np.empty((n, count)) for _ in range(3))
        bound, value = np.empty(count), np.empty(count)
        ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
        found = (verdict, reason, bound, left_lower, left_upper, cut_lower, cut_upper, split, value, centre)

        def examine_piece(piece: tuple[int, int]) -> None:
            self._module.examine(self._form, (*ends, *found, *models), count, *piece, threshold, self._shared)

        self._threads.map(examine_piece, pieces(count, self._threads.jobs))
        return Examination(*found)

    def limb_models(
        self,
        lower: FloatArray,
        upper: FloatArray,
        least: FloatArray | None = None,
        tilts: FloatArray | None = None,
        threshold: float = -np.inf,
    ) -> LimbModels:
        """Return quadratic upper models of a limb over boxes, or of the common part plus the limbs' tilts.

        Boxes of shared variables are contracted to the part where the conditions may be satisfied and the sum can
        exceed the threshold. A box is empty if a lower end is above its upper end.

        Args:
            lower: (n, B) lower ends; shared variables come first.
            upper: (n, B) upper ends.
            least: (B,) value below which a point cannot be the optimum; None without such a value.
            tilts: (3 + m + m^2, B) sum of the limbs' best values; sum of the absolute best values; bound of the
                rounding of each sum of tilts; sums of the tilts' gradients, and of the tilts' matrices, row by row.
                None for a limb.
            threshold: largest bound of a box that is closed.
        """
        (n, count), m = lower.shape, self._shared
        # Flags, the models, then slopes and stops of shared variables. A flag is 1 if the function is defined, plus 2
        # if every condition is satisfied.
        rows = np.empty((3 + 4 * n + n * n + 4 * m, count))
        matters = (None if each is None else np.ascontiguousarray(each) for each in (least, tilts))
        found = self.examine(lower, upper, threshold, (rows, *matters))
        vectors, H = rows[3 : 3 + 4 * n].reshape(4, n, -1), rows[3 + 4 * n :][: n * n].reshape(n, n, -1)
        sides = rows[3 + 4 * n + n * n :].reshape(m, 4, count)
        closing = (
            (BoxState.INFEASIBLE, BoxState.MONOTONE, BoxState.EMPTIED) if tilts is None else (BoxState.INFEASIBLE,)
        )
        return LimbModels(
            **vars(found),
            is_possible=~np.isin(found.verdict, closing),
            defined=(rows[0] == 1) | (rows[0] == 3),
            holds=rows[0] >= 2,
            L=QuadraticModel(rows[1], vectors[0], H, vectors[1], vectors[2], vectors[3], rows[2]),
            slope_lo=sides[:, 0],
            slope_hi=sides[:, 1],
            stops_up=sides[:, 2] > 0,
            stops_down=sides[:, 3] > 0,
        )


def search_tape(form: StandardForm, rows: Rows | None = None, *, is_short: bool = True) -> Tape:
    """Return the tape of the rows of a form, then of the derivatives of these rows, row by row.

    The default rows are its R expressions.

    With ``is_short``, common subexpressions are written once. The search for common subexpressions cannot be
    interrupted, and doubles the time.

    Raises:
        UncoveredError: an expression has an operation without an interval rule, or a jump.
    """
    try:
        rows = search_rows(form, apart=False) if rows is None else rows
        refuse_jumps(rows.expressions, form.x)
        jacobian = ca.densify(without_ties(ca.jacobian(rows.expressions, form.x), form.x))
        results = [rows.expressions, jacobian.T]
        return compile_tape(ca.Function("search", [form.x], ca.cse(results) if is_short else results))
    except UncoveredError as error:
        raise UncoveredError(error.operation, _uncovered_limit(form)) from None


def value_tape(form: StandardForm, rows: Rows | None = None) -> Tape | None:
    """Return a tape of a form's R expressions without derivatives, for the first pass, then of the rows for tangents.

    Returns:
        The tape; None for a form with too many variables for a first pass.
    """
    if form.n > MOST_VARIABLES:
        return None
    every = form.expressions if rows is None else ca.densify(ca.vertcat(form.expressions, rows.expressions))
    return compile_tape(ca.Function("values", [form.x], [ca.cse(every)]))


def without_conditions(form: StandardForm) -> StandardForm:
    """Return the form without its conditions."""
    return replace(form, conditions=())


def objective_tape(form: StandardForm, length: int) -> Tape | None:
    """Return the tape of a form's functions and their derivatives.

    None if the tape is not much shorter than ``length``.
    """
    if form.n > MOST_VARIABLES or not form.conditions:
        return None
    # The tape without derivatives is shorter, and often already too long.
    values = ca.Function("values", [form.x], [ca.cse(ca.vertcat(*form.functions))])
    shortest = sum(values.instruction_id(k) != ca.OP_CONST for k in range(values.n_instructions()))
    if (shortest + len(form.functions) * form.n) * _MANY_CONDITIONS > length:
        return None
    tape = search_tape(without_conditions(form))
    return tape if len(tape) * _MANY_CONDITIONS <= length else None


def _uncovered_limit(form: StandardForm) -> str | None:
    """Return the key of the limit that contains an operation without an interval rule.

    The result is None if an expression of the robot contains such an operation.
    """
    keys = {each.name: next(filter(None, each.keys), None) for each in form.nlp.program.constraints}
    whose = [*(None for _ in form.functions), *(keys.get(each.name) for each in form.conditions)]
    for k, key in enumerate(whose):
        row = form.expressions[k]
        try:
            refuse_jumps(row, form.x)
            compile_tape(ca.Function("row", [form.x], [row, ca.densify(ca.jacobian(row, form.x)).T]))
        except UncoveredError:
            return None if key is None else f"limits.{key}"
    return None
