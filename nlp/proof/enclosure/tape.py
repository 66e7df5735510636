"""A function's expression graph as a tape: a flat list of operations on registers, for any arithmetic.

CasADi lists the operations of an ``SX`` function one by one. :func:`compile_tape` writes that list in a dozen
operations, and the others by exact identities of real numbers (``tan = sin / cos``, ``2 x = x * 2``, a whole power as
products), so that an arithmetic needs few rules. An operation without an identity is refused by its name.
"""

from __future__ import annotations

import enum
import math
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

    The numbers are those of ``kernel/values.h``.
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
        to: (N,) register written, or the index of the result for an output.
        a, b: (N,) registers read, or the index of the variable for an input; 0 where there is none.
        k: (N,) constants.
        first, last: (N,) span of variables: the written value depends on no others than ``first <= i < last``.
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
    def head(self) -> tuple[NDArray[np.int32], FloatArray, int, int, int]:
        """The tape as the C kernel reads it: code, constants, and numbers of instructions, registers and results."""
        code = np.stack([self.op, self.to, self.a, self.b, self.first, self.last], axis=1).astype(np.int32)
        return np.ascontiguousarray(code), self.k, len(self), self.registers, self.outputs


_SAME = {ca.OP_ADD: Op.ADD, ca.OP_SUB: Op.SUB, ca.OP_MUL: Op.MUL, ca.OP_DIV: Op.DIV}
_UNARY = {
    ca.OP_SQ: Op.SQUARE,
    ca.OP_SQRT: Op.SQRT,
    ca.OP_SIN: Op.SIN,
    ca.OP_COS: Op.COS,
    ca.OP_EXP: Op.EXP,
    ca.OP_LOG: Op.LOG,
    ca.OP_ATAN: Op.ATAN,
}
_NAMES = {getattr(ca, name): name[3:].lower() for name in dir(ca) if name.startswith("OP_")}
#: Operations between two looks at whether to stop: about a tenth of a second.
_LOOK = 2048
#: The largest whole power that is written as products.
_LARGEST_POWER = 64


class _TapeWriter:
    """A tape under construction.

    It knows which registers hold constants, so that operations with a constant need no register for it. The variables
    that a register depends on are the bits of a number.

    Args:
        inputs: number of variables.
        registers: number of registers of the CasADi function.
    """

    def __init__(self, inputs: int, registers: int) -> None:
        self._rows: list[tuple[int, int, int, int, float, int]] = []
        self._inputs, self._spare = inputs, registers
        self.constant: dict[int, float] = {}
        self._written: set[int] = set()
        self._reach: dict[int, int] = {}

    def temporary(self) -> int:
        """Return a new register beyond those of the CasADi function."""
        self._spare += 1
        return self._spare - 1

    def _read(self, register: int) -> int:
        """Return the variables that a register depends on, after writing its constant where it holds one."""
        if register in self.constant and register not in self._written:
            self._append(Op.CONSTANT, register, 0, 0, self.constant[register], 0)
            self._written.add(register)
        return self._reach[register]

    def set_constant(self, register: int, value: float) -> None:
        """Set a register to a constant, which is written only when an instruction reads it."""
        self.constant[register] = value
        self._written.discard(register)

    def write(self, op: Op, to: int, a: int, b: int | None = None, k: float = 0.0) -> None:
        """Append an instruction on registers."""
        reach = self._read(a)
        if b is None:
            b = a
        else:
            reach |= self._read(b)
        self._append(op, to, a, b, k, reach)

    def write_input(self, to: int, index: int) -> None:
        """Append the instruction that reads a variable."""
        self._append(Op.INPUT, to, index, 0, 0.0, 1 << index)

    def _append(self, op: Op, to: int, a: int, b: int, k: float, reach: int) -> None:
        self._rows.append((op, to, a, b, k, reach))
        if op is not Op.OUTPUT:
            self._reach[to] = reach
            if op is not Op.CONSTANT:
                self.constant.pop(to, None)

    def finish(self, outputs: int) -> Tape:
        """Return the tape."""
        # Expressions without an entry have no instructions.
        *codes, k, reach = zip(*self._rows, strict=True) if self._rows else [()] * 6
        spans = (
            [(each & -each).bit_length() - 1 if each else 0 for each in reach],
            [each.bit_length() for each in reach],
        )
        op, to, a, b, first, last = (np.array(each, dtype=np.int32) for each in (*codes, *spans))
        constants = np.array(k, dtype=np.float64)
        for column in (op, to, a, b, constants, first, last):
            column.setflags(write=False)
        return Tape(op, to, a, b, constants, first, last, self._inputs, outputs, self._spare)


