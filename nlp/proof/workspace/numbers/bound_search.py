"""Smallest values of numbers of a robot over a workspace, from bounds of them over boxes: bisection.

A :class:`Number` has lower bounds over boxes, and values at points. A value at a point is an upper bound of the
smallest one; proofs rest on the bounds alone. One number is searched with the boxes of the smallest bounds first.
Several with limits share one cover by boxes: following closed loops there costs more than bounds of numbers.
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

#: Number of boxes examined at once, and number of those with the smallest bounds at which values are computed.
_BLOCK, _TRIED = 256, 8
#: Part of the largest value known below which gaps are parts of this one.
_NEAR_ZERO = 1e-6
#: Random points from which the search of a small value begins, steps from the best of them, and points in each step.
_POINTS, _STEPS, _AROUND = 256, 24, 32
#: Factor of the size of steps from one to the next.
_SHRINK = 0.7
_SEED = 0
#: Part of itself by which a value may be off by rounding: the first of several that are the same is taken.
_TIE = 1e-11


class Bounds(NamedTuple):
    """Lower bounds (B, K) over boxes, -inf without one, and the shares (B, K, f) of coordinates in their slack."""

    lower: FloatArray
    shares: FloatArray


class Number(ABC):
    """K numbers of a robot whose smallest values are looked for: a test of boxes, and values at points.

    Args:
        problem: the design, or all machines that are meant.
        entries: (E, 1) expressions of its coordinates whose forms give bounds.
        count: K.

    Attributes:
        problem, entries, count: as given.
        unknown: (K,) bounds over a box of which nothing is known.
        levels: (K,) bounds from which on a number has no part in where boxes are bisected.
    """

    def __init__(self, problem: Problem, entries: SX, count: int = 1) -> None:
        self.problem, self.entries, self.count = problem, entries, count
        self.unknown, self.levels = np.full(count, -np.inf), np.full(count, np.inf)

    @abstractmethod
    def over(self, forms: Forms, count: int) -> Bounds:
        """Return lower bounds over B boxes.

        Args:
            forms: of the entries.
            count: number f of the first terms, which are the independent coordinates. The last terms are the errors of
                joint centres; those between are products of two coordinates.
        """

    @abstractmethod
    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (P, K) at closed points (P, n)."""

    @cached_property
    def examiner(self) -> Examiner:
        """The examination of boxes by bounds of the numbers, which are the ``smallest`` of its results.

        Raises:
            UncoveredError: an expression holds an operation without a rule.
        """
        return Examiner(self.problem, self)

    def examine(self, forms: Forms, f: int, errors: int) -> Tested:  # noqa: ARG002 - they are those of the problem
        """Return the lower bounds (B, K) of boxes; none is regular."""
        lower, shares = self.over(forms, f)
        shares = np.nan_to_num(shares, posinf=0.0)
        shares /= np.maximum(shares.sum(axis=2, keepdims=True), np.finfo(float).tiny)
        return not_regular((shares * ~(lower >= self.levels)[:, :, None]).sum(axis=1), lower)

    def bounds(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Return lower bounds (B, K) over boxes (B, n) of the design, without dependent coordinates."""
        tolerance = np.full((len(lower), len(self.problem.of_errors)), self.problem.tolerance)
        ends = np.hstack([lower, -tolerance]), np.hstack([upper, tolerance])
        return self.examiner.examine(LoopBoxes(*ends, ends[0], np.ones(len(lower), dtype=bool))).smallest

    def near(self, boxes: LoopBoxes, which: NDArray[np.intp]) -> FloatArray:  # noqa: ARG002 - for numbers with slopes
        """Return points (S, P, n) at which number ``which[k]`` may be small in box k of P, closed or NaN."""
        return self.closed(boxes.centre)[None]

    def closed(self, z: FloatArray) -> FloatArray:
        """Return points (P, n) with closed loops near points; one that does not close is NaN."""
        return self.problem.loops.all_closed(z.T, list(self.problem.dependent)).T if self.problem.dependent else z


class Minimum(NamedTuple):
    """The smallest value of a number over a workspace.

    Attributes:
        bound: proven: no pose, and no machine that is meant, has a smaller value; -inf where nothing is proved.
        value: the smallest value known; infinite without one.
        at: coordinates of the point that has it.
        boxes, open: number of boxes examined, and of boxes left.
        seconds: wall time.
        reason: for stopping before the gap was met; else empty.
        place: segment of a path, and its parameter, of the point that has the value; None for a workspace.
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
    """The bound that a search of a smallest value is to reach.

    Attributes:
        gap: allowed distance of the bound from the smallest value known.
        part: the same as a part of the value, which is added.
        limit: a bound of this is enough while no smaller value is known, and not less; None without one.
        slack: how far a value may be below the limit and still count as on it.
        is_enough: whether such a bound is enough whatever the gap is.
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
            size: largest known size of the quantity.
        """
        met = value - self.gap - self.part * max(abs(value), _NEAR_ZERO * size) if math.isfinite(value) else math.inf
        if self.limit is None or value < self.limit - self.slack:
            return met, met
        decided = self.limit if value >= self.limit else self.limit - self.slack
        closing = max(met, decided) if math.isfinite(met) else decided
        return closing, decided if self.is_enough else closing


class _Best(NamedTuple):
    """The smallest values (K,) known, infinite without one, the points (K, n) that have them, and places (K, 2)."""

    value: FloatArray
    at: FloatArray
    where: FloatArray


class SmallestValues(LoopRule):
    """Rule of the smallest values of numbers; boxes carry their bounds.

    Args:
        number: the numbers.
        goals: the bounds that are to be reached.
        recorder: records the boxes for a proof.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
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
        """Return the bounds (K,) at which boxes are closed: of several numbers those that are enough."""
        known = self._best.value.tolist(), self._sizes.tolist()
        pairs = [goal.levels(*each) for goal, *each in zip(self._goals, *known, strict=True)]
        return np.array(pairs)[:, 1 if len(pairs) > 1 else 0]

    def examine(self, boxes: Boxes[Followed]) -> BoxResults[Followed]:
        """Return bounds of boxes, and take note of small values in them."""
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
        # Bounds over long and narrow boxes are wide, those of loops above all. A box of a dwell has no width.
        split = coordinates_to_split(left.shares * np.sqrt(width / np.where(widest > 0, widest, 1.0)), width)
        parts = self.boxes_of(left, (-left.smallest).max(axis=1), split, left.smallest)
        return BoxResults(parts, -float(found.smallest[done].min(initial=np.inf)), len(done))

    def _try(self, found: Examined) -> None:
        """Take note of values in the boxes with the smallest bounds of each number."""
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
        """Take note of values at the ends of segments; of a robot with dependent coordinates at the first one."""
        if self._problem.dependent:
            self._note(self._problem.start[None], np.zeros((1, 2)))
            return
        for rows in cover.blocks():
            self._note_on_path(
                cover, some(self._start, np.arange(*rows.indices(len(cover.pieces)))), cover.pieces[rows]
            )

    def _note_on_path(self, cover: PathCover, boxes: LoopBoxes, along: FloatArray) -> None:
        """Take note of values at the ends and in the middle of pieces of a path, where their boxes are known."""
        for part in (0.0, 0.5, 1.0):
            z = boxes.near.copy()
            z[:, self._problem.of_path] = self._problem.path_points(cover, along, part)
            z, s = self._number.closed(z), along[:, 1] + part * (along[:, 2] - along[:, 1])
            kept = np.isfinite(z).all(axis=1) & are_between(z, boxes, self._problem.dependent)
            self._note(z[kept], np.stack([along[kept, 0], s[kept]], axis=1))

    def _start_from_poses(self) -> None:
        """Take note of values at random poses and at corners, and near the best of them; without dependent ones."""
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
        """Take note of the values at points (P, n), and of their places (P, 2) on a path."""
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
        """Return whether all boxes surely have the assembly of the middle, or of the first point of a path."""
        # A path may come back to a pose with other joints, such as those that have turned all round.
        if not self._roots or self._problem.cover is not None:
            return super().is_one_assembly()
        roots, start = joined(self._roots), self._problem.start
        inside = (roots.lower <= start) & (roots.upper >= start)
        here, same = (inside[:, list(which)].all(axis=1) for which in (self._independent, self._problem.dependent))
        return bool((same | ~here).all()) and super().is_one_assembly()

    def minima(self) -> list[Minimum]:
        """Search the workspace; return the smallest value of each number."""
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
            # Joints beyond may be those of another assembly, and so are numbers.
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
    """Prove the smallest values of numbers of a robot over its poses.

    Args:
        number: K numbers.
        goals: K bounds that are to be reached.
        recorder: records the boxes for a proof, without dependent coordinates; every leaf has a bound of at least that
            of the result.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    with one_search():
        return SmallestValues(number, goals, recorder).minima()
