"""Tilts: quadratic functions of the shared variables, one for each limb of each box of these.

    t(s) = g.e + 1/2 e'Q e,    e_i = (s_i - c_i) / r_i,

with centre c and half widths r of the box, as computed in doubles. Any tilts give a bound, so that nothing of them has
to be trusted; a limb's function minus its tilt and the sum of all tilts must take the same ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..slopebounds import SumModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray

#: Error of a sum of a few hundred rounded terms, in parts of their sizes.
_SUMS = 1e-13


@dataclass(frozen=True, eq=False)
class Tilts:
    """Tilts over L boxes of m shared variables.

    Attributes:
        centre, radius: (m, L) of the boxes; a radius of 0 is 1 here, as e is 0 then.
        g: (m, L).
        Q: (m, m, L) symmetric.
    """

    centre: FloatArray
    radius: FloatArray
    g: FloatArray
    Q: FloatArray

    def select(self, which: NDArray[np.intp]) -> Tilts:
        """Return the tilts of some boxes, which may repeat."""
        return Tilts(self.centre[:, which], self.radius[:, which], self.g[:, which], self.Q[:, :, which])

    def total(self) -> FloatArray:
        """Return the largest size (L,) of each tilt over its box."""
        return np.asarray(np.abs(self.g).sum(axis=0) + 0.5 * np.abs(self.Q).sum(axis=(0, 1)))

    def at(self, s: FloatArray) -> FloatArray:
        """Return values (L,) at one point (m, L) for each, as computed in doubles."""
        e = (s - self.centre) / self.radius
        return np.asarray((self.g * e).sum(axis=0) + 0.5 * np.einsum("ib,ijb,jb->b", e, self.Q, e))


def tilts_over(lower: FloatArray, upper: FloatArray, g: FloatArray, Q: FloatArray) -> Tilts:
    """Return tilts over boxes with ends (m, L)."""
    radius = 0.5 * (upper - lower)
    return Tilts(0.5 * (lower + upper), np.where(radius > 0, radius, 1.0), g, Q)


def sum_of_tilts(parts: list[Tilts]) -> Tilts:
    """Return the sums of tilts over the same boxes, rounded; ``total`` of each part bounds the error."""
    return replace(parts[0], g=np.sum([each.g for each in parts], axis=0), Q=np.sum([each.Q for each in parts], axis=0))


def without_tilts(model: SumModel, tilts: Tilts, lower: FloatArray, upper: FloatArray) -> SumModel:
    """Return models over pieces, ends (n, N), of the N boxes, minus tilts of their first m variables."""
    m = len(tilts.g)
    centre = np.clip(0.5 * (lower[:m] + upper[:m]), lower[:m], upper[:m])
    e, r = (centre - tilts.centre) / tilts.radius, model.radius[:m] / tilts.radius
    across = np.einsum("ijb,jb->ib", np.abs(tilts.Q), np.abs(e) + r)
    g = tilts.g + np.einsum("ijb,jb->ib", tilts.Q, e)
    value = (tilts.g * e).sum(axis=0) + 0.5 * np.einsum("ib,ijb,jb->b", e, tilts.Q, e)
    sizes = np.abs(tilts.g) + across
    margin = _SUMS * ((sizes * (np.abs(e) + r)).sum(axis=0) + np.abs(model.b[:m]).sum(axis=0))
    slopes = g / tilts.radius
    reach = (np.einsum("ijb,jb->ib", np.abs(tilts.Q), r) + _SUMS * sizes) / tilts.radius * (1 + _SUMS)
    b, H = model.b.copy(), model.H.copy()
    low, high = model.slope_low.copy(), model.slope_high.copy()
    b[:m] -= g * r
    H[:m, :m] -= tilts.Q * r[:, None] * r[None]
    low[:m] -= slopes + reach
    high[:m] -= slopes - reach
    return replace(
        model,
        total=model.total - value + margin + _SUMS * np.abs(model.total),
        fixed=model.fixed - value + margin + _SUMS * np.abs(model.fixed),
        b=b,
        H=H,
        slope_low=low,
        slope_high=high,
    )
