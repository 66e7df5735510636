"""Operations of CasADi's graphs in any arithmetic of the check: a list of steps, and those that are composed of others.

An arithmetic of this package derives from :class:`Composed`, writes a dozen operations, and has the others by exact
identities of real numbers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

import casadi as ca
import numpy as np

from ...errors import UncoveredError

Value = TypeVar("Value")
#: The largest whole power that is written as products.
_LARGEST_POWER = 64


class Composed(ABC, Generic[Value]):
    """Operations on values of one arithmetic; those that are written here are composed of the abstract ones."""

    @abstractmethod
    def variable(self, i: int) -> Value:
        """Return variable number i."""

    @abstractmethod
    def constant(self, value: float) -> Value:
        """Return a constant."""

    @abstractmethod
    def number(self, u: Value) -> float | None:
        """Return the number that a constant is; None for what is not known to be one."""

    @abstractmethod
    def add(self, u: Value, v: Value) -> Value:
        """Return u + v."""

    @abstractmethod
    def sub(self, u: Value, v: Value) -> Value:
        """Return u - v."""

    @abstractmethod
    def mul(self, u: Value, v: Value) -> Value:
        """Return u v."""

    @abstractmethod
    def div(self, u: Value, v: Value) -> Value:
        """Return u / v."""

    @abstractmethod
    def scale(self, u: Value, by: float) -> Value:
        """Return a multiple of u."""

    @abstractmethod
    def square(self, u: Value) -> Value:
        """Return the square of u."""

    @abstractmethod
    def sqrt(self, u: Value) -> Value:
        """Return the root of u."""

    @abstractmethod
    def sin(self, u: Value) -> Value:
        """Return the sine of u."""

    @abstractmethod
    def cos(self, u: Value) -> Value:
        """Return the cosine of u."""

    @abstractmethod
    def exp(self, u: Value) -> Value:
        """Return the exponential of u."""

    @abstractmethod
    def log(self, u: Value) -> Value:
        """Return the natural logarithm of u."""

    @abstractmethod
    def atan(self, u: Value) -> Value:
        """Return the arc tangent of u."""

    @abstractmethod
    def ramp(self, u: Value) -> Value:
        """Return max(u, 0)."""

    @abstractmethod
    def step(self, u: Value) -> Value:
        """Return 1 where u is not negative, else 0."""

    def one(self) -> Value:
        """Return 1."""
        return self.constant(1.0)

    def fmax(self, u: Value, v: Value) -> Value:
        """Return the larger of two values."""
        return self.add(v, self.ramp(self.sub(u, v)))

    def fmin(self, u: Value, v: Value) -> Value:
        """Return the smaller of two values."""
        return self.scale(self.fmax(self.scale(u, -1.0), self.scale(v, -1.0)), -1.0)

    def sign(self, u: Value) -> Value:
        """Return 1 where u is not negative, else -1."""
        return self.sub(self.scale(self.step(u), 2.0), self.one())

    def fabs(self, u: Value) -> Value:
        """Return the size of u."""
        return self.sub(self.scale(self.ramp(u), 2.0), u)

    def tan(self, u: Value) -> Value:
        """Return the tangent of u."""
        return self.div(self.sin(u), self.cos(u))

    def asin(self, u: Value) -> Value:
        """Return the arc sine of u."""
        return self.atan(self.div(u, self.sqrt(self.sub(self.one(), self.square(u)))))

    def acos(self, u: Value) -> Value:
        """Return the arc cosine of u."""
        return self.sub(self.scale(self.atan(self.one()), 2.0), self.asin(u))

    def atan2(self, y: Value, x: Value) -> Value:
        """Return the angle off the negative x-axis, ``2 atan(y / (sqrt(x^2 + y^2) + x))``."""
        return self.scale(self.atan(self.div(y, self.add(self.hypot(y, x), x))), 2.0)

    def hypot(self, y: Value, x: Value) -> Value:
        """Return the root of the sum of two squares."""
        return self.sqrt(self.add(self.square(y), self.square(x)))

    def power(self, u: Value, exponent: Value) -> Value:
        """Return a constant whole or half power.

        Raises:
            UncoveredError: the power is another one.
        """
        power = self.number(exponent)
        if power is None or not ((2 * power).is_integer() and 0 < abs(power) <= _LARGEST_POWER):
            raise UncoveredError("a power that is not constant, or not whole or half")
        base, left = (u, int(abs(power))) if power.is_integer() else (self.sqrt(u), int(abs(2 * power)))
        result: Value | None = None
        while left:
            if left & 1:
                result = base if result is None else self.mul(result, base)
            left >>= 1
            base = self.square(base) if left else base
        positive = self.one() if result is None else result
        return positive if power > 0 else self.div(self.one(), positive)


_UNARY: dict[int, Callable[[Composed[Any], Any], Any]] = {
    ca.OP_ASSIGN: lambda _, u: u,
    ca.OP_NEG: lambda at, u: at.scale(u, -1.0),
    ca.OP_TWICE: lambda at, u: at.scale(u, 2.0),
    ca.OP_SQ: lambda at, u: at.square(u),
    ca.OP_SQRT: lambda at, u: at.sqrt(u),
    ca.OP_INV: lambda at, u: at.div(at.one(), u),
    ca.OP_SIN: lambda at, u: at.sin(u),
    ca.OP_COS: lambda at, u: at.cos(u),
    ca.OP_TAN: lambda at, u: at.tan(u),
    ca.OP_ATAN: lambda at, u: at.atan(u),
    ca.OP_ASIN: lambda at, u: at.asin(u),
    ca.OP_ACOS: lambda at, u: at.acos(u),
    ca.OP_EXP: lambda at, u: at.exp(u),
    ca.OP_FABS: lambda at, u: at.fabs(u),
    ca.OP_SIGN: lambda at, u: at.sign(u),
    ca.OP_LOG: lambda at, u: at.log(u),
}
_BINARY: dict[int, Callable[[Composed[Any], Any, Any], Any]] = {
    ca.OP_ADD: lambda at, u, v: at.add(u, v),
    ca.OP_SUB: lambda at, u, v: at.sub(u, v),
    ca.OP_MUL: lambda at, u, v: at.mul(u, v),
    ca.OP_DIV: lambda at, u, v: at.div(u, v),
    ca.OP_POW: lambda at, u, v: at.power(u, v),
    ca.OP_CONSTPOW: lambda at, u, v: at.power(u, v),
    ca.OP_ATAN2: lambda at, u, v: at.atan2(u, v),
    ca.OP_HYPOT: lambda at, u, v: at.hypot(u, v),
    ca.OP_FMAX: lambda at, u, v: at.fmax(u, v),
    ca.OP_FMIN: lambda at, u, v: at.fmin(u, v),
    ca.OP_LE: lambda at, u, v: at.step(at.sub(v, u)),
}


class Steps:
    """The operations of a function of one vector, in order.

    Args:
        function: made of ``SX``, with one dense input (n, 1) and dense outputs.

    Attributes:
        outputs: number of the outputs' elements.

    Raises:
        UncoveredError: the function holds an operation without a rule.
    """

    def __init__(self, function: ca.Function) -> None:
        self._registers = function.sz_w()
        self._steps: list[tuple[int, Sequence[int], Sequence[int], float]] = []
        for k in range(function.n_instructions()):
            op = function.instruction_id(k)
            if op not in {ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT, *_UNARY, *_BINARY}:
                raise UncoveredError(f"the operation number {op} of CasADi's")
            value = function.instruction_constant(k) if op == ca.OP_CONST else 0.0
            self._steps.append((op, function.instruction_input(k), function.instruction_output(k), value))
        self._offset = np.concatenate([[0], np.cumsum([function.numel_out(i) for i in range(function.n_out())])])
        self.outputs = int(self._offset[-1])

    def run(self, arithmetic: Composed[Value]) -> list[Value]:
        """Return the outputs' elements, column by column, as values of an arithmetic."""
        work: list[Value | None] = [None] * self._registers
        results: list[Value | None] = [None] * self.outputs
        with np.errstate(all="ignore"):
            for op, source, target, constant in self._steps:
                if op == ca.OP_OUTPUT:
                    results[int(self._offset[target[0]]) + target[1]] = work[source[0]]
                elif op == ca.OP_INPUT:
                    work[target[0]] = arithmetic.variable(source[1])
                elif op == ca.OP_CONST:
                    work[target[0]] = arithmetic.constant(constant)
                else:
                    operands = [work[each] for each in source]
                    work[target[0]] = (_UNARY[op] if op in _UNARY else _BINARY[op])(arithmetic, *operands)
        return [each for each in results if each is not None]
