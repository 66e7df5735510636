"""Replacement of unknowns in expressions, with sine and cosine of an unknown angle replaced as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
from casadi import SX


class Solved(NamedTuple):
    """Closed form of an unknown: value, sine and cosine for an angle, and edge of the reach."""

    value: SX
    sine: SX | None
    cosine: SX | None
    reach: SX

    @classmethod
    def angle(cls, sine: SX, cosine: SX, reach: SX) -> Solved:
        """Return an angle from its sine and cosine (1, 1), undefined at half a turn."""
        return cls(2 * ca.atan(sine / (1 + cosine)), sine, cosine, reach)


def with_replaced(symbols: Sequence[SX], outputs: Sequence[SX], argument: int, solved: dict[int, Solved]) -> list[SX]:
    """Return expressions with unknowns replaced, and their sines and cosines replaced as a whole.

    Args:
        symbols: arguments of the expressions.
        outputs: the expressions.
        argument: index of the argument with the unknowns.
        solved: closed forms by the index of the unknown.
    """
    function = ca.Function("outputs", list(symbols), [ca.densify(each) for each in outputs])
    work: list[SX] = [SX(0)] * function.sz_w()
    # Unknown in each register, with its sign.
    held: list[tuple[int, float] | None] = [None] * function.sz_w()
    results = [[SX(0)] * function.numel_out(i) for i in range(function.n_out())]
    for k in range(function.n_instructions()):
        op, source, target = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_OUTPUT:
            results[target[0]][target[1]] = work[source[0]]
            continue
        to = target[0]
        own = None
        if op == ca.OP_INPUT:
            is_solved = source[0] == argument and source[1] in solved
            value = solved[source[1]].value if is_solved else ca.vec(symbols[source[0]])[source[1]]
            own = (source[1], 1.0) if is_solved else None
        elif op == ca.OP_CONST:
            value = SX(function.instruction_constant(k))
        else:
            value, own = _applied(op, [work[i] for i in source], held[source[0]], solved)
        work[to], held[to] = value, own
    return [ca.reshape(ca.vertcat(*result), each.shape) for result, each in zip(results, outputs, strict=True)]


def _applied(
    op: int, operands: list[SX], held: tuple[int, float] | None, solved: dict[int, Solved]
) -> tuple[SX, tuple[int, float] | None]:
    """Return the result of an operation.

    If the result is an unknown or minus an unknown, also return the index of the unknown and the sign.
    """
    if held is not None and op in (ca.OP_SIN, ca.OP_COS, ca.OP_NEG):
        index, sign = held
        own = solved[index]
        if op == ca.OP_NEG:
            return -operands[0], (index, -sign)
        if own.sine is not None and own.cosine is not None:
            return (sign * own.sine if op == ca.OP_SIN else own.cosine), None
    return (SX.unary(op, operands[0]) if len(operands) == 1 else SX.binary(op, *operands)), None


def at_turn(expression: SX, q: SX, sine: SX | float, cosine: SX | float) -> SX:
    """Return an expression with the sine and cosine of an angle replaced by given values.

    Everywhere else the angle is replaced by 0.
    """
    others = ca.symvar(expression)
    rest = ca.vertcat(*[each for each in others if each.element_hash() != q.element_hash()])
    turned = Solved(SX(0), SX(sine), SX(cosine), SX(0))
    return with_replaced([rest, q], [expression], 1, {0: turned})[0]
