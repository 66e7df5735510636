"""Operations of CasADi's graphs in polynomials with a ball: those that have a rule, and those composed of others.

Compositions are exact identities of real numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ...errors import UncoveredError
from . import polynomials as poly
from .polynomials import Polynomial

if TYPE_CHECKING:
    from ....models import FloatArray

#: The largest whole power that is written as products.
_LARGEST_POWER = 64
_ONE = poly.constant(1.0)


def _fmax(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return the larger of two values."""
    return poly.add(v, poly.ramp(poly.sub(u, v)))


def _fmin(u: Polynomial, v: Polynomial) -> Polynomial:
    """Return the smaller of two values."""
    return poly.scale(_fmax(poly.scale(u, -1.0), poly.scale(v, -1.0)), -1.0)


def _sign(u: Polynomial) -> Polynomial:
    """Return 1 where u is not negative, else -1."""
    return poly.sub(poly.scale(poly.step(u), 2.0), _ONE)


def _fabs(u: Polynomial) -> Polynomial:
    """Return the size of u."""
    return poly.sub(poly.scale(poly.ramp(u), 2.0), u)


def _tan(u: Polynomial) -> Polynomial:
    """Return the tangent of u."""
    return poly.div(poly.sin(u), poly.cos(u))


def _asin(u: Polynomial) -> Polynomial:
    """Return the arc sine of u."""
    return poly.atan(poly.div(u, poly.sqrt(poly.sub(_ONE, poly.square(u)))))


def _acos(u: Polynomial) -> Polynomial:
    """Return the arc cosine of u."""
    return poly.sub(poly.scale(poly.atan(_ONE), 2.0), _asin(u))


def _atan2(y: Polynomial, x: Polynomial) -> Polynomial:
    """Return the angle off the negative x-axis, ``2 atan(y / (sqrt(x^2 + y^2) + x))``."""
    return poly.scale(poly.atan(poly.div(y, poly.add(_hypot(y, x), x))), 2.0)


def _hypot(y: Polynomial, x: Polynomial) -> Polynomial:
    """Return the root of the sum of two squares."""
    return poly.sqrt(poly.add(poly.square(y), poly.square(x)))


def _power(u: Polynomial, exponent: Polynomial) -> Polynomial:
    """Return a constant whole or half power.

    Raises:
        UncoveredError: the power is another one.
    """
    power = poly.number_of(exponent)
    if power is None or not ((2 * power).is_integer() and 0 < abs(power) <= _LARGEST_POWER):
        raise UncoveredError("a power that is not constant, or not whole or half")
    base, left = (u, int(abs(power))) if power.is_integer() else (poly.sqrt(u), int(abs(2 * power)))
    result: Polynomial | None = None
    while left:
        if left & 1:
            result = base if result is None else poly.mul(result, base)
        left >>= 1
        base = poly.square(base) if left else base
    positive = _ONE if result is None else result
    return positive if power > 0 else poly.div(_ONE, positive)


_UNARY: dict[int, Callable[[Polynomial], Polynomial]] = {
    ca.OP_ASSIGN: lambda u: u,
    ca.OP_NEG: lambda u: poly.scale(u, -1.0),
    ca.OP_TWICE: lambda u: poly.scale(u, 2.0),
    ca.OP_SQ: poly.square,
    ca.OP_SQRT: poly.sqrt,
    ca.OP_INV: lambda u: poly.div(_ONE, u),
    ca.OP_SIN: poly.sin,
    ca.OP_COS: poly.cos,
    ca.OP_TAN: _tan,
    ca.OP_ATAN: poly.atan,
    ca.OP_ASIN: _asin,
    ca.OP_ACOS: _acos,
    ca.OP_EXP: poly.exp,
    ca.OP_FABS: _fabs,
    ca.OP_SIGN: _sign,
    ca.OP_LOG: poly.log,
}
_BINARY: dict[int, Callable[[Polynomial, Polynomial], Polynomial]] = {
    ca.OP_ADD: poly.add,
    ca.OP_SUB: poly.sub,
    ca.OP_MUL: poly.mul,
    ca.OP_DIV: poly.div,
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_ATAN2: _atan2,
    ca.OP_HYPOT: _hypot,
    ca.OP_FMAX: _fmax,
    ca.OP_FMIN: _fmin,
    ca.OP_LE: lambda u, v: poly.step(poly.sub(v, u)),
}


class PolynomialArithmetic:
    """Polynomials of a function of one vector: its operations, in order.

    Args:
        function: made of ``SX``, with one dense input (n, 1) and dense outputs.

    Raises:
        UncoveredError: the function holds an operation without a rule.
    """

    def __init__(self, function: ca.Function) -> None:
        self._steps: list[tuple[int, Sequence[int], Sequence[int], float]] = []
        for k in range(function.n_instructions()):
            op = function.instruction_id(k)
            if op not in {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, *_UNARY, *_BINARY}:
                raise UncoveredError(f"the operation number {op} of CasADi's")
            value = function.instruction_constant(k) if op == ca.OP_CONST else 0.0
            self._steps.append((op, function.instruction_input(k), function.instruction_output(k), value))
        self._offset = np.concatenate([[0], np.cumsum([function.numel_out(i) for i in range(function.n_out())])])

    def __call__(self, lower: FloatArray, upper: FloatArray) -> list[Polynomial]:
        """Return polynomials of the outputs' elements, column by column, over boxes with ends (n, N)."""
        work: dict[int, Polynomial] = {}
        results: dict[int, Polynomial] = {}
        with np.errstate(all="ignore"):
            for op, source, target, constant in self._steps:
                if op == ca.OP_OUTPUT:
                    results[int(self._offset[target[0]]) + target[1]] = work[source[0]]
                elif op == ca.OP_INPUT:
                    work[target[0]] = poly.variable(source[1], lower[source[1]], upper[source[1]])
                elif op == ca.OP_CONST:
                    work[target[0]] = poly.constant(constant)
                elif op in _UNARY:
                    work[target[0]] = _UNARY[op](work[source[0]])
                else:
                    work[target[0]] = _BINARY[op](work[source[0]], work[source[1]])
        return [results[k] for k in range(int(self._offset[-1]))]
