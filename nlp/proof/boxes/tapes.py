"""A form as lists of operations, which the kernel evaluates on every box."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from ...errors import UncoveredError
from ..enclosure.squared_quotients import SearchRows, TangentRows, search_rows
from ..enclosure.tape import Tape, compile_tape
from ..statement.piecewise_derivatives import refuse_jumps
from ..statement.standard_form import StandardForm

#: How many times longer than that of the functions a tape must be for the gradients of conditions to wait.
_MANY_CONDITIONS = 4
#: Largest number of variables for which the first pass is made: a value has half its square as coefficients.
MOST_VARIABLES = 12


def search_tape(form: StandardForm, rows: SearchRows | None = None, *, is_short: bool = True) -> Tape:
    """Compile the E rows of a form, its R expressions if left out, then their derivatives, row by row.

    Equal parts are written once with ``is_short``; looking for them cannot be stopped, and takes as long as the rest.

    Raises:
        UncoveredError: an expression holds an operation without a rule, or its value jumps.
    """
    try:
        rows = search_rows(form, apart=False) if rows is None else rows
        refuse_jumps(rows.expressions, form.x)
        results = [rows.expressions, rows.jacobian.T]
        return compile_tape(ca.Function("search", [form.x], ca.cse(results) if is_short else results))
    except UncoveredError as error:
        raise UncoveredError(error.operation, _uncovered_limit(form)) from None


def value_tape(form: StandardForm, rows: TangentRows | None = None) -> Tape | None:
    """Compile a form's R expressions alone, for the first pass, and the rows for tangents behind them.

    None is returned for a form with too many variables for a first pass.
    """
    if form.n > MOST_VARIABLES:
        return None
    every = form.expressions if rows is None else ca.densify(ca.vertcat(form.expressions, rows.expressions))
    return compile_tape(ca.Function("values", [form.x], [ca.cse(every)]))


def without_conditions(form: StandardForm) -> StandardForm:
    """Return the form of the functions alone."""
    return replace(form, conditions=(), signs=())


def objective_tape(form: StandardForm, length: int) -> Tape | None:
    """Compile the functions and their derivatives; None where they take much of a whole tape of so many operations."""
    if form.n > MOST_VARIABLES or not form.conditions:
        return None
    tape = search_tape(without_conditions(form))
    return tape if len(tape) * _MANY_CONDITIONS <= length else None


def _uncovered_limit(form: StandardForm) -> str | None:
    """Return the key of the limit whose expressions hold an operation without a rule; None where the robot's do."""
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
