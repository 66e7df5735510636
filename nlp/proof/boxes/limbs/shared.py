"""Search of a form whose limbs share variables: bisection of shared boxes, with lists of own boxes for each limb.

The halves of a shared box inherit its limbs' lists. An own box is dropped if the sum of its bound and the largest
bounds of all other limbs is at most the threshold. Each step bisects own boxes of the limbs with the largest spread, or
the shared box if its spread is larger. :mod:`screwsynth.nlp.proof.boxes.limbs.decomposition` has the bounds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from .....models.arrays import first_largest
from ...checker.tree import Node, leaf_bytes, node_bytes
from ...enclosure.forms import TINY, ULP
from ..engine import Engine, LimbModels, Threads
from ..optimum import LEAST_WIDTHS
from ..search import SMALL, WHOLE, Boxes, BoxResults, Order, Rule, Search, some
from ..tree import TreeRecord, halves_of, keys_of
from .decomposition import LimbBound, OwnBoxes, bound_limb, first_largest_of_lists, tilts_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray
    from ...statement.limb_separation import Separation
    from ...statement.standard_form import StandardForm
    from ..incumbent import Incumbent

Result = TypeVar("Result")
#: Weight of a model's linear part relative to its curved part in the choice of a variable, as in the kernel.
_LINEAR = 0.3
#: Boxes of own variables are bisected if the distance of their bound from the best bound is below this fraction of the
#: limb's spread.
_NEAR = 0.5
#: Smallest relative reduction of a side that makes a contraction of a box worthwhile.
_WORTH = 0.1
#: Rounding error of sums of a few values, relative to their absolute values.
_SUM = 1e-13
#: Number of shared boxes examined at once: a step with long lists takes about half a second.
_BLOCK = 256
#: Length of a list of own boxes above which the shared box is bisected instead.
_LONGEST = 512
#: Fraction of the largest spread above which a limb's list is refined too.
_SPREAD = 0.25
#: Margin, as a fraction of the gap, between the bound at which a recorded search closes a box and the proved bound.
_RESERVE = 0.5
#: Factor by which the expected gain of the limbs' lists must exceed that of the shared box.
_PATIENCE = 1.0


@dataclass(frozen=True, eq=False)
class SharedSums:
    """Bounds of the form over B shared boxes: boxes of the variables that several limbs share.

    The common part of the form depends only on shared variables. The tilt of a limb is a quadratic function of shared
    variables that is moved from the limb to the common part.

    Attributes:
        limbs: bounds of each limb.
        common: models of the common part plus the tilts and best values of all limbs, and the contracted boxes.
        sums: (B,) upper bounds from these models: the limbs' best values plus the maximum of the common part.
        bound: (B,) upper bounds: minimum of ``sums`` and of the earlier bounds of the boxes.
        is_possible: (B,) whether the common conditions may be satisfied and every limb has an open box.
    """

    limbs: list[LimbBound]
    common: LimbModels
    sums: FloatArray
    bound: FloatArray
    is_possible: NDArray[np.bool_]


class LeftOwn(NamedTuple):
    """Remaining boxes of a limb's own variables.

    Attributes:
        own: the boxes; a list may be empty.
        spread: (B,) possible change of the bound of the best box of each list along its own variables.
        good: (d, B) best known point of the own variables.
        is_near: (N,) whether a refinement of the list bisects the box.
        along: (N,) index of the variable to bisect.
    """

    own: OwnBoxes
    spread: FloatArray
    good: FloatArray
    is_near: NDArray[np.bool_]
    along: NDArray[np.intp]


class SharedColumns(NamedTuple):
    """Data that the search keeps for each shared box.

    Attributes:
        own: for each limb, the lists of boxes of its own variables.
        good: for each limb, the best known point (B, d) of its own variables.
    """

    own: tuple[OwnBoxes, ...]
    good: tuple[FloatArray, ...]


def shared_search(
    form: StandardForm,
    separation: Separation,
    incumbent: Incumbent,
    jobs: int | None,
    recorder: TreeRecord | None = None,
) -> Search[SharedRule]:
    """Return the search of limbs with shared variables: see :class:`SharedRule`."""
    rule = SharedRule(form, separation, incumbent, jobs, recorder)
    common, m = rule.common_form, len(separation.shared)
    own = tuple(
        OwnBoxes(limb.form.lower[m:, None], limb.form.upper[m:, None], np.zeros(1, dtype=np.int64), 1)
        for limb in separation.limbs
    )
    columns = SharedColumns(own, tuple((0.5 * (each.lower + each.upper)).T for each in own))
    root = Boxes(common.lower[None], common.upper[None], np.array([np.inf]), np.array([WHOLE]), columns)
    whole = common.upper - common.lower
    return Search(rule, root, whole=whole, least=LEAST_WIDTHS, order=Order.LARGEST_CHUNK)


class SharedRule(Rule[SharedColumns]):
    """Rule for the maximum of limbs with shared variables.

    Args:
        form: the whole form.
        separation: limbs of the form.
        incumbent: best known point, which the search improves.
        jobs: number of threads, which share the limbs.
        recorder: recorder of the search for a proof. A recorded search neither contracts shared boxes nor drops boxes
            of own variables because of other limbs, as proofs have no rules for these steps.
    """

    block = _BLOCK

    def __init__(
        self,
        form: StandardForm,
        separation: Separation,
        incumbent: Incumbent,
        jobs: int | None,
        recorder: TreeRecord | None = None,
    ) -> None:
        if separation.common is None:
            raise ValueError("the limbs share no variable")
        self._form, self._separation, self._incumbent = form, separation, incumbent
        self.common_form, self.names = separation.common, separation.common.names
        self._m, self._turn = len(separation.shared), 0
        # Threads share whole limbs, as a large part of a limb's work is in NumPy and cannot be divided.
        self._threads = Threads(jobs)
        # Engines of long limbs take seconds to set up. Each set-up is one step, so that the search can stop after any
        # of them.
        self._engines, self._opposites = list[Engine](), list[Engine]()
        self._recorder = recorder
        if recorder is not None:
            recorder.begin = bytes([Node.SHARED])

    @cached_property
    def _common(self) -> Engine:
        """Engine of the common part."""
        return Engine(self.common_form, 1, self._m)

    def examine(self, boxes: Boxes[SharedColumns]) -> BoxResults[SharedColumns]:
        """Return bounds of shared boxes, and improve the incumbent; the first steps each set up one limb."""
        if len(self._engines) < len(self._separation.limbs):
            form = self._separation.limbs[len(self._engines)].form
            # The negative function of a limb, for lower models.
            self._opposites.append(Engine(replace(form, functions=(-form.functions[0],)), 1, self._m))
            self._engines.append(Engine(form, 1, self._m))
            return BoxResults(boxes, -math.inf, 0)
        before = self._incumbent.value
        self._turn += 1
        with np.errstate(all="ignore"):
            # A proof has no contractions of shared boxes, and no own boxes dropped because of other limbs.
            below = self.target if self._recorder is None else -math.inf
            sums = self._sums(boxes, below)
            self._improve(boxes, sums)
            left, alive, emptied = self._branch(boxes, sums, below)
        # Points that contraction or dropped boxes exclude may have values up to the threshold.
        examined, reasons = sum(own.of.size + own.count for own in boxes.more.own), (sums, alive, emptied)
        return BoxResults(left, self.target, examined, is_better=self._incumbent.value > before, reasons=reasons)

    def record(self, boxes: Boxes[SharedColumns], found: BoxResults[SharedColumns], split: NDArray[np.intp]) -> None:
        """Record bisections and closed boxes for a proof.

        In a closed box, the difference between target and bound is divided equally among the limbs and the common part.
        """
        if self._recorder is None or found.reasons is None:
            return
        sums, alive, emptied = found.reasons
        emptied = emptied | (np.array([limb.best for limb in sums.limbs]) == -np.inf)
        keys = keys_of(boxes.lower, boxes.upper)
        for k in np.flatnonzero(~alive).tolist():
            self._recorder.add(keys[k], _leaf(sums, k, emptied[:, k], self.target))
        cut = split >= 0
        _, halves = halves_of(found.left.lower[cut], found.left.upper[cut], split[cut])
        for k, i, parts in zip(np.flatnonzero(alive)[cut].tolist(), split[cut].tolist(), halves, strict=True):
            self._recorder.add(keys[k], node_bytes(Node.HALF, i), *parts)

    def _of_limbs(self, function: Callable[[int], Result]) -> list[Result]:
        """Return the results of a function for the index of each limb; NumPy's warnings are off in each thread."""

        def quiet(k: int) -> Result:
            with np.errstate(all="ignore"):
                return function(k)

        return self._threads.map(quiet, range(len(self._engines)))

    def _sums(self, boxes: Boxes[SharedColumns], below: float) -> SharedSums:
        """Return bounds of shared boxes, and the sub-boxes in which the sum can exceed a value."""
        limbs = self._of_limbs(lambda k: self._bound_limb(k, boxes))
        common = self._common.limb_models(boxes.lower.T, boxes.upper.T, tilts=tilts_of(limbs), threshold=below)
        bound, best = common.L.bound(), np.array([limb.best for limb in limbs])
        known = common.defined & np.isfinite(best).all(axis=0) & ~np.isnan(bound)
        sums = np.where(known, bound, np.inf)
        is_possible = common.is_possible & ~(best == -np.inf).any(axis=0)
        return SharedSums(limbs, common, sums, np.fmin(sums, boxes.bound), is_possible)

    def _bound_limb(self, k: int, boxes: Boxes[SharedColumns]) -> LimbBound:
        """Return bounds of a limb over shared boxes and its own boxes."""
        engine, own, good = self._engines[k], boxes.more.own[k], boxes.more.good[k].T
        place = np.concatenate([boxes.lower.T, good]), np.concatenate([boxes.upper.T, good])
        at_good, fall = engine.limb_models(*place), self._opposites[k].limb_models(*place).L
        # For any values of the shared variables, own points with values below the good point are not optimal.
        least = np.where(at_good.holds & at_good.defined, -fall.bound(), -np.inf)
        lower = np.concatenate([boxes.lower.T[:, own.of], own.lower])
        upper = np.concatenate([boxes.upper.T[:, own.of], own.upper])
        return bound_limb(own, good, engine.limb_models(lower, upper, least[own.of]), at_good, fall, self._m)

    def _improve(self, boxes: Boxes[SharedColumns], sums: SharedSums) -> None:
        """Improve the incumbent from the best centre, and sometimes from the box with the largest bound."""
        values = sums.common.value
        places = [first_largest_of_lists(limb.models.value, limb.own) for limb in sums.limbs]
        for limb, place in zip(sums.limbs, places, strict=True):
            values = values + limb.models.value[place]
        values = np.where(np.isnan(values), -np.inf, values)
        node = int(np.argmax(values))
        if values[node] > self._incumbent.value:
            self._incumbent.consider(self._point(boxes, node, [int(place[node]) for place in places]))
        if self._turn & (self._turn - 1) == 0:
            node = int(np.argmax(np.where(sums.is_possible & np.isfinite(sums.bound), sums.bound, -np.inf)))
            self._incumbent.improve_near(self._point(boxes, node, [int(limb.top[node]) for limb in sums.limbs]))

    def _point(self, boxes: Boxes[SharedColumns], node: int, places: list[int]) -> FloatArray:
        """Return the point at the centres of a shared box and of one own box of each limb."""
        point = np.zeros(self._form.n)
        point[list(self._separation.shared)] = 0.5 * boxes.lower[node] + 0.5 * boxes.upper[node]
        for limb, own, place in zip(self._separation.limbs, boxes.more.own, places, strict=True):
            point[list(limb.own)] = 0.5 * own.lower[:, place] + 0.5 * own.upper[:, place]
        return point

    def _branch(
        self, boxes: Boxes[SharedColumns], sums: SharedSums, below: float
    ) -> tuple[Boxes[SharedColumns], NDArray[np.bool_], NDArray[np.bool_]]:
        """Drop and contract boxes, and refine the lists of boxes that are not bisected.

        Returns:
            The remaining sub-boxes; a mask (B,) of the shared boxes that contain them; and whether each limb has no
            open box, (K, B). In a recorded search, only the conditions of a limb can close all of its boxes.
        """
        bounded = sums.bound <= self.target
        if self._recorder is not None:
            # The proof needs the values of this box, not an inherited bound. The checker has another arithmetic and
            # needs a margin up to the threshold.
            room = max(self.target - self._incumbent.value, 0.0)
            bounded = sums.sums <= (self.target - _RESERVE * room if math.isfinite(room) else self.target)
        finite, count = np.isfinite(sums.bound), len(bounded)
        lower, upper, alive = boxes.lower.T, boxes.upper.T, np.ones(count, dtype=bool)
        if self._recorder is None:
            lower, upper, alive = contracted(self.common_form, boxes, sums)
        lists = self._of_limbs(lambda k: cut_own(sums.limbs[k], sums.sums, below))
        sizes = np.array([np.bincount(each.own.of, minlength=count) for each in lists])
        alive = alive & sums.is_possible & ~bounded & (sizes > 0).all(axis=0)
        whole = (self.common_form.upper - self.common_form.lower)[:, None]
        can_cut = ((upper - lower) / whole).max(axis=0) > np.where(finite, LEAST_WIDTHS[1], LEAST_WIDTHS[0])
        change = self._shared_change(boxes, sums, lower, upper)
        spread = np.array([each.spread for each in lists])
        wider = (spread.sum(axis=0) > _PATIENCE * change.sum(axis=0)) & finite & (sizes.max(axis=0) < _LONGEST)
        refine = alive & (spread > 0).any(axis=0) & (wider | ~can_cut)
        cut = alive & ~refine & can_cut
        # A shared box is examined again if this box, or a box in one of its lists, was moved or collapsed.
        moved = ((lower != boxes.lower.T) | (upper != boxes.upper.T)).any(axis=0)
        for before, each in zip(boxes.more.own, lists, strict=True):
            moved |= each.own.width < before.width
        split = np.where(cut, first_largest(change.T), np.where(refine | moved, WHOLE, SMALL))
        refined = refine & (spread >= _SPREAD * spread.max(axis=0))
        own = tuple(
            each.own.bisect(each.is_near & which[each.own.of], each.along)
            for each, which in zip(lists, refined, strict=True)
        )
        columns = SharedColumns(own, tuple(each.good.T for each in lists))
        return some(Boxes(lower.T, upper.T, sums.bound, split, columns), alive), alive, sizes == 0

    def _shared_change(
        self, boxes: Boxes[SharedColumns], sums: SharedSums, lower: FloatArray, upper: FloatArray
    ) -> FloatArray:
        """Return the possible change (m, B) of the bound along each shared variable within the remaining sub-boxes."""
        m, M = self._m, sums.common.L
        change = _LINEAR * np.abs(M.b) + np.abs(M.H).sum(axis=0) + M.w
        for limb in sums.limbs:
            change = change + limb.L.w[:m, limb.top] + np.abs(limb.L.H[:m, :, limb.top]).sum(axis=1)
        width = (boxes.upper - boxes.lower).T
        change = change * (upper - lower) / np.where(width > 0, width, 1.0)
        relative = (upper - lower) / (self.common_form.upper - self.common_form.lower)[:, None]
        return np.where(np.isfinite(change).all(axis=0) & (change > 0).any(axis=0), change, relative)


