"""Quadratic upper models of expressions over boxes, from the Taylor forms of their gradients; the kernel makes them.

With ``h = r e``, ``|e_i| <= 1``, the forms of a gradient, ``grad L in G + A t e + t^2 [p, q]``, integrated along the
ray from the centre, give

    L(c + h) in L(c) + sum_i b_i e_i + 1/2 sum_ij H_ij e_i e_j +- sum_i w_i |e_i|,
    b_i = r_i (G_i + (p_i + q_i) / 6),   H = sym(r_i A_ij),   w_i = r_i (q_i - p_i) / 6,

a quadratic model with a remainder of third order, without second derivatives. With ``mu`` on the simplex and
``lambda_k >= 0`` on inequalities, ``L = sum_j mu_j phi_j - sum_k lambda_k h_k`` is at least ``min phi`` wherever the
conditions hold: its bound holds there for any multipliers. The multipliers used make its gradient at the centre small.
``docs/certificate.md`` has the derivation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .engine import kernel

if TYPE_CHECKING:
    from ....models import FloatArray


class Ends(NamedTuple):
    """Least and largest ``e_i``, (n, B) each, of the points that can reach a level; low > high where none can."""

    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """An upper model ``middle + b e + 1/2 e'He + w |e|`` of a function on the box, e in [-1, 1]^n.

    Attributes:
        middle: (B,) upper bound of the function at the centre.
        b: (n, B).
        H: (n, n, B) symmetric.
        w: (n, B).
        slope_lo, slope_hi: (n, B) interval gradient times ``r_i``.
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
        kernel().models(len(self.b), self._arrays(), bound.size, bound)
        return bound

    def ends_reaching(self, level: float | FloatArray) -> Ends:
        """Return the ends of the ``e_i`` for which the model can reach a level, one or (B,), for any other ``e_j``."""
        low, high, levels = np.empty(self.b.shape), np.empty(self.b.shape), np.empty(self.middle.size)
        levels[:] = level
        kernel().models(len(self.b), self._arrays(), levels.size, levels, low, high)
        return Ends(low, high)

    def _arrays(self) -> tuple[FloatArray, ...]:
        """Return the model as the kernel reads it."""
        arrays = (self.middle, self.b, self.H, self.w, self.slope_lo, self.slope_hi, self.rounding)
        return tuple(np.ascontiguousarray(each) for each in arrays)
