"""Forms and quadratic models of expressions over many boxes, by the C kernel, with rigorous rounding terms.

On the box ``x_i = c_i + r_i e_i``, ``|e_i| <= 1``, the kernel has two enclosures of a value ``v``: for ``0 <= t <= 1``

    v(t e) in c + t sum_i a_i e_i + t^2 [p, q] +- s        and        lo <= v <= hi,

with the value ``c`` and the scaled gradient ``a`` at the centre, an interval ``[p, q]`` that contains 0 and all
second-order terms, and a bound ``s`` of the rounding errors. Second-order terms shrink with ``t^2``, so the integral of
a gradient's form along a ray has a third of their width. A value that may be undefined somewhere in the box, or that
overflows, is *poisoned*: its ``s`` and its ends are infinite, and so are those of every value computed from it.
``docs/certificate.md`` has the rules and their sources.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import SX

from ....models import FloatArray
from .engine import kernel
from .tape import Tape, compile_tape

#: Relative outward shift of an end of an interval per operation: four times the rounding unit 2^-53.
ULP = 2.0**-51
#: Upper bound of the underflow error of an operation. Additions are exact there.
TINY = 1e-300


class Forms(NamedTuple):
    """Affine forms of R expressions over B boxes: each value is in ``c + a.e + [-r, r]``.

    Attributes:
        c: (B, R) values at the centres, plus the middles of the second-order terms.
        a: (B, R, n) linear parts, scaled by the half widths of the boxes.
        r: (B, R) bounds of the remainder, with rounding; infinite where a value may be undefined.
    """

    c: FloatArray
    a: FloatArray
    r: FloatArray

    def part(self, which: slice) -> Forms:
        """Return the forms of some of the expressions."""
        return Forms(self.c[:, which], self.a[:, which], self.r[:, which])

    @property
    def sizes(self) -> FloatArray:
        """Bounds (B, R) of the absolute values of the expressions."""
        return np.asarray(np.abs(self.c) + np.abs(self.a).sum(axis=2) + self.r)


class Encloser:
    """Function that computes forms of expressions over boxes, by the C kernel.

    Args:
        z: (n, 1) symbols of the coordinates.
        expressions: (R, 1) expressions of the coordinates.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
    """

    def __init__(self, z: SX, expressions: SX) -> None:
        self.tape: Tape = compile_tape(ca.Function("entries", [z], [ca.densify(expressions)]))

    def __call__(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return the forms over boxes with ends (n, B)."""
        return self._forms(lower, upper, 1)

    def second(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return second-order forms over boxes with ends (n, B); terms ``e_i e_j``, i <= j, follow row by row.

        Each ``e_i^2`` is written as ``1/2 + 1/2 e`` with e in [-1, 1].
        """
        c, a, r = self._forms(lower, upper, 2)
        n = len(lower)
        squares = n + np.cumsum([0, *range(n, 1, -1)])
        a[:, :, squares] *= 0.5
        return Forms(c + a[:, :, squares].sum(axis=2), a, r)

    def _forms(self, lower: FloatArray, upper: FloatArray, order: int) -> Forms:
        """Return the forms of first or second order."""
        n, count = lower.shape
        c, r = (np.empty((self.tape.outputs, count)) for _ in range(2))
        a = np.empty((self.tape.outputs, n if order == 1 else n * (n + 3) // 2, count))
        ends = np.ascontiguousarray(lower), np.ascontiguousarray(upper)
        kernel().enclose(n, self.tape.head, (*ends, c, a, r), count, order)
        return Forms(c.T, a.transpose(2, 0, 1), r.T)


class Ends(NamedTuple):
    """Ranges of the coordinates ``e_i`` of the points that can reach a level.

    Attributes:
        low: (n, B) smallest ``e_i``; above ``high`` if no point can reach the level.
        high: (n, B) largest ``e_i``.
    """

    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """An upper model ``middle + b e + 1/2 e'He + w |e|`` of a function on the box, e in [-1, 1]^n.

    Attributes:
        middle: (B,) upper bound of the function at the centre.
        b: (n, B) linear coefficients.
        H: (n, n, B) symmetric matrices.
        w: (n, B) coefficients of the absolute values.
        slope_lo, slope_hi: (n, B) ends of the interval gradient times ``r_i``.
        rounding: (B,) bound of the rounding errors of all sums.
    """

    middle: FloatArray
    b: FloatArray
    H: FloatArray
    w: FloatArray
    slope_lo: FloatArray
    slope_hi: FloatArray
    rounding: FloatArray

    def bound(self) -> FloatArray:
        """Return an upper bound (B,) over the box."""
        bound = np.empty(self.middle.size)
        self._call(bound, None, None, None)
        return bound

    def ends_reaching(self, level: float | FloatArray) -> Ends:
        """Return the ranges of each ``e_i`` in which the model can reach a level: one number, or (B,)."""
        low, high = np.empty(self.b.shape), np.empty(self.b.shape)
        self._call(None, np.full(self.middle.size, level), low, high)
        return Ends(low, high)

    def _call(self, *results: FloatArray | None) -> None:
        """Call the kernel, which writes into the arrays ``results``; None for a result that is not needed."""
        arrays = (self.middle, self.b, self.H, self.w, self.slope_lo, self.slope_hi, self.rounding)
        kernel().models(len(self.b), (*(np.ascontiguousarray(each) for each in arrays), *results), self.middle.size)