def _leaf(sums: SharedSums, k: int, emptied: NDArray[np.bool_], target: float) -> bytes:
    """Return the bytes of the proof's node for closed box k; ``emptied`` (K,) marks limbs without a feasible point."""
    limbs = sums.limbs
    if emptied.any():
        zero = np.zeros((len(limbs), len(limbs[0].tilt.g)))
        bounds = np.where(np.cumsum(emptied) * emptied == 1, -np.inf, np.inf)
        return leaf_bytes(bounds, zero, zero[:, :, None] * zero[:, None])
    if not sums.sums[k] <= target:
        return bytes([Node.INFEASIBLE])
    room = (target - sums.sums[k]) / (len(limbs) + 1)
    g, Q = (np.array([each[..., k] for each in ends]) for ends in zip(*[limb.tilt for limb in limbs], strict=True))
    return leaf_bytes(np.array([limb.best[k] for limb in limbs]) + room, g, Q)


def contracted(
    form: StandardForm, boxes: Boxes[SharedColumns], sums: SharedSums
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """Return bounds (m, B) of the remaining sub-boxes of B shared boxes, and whether each is nonempty (B,).

    Only the part remains where the common conditions may be satisfied and the sum can exceed the threshold. If the sum
    increases along a variable, the box collapses to a face of the whole box, or is dropped. As in the search of whole
    boxes, this requires that no condition of the common part or of a limb prevents the motion of a point.
    """
    finite, fits = np.isfinite(sums.bound), (sums.common.lower <= sums.common.upper).all(axis=0)
    lower = np.where(fits & finite, sums.common.lower, boxes.lower.T)
    upper = np.where(fits & finite, sums.common.upper, boxes.upper.T)
    alive, count = fits | ~finite, len(finite)
    parts = [*((limb.models, limb.own.starts) for limb in sums.limbs), (sums.common, np.arange(count))]
    for i in range(form.n):
        for side in (1, -1):
            slope, size, stopped = np.zeros(count), np.zeros(count), np.zeros(count, dtype=bool)
            for found, starts in parts:
                each = found.slope_lo[i] if side > 0 else -found.slope_hi[i]
                least = np.minimum.reduceat(np.where(found.is_possible, each, np.inf), starts)
                slope, size = slope + least, size + np.abs(least)
                stops = found.is_possible & (found.stops_up[i] if side > 0 else found.stops_down[i])
                stopped |= np.logical_or.reduceat(stops, starts)
            rises = (slope - _SUM * size > 0) & ~stopped & alive & (boxes.upper[:, i] > boxes.lower[:, i])
            whole = form.upper[i] if side > 0 else form.lower[i]
            at_face = rises & ((upper[i] if side > 0 else lower[i]) == whole)
            alive &= ~(rises & ~at_face)
            (lower if side > 0 else upper)[i, at_face] = whole
    return lower, upper, alive


def cut_own(limb: LimbBound, sums: FloatArray, threshold: float) -> LeftOwn:
    """Return the boxes of a limb's own variables for which the sum of all limbs can exceed a threshold.

    Args:
        limb: bounds of the limb.
        sums: (B,) upper bounds of the shared boxes: sums of the limbs' best values and of the common part. Smaller
            bounds from other sources must not be used here, as these do not bound the other limbs.
        threshold: largest bound of a box that is closed.
    """
    own, L, found = limb.own, limb.L, limb.models
    m = len(L.b) - len(own.lower)
    # The other limbs and the common part contribute at most ``sums - best``, so this limb must contribute the rest.
    level = threshold - (sums - limb.best)
    level = level - _SUM * (abs(threshold) + np.abs(sums) + np.abs(limb.best))
    level = np.fmax(np.where(np.isfinite(level), level, -np.inf), limb.reached)
    keep = (limb.bounds > -np.inf) & ~(limb.bounds < level[own.of])
    ends = L.ends_reaching(level[own.of])
    centre = found.centre[m:]
    radius = np.maximum(own.upper - centre, centre - own.lower) * (1 + ULP) + TINY
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
    change = _LINEAR * np.abs(L.b[m:]) + np.abs(L.H[m:]).sum(axis=1) + L.w[m:]
    change = np.where(upper > lower, change * (upper - lower) / width, 0.0)
    change = np.where(np.isfinite(change), change, np.where(upper > lower, upper - lower, 0.0))
    total = change.sum(axis=0)
    spread = np.where(np.isfinite(limb.best), total[limb.top], 0.0)
    is_near = (limb.bounds > (limb.best - _NEAR * total[limb.top])[own.of]) & (total > 0)
    # The centre of the best box becomes the good point if its value is larger.
    best = first_largest_of_lists(found.value, own)
    good = np.where(found.value[best] > limb.value_of_good, centre[:, best], limb.good)
    left = OwnBoxes(lower[:, keep], upper[:, keep], own.of[keep], own.count)
    return LeftOwn(left, spread, good, is_near[keep], first_largest(change.T)[keep])
