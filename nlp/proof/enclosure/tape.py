"""A flat list of operations on registers, for any arithmetic; :mod:`.instructions` writes it from a graph."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

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
