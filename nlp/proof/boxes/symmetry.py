"""Symmetries of a form, read off its expressions: mirrors, and parts that are copies of each other.

A mirror changes the signs of some variables, and nothing that a certificate speaks of. The axis of a joint, for
example, may point either way. It is found where every intermediate value either keeps its sign or changes it, for all
values of the variables. This is a linear condition, modulo 2, on the set of variables that change theirs. So the
mirrors found are a group, and one half of the box for each of its generators holds an optimum of the whole box.

Copies are forms with the same operations, constants and bounds, in other variables. They have the same maximum.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import casadi as ca

from ....models import frozen_array
from ...errors import UncoveredError
from ..enclosure.tape import Op, compile_tape

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ..enclosure.tape import Tape
    from ..statement.standard_form import StandardForm

#: Odd functions of one value, which change their sign with it.
_ODD = frozenset({Op.SCALE, Op.SIN, Op.ATAN})
#: Even functions of one value.
_EVEN = frozenset({Op.SQUARE, Op.COS})
#: Operations whose result changes its sign with the first value, where it keeps or changes it.
_LIKE_THE_FIRST = _ODD | {Op.ADD, Op.SUB, Op.SHIFT}


class _Equations:
    """Linear equations modulo 2; a sum of unknowns is a number with their bits."""

    def __init__(self) -> None:
        #: Sums that are 0, by their highest unknown.
        self._sums: dict[int, int] = {}

    def add(self, total: int) -> None:
        """Add the equation that a sum of unknowns is 0."""
        while total:
            highest = total.bit_length() - 1
            if highest not in self._sums:
                self._sums[highest] = total
                return
            total ^= self._sums[highest]

    def solutions(self, unknowns: int) -> list[int]:
        """Return a basis of the solutions: each has a bit that no other one has, its lowest."""
        basis = []
        for free in range(unknowns):
            if free in self._sums:
                continue
            # The unknowns below a highest one determine it: from the lowest up, with one free unknown 1.
            solution = 1 << free
            for highest in sorted(self._sums):
                if (self._sums[highest] & solution).bit_count() % 2:
                    solution |= 1 << highest
            basis.append(solution)
        return basis


def mirrors(form: StandardForm) -> list[tuple[int, ...]]:
    """Return sets of variables whose signs may be changed together; the first variable of each is in no other one.

    Bounds stay as they are, as do the functions, the inequalities, and whether an equation holds.
    """
    held = [i for i in range(form.n) if form.lower[i] != -form.upper[i]]
    if len(held) == form.n:
        return []
    equations = _Equations()
    for i in held:
        equations.add(1 << i)
    # Mostly the functions alone have no mirror: then the many expressions of the conditions are not looked at.
    for part in (replace(form, conditions=(), signs=()), form):
        tape = _tape_of(part)
        if tape is None:
            return []
        for each in _conditions_of(tape, part.is_equation):
            equations.add(each)
        found = equations.solutions(form.n)
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


def _conditions_of(tape: Tape, is_equation: tuple[bool, ...]) -> Iterable[int]:
    """Yield sums of unknowns that must be 0 for every value of a tape to keep or change its sign.

    An unknown is 1 where a variable changes its sign; a register has the sum that is 1 where it does.
    """
    signs: dict[int, int] = {}
    rows = zip(tape.op.tolist(), tape.to.tolist(), tape.a.tolist(), tape.b.tolist(), tape.k.tolist(), strict=True)
    for op, to, a, b, k in rows:
        if op == Op.INPUT:
            signs[to] = 1 << a
            continue
        one, other = signs.get(a, 0), signs.get(b, 0)
        if op == Op.OUTPUT:
            yield 0 if is_equation[to] else one
        else:
            yield _condition(op, one, other, k)
            signs[to] = one ^ other if op in (Op.MUL, Op.DIV) else one if op in _LIKE_THE_FIRST else 0


def _condition(op: int, one: int, other: int, k: float) -> int:
    """Return the sum that must be 0 for the result of an operation to keep or change its sign."""
    if op in (Op.ADD, Op.SUB):
        return one ^ other
    if op in (Op.CONSTANT, Op.MUL, Op.DIV) or op in _ODD or op in _EVEN or (op == Op.SHIFT and k == 0):
        return 0
    # A function that is neither odd nor even, or a sum with a constant.
    return one
