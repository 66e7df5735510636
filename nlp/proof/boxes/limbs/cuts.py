"""Parts of shared boxes and of own boxes that are left: contraction, monotonicity, and values below a threshold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models.arrays import first_largest
from ...enclosure.forms import ULP, midpoints
from ..engine import LimbModels
from .boxes import OwnBoxes, SharedBoxes
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
        common: models of the part with shared variables alone, with all tilts and bests, and what is left of the boxes.
        sums: (B,) upper bounds from these models: the limbs' bests, and the most that the common part adds to them.
        bound: (B,) upper bounds: the lesser of these and of those that the boxes had before.
        is_possible: (B,) whether the common conditions can hold and every limb has a box left.
    """

    models: list[LimbModels]
    parts: list[LimbBound]
    common: LimbModels
    sums: FloatArray
    bound: FloatArray
    is_possible: NDArray[np.bool_]


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


def collapse_monotone(form: StandardForm, boxes: SharedBoxes, sums: SharedSums, left: Left) -> Left:
    """Return shared boxes collapsed on faces of the whole box, or dropped, where the sum rises along a variable.

    The argument is that of the search of whole boxes: no condition may stop a point, of the common part or of a limb.
    """
    lower, upper, alive = left.lower.copy(), left.upper.copy(), left.alive.copy()
    parts = [*zip(sums.models, [own.starts for own in boxes.own], strict=True), (sums.common, np.arange(boxes.count))]
    for i in range(form.n):
        for side in (1, -1):
            slope, size = np.zeros(boxes.count), np.zeros(boxes.count)
            stopped = np.zeros(boxes.count, dtype=bool)
            for found, starts in parts:
                each = found.slope_lo[i] if side > 0 else -found.slope_hi[i]
                least = np.minimum.reduceat(np.where(found.is_possible, each, np.inf), starts)
                slope, size = slope + least, size + np.abs(least)
                stops = found.is_possible & (found.stops_up[i] if side > 0 else found.stops_down[i])
                stopped |= np.logical_or.reduceat(stops, starts)
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
    margin = (np.abs(centre) + radius) * (4 * ULP)
    low = centre + radius * ends.low[m:] - margin
    high = centre + radius * ends.high[m:] + margin
    old_lower, old_upper = found.lower[m:], found.upper[m:]
    worth = _WORTH * (old_upper - old_lower)
    lower = np.where(found.defined & (low - old_lower > worth), low, old_lower)
    upper = np.where(found.defined & (old_upper - high > worth), high, old_upper)
    alive = (lower <= upper).all(axis=0)
    keep &= alive
    lower, upper = np.where(alive, lower, old_lower), np.where(alive, upper, old_upper)
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
