"""Signs of expressions by their operations: a sum of squares is at least 0, without a search of boxes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import casadi as ca
from casadi import SX


class _Signs(NamedTuple):
    """Signs that a value can have, apart from 0."""

    negative: bool = True
    positive: bool = True


def _product(a: _Signs, b: _Signs) -> _Signs:
    """Return the signs of a product, or of a quotient."""
    return _Signs(
        (a.negative and b.positive) or (a.positive and b.negative),
        (a.negative and b.negative) or (a.positive and b.positive),
    )


#: Signs of the values of operations, from those of the first and of the last operand; any sign for other operations.
_RULES: Mapping[int, Callable[[_Signs, _Signs], _Signs]] = {
    **dict.fromkeys((ca.OP_SQ, ca.OP_SQRT, ca.OP_FABS, ca.OP_EXP), lambda _a, _b: _Signs(negative=False)),
    **dict.fromkeys((ca.OP_ASSIGN, ca.OP_TWICE, ca.OP_INV), lambda a, _: a),
    **dict.fromkeys((ca.OP_MUL, ca.OP_DIV), _product),
    ca.OP_NEG: lambda a, _: _Signs(a.positive, a.negative),
    ca.OP_ADD: lambda a, b: _Signs(a.negative or b.negative, a.positive or b.positive),
    ca.OP_SUB: lambda a, b: _Signs(a.negative or b.positive, a.positive or b.negative),
    ca.OP_FMAX: lambda a, b: _Signs(a.negative and b.negative, a.positive or b.positive),
    ca.OP_FMIN: lambda a, b: _Signs(a.negative or b.negative, a.positive and b.positive),
}


def is_nowhere_positive(expression: SX, x: SX) -> bool:
    """Return whether the operations of an expression (1, 1) of x (n, 1) make it at most 0 wherever it is defined."""
    function = ca.Function("signs", [x], [expression])
    work = [_Signs()] * function.sz_w()
    found = _Signs(negative=False, positive=False)  # for an expression that is structurally 0
    for k in range(function.n_instructions()):
        op, source, target = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_OUTPUT:
            found = work[source[0]]
        elif op == ca.OP_INPUT:
            work[target[0]] = _Signs()
        elif op == ca.OP_CONST:
            value = function.instruction_constant(k)
            # A NaN constant may have any sign.
            work[target[0]] = _Signs(not value >= 0, not value <= 0)
        elif op == ca.OP_MUL and source[0] == source[1]:
            work[target[0]] = _Signs(negative=False)
        else:
            rule = _RULES.get(op)
            work[target[0]] = _Signs() if rule is None else rule(work[source[0]], work[source[-1]])
    return not found.positive
