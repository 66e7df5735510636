"""Lagrangian decomposition: bounds of a sum of limbs over boxes of shared variables, from upper models of the limbs.

The sum of the limbs' maxima over a box of the shared variables ``s`` exceeds the maximum of the sum, because the maxima
are at different ``s``. So a quadratic function ``t_k`` of ``s``, the *tilt*, is subtracted from every limb's function,
and the sum of the tilts is added to the common part, which depends only on ``s``:

    phi(s, o) <= sum_k max over the boxes of limb k of (phi_k - t_k) + max_s (phi_0 + sum_k t_k).

This is valid for any tilts. Here a tilt has the gradient and curvature along ``s`` of the limb's model at a good point
of its own variables, so that the rest of the limb hardly depends on ``s``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...enclosure.forms import TINY, ULP, QuadraticModel
from ..engine import LimbModels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray


@dataclass(frozen=True, eq=False)
class OwnBoxes:
    """Lists of boxes of one limb's own variables, for B shared boxes.

    Attributes:
        lower, upper: (d, N) ends of the boxes of all lists, one list after the other.
        of: (N,) index of the shared box to which each box of own variables belongs; ascending.
        count: number B of shared boxes.
    """

    lower: FloatArray
    upper: FloatArray
    of: NDArray[np.int64]
    count: int

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Index (B,) of the first box of each list; no list may be empty."""
        return np.flatnonzero(np.diff(self.of, prepend=-1))

    def some(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> OwnBoxes:
        """Return the lists of the shared boxes of given indices; an index may repeat."""
        chosen = np.flatnonzero(which) if which.dtype == np.bool_ else which
        sizes = np.bincount(self.of, minlength=self.count)
        starts, counts = (np.cumsum(sizes) - sizes)[chosen], sizes[chosen]
        before = np.cumsum(counts) - counts
        places = np.repeat(starts - before, counts) + np.arange(int(counts.sum()))
        of = np.repeat(np.arange(chosen.size), counts)
        return OwnBoxes(self.lower[:, places], self.upper[:, places], of, chosen.size)

    def joined(self, parts: Sequence[OwnBoxes]) -> OwnBoxes:
        """Return the lists of several objects as one object, one after the other."""
        first = np.cumsum([0, *(part.count for part in parts)])
        return OwnBoxes(
            np.concatenate([part.lower for part in parts], axis=1),
            np.concatenate([part.upper for part in parts], axis=1),
            np.concatenate([part.of + start for part, start in zip(parts, first, strict=False)]),
            int(first[-1]),
        )

    @property
    def width(self) -> FloatArray:
        """Sum (B,) of all widths of the boxes of each list."""
        return np.asarray(np.bincount(self.of, (self.upper - self.lower).sum(axis=0), minlength=self.count))

    def bisect(self, which: NDArray[np.bool_], along: NDArray[np.intp]) -> OwnBoxes:
        """Return the lists after the bisection of some boxes (N,), each along one variable (N,)."""
        places = np.repeat(np.arange(self.of.size), 1 + which)
        lower, upper = self.lower[:, places].copy(), self.upper[:, places].copy()
        second = np.flatnonzero(np.diff(places, prepend=-1) == 0)
        i = along[places[second]]
        middle = 0.5 * lower[i, second] + 0.5 * upper[i, second]
        upper[i, second - 1], lower[i, second] = middle, middle
        return OwnBoxes(lower, upper, self.of[places], self.count)


class Tilt(NamedTuple):
    """A function ``g.e + 1/2 e'Q e`` of the shared variables over B boxes, e in [-1, 1]^m.

    Attributes:
        g: (m, B) gradients.
        Q: (m, m, B) symmetric matrices.
    """

    g: FloatArray
    Q: FloatArray


@dataclass(frozen=True, eq=False)
class LimbBound:
    """Bounds of one limb with d own variables, over B boxes of shared variables and N boxes of own variables.

    Attributes:
        own: boxes of the own variables.
        good: (d, B) best known point of the own variables.
        models: models of the limb over the N boxes.
        tilt: tilt that is subtracted from the limb.
        reached: (B,) lower bound, over the shared box, of the limb minus its tilt at the good point.
        value_of_good: (B,) value of the limb at the good point and the centre of the shared box; -inf if unknown.
        L: models of the limb minus its tilt over the N boxes.
        bounds: (N,) upper bounds of the limb minus its tilt; -inf where no optimum may lie.
        best: (B,) largest bound of each list.
        top: (B,) index of the box with the largest bound.
    """

    own: OwnBoxes
    good: FloatArray
    models: LimbModels
    tilt: Tilt
    reached: FloatArray
    value_of_good: FloatArray
    L: QuadraticModel
    bounds: FloatArray
    best: FloatArray
    top: NDArray[np.intp]


def first_largest_of_lists(values: FloatArray, own: OwnBoxes) -> NDArray[np.intp]:
    """Return the index (B,) of the first largest value (N,) of each list; NaN counts as -inf."""
    values = np.where(np.isnan(values), -np.inf, values)
    starts = own.starts
    largest = np.maximum.reduceat(values, starts)
    places = np.where(values == largest[own.of], np.arange(values.size), values.size)
    return np.asarray(np.minimum.reduceat(places, starts))


def bound_limb(
    own: OwnBoxes, good: FloatArray, models: LimbModels, at_good: LimbModels, fall: QuadraticModel, m: int
) -> LimbBound:
    """Return bounds of a limb, with a tilt for each shared box.

    A box of own variables is dropped if the limb's value at the good point exceeds its values in the whole box: then
    no optimum lies in the box.

    Args:
        own: boxes of the own variables.
        good: (d, B) point of the own variables for each of the B shared boxes.
        models: models of the limb over the N own boxes.
        at_good: models of the limb at the good points.
        fall: upper models of the negative limb at the good points.
        m: number of shared variables, the first ones.
    """
    L, usable = models.L, models.is_possible & models.defined
    promise = np.where(usable, L.middle + np.abs(L.b[m:]).sum(axis=0), -np.inf)
    chosen = first_largest_of_lists(promise, own)
    is_known = at_good.holds & at_good.defined
    g = np.where(is_known, at_good.L.b[:m], L.b[:m, chosen])
    Q = np.where(is_known, at_good.L.H[:m, :m], L.H[:m, :m, chosen])
    finite = np.isfinite(g).all(axis=0) & np.isfinite(Q).all(axis=(0, 1)) & (is_known | usable[chosen])
    tilt = Tilt(np.where(finite, g, 0.0), np.where(finite, Q, 0.0))
    reached = np.where(is_known, -_add(fall, tilt).bound(), -np.inf)
    reached = np.where(np.isnan(reached), -np.inf, reached)
    rest = _add(L, Tilt(-tilt.g[:, own.of], -tilt.Q[:, :, own.of]))
    bounds = np.where(models.defined, rest.bound(), np.inf)
    # The bound of the limb, and the bound of its negative tilt.
    apart = np.abs(tilt.g).sum(axis=0) + 0.5 * np.abs(tilt.Q).sum(axis=(0, 1))
    # The two bounds may cancel, so rounding is relative to their absolute values.
    other = models.bound + apart[own.of] + (np.abs(models.bound) + apart[own.of]) * (64 * ULP) + TINY
    bounds = np.fmin(bounds, other)
    is_possible = models.is_possible & ~(bounds < reached[own.of])
    bounds = np.where(is_possible, np.where(np.isnan(bounds), np.inf, bounds), -np.inf)
    value = np.where(is_known, at_good.value, -np.inf)
    best, top = np.maximum.reduceat(bounds, own.starts), first_largest_of_lists(bounds, own)
    return LimbBound(own, good, models, tilt, reached, value, rest, bounds, best, top)


def tilts_of(limbs: Sequence[LimbBound]) -> FloatArray:
    """Return the sum of the tilts and best values of all limbs, for ``tilts`` of :meth:`Engine.limb_models`."""
    best = np.array([limb.best for limb in limbs])
    g, Q = (np.array(each) for each in zip(*[limb.tilt for limb in limbs], strict=True))
    lost = 64 * ULP * (np.abs(g).sum(axis=(0, 1)) + np.abs(Q).sum(axis=(0, 1, 2)))
    total = np.where(np.isfinite(best).all(axis=0), best.sum(axis=0), np.inf)
    sums = g.sum(axis=0), Q.sum(axis=0).reshape(-1, best.shape[1])
    return np.concatenate([[total, np.abs(best).sum(axis=0), lost], *sums])


def _add(L: QuadraticModel, tilt: Tilt) -> QuadraticModel:
    """Return the models of a limb plus a tilt of their first variables."""
    m = len(tilt.g)
    b, H = L.b.copy(), L.H.copy()
    across = np.abs(tilt.Q).sum(axis=1)
    # Absolute values before the sum, which may cancel.
    sizes = np.abs(b[:m]) + np.abs(tilt.g) + np.abs(H[:m, :m]).sum(axis=1) + across
    margin = 64 * ULP * (sizes + np.abs(L.slope_lo[:m]) + np.abs(L.slope_hi[:m])) + TINY
    b[:m] += tilt.g
    H[:m, :m] += tilt.Q
    low, high = L.slope_lo.copy(), L.slope_hi.copy()
    low[:m] += tilt.g - across - margin
    high[:m] += tilt.g + across + margin
    return replace(L, b=b, H=H, slope_lo=low, slope_hi=high, rounding=L.rounding + 64 * ULP * sizes.sum(axis=0) + TINY)
