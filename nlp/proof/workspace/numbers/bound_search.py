"""Branch and bound for the smallest values of quantities of a robot over a workspace.

A :class:`Number` has lower bounds over boxes, and values at points. Values at points only guide the search; proofs use
the bounds. For one quantity, boxes with the smallest bounds are bisected first. Several quantities with limits share
one cover of boxes, as closing the loops over boxes takes longer than bounding quantities.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from casadi import SX

from .....models import FloatArray
from ....interruption import one_search
from ...boxes.search import TOO_SMALL, Boxes, BoxResults, Effort, Order, joined, some
from ...boxes.tree import TreeRecord
from ...enclosure.forms import Forms
from ..ranks.loop_boxes import (
    APART,
    Examined,
    Examiner,
    Followed,
    LoopBoxes,
    LoopRule,
    are_between,
    coordinates_to_split,
)
from ..ranks.rank_rule import Tested, not_regular
from ..robot.path_cover import PathCover, Place
from ..robot.posed_robot import Problem

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Number of boxes examined at once, and number of boxes with the smallest bounds at which values are computed.
_BLOCK, _TRIED = 256, 8
#: Fraction of the largest known absolute value; for smaller values, gaps are relative to this fraction.
_NEAR_ZERO = 1e-6
#: Search for small values: number of random points at the start, number of steps from the best point, and number of
#: points per step.
_POINTS, _STEPS, _AROUND = 256, 24, 32
#: Factor of the step size from one step to the next.
_SHRINK = 0.7
_SEED = 0
#: Relative difference of values that counts as rounding; the first of equal values is taken.
_TIE = 1e-11


class Bounds(NamedTuple):
    """Lower bounds of K quantities over B boxes.

    Attributes:
        lower: (B, K) lower bounds; -inf without a bound.
        shares: (B, K, f) share of each coordinate in the overestimation of each quantity.
    """

    lower: FloatArray
    shares: FloatArray


class Number(ABC):
    """K quantities of a robot for branch and bound: lower bounds over boxes, and values at points.

    Args:
        problem: the nominal robot, or all robots within the tolerance.
        entries: (E, 1) expressions of the problem's coordinates; bounds are computed from their forms.
        count: number K of quantities.

    Attributes:
        problem, entries, count: the arguments.
        unknown: (K,) values that stand for unknown bounds over a box.
        levels: (K,) bounds at which a box is closed; a quantity with a larger bound does not influence the bisection.
    """

    def __init__(self, problem: Problem, entries: SX, count: int = 1) -> None:
        self.problem, self.entries, self.count = problem, entries, count
        self.unknown, self.levels = np.full(count, -np.inf), np.full(count, np.inf)

    @abstractmethod
    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over B boxes.

        Args:
            forms: forms of the entries.
            count: number f of independent coordinates. The terms of each form have this order: these coordinates,
                products of two of them, joint-centre errors.
        """

    @abstractmethod
    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (P, K) at points (P, n) with closed loops."""

    @cached_property
    def examiner(self) -> Examiner:
        """Examiner of boxes; its results have the bounds of the quantities in ``smallest``.

        Raises:
            UncoveredError: an expression has an operation without an interval rule.
        """
        return Examiner(self.problem, self)

    def examine(self, forms: Forms, f: int, errors: int) -> Tested:  # noqa: ARG002 - the problem has them
        """Return the lower bounds (B, K) of boxes; no box counts as regular."""
        lower, shares = self.over(forms, f)
        shares = np.nan_to_num(shares, posinf=0.0)
        shares /= np.maximum(shares.sum(axis=2, keepdims=True), np.finfo(float).tiny)
        return not_regular((shares * ~(lower >= self.levels)[:, :, None]).sum(axis=1), lower)

    def bounds(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return lower bounds (B, K) over boxes (B, n) of the nominal robot, without dependent coordinates."""
        tolerance = np.full((len(lower), len(self.problem.of_errors)), self.problem.tolerance)
        ends = np.hstack([lower, -tolerance]), np.hstack([upper, tolerance])
        return self.examiner.examine(LoopBoxes(*ends, ends[0], np.ones(len(lower), dtype=bool))).smallest

    def near(self, boxes: LoopBoxes, which: NDArray[np.intp]) -> FloatArray:  # noqa: ARG002 - for numbers with slopes
        """Return points (S, P, n) at which quantity ``which[k]`` may be small in box k of P; NaN with open loops."""
        return self.closed(boxes.centre)[None]

    def closed(self, z: FloatArray) -> FloatArray:
        """Return points (P, n) with closed loops near given points; NaN where the loops do not close."""
        return self.problem.loops.all_closed(z.T, list(self.problem.dependent)).T if self.problem.dependent else z


