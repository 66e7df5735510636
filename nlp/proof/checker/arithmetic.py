"""Operations of CasADi's graphs for polynomials with an error ball: direct rules, and compositions of other operations.

Compositions are exact identities of real numbers.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence

import casadi as ca
import numpy as np

from ....models import FloatArray
from ...errors import UncoveredError
from .polynomials import Polynomial, atan, constant, cos, exp, log, ramp, sin, sqrt, square, step, variable

#: Largest whole power that is written as products.
_LARGEST_POWER = 64
_ONE = constant(1.0)


def _asin(u: Polynomial) -> Polynomial:
    """Return the arc sine of u."""
    return atan(u / sqrt(_ONE - square(u)))


def _hypot(y: Polynomial, x: Polynomial) -> Polynomial:
    """Return the root of the sum of two squares."""
    return sqrt(square(y) + square(x))


def _power(u: Polynomial, exponent: Polynomial) -> Polynomial:
    """Return a power with a constant exponent, a multiple of 1/2.

    Raises:
        UncoveredError: the exponent is not a constant multiple of 1/2.
    """
    power = exponent.number
    if power is None or not ((2 * power).is_integer() and 0 < abs(power) <= _LARGEST_POWER):
        raise UncoveredError("a power whose exponent is not a constant multiple of 1/2")
    base, left = (u, int(abs(power))) if power.is_integer() else (sqrt(u), int(abs(2 * power)))
    result: Polynomial | None = None
    while left:
        if left & 1:
            result = base if result is None else result * base
        left >>= 1
        base = square(base) if left else base
    positive = _ONE if result is None else result
    return positive if power > 0 else _ONE / positive


_UNARY: dict[int, Callable[[Polynomial], Polynomial]] = {
    ca.OP_ASSIGN: lambda u: u,
    ca.OP_NEG: lambda u: u * -1.0,
    ca.OP_TWICE: lambda u: u * 2.0,
    ca.OP_SQ: square,
    ca.OP_SQRT: sqrt,
    ca.OP_INV: lambda u: _ONE / u,
    ca.OP_SIN: sin,
    ca.OP_COS: cos,
    ca.OP_TAN: lambda u: sin(u) / cos(u),
    ca.OP_ATAN: atan,
    ca.OP_ASIN: _asin,
    ca.OP_ACOS: lambda u: atan(_ONE) * 2.0 - _asin(u),
    ca.OP_EXP: exp,
    ca.OP_FABS: lambda u: ramp(u) * 2.0 - u,
    ca.OP_SIGN: lambda u: step(u) * 2.0 - _ONE,
    ca.OP_LOG: log,
}
_BINARY: dict[int, Callable[[Polynomial, Polynomial], Polynomial]] = {
    ca.OP_ADD: operator.add,
    ca.OP_SUB: operator.sub,
    ca.OP_MUL: operator.mul,
    ca.OP_DIV: operator.truediv,
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    # Valid off the negative x-axis.
    ca.OP_ATAN2: lambda y, x: atan(y / (_hypot(y, x) + x)) * 2.0,
    ca.OP_HYPOT: _hypot,
    ca.OP_FMAX: lambda u, v: v + ramp(u - v),
    ca.OP_FMIN: lambda u, v: v - ramp(v - u),
    ca.OP_LE: lambda u, v: step(v - u),
}


class PolynomialArithmetic:
    """Evaluation of a CasADi function with polynomials over boxes, one operation after the other.

    Args:
        function: function of ``SX`` with one dense input (n, 1) and dense outputs.

    Raises:
        UncoveredError: the function has an operation without a rule.
    """

    def __init__(self, function: ca.Function) -> None:
        self._steps: list[tuple[int, Sequence[int], Sequence[int]]] = []
        self._constants: dict[int, Polynomial] = {}
        for k in range(function.n_instructions()):
            op = function.instruction_id(k)
            if op == ca.OP_CONST:
                self._constants[k] = constant(function.instruction_constant(k))
            elif op not in {ca.OP_INPUT, ca.OP_OUTPUT, *_UNARY, *_BINARY}:
                raise UncoveredError(f"the CasADi operation number {op}")
            self._steps.append((op, function.instruction_input(k), function.instruction_output(k)))
        self._offset = np.concatenate([[0], np.cumsum([function.numel_out(i) for i in range(function.n_out())])])

    def __call__(self, lower: FloatArray, upper: FloatArray, given: Sequence[Polynomial] = ()) -> list[Polynomial]:
        """Return polynomials of the outputs' elements, column by column, over boxes with ends (n, N).

        Args:
            lower: (n, N) lower ends of the first n inputs.
            upper: (n, N) upper ends of the first n inputs.
            given: values of the remaining inputs.
        """
        work: dict[int, Polynomial] = {}
        results: dict[int, Polynomial] = {}
        with np.errstate(all="ignore"):
            for k, (op, source, target) in enumerate(self._steps):
                if op == ca.OP_OUTPUT:
                    results[int(self._offset[target[0]]) + target[1]] = work[source[0]]
                elif op == ca.OP_INPUT:
                    i = source[1]
                    is_box = i < len(lower)
                    work[target[0]] = variable(i, lower[i], upper[i]) if is_box else given[i - len(lower)]
                elif op == ca.OP_CONST:
                    work[target[0]] = self._constants[k]
                elif op in _UNARY:
                    work[target[0]] = _UNARY[op](work[source[0]])
                else:
                    work[target[0]] = _BINARY[op](work[source[0]], work[source[1]])
        return [results[k] for k in range(int(self._offset[-1]))]
