"""Derivatives of ``fmax`` and ``fmin`` in a form that can be enclosed, and values that jump, which have none.

CasADi writes the derivative of ``fmax(a, b)`` by a as ``(b <= a) / ((a <= b) + (b <= a))``, which is 1, 0, or a half
where both are equal. Enclosed term by term, the divisor may be 0. Here the sum of the two comparisons is written as 1.
The derivative is then 1 where both are equal, and as it was elsewhere. Bounds use integrals of derivatives along lines,
and any number from 0 to 1 is a generalised derivative there.
"""

from __future__ import annotations

import casadi as ca
from casadi import SX

from ...errors import UncoveredError

#: Operations whose value jumps. Their derivative is written as 0, so that its integral along a line is not the change.
_JUMPS = {ca.OP_LE: "the comparison 'le'", ca.OP_SIGN: "the operation 'sign'"}


def refuse_jumps(expressions: SX, x: SX) -> None:
    """Refuse expressions of x (n, 1) whose values jump. Derivatives of theirs may: those of continuous values do.

    Raises:
        UncoveredError: there is such an expression.
    """
    function = ca.Function("values", [x], [expressions])
    for k in range(function.n_instructions()):
        if function.instruction_id(k) in _JUMPS:
            raise UncoveredError(_JUMPS[function.instruction_id(k)])


def without_ties(expressions: SX, x: SX) -> SX:
    """Return expressions (r, c) of x (n, 1) with the sum of a comparison and its converse written as 1."""
    function = ca.Function("ties", [x], [expressions])
    count = function.n_instructions()
    if not any(function.instruction_id(k) == ca.OP_LE for k in range(count)):
        return expressions
    work: list[SX] = [SX(0)] * function.sz_w()
    # Operands of the comparison that a value is, by their hashes.
    compared: dict[int, tuple[int, int]] = {}
    # A hash is the address of a node, which another node may get once nothing holds the first one.
    held: list[SX] = []
    results = [SX(0)] * expressions.nnz()
    for k in range(count):
        op, source, target = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if op == ca.OP_OUTPUT:
            results[target[1]] = work[source[0]]
        elif op == ca.OP_INPUT:
            work[target[0]] = x[source[1]]
        elif op == ca.OP_CONST:
            work[target[0]] = SX(function.instruction_constant(k))
        elif len(source) == 1:
            work[target[0]] = SX.unary(op, work[source[0]])
        else:
            a, b = work[source[0]], work[source[1]]
            one, other = (compared.get(each.element_hash()) for each in (a, b))
            is_tie = op == ca.OP_ADD and one is not None and other == one[::-1]
            work[target[0]] = SX(1) if is_tie else SX.binary(op, a, b)
            if op == ca.OP_LE:
                compared[work[target[0]].element_hash()] = (a.element_hash(), b.element_hash())
                held.append(work[target[0]])
    return SX(expressions.sparsity(), ca.vertcat(*results))