class Minimum(NamedTuple):
    """Smallest value of a quantity over a workspace.

    Attributes:
        bound: proved lower bound over all poses and all robots within the tolerance; -inf without a proof.
        value: smallest known value; infinite if no value is known.
        at: coordinates of the point with this value.
        boxes, open: number of examined boxes, and of open boxes at the end.
        seconds: wall time.
        reason: reason why the search stopped before the gap was reached; otherwise empty.
        place: segment and parameter of the point on a path; None for a box of poses.
    """

    bound: float = -math.inf
    value: float = math.inf
    at: FloatArray = np.zeros(0)
    boxes: int = 0
    open: int = 0
    seconds: float = 0.0
    reason: str = ""
    place: Place | None = None


class Goal(NamedTuple):
    """Goal of a search for a smallest value.

    Attributes:
        gap: allowed absolute difference between the smallest known value and the bound.
        part: allowed relative difference, in addition to ``gap``.
        limit: lower limit of the quantity; None without a limit. The bound must reach the limit unless a smaller value
            is known.
        slack: violation of the limit that counts as rounding.
        is_enough: If true, a bound that reaches the limit is sufficient, whatever its gap.
    """

    gap: float = 0.0
    part: float = 0.0
    limit: float | None = None
    slack: float = 0.0
    is_enough: bool = True

    def levels(self, value: float, size: float) -> tuple[float, float]:
        """Return the bounds at which a box is closed, and at which the search ends.

        Args:
            value: smallest known value.
            size: largest known absolute value of the quantity.
        """
        met = value - self.gap - self.part * max(abs(value), _NEAR_ZERO * size) if math.isfinite(value) else math.inf
        if self.limit is None or value < self.limit - self.slack:
            return met, met
        decided = self.limit if value >= self.limit else self.limit - self.slack
        closing = max(met, decided) if math.isfinite(met) else decided
        return closing, decided if self.is_enough else closing


class _Best(NamedTuple):
    """Smallest known values of the quantities of a search.

    Attributes:
        value: (K,) smallest known values; infinite if no value is known.
        at: (K, n) points with these values.
        where: (K, 2) segments and parameters of the points on a path.
    """

    value: FloatArray
    at: FloatArray
    where: FloatArray