def compile_tape(function: ca.Function) -> Tape:
    """Compile a function of one vector.

    Args:
        function: made of ``SX``, with one dense input (n, 1) and any number of dense outputs; their elements, column by
            column, are the results in order.

    Raises:
        UncoveredError: the function holds an operation without a rule, or a constant that is not finite.
    """
    writer = _TapeWriter(function.numel_in(0), function.sz_w())
    sizes = [function.numel_out(i) for i in range(function.n_out())]
    offset = np.concatenate([[0], np.cumsum(sizes)])
    for index in range(function.n_instructions()):
        if index % _LOOK == 0:
            stop_if_requested()
        op = function.instruction_id(index)
        source, target = function.instruction_input(index), function.instruction_output(index)
        if op == ca.OP_CONST:
            value = function.instruction_constant(index)
            if not math.isfinite(value):
                raise UncoveredError(f"the constant {value}")
            writer.set_constant(target[0], value)
        elif op == ca.OP_INPUT:
            writer.write_input(target[0], source[1])
        elif op == ca.OP_OUTPUT:
            writer.write(Op.OUTPUT, int(offset[target[0]]) + target[1], source[0])
        else:
            _write_operation(writer, op, target[0], source)
    return writer.finish(int(offset[-1]))


def _write_operation(writer: _TapeWriter, op: int, to: int, source: list[int]) -> None:
    """Write an operation of CasADi's in the operations of a tape."""
    a = source[0]
    b = source[1] if len(source) > 1 else a
    known = writer.constant
    if op in _SAME:
        if op == ca.OP_MUL and (a in known or b in known):
            a, b = (b, a) if a in known else (a, b)
            writer.write(Op.SCALE, to, a, k=known[b])
        elif op == ca.OP_ADD and (a in known or b in known):
            a, b = (b, a) if a in known else (a, b)
            writer.write(Op.SHIFT, to, a, k=known[b])
        elif op == ca.OP_SUB and b in known:
            writer.write(Op.SHIFT, to, a, k=-known[b])
        else:
            writer.write(_SAME[op], to, a, b)
    elif op in _UNARY:
        writer.write(_UNARY[op], to, a)
    elif op in (ca.OP_TWICE, ca.OP_NEG):
        writer.write(Op.SCALE, to, a, k=2.0 if op == ca.OP_TWICE else -1.0)
    elif op == ca.OP_ASSIGN:
        writer.write(Op.SCALE, to, a, k=1.0)
    else:
        _write_composition(writer, op, to, a, b)


def _write_composition(writer: _TapeWriter, op: int, to: int, a: int, b: int) -> None:
    """Write an operation as several others, by an identity that is exact for real numbers."""
    one = writer.temporary()
    if op in (ca.OP_FMAX, ca.OP_FMIN, ca.OP_LE, ca.OP_FABS, ca.OP_SIGN):
        _write_kink(writer, op, to, a, b)
    elif op == ca.OP_INV:
        writer.set_constant(one, 1.0)
        writer.write(Op.DIV, to, one, a)
    elif op == ca.OP_TAN:
        other = writer.temporary()
        writer.write(Op.SIN, one, a)
        writer.write(Op.COS, other, a)
        writer.write(Op.DIV, to, one, other)
    elif op == ca.OP_HYPOT:
        other = writer.temporary()
        writer.write(Op.SQUARE, one, a)
        writer.write(Op.SQUARE, other, b)
        writer.write(Op.ADD, one, one, other)
        writer.write(Op.SQRT, to, one)
    elif op in (ca.OP_ASIN, ca.OP_ACOS):
        # asin y = atan(y / sqrt(1 - y^2)), acos y = pi/2 - asin y, for |y| < 1.
        writer.write(Op.SQUARE, one, a)
        writer.write(Op.SCALE, one, one, k=-1.0)
        writer.write(Op.SHIFT, one, one, k=1.0)
        writer.write(Op.SQRT, one, one)
        writer.write(Op.DIV, one, a, one)
        writer.write(Op.ATAN, to, one)
        if op == ca.OP_ACOS:
            writer.write(Op.SCALE, to, to, k=-1.0)
            _add_half_pi(writer, to)
    elif op == ca.OP_ATAN2:
        # atan2(y, x) = 2 atan(y / (sqrt(x^2 + y^2) + x)), off the negative x-axis.
        other = writer.temporary()
        writer.write(Op.SQUARE, one, a)
        writer.write(Op.SQUARE, other, b)
        writer.write(Op.ADD, one, one, other)
        writer.write(Op.SQRT, one, one)
        writer.write(Op.ADD, one, one, b)
        writer.write(Op.DIV, one, a, one)
        writer.write(Op.ATAN, one, one)
        writer.write(Op.SCALE, to, one, k=2.0)
    elif op in (ca.OP_POW, ca.OP_CONSTPOW) and b in writer.constant:
        _write_power(writer, to, a, writer.constant[b])
    else:
        raise UncoveredError(f"the operation {_NAMES.get(op, str(op))!r}")


