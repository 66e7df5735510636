"""A function's expression graph as a tape: a flat list of operations on registers, for any arithmetic.

CasADi lists the operations of an ``SX`` function one by one. :func:`compile_tape` writes this list with a dozen
operations, and expresses others by exact identities of real numbers (``tan = sin / cos``, ``2 x = x * 2``, an integer
power by products), so that an arithmetic needs few rules. An operation without an identity raises an error.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from ...errors import UncoveredError
from ...interruption import stop_if_requested

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ....models import FloatArray


class Op(enum.IntEnum):
    """Operations on registers ``r``: ``r[to] = ...`` from ``r[a]``, ``r[b]`` and the constant ``k``.

    The values are those of ``kernel/values.h``.
    """

    CONSTANT = 0  # k
    INPUT = 1  # variable a
    OUTPUT = 2  # result ``to`` is r[a]
    ADD = 3  # r[a] + r[b]
    SUB = 4  # r[a] - r[b]
    MUL = 5  # r[a] * r[b]
    DIV = 6  # r[a] / r[b]
    SHIFT = 7  # r[a] + k
    SCALE = 8  # r[a] * k
    SQUARE = 9  # r[a]^2
    SQRT = 10
    SIN = 11
    COS = 12
    EXP = 13
    LOG = 14
    ATAN = 15
    RAMP = 16  # max(r[a], 0)
    STEP = 17  # 1 where r[a] >= 0, else 0


@dataclass(frozen=True, eq=False)
class Tape:
    """A list of N instructions.

    Attributes:
        op: (N,) :class:`Op` of each instruction.
        to: (N,) register to write; for an output, the index of the result.
        a, b: (N,) registers to read; for an input, the index of the variable; 0 without an operand.
        k: (N,) constants.
        first, last: (N,) span of variables: the written value depends only on variables ``first <= i < last``.
        inputs: number of variables.
        outputs: number of results.
        registers: number of registers.
    """

    op: NDArray[np.int32]
    to: NDArray[np.int32]
    a: NDArray[np.int32]
    b: NDArray[np.int32]
    k: FloatArray
    first: NDArray[np.int32]
    last: NDArray[np.int32]
    inputs: int
    outputs: int
    registers: int

    def __len__(self) -> int:
        return len(self.op)

    @cached_property
    def head(self) -> tuple[tuple[NDArray[np.int32], FloatArray], int, int, int]:
        """Tape as the C kernel reads it: code, constants, and the numbers of instructions, registers and results."""
        code = np.stack([self.op, self.to, self.a, self.b, self.first, self.last], axis=1).astype(np.int32)
        return (np.ascontiguousarray(code), self.k), len(self), self.registers, self.outputs


_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}
#: Number of operations between two checks for an interrupt, about a tenth of a second.
_LOOK = 2048
#: Largest integer power that is written as products.
_LARGEST_POWER = 64


class _Value:
    """Result of an operation, or a constant, in formulas. It is written when an instruction first reads it.

    Attributes:
        op, a, b, k: the operation.
        register: register of the result; -1 for any free register.
        reach: variables on which the result depends, as bits; -1 for a result that is not written yet.
    """

    __slots__ = ("a", "b", "is_constant", "k", "op", "reach", "register")

    def __init__(self, op: Op, a: _Value | None = None, b: _Value | None = None, k: float = 0.0) -> None:
        self.op, self.a, self.b, self.k = op, a, b, k
        self.is_constant = op is Op.CONSTANT
        self.register, self.reach = -1, -1

    def __add__(self, other: _Value) -> _Value:
        one, two = (other, self) if self.is_constant else (self, other)
        return _Value(Op.SHIFT, one, k=two.k) if two.is_constant else _Value(Op.ADD, one, two)

    def __sub__(self, other: _Value) -> _Value:
        return _Value(Op.SHIFT, self, k=-other.k) if other.is_constant else _Value(Op.SUB, self, other)

    def __neg__(self) -> _Value:
        return _constant(-self.k) if self.is_constant else _Value(Op.SCALE, self, k=-1.0)

    def __mul__(self, other: _Value) -> _Value:
        one, two = (other, self) if self.is_constant else (self, other)
        return _Value(Op.SCALE, one, k=two.k) if two.is_constant else _Value(Op.MUL, one, two)

    def __truediv__(self, other: _Value) -> _Value:
        return _Value(Op.DIV, self, other)


def _constant(k: float) -> _Value:
    return _Value(Op.CONSTANT, k=k)


def _hypot(a: _Value, b: _Value) -> _Value:
    return _Value(Op.SQRT, _Value(Op.SQUARE, a) + _Value(Op.SQUARE, b))


def _asin(a: _Value) -> _Value:
    """Return ``atan(a / sqrt(1 - a^2))``, for |a| < 1."""
    return _Value(Op.ATAN, a / _Value(Op.SQRT, -_Value(Op.SQUARE, a) + _constant(1.0)))


def _fmax(a: _Value, b: _Value) -> _Value:
    """Return ``b + ramp(a - b)``. A constant becomes b, so that ``fmax(0, x)`` is only a ramp of x."""
    a, b = (b, a) if a.is_constant else (a, b)
    return b + _Value(Op.RAMP, a - b)


def _power(a: _Value, b: _Value) -> _Value:
    """Return an integer or half-integer power as products, a square root and a quotient."""
    if not b.is_constant:
        raise UncoveredError("the operation 'pow'")
    if not ((2 * b.k).is_integer() and 0 < abs(b.k) <= _LARGEST_POWER):
        raise UncoveredError(f"the power {b.k:g}")
    base, left = (a, int(abs(b.k))) if b.k.is_integer() else (_Value(Op.SQRT, a), int(abs(2 * b.k)))
    product = _constant(1.0)
    while left:
        if left & 1:
            product = base if product.is_constant else product * base
        base, left = _Value(Op.SQUARE, base), left >> 1
    return _constant(1.0) / product if b.k < 0 else product


#: CasADi's operations expressed as operations of a tape, by identities that are exact for real numbers. As pi is not a
#: double,
#: pi / 2 is twice the arc tangent of 1.
_FORMULAS: dict[int, Callable[[_Value, _Value], _Value]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_SQ: lambda a, _: _Value(Op.SQUARE, a),
    ca.OP_SQRT: lambda a, _: _Value(Op.SQRT, a),
    ca.OP_SIN: lambda a, _: _Value(Op.SIN, a),
    ca.OP_COS: lambda a, _: _Value(Op.COS, a),
    ca.OP_EXP: lambda a, _: _Value(Op.EXP, a),
    ca.OP_LOG: lambda a, _: _Value(Op.LOG, a),
    ca.OP_ATAN: lambda a, _: _Value(Op.ATAN, a),
    ca.OP_TWICE: lambda a, _: _Value(Op.SCALE, a, k=2.0),
    ca.OP_NEG: lambda a, _: _Value(Op.SCALE, a, k=-1.0),
    ca.OP_ASSIGN: lambda a, _: _Value(Op.SCALE, a, k=1.0),
    ca.OP_INV: lambda a, _: _constant(1.0) / a,
    ca.OP_TAN: lambda a, _: _Value(Op.SIN, a) / _Value(Op.COS, a),
    ca.OP_HYPOT: _hypot,
    ca.OP_ASIN: lambda a, _: _asin(a),
    ca.OP_ACOS: lambda a, _: -_asin(a) + _Value(Op.ATAN, _constant(1.0)) * _constant(2.0),
    # Valid off the negative x-axis.
    ca.OP_ATAN2: lambda a, b: _Value(Op.ATAN, a / (_hypot(a, b) + b)) * _constant(2.0),
    ca.OP_FMAX: _fmax,
    ca.OP_FMIN: lambda a, b: -_fmax(-a, -b),
    ca.OP_LE: lambda a, b: _Value(Op.STEP, b - a),
    ca.OP_FABS: lambda a, _: _Value(Op.RAMP, a) * _constant(2.0) - a,
    # Valid if the operand is not 0.
    ca.OP_SIGN: lambda a, _: _Value(Op.STEP, a) * _constant(2.0) + _constant(-1.0),
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
}


class _TapeWriter:
    """Writer of a tape, instruction by instruction.

    Args:
        registers: number of registers of the CasADi function; higher registers are free.
    """

    def __init__(self, registers: int) -> None:
        self._rows: list[tuple[int, int, int, int, float, int]] = []
        self._values: dict[int, _Value] = {}
        self._free, self._next, self._registers = registers, registers, registers

    def put(self, register: int, value: _Value) -> None:
        """Set a register of the CasADi function."""
        if value.reach >= 0:
            value = _Value(Op.SCALE, value, k=1.0)
        value.register, self._next = register, self._free
        if not value.is_constant:
            self._write(value)
        self._values[register] = value

    def put_input(self, register: int, index: int) -> None:
        """Set a register of the CasADi function to a variable."""
        value = self._values[register] = _Value(Op.INPUT)
        value.register, value.reach = register, 1 << index
        self._rows.append((Op.INPUT, register, index, 0, 0.0, value.reach))

    def put_formula(self, register: int, op: int, operands: list[int]) -> None:
        """Set a register of the CasADi function to the result of an operation on registers."""
        if op not in _FORMULAS:
            raise UncoveredError(f"the operation {_NAMES.get(op, str(op))!r}")
        self.put(register, _FORMULAS[op](self._values[operands[0]], self._values[operands[-1]]))

    def output(self, register: int, place: int) -> None:
        """Make a register of the CasADi function a result."""
        read, reach = self._read(self._values[register])
        self._rows.append((Op.OUTPUT, place, read, read, 0.0, reach))

    def _read(self, value: _Value) -> tuple[int, int]:
        """Return a value's register and reach; the value is written first if necessary."""
        if value.reach < 0:
            self._write(value)
        return value.register, value.reach

    def _write(self, value: _Value) -> None:
        """Append the instruction that computes a value, after those of its operands."""
        a, reach = self._read(value.a) if value.a else (0, 0)
        b, other = self._read(value.b) if value.b else (a, 0)
        if value.register < 0:
            value.register, self._next = self._next, self._next + 1
            self._registers = max(self._registers, self._next)
        value.reach = reach | other
        self._rows.append((value.op, value.register, a, b, value.k, value.reach))

    def finish(self, inputs: int, outputs: int) -> Tape:
        """Return the tape."""
        # An empty expression has no instructions.
        *codes, k, reach = zip(*self._rows, strict=True) if self._rows else [()] * 6
        least = [(each & -each).bit_length() - 1 if each else 0 for each in reach]
        columns = (*codes, least, [each.bit_length() for each in reach])
        op, to, a, b, first, last = (np.array(each, dtype=np.int32) for each in columns)
        constants = np.array(k, dtype=np.float64)
        for column in (op, to, a, b, constants, first, last):
            column.setflags(write=False)
        return Tape(op, to, a, b, constants, first, last, inputs, outputs, self._registers)


def compile_tape(function: ca.Function) -> Tape:
    """Compile a CasADi function of one vector into a tape.

    Args:
        function: function of ``SX``, with one dense input (n, 1) and any number of dense outputs; their elements,
            column by column, are the results.

    Raises:
        UncoveredError: the function has an operation without an interval rule, or a constant that is not finite.
    """
    writer = _TapeWriter(function.sz_w())
    offset = np.cumsum([0, *(function.numel_out(i) for i in range(function.n_out()))])
    for index in range(function.n_instructions()):
        if index % _LOOK == 0:
            stop_if_requested()
        op = function.instruction_id(index)
        source, target = function.instruction_input(index), function.instruction_output(index)
        if op == ca.OP_CONST:
            value = function.instruction_constant(index)
            if not math.isfinite(value):
                raise UncoveredError(f"a constant that is not finite ({value})")
            writer.put(target[0], _constant(value))
        elif op == ca.OP_INPUT:
            writer.put_input(target[0], source[1])
        elif op == ca.OP_OUTPUT:
            writer.output(source[0], int(offset[target[0]]) + target[1])
        else:
            writer.put_formula(target[0], op, source)
    return writer.finish(function.numel_in(0), int(offset[-1]))
