"""Forms of expressions over many boxes, by the enclosures of the certificate's search: in C or in NumPy.

On a box ``z_i = c_i + r_i e_i`` with ``|e_i| <= 1`` an expression lies in ``c + a.e + [-r, r]``: its value at the
centre and the middle of its terms of second order, its scaled gradient, and the rest of these terms with rounding.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from .engine import chosen_kernel, kernel
from .first_order import enclose
from .instructions import compile_tape
from .second_order import enclose_second
from .tape import Tape

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Part of its parts by which a sum of two doubles may be off, several times.
_ULP = 2.0**-51


class Forms(NamedTuple):
    """R expressions over B boxes.

    Attributes:
        c: (B, R) middles.
        a: (B, R, n) linear parts, scaled by the half widths of the boxes.
        r: (B, R) bounds of the rest; infinite where a value may be undefined.
    """

    c: FloatArray
    a: FloatArray
    r: FloatArray

    def part(self, which: slice) -> Forms:
        """Return the forms of some of the expressions."""
        return Forms(self.c[:, which], self.a[:, which], self.r[:, which])


class SecondForms(NamedTuple):
    """R expressions over B boxes, with ``Q_ij e_i e_j`` for each pair i <= j, row by row.

    Attributes:
        c: (B, R) values at the centres, and middles of the terms of higher order.
        a: (B, R, n) linear parts.
        Q: (B, R, n (n + 1) / 2) terms of second order.
        r: (B, R) bounds of the rest; infinite where a value may be undefined.
    """

    c: FloatArray
    a: FloatArray
    Q: FloatArray
    r: FloatArray


class Encloser:
    """Forms of expressions.

    Args:
        z: (n, 1) symbols of the coordinates.
        expressions: (R, 1) of them.
        engine: ``"c"``, ``"numpy"``, or None for the C kernel where it was built.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
        ValueError: there is no engine of that name here.
    """

    def __init__(self, z: SX, expressions: SX, engine: str | None = None) -> None:
        self.tape: Tape = compile_tape(ca.Function("entries", [z], [ca.densify(expressions)]))
        self.module: ModuleType | None = chosen_kernel(engine, kernel)
        code = [getattr(self.tape, name) for name in ("op", "to", "a", "b", "first", "last")]
        self._code = np.ascontiguousarray(np.stack(code, axis=1).astype(np.int32))

    @property
    def name(self) -> str:
        """``c`` or ``numpy``."""
        return "numpy" if self.module is None else "c"

    @property
    def head(self) -> tuple[NDArray[np.int32], FloatArray, int, int, int]:
        """The tape as the C kernel reads it."""
        return self._code, self.tape.k, len(self.tape), self.tape.registers, self.tape.outputs

    def __call__(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return the forms over boxes with ends (n, B)."""
        tape, (n, count) = self.tape, lower.shape
        if self.module is None:
            found = enclose(tape, lower, upper)
            c, a, p, q, s = found.c, found.a, found.p, found.q, found.s
        else:
            c, p, q, s = (np.empty((tape.outputs, count)) for _ in range(4))
            a = np.empty((tape.outputs, n, count))
            ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
            self.module.enclose(n, self.head, (*ends, c, p, q, s, a), count)
        middle, rest = _centred(c, p, q, s)
        return Forms(middle, a.transpose(2, 0, 1), rest)

    def second(self, lower: FloatArray, upper: FloatArray) -> SecondForms:
        """Return the forms of second order over boxes with ends (n, B)."""
        tape, (n, count) = self.tape, lower.shape
        if self.module is None:
            found = enclose_second(tape, lower, upper)
            c, p, q, s = found.c, found.p, found.q, found.s
            terms = np.concatenate([found.a, found.Q], axis=1)
        else:
            c, p, q, s = (np.empty((tape.outputs, count)) for _ in range(4))
            terms = np.empty((tape.outputs, n * (n + 3) // 2, count))
            ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
            self.module.enclose(n, self.head, (*ends, c, p, q, s, terms), count, 2)
        middle, rest = _centred(c, p, q, s)
        terms = terms.transpose(2, 0, 1)
        return SecondForms(middle, terms[:, :, :n], terms[:, :, n:], rest)


def _centred(c: FloatArray, p: FloatArray, q: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return middles (B, R) of expressions in ``c + [p, q] +- s``, and bounds of the rest."""
    middle, half = 0.5 * (p + q), 0.5 * (q - p)
    return (c + middle).T, (half + s + 4 * _ULP * (half + np.abs(c) + np.abs(middle))).T