class SmallestValues(LoopRule):
    """Rule of branch and bound for the smallest values of quantities; boxes store their bounds.

    Args:
        number: the quantities.
        goals: goal of each quantity.
        recorder: recorder of the boxes for a proof.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
    """

    def __init__(self, number: Number, goals: Sequence[Goal], recorder: TreeRecord | None = None) -> None:
        super().__init__(number.problem, number.examiner, recorder)
        self._number, self._goals, self._more = number, goals, number.unknown[None]
        self.block = _BLOCK if number.problem.dependent else 2 * _BLOCK
        K, start = len(goals), number.problem.start
        self._best = _Best(np.full(K, np.inf), np.tile(start, (K, 1)), np.zeros((K, 2)))
        self._closed, self._sizes = np.full(K, np.inf), np.zeros(K)
        cover = self._problem.cover
        if cover is not None:
            self._start_from_path(cover)
        elif not self._problem.dependent:
            self._start_from_poses()

    def _levels(self) -> FloatArray:
        """Return the bounds (K,) at which a box is closed: the bound of every quantity must reach its level."""
        known = self._best.value.tolist(), self._sizes.tolist()
        pairs = [goal.levels(*each) for goal, *each in zip(self._goals, *known, strict=True)]
        return np.array(pairs)[:, 1 if len(pairs) > 1 else 0]

    def examine(self, boxes: Boxes[Followed]) -> BoxResults[Followed]:
        """Return bounds of boxes, and update the best known values from points in them."""
        self._number.levels = self._levels()
        found = self.examined(boxes)
        if not self._sizes.all():  # The bounds give a size to a quantity whose known values are all 0.
            bounds = np.where(np.isfinite(found.smallest), np.abs(found.smallest), 0.0)
            self._sizes = np.maximum(self._sizes, bounds.max(axis=0, initial=0.0))
        self._try(found)
        done = found.boxes.is_known & (found.smallest >= self._levels()).all(axis=1)
        self._closed = np.minimum(self._closed, found.smallest[done].min(axis=0, initial=np.inf))
        left = some(found, np.flatnonzero(~done))
        width = self.widths(left.boxes)
        widest = width.max(axis=1, keepdims=True, initial=0.0)
        # Bounds over long and narrow boxes are weak, especially with loops. The box of a dwell has width 0.
        split = coordinates_to_split(left.shares * np.sqrt(width / np.where(widest > 0, widest, 1.0)), width)
        parts = self.boxes_of(left, (-left.smallest).max(axis=1), split, left.smallest)
        return BoxResults(parts, -float(found.smallest[done].min(initial=np.inf)), len(done))

    def _try(self, found: Examined) -> None:
        """Update the best known values in the boxes with the smallest bounds of each quantity."""
        known, count = np.flatnonzero(found.boxes.is_known), len(self._goals)
        if not known.size:
            return
        rows = np.argsort(found.smallest[known], axis=0, kind="stable")[: max(1, _TRIED // count)].T
        which, boxes = np.repeat(np.arange(count), rows.shape[1]), some(found.boxes, known[rows.ravel()])
        with np.errstate(all="ignore"):
            cover = self._problem.cover
            if cover is not None:
                self._note_on_path(cover, boxes, found.along[known[rows.ravel()]])
                return
            sets = self._number.near(boxes, which)
            every = some(boxes, np.tile(np.arange(len(which)), len(sets)))
            z, problem = sets.reshape(-1, sets.shape[2]), self._problem
            inside = np.isfinite(z).all(axis=1) & are_between(z, every, problem.dependent)
            inside[inside] = problem.box.holds(problem.pose_of(z[inside]))
        self._note(z[inside])

    def _start_from_path(self, cover: PathCover) -> None:
        """Update the best known values at ends of segments; with dependent coordinates only at the first point."""
        if self._problem.dependent:
            self._note(self._problem.start[None], np.zeros((1, 2)))
            return
        for rows in cover.blocks():
            self._note_on_path(
                cover, some(self._start, np.arange(*rows.indices(len(cover.pieces)))), cover.pieces[rows]
            )

    def _note_on_path(self, cover: PathCover, boxes: LoopBoxes, along: FloatArray) -> None:
        """Update the best known values at the ends and middles of pieces of a path with known boxes."""
        for part in (0.0, 0.5, 1.0):
            z = boxes.near.copy()
            z[:, self._problem.of_path] = self._problem.path_points(cover, along, part)
            z, s = self._number.closed(z), along[:, 1] + part * (along[:, 2] - along[:, 1])
            kept = np.isfinite(z).all(axis=1) & are_between(z, boxes, self._problem.dependent)
            self._note(z[kept], np.stack([along[kept, 0], s[kept]], axis=1))

    def _start_from_poses(self) -> None:
        """Update the best known values at random poses, at corners, and near the poses with the smallest values."""
        box, free, rng, step = self._problem.box, list(self._problem.free), np.random.default_rng(_SEED), 0.3
        sides = np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T
        points = np.concatenate([box.random(_POINTS, rng), box.clipped(box.lower + sides * (box.upper - box.lower))])
        for _ in range(1 + _STEPS):
            before = self._best
            z = np.tile(before.at[0], (len(points), 1))
            z[:, : len(free)] = points[:, free]
            self._note(z)
            step *= _SHRINK if self._best is before else 1.0
            y = self._problem.pose_of(self._best.at[0])
            points = box.clipped(y + step * (box.upper - box.lower) * rng.normal(size=(_AROUND, 6)))

    def _note(self, z: FloatArray, where: FloatArray | None = None) -> None:
        """Update the best known values at points (P, n) with places (P, 2) on a path."""
        if not len(z):
            return
        known, at, places = self._best
        with np.errstate(all="ignore"):
            values = self._number.values(z)
            values = np.where(np.isfinite(values), values, np.inf)
            least = values.min(axis=0)
            self._sizes = np.maximum(self._sizes, np.where(np.isfinite(values), np.abs(values), 0.0).max(axis=0))
            better = np.isfinite(least) & ~(least >= known - _TIE * np.abs(known))
            first = np.argmax(values <= least + _TIE * np.abs(least), axis=0)
        if better.any():
            places = places if where is None else np.where(better[:, None], where[first], places)
            self._best = _Best(np.where(better, least, known), np.where(better[:, None], z[first], at), places)

    def is_one_assembly(self) -> bool:
        """Return whether all boxes are provably in the assembly mode of the start of the search."""
        # A path may return to a pose in another assembly mode, for example after full turns of joints.
        if not self._roots or self._problem.cover is not None:
            return super().is_one_assembly()
        roots, start = joined(self._roots), self._problem.start
        inside = (roots.lower <= start) & (roots.upper >= start)
        here, same = (inside[:, list(which)].all(axis=1) for which in (self._independent, self._problem.dependent))
        return bool((same | ~here).all()) and super().is_one_assembly()

    def minima(self) -> list[Minimum]:
        """Search the workspace; return the smallest value of each quantity."""
        effort, is_one = Effort(), len(self._goals) == 1
        search = self.search(Order.LARGEST if is_one else Order.NEWEST)

        def ending() -> str | None:
            if is_one and -search.bound >= self._goals[0].levels(float(self._best.value[0]), float(self._sizes[0]))[1]:
                return ""
            small = max((float(each.bound.max()) for each in search.state.small), default=-math.inf)
            return TOO_SMALL if search.state.small and (small >= search.bound or not is_one) else None

        reason = effort.run(search, ending)
        bounds = np.min([self._closed, *(each.more.more.min(axis=0) for each in search.state.left)], axis=0)
        values, until = self._best.value, self.assembled_until()
        if self._problem.cover is None and np.isfinite(bounds).any() and not self.is_one_assembly():
            reason, bounds = APART, np.full(len(bounds), -np.inf)
        elif until < (math.inf, 0.0):
            # Boxes beyond this place may be in another assembly mode, with other values.
            reason, bounds = reason or APART, np.full(len(bounds), -np.inf)
            is_beyond = [tuple(where) > until for where in self._best.where.tolist()]
            values = np.where(is_beyond, np.inf, values)
        return [
            Minimum(
                min(bound, value) if bound < math.inf else -math.inf,
                *(value, at, search.boxes, search.left, effort.seconds, reason),
                None if self._problem.cover is None else Place(int(where[0]), float(where[1])),
            )
            for bound, value, at, where in zip(bounds.tolist(), values.tolist(), *self._best[1:], strict=True)
        ]


def smallest_values(number: Number, goals: Sequence[Goal], recorder: TreeRecord | None = None) -> list[Minimum]:
    """Prove the smallest values of quantities of a robot over its poses.

    Args:
        number: K quantities.
        goals: goal of each quantity.
        recorder: recorder of the boxes for a proof, for robots without dependent coordinates. The bound of every leaf
            is at least the bound of the result.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
    """
    with one_search():
        return SmallestValues(number, goals, recorder).minima()
