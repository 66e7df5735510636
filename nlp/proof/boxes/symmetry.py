"""Symmetries of a form, read off its expressions: mirrors, and parts that are copies of each other.

A mirror changes the signs of some variables, and no function or condition of the form. The axis of a joint, for
example, may point either way. It is found where every intermediate value either keeps its sign or changes it, for all
values of the variables. This is a linear condition, modulo 2, on the set of variables that change theirs. So the
mirrors found are a group, and one half of the box for each of its generators holds an optimum of the whole box.

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
    """Return sets of variables whose signs may be changed together; the first variable of each is in no other one.

    Bounds stay as they are, as do the functions, the inequalities, and whether an equation holds.
    """
    held = [1 << i for i in range(form.n) if form.lower[i] != -form.upper[i]]
    if len(held) == form.n:
        return []
    found: list[int] = []
    # Mostly the functions alone have no mirror: then the many expressions of the conditions are not looked at.
    for part in (without_conditions(form), form):
        tape = _tape_of(part)
        found = [] if tape is None else _solutions([*held, *_sums_of(tape, part.is_equation)], form.n)
        if not found:
            return []
    return [tuple(i for i in range(form.n) if each >> i & 1) for each in found]


def halved(form: StandardForm) -> StandardForm:
    """Return a form with the part of its box that is left of all mirrors: it has the same maximum."""
    found = mirrors(form)
    if not found:
        return form
    lower = form.lower.copy()
    lower[[each[0] for each in found]] = 0.0
    return replace(form, lower=frozen_array(lower, lower.shape))


def grouped(forms: Sequence[StandardForm]) -> list[list[int]]:
    """Return the numbers of forms, those of copies together."""
    groups: dict[object, list[int]] = {}
    for number, form in enumerate(forms):
        tape = _tape_of(form)
        columns = () if tape is None else (tape.op, tape.to, tape.a, tape.b, tape.k)
        key = (len(form.functions), form.is_equation, *(each.tobytes() for each in (form.lower, form.upper, *columns)))
        groups.setdefault(number if tape is None else key, []).append(number)
    return list(groups.values())


def _tape_of(form: StandardForm) -> Tape | None:
    """Compile a form's expressions; None where an operation has no rule, which the search refuses by its limit."""
    try:
        return compile_tape(ca.Function("values", [form.x], [form.expressions]))
    except UncoveredError:
        return None


def _sums_of(tape: Tape, is_equation: Sequence[bool]) -> Iterator[int]:
    """Yield sums of unknowns that are 0 modulo 2 where every value of a tape keeps or changes its sign.

    An unknown is 1 where a variable changes its sign; a sum is a number with the bits of its unknowns. A register has
    the sum that is 1 where it changes its sign.
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
            # Even functions keep the sign in any case; others are neither odd nor even, and a constant has no operand.
            yield 0 if op in (Op.SQUARE, Op.COS, Op.CONSTANT) else one
            signs[to] = 0


def _solutions(sums: Iterable[int], unknowns: int) -> list[int]:
    """Return a basis of the sets of unknowns with which sums are 0 modulo 2: each has a bit of its own, its lowest."""
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
            # The unknowns below the highest one of a row determine it: from the lowest up, with one free unknown 1.
            solution = 1 << free
            for highest in sorted(rows):
                if (rows[highest] & solution).bit_count() % 2:
                    solution |= 1 << highest
            basis.append(solution)
    return basis
