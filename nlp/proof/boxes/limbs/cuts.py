"""Parts of shared boxes and of own boxes that are left: contraction, monotonicity, and values below a threshold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models.arrays import first_largest
from ...enclosure.forms import ULP, midpoints
from ...enclosure.quadratic_models import Ends, GradientModel, QuadraticModel, affine_ends_reaching
from .boxes import OwnBoxes, SharedBoxes
from .models import LimbModels
from .sums import LimbBound, first_largest_of_lists

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray
    from ...statement.standard_form import StandardForm

#: Weight of a model's linear part beside its curved part in the choice of a variable, as in the kernel.
LINEAR = 0.3
#: Own boxes are bisected where their bound is within this part of the limb's spread of the best.
_NEAR = 0.5
#: Part of its side that a contraction of a box must gain.
_WORTH = 0.1
#: Rounding of sums of a few values, in parts of their sizes.
_SUM = 1e-13


@dataclass(frozen=True, eq=False)
class SharedSums:
    """Bounds of B shared boxes.

    Attributes:
        models: of each limb.
        parts: bounds of each limb.
        common: enclosures of the part with shared variables alone.
        M: (B) models of the common part with all tilts and bests.
        sums: (B,) upper bounds from these models: the limbs' bests, and the most that the common part adds to them.
        bound: (B,) upper bounds: the lesser of these and of those that the boxes had before.
        is_possible: (B,) whether the common conditions can hold and every limb has a box left.
        binding: (R, B) whether a common condition may bind.
    """

    models: list[LimbModels]
    parts: list[LimbBound]
    common: GradientModel
    M: QuadraticModel
    sums: FloatArray
    bound: FloatArray
    is_possible: NDArray[np.bool_]
    binding: NDArray[np.bool_]


class Left(NamedTuple):
    """The parts of B boxes that are left: ends (m, B), and whether anything is (B,)."""

    lower: FloatArray
    upper: FloatArray
    alive: NDArray[np.bool_]


class LeftOwn(NamedTuple):
    """A limb's own boxes that are left.

    Attributes:
        own: the boxes; a list may be empty.
        spread: (B,) how much the bound of the best box of each list can change along its own variables.
        good: (d, B) the best point known of the own variables.
        is_near: (N,) whether a box is to be bisected where its list is refined.
        along: (N,) the variable to bisect.
    """

    own: OwnBoxes
    spread: FloatArray
    good: FloatArray
    is_near: NDArray[np.bool_]
    along: NDArray[np.intp]


def contract_shared(form: StandardForm, boxes: SharedBoxes, sums: SharedSums, threshold: float) -> Left:
    """Return what is left of shared boxes where the sum can exceed a threshold and each common condition can hold."""
    centre, radius = midpoints(boxes.lower, boxes.upper)
    ends = [sums.M.ends_reaching(threshold)]
    for r, is_equation in enumerate(form.is_equation):
        if r == 0:
            continue
        for sign in (1.0, -1.0) if is_equation else (-1.0,):
            ends.append(affine_ends_reaching(sums.common.value, r, sign, 0.0))
            ends.append(sums.common.expression_model(r, sign).ends_reaching(0.0))
    return _moved(boxes.lower, boxes.upper, centre, radius, ends, np.isfinite(sums.bound))


def _moved(
    lower: FloatArray,
    upper: FloatArray,
    centre: FloatArray,
    radius: FloatArray,
    ends: list[Ends],
    usable: NDArray[np.bool_],
) -> Left:
    """Return boxes with ends moved to the tightest of some, in parts of the radius, where that gains enough."""
    margin = (np.abs(centre) + radius) * (4 * ULP)
    low = centre + radius * np.max([each.low for each in ends], axis=0) - margin
    high = centre + radius * np.min([each.high for each in ends], axis=0) + margin
    worth = _WORTH * (upper - lower)
    new_lower = np.where(usable & (low - lower > worth), low, lower)
    new_upper = np.where(usable & (upper - high > worth), high, upper)
    alive = np.asarray((new_lower <= new_upper).all(axis=0))
    return Left(np.where(alive, new_lower, lower), np.where(alive, new_upper, upper), alive)


def collapse_monotone(form: StandardForm, boxes: SharedBoxes, sums: SharedSums, left: Left) -> Left:
    """Return shared boxes collapsed on faces of the whole box, or dropped, where the sum rises along a variable.

    The argument is that of the search of whole boxes: no condition may stop a point, of the common part or of a limb.
    """
    lower, upper, alive = left.lower.copy(), left.upper.copy(), left.alive.copy()
    for i in range(form.n):
        for side in (1, -1):
            slope, size = np.zeros(boxes.count), np.zeros(boxes.count)
            stopped = np.zeros(boxes.count, dtype=bool)
            for found, own in zip(sums.models, boxes.own, strict=True):
                each = found.slope_lo[i] if side > 0 else -found.slope_hi[i]
                least = np.minimum.reduceat(np.where(found.is_possible, each, np.inf), own.starts)
                slope, size = slope + least, size + np.abs(least)
                stops = found.is_possible & (found.stops_up[i] if side > 0 else found.stops_down[i])
                stopped |= np.logical_or.reduceat(stops, own.starts)
            g_lo, g_hi = sums.common.gradient_lo[:, i], sums.common.gradient_hi[:, i]
            own_slope = g_lo[0] if side > 0 else -g_hi[0]
            slope, size = slope + own_slope, size + np.abs(own_slope)
            for r in range(1, len(g_lo)):
                if form.dependence[r][i]:
                    falls = (g_hi[r] < 0) if side > 0 else (g_lo[r] > 0)
                    stopped |= sums.binding[r] & ~(falls & (not form.is_equation[r]))
            rises = (slope - _SUM * size > 0) & ~stopped & alive & (boxes.upper[i] > boxes.lower[i])
            whole = form.upper[i] if side > 0 else form.lower[i]
            at_face = rises & ((upper[i] if side > 0 else lower[i]) == whole)
            alive &= ~(rises & ~at_face)
            (lower if side > 0 else upper)[i, at_face] = whole
    return Left(lower, upper, alive)


def cut_own(
    good: FloatArray,
    found: LimbModels,
    part: LimbBound,
    own: OwnBoxes,
    sums: FloatArray,
    threshold: float,
) -> LeftOwn:
    """Return a limb's own boxes that can exceed a threshold together with the best of everything else.

    Args:
        good: (d, B) the best point known of the own variables.
        found: models of the limb.
        part: its bounds.
        own: its boxes.
        sums: (B,) upper bounds of the shared boxes, each the sum of the limbs' bests and of what the common part adds.
            A lesser bound of the whole, from elsewhere, would say nothing of the other limbs.
        threshold: the threshold.
    """
    m = len(found.lower) - len(own.lower)
    # The others give at most ``sums - best``, so this limb must give the rest.
    level = threshold - (sums - part.best)
    level = level - _SUM * (abs(threshold) + np.abs(sums) + np.abs(part.best))
    level = np.fmax(np.where(np.isfinite(level), level, -np.inf), part.reached)
    keep = (part.bounds > -np.inf) & ~(part.bounds < level[own.of])
    ends = part.L.ends_reaching(level[own.of])
    centre, radius = midpoints(own.lower, own.upper)
    own_ends = [Ends(ends.low[m:], ends.high[m:])]
    moved = _moved(found.lower[m:], found.upper[m:], centre, radius, own_ends, found.defined)
    keep &= moved.alive
    lower, upper = moved.lower, moved.upper
    width = np.where(own.upper > own.lower, own.upper - own.lower, 1.0)
    change = LINEAR * np.abs(part.L.b[m:]) + np.abs(part.L.H[m:]).sum(axis=1) + part.L.w[m:]
    change = np.where(upper > lower, change * (upper - lower) / width, 0.0)
    change = np.where(np.isfinite(change), change, np.where(upper > lower, upper - lower, 0.0))
    total = change.sum(axis=0)
    spread = np.where(np.isfinite(part.best), total[part.top], 0.0)
    is_near = (part.bounds > (part.best - _NEAR * total[part.top])[own.of]) & (total > 0)
    # The centre of the best box becomes the good point where its value is larger.
    best = first_largest_of_lists(found.value, own)
    better = found.value[best] > part.value_of_good
    good = np.where(better, centre[:, best], good)
    left = OwnBoxes(lower[:, keep], upper[:, keep], own.of[keep], own.count)
    return LeftOwn(left, spread, good, is_near[keep], first_largest(change.T)[keep])