def _write_kink(writer: _TapeWriter, op: int, to: int, a: int, b: int) -> None:
    """Write an operation with a kink or a step by a ramp or a step of one number.

    fmax(a, b) = b + ramp(a - b), fmin(a, b) = b - ramp(b - a), (a <= b) = step(b - a), |a| = 2 ramp(a) - a, and the
    sign of a is 2 step(a) - 1 where it is not 0.
    """
    other = writer.temporary()
    if op == ca.OP_LE:
        _write_difference(writer, other, b, a)
        writer.write(Op.STEP, to, other)
    elif op == ca.OP_SIGN:
        writer.write(Op.STEP, other, a)
        writer.write(Op.SCALE, other, other, k=2.0)
        writer.write(Op.SHIFT, to, other, k=-1.0)
    elif op == ca.OP_FABS:
        writer.write(Op.RAMP, other, a)
        writer.write(Op.SCALE, other, other, k=2.0)
        writer.write(Op.SUB, to, other, a)
    else:
        # The constant is the one that is added, so that fmax(0, x) is a ramp of x and nothing else.
        if a in writer.constant:
            a, b = b, a
        _write_difference(writer, other, *((a, b) if op == ca.OP_FMAX else (b, a)))
        writer.write(Op.RAMP, other, other)
        if op == ca.OP_FMIN:
            writer.write(Op.SCALE, other, other, k=-1.0)
        if b in writer.constant:
            writer.write(Op.SHIFT, to, other, k=writer.constant[b])
        else:
            writer.write(Op.ADD, to, b, other)


def _write_difference(writer: _TapeWriter, to: int, a: int, b: int) -> None:
    """Write ``a - b`` for numbers of which at most one is constant."""
    if b in writer.constant:
        writer.write(Op.SHIFT, to, a, k=-writer.constant[b])
    elif a in writer.constant:
        writer.write(Op.SCALE, to, b, k=-1.0)
        writer.write(Op.SHIFT, to, to, k=writer.constant[a])
    else:
        writer.write(Op.SUB, to, a, b)


def _add_half_pi(writer: _TapeWriter, to: int) -> None:
    """Write an addition of pi / 2, as twice the arc tangent of 1: no double is pi."""
    quarter = writer.temporary()
    writer.set_constant(quarter, 1.0)
    writer.write(Op.ATAN, quarter, quarter)
    writer.write(Op.SCALE, quarter, quarter, k=2.0)
    writer.write(Op.ADD, to, to, quarter)


def _write_power(writer: _TapeWriter, to: int, a: int, power: float) -> None:
    """Write a whole power, or half of one, as products, a root and a quotient."""
    twice = 2 * power
    if not (twice.is_integer() and 0 < abs(power) <= _LARGEST_POWER):
        raise UncoveredError(f"the power {power:g}")
    base, result = writer.temporary(), writer.temporary()
    if power.is_integer():
        writer.write(Op.SCALE, base, a, k=1.0)
        left = int(abs(power))
    else:
        writer.write(Op.SQRT, base, a)
        left = int(abs(twice))
    empty = True
    while left:
        if left & 1:
            if empty:
                writer.write(Op.SCALE, result, base, k=1.0)
            else:
                writer.write(Op.MUL, result, result, base)
            empty = False
        left >>= 1
        if left:
            writer.write(Op.SQUARE, base, base)
    if power < 0:
        unit = writer.temporary()
        writer.set_constant(unit, 1.0)
        writer.write(Op.DIV, to, unit, result)
    else:
        writer.write(Op.SCALE, to, result, k=1.0)
