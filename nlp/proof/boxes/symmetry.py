"""Symmetries of a form, from its expressions: mirrors, and copies of parts.

A mirror changes the signs of some variables, but no function or condition of the form. For example, the axis of a
joint may point either way. It exists if every intermediate value either keeps or changes its sign, for all values of
the variables. This is a linear condition, modulo 2, on the set of variables that change sign. So the mirrors are a
group, and for each generator one half of the box contains an optimum of the whole box.

Copies are forms with the same operations, constants and bounds, in other variables. They have the same maximum.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import casadi as ca

from ....models import frozen_array
from ...errors import UncoveredError
from ..enclosure.tape import Op, Tape, compile_tape
from ..statement.standard_form import StandardForm
from .engine import without_conditions


def mirrors(form: StandardForm) -> list[tuple[int, ...]]:
    """Return sets of variables whose signs may change together; the first variable of each set is in no other set.

    Bounds, functions, inequalities and the solutions of equations stay the same.
    """
    held = [1 << i for i in range(form.n) if form.lower[i] != -form.upper[i]]
    if len(held) == form.n:
        return []
    found: list[int] = []
    # Often the functions have no mirror; then the many expressions of the conditions are not examined.
    for part in (without_conditions(form), form):
        tape = _tape_of(part)
        found = [] if tape is None else _solutions([*held, *_sums_of(tape, part.is_equation)], form.n)
        if not found:
            return []
    return [tuple(i for i in range(form.n) if each >> i & 1) for each in found]


def halved(form: StandardForm) -> StandardForm:
    """Reduce the box of a form by its mirrors, and return the reduced form, which has the same maximum."""
    found = mirrors(form)
    if not found:
        return form
    lower = form.lower.copy()
    lower[[each[0] for each in found]] = 0.0
    return replace(form, lower=frozen_array(lower, lower.shape))


def grouped(forms: Sequence[StandardForm]) -> list[list[int]]:
    """Return the indices of forms in groups of copies."""
    groups: dict[object, list[int]] = {}
    for number, form in enumerate(forms):
        tape = _tape_of(form)
        columns = () if tape is None else (tape.op, tape.to, tape.a, tape.b, tape.k)
        key = (len(form.functions), form.is_equation, *(each.tobytes() for each in (form.lower, form.upper, *columns)))
        groups.setdefault(number if tape is None else key, []).append(number)
    return list(groups.values())


def _tape_of(form: StandardForm) -> Tape | None:
    """Compile a form's expressions; None if an operation has no interval rule, which the search reports later."""
    try:
        return compile_tape(ca.Function("values", [form.x], [form.expressions]))
    except UncoveredError:
        return None


def _sums_of(tape: Tape, is_equation: Sequence[bool]) -> Iterator[int]:
    """Yield sums of unknowns that must be 0 modulo 2 so that every value of a tape keeps or changes its sign.

    An unknown is 1 if a variable changes its sign; a sum is an integer with the bits of its unknowns. The sum of a
    register is 1 if the register changes its sign.
    """
    signs: dict[int, int] = {}
    for op, to, a, b, k in zip(*(each.tolist() for each in (tape.op, tape.to, tape.a, tape.b, tape.k)), strict=True):
        one, other = signs.get(a, 0), signs.get(b, 0)
        if op == Op.INPUT:
            signs[to] = 1 << a
        elif op == Op.OUTPUT:
            yield 0 if is_equation[to] else one
        elif op in (Op.ADD, Op.SUB):
            yield one ^ other
            signs[to] = one
        elif op in (Op.MUL, Op.DIV):
            signs[to] = one ^ other
        elif op in (Op.SCALE, Op.SIN, Op.ATAN) or (op == Op.SHIFT and k == 0):
            signs[to] = one  # an odd function
        else:
            # Even functions always keep the sign; other functions are neither odd nor even; a constant has no operand.
            yield 0 if op in (Op.SQUARE, Op.COS, Op.CONSTANT) else one
            signs[to] = 0


def _solutions(sums: Iterable[int], unknowns: int) -> list[int]:
    """Return a basis of the sets of unknowns with all sums 0 modulo 2; the lowest bit of each is in no other set."""
    rows: dict[int, int] = {}
    for total in sums:
        left = total
        while left and left.bit_length() - 1 in rows:
            left ^= rows[left.bit_length() - 1]
        if left:
            rows[left.bit_length() - 1] = left
    basis = []
    for free in range(unknowns):
        if free not in rows:
            # The highest unknown of a row follows from lower ones: solve from the lowest up, with one free unknown 1.
            solution = 1 << free
            for highest in sorted(rows):
                if (rows[highest] & solution).bit_count() % 2:
                    solution |= 1 << highest
            basis.append(solution)
    return basis
