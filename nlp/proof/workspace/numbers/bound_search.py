"""Smallest value of a function over a box of poses, from bounds of it over boxes: best-first bisection.

The function is given by an :class:`Oracle`: lower bounds over boxes, and values at points. Its value at a point is an
upper bound of the smallest value, improved by random steps from the best point known; what is proved rests on the
bounds alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from casadi import SX

from .....models import FloatArray
from .....models.arrays import first_largest
from ....interruption import one_search
from ...boxes.search import TOO_SMALL, Boxes, Columns, Effort, Order, Rule, Search, Verdicts, bisected, some
from ...enclosure.forms import Encloser, Forms
from ..ranks.covering import APART, Followed, LoopRule
from ..ranks.loop_boxes import Examiner, LoopBoxes, are_between
from ..ranks.rank_rule import Tested
from ..robot.pose_box import PoseBox
from ..robot.posed_robot import Problem
from ..robot.tolerance_model import ToleranceModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ...boxes.tree import TreeRecord

#: Number of boxes examined at once.
_BLOCK = 512
#: Value below which gaps are parts of this one.
_NEAR_ZERO = 1e-6
#: Random points from which the search of a small value begins, steps from the best of them, and points in each step.
_POINTS, _STEPS, _AROUND = 256, 24, 32
#: Factor of the size of steps from one to the next.
_SHRINK = 0.7
_SEED = 0
#: Of a search that follows loops: number of boxes examined at once, number of those with the smallest bounds at which
#: values are computed, and widths of a box, in parts of the whole box, below which it is not bisected.
_FOLLOWED_BLOCK, _TRIED = 256, 8
_LEAST_WIDTHS = 2.0**-24, 2.0**-24
#: Part of itself by which a value may be off by rounding: the first of several that are the same is taken.
_TIE = 1e-11


class Bounds(NamedTuple):
    """Lower bounds (B,) over boxes, -inf without one, and the share (B, 6) of each coordinate in their slack."""

    lower: FloatArray
    shares: FloatArray


class Oracle(Protocol):
    """Bounds and values of a function of the pose."""

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""

    def values(self, points: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, 6)."""


class Bounded(Protocol):
    """A number of which forms of expressions give bounds.

    Attributes:
        entries: (E, 1) the expressions, in the coordinates of a robot or of all machines.
    """

    entries: SX

    def over(self, forms: Forms, count: int, errors: int) -> Bounds:
        """Return lower bounds over B boxes, and the share (B, f) of each independent coordinate in their slack.

        Args:
            forms: of the entries.
            count: number f of the first terms, which are the independent coordinates.
            errors: number of the last terms, which are errors of joint centres; those between are products of two
                coordinates.
        """


class Number(Bounded, Protocol):
    """A number with bounds and values.

    Attributes:
        family: all machines in whose coordinates the entries are; None for the design alone.
    """

    family: ToleranceModel | None

    def values(self, z: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, n) of the design."""


class OverPoses:
    """Bounds and values of a number of a robot without dependent coordinates.

    Args:
        number: the number.
        problem: the robot.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    def __init__(self, number: Number, problem: Problem) -> None:
        family = number.family
        self._number, self._box, self._free = number, problem.box, list(problem.free)
        # A single pose has no coordinate, and forms need one.
        coordinates = problem.z if family is None else family.coordinates
        self._encloser = Encloser(coordinates if coordinates.numel() else SX.sym("none"), number.entries)
        self._errors = np.zeros(0) if family is None else np.full(family.errors.numel(), family.tolerance)

    def values(self, points: FloatArray) -> FloatArray:
        """Return the values (K,) at points (K, 6)."""
        return self._number.values(points[:, self._free])

    def forms(self, lower: FloatArray, upper: FloatArray) -> Forms:
        """Return forms of the number's entries over boxes (B, 6): coordinates, their products or errors of centres."""
        errors = np.tile(self._errors, (len(lower), 1))
        ends = np.hstack([lower[:, self._free], -errors]).T, np.hstack([upper[:, self._free], errors]).T
        if not len(ends[0]):
            ends = np.zeros((1, len(lower))), np.zeros((1, len(lower)))
        return self._encloser(*ends) if errors.size else self._encloser.second(*ends)

    def bounds(self, lower: FloatArray, upper: FloatArray) -> Bounds:
        """Return lower bounds over boxes (B, 6)."""
        found = self._number.over(self.forms(lower, upper), len(self._free), len(self._errors))
        shares = np.zeros(lower.shape)
        shares[:, self._free] = found.shares
        whole = self._box.upper - self._box.lower
        wide = (upper - lower) / np.where(whole > 0, whole, np.inf)
        return Bounds(found.lower, np.where(shares.any(axis=1, keepdims=True), shares, wide))


class Minimum(NamedTuple):
    """The smallest value of a function over the workspace.

    Attributes:
        bound: proven: no pose, and no machine that is meant, has a smaller value.
        value: the smallest value known; infinite without one.
        at: coordinates of the point that has it.
        boxes, open: number of boxes examined, and of boxes left.
        seconds: wall time.
        reason: for stopping before the gap was met; else empty.
    """

    bound: float
    value: float
    at: FloatArray
    boxes: int
    open: int
    seconds: float
    reason: str


def prove_minimum(
    oracle: Oracle,
    box: PoseBox,
    *,
    gap: float,
    limit: float | None = None,
    slack: float = 0.0,
    time_limit: float | None = None,
    recorder: TreeRecord | None = None,
) -> Minimum:
    """Prove the smallest value of a function over a box of poses.

    Args:
        oracle: the function.
        box: the poses.
        gap: allowed distance of the bound from the best value known, in the function's unit.
        limit: the search ends, with a wider gap, once the bound is at least this, and not before, whatever the gap is,
            while no value below it is known.
        slack: how far a value may be below the limit and still count as on it.
        time_limit: seconds after which the search stops with the bound reached.
        recorder: records the boxes for a proof; every leaf has a bound of at least that of the result.
    """
    with one_search(time_limit):
        rule = _OracleRule(oracle, box, Goal(gap, limit, slack), recorder)
        lower, upper = box.lower[None], box.upper[None]
        root = Boxes(lower, upper, np.array([math.inf]), rule.split(lower, upper, oracle.bounds(lower, upper)), ())
        return searched(rule, root, box.upper - box.lower, (0.0, 0.0))


class Goal(NamedTuple):
    """The bound that a search of a smallest value is to reach.

    Attributes:
        gap: allowed distance of the bound from the smallest value known.
        limit: the search ends once the bound is at least this; None without one.
        slack: how far a value may be below the limit and still count as on it.
        is_relative: whether the gap is a part of the value, and is to be met where the limit is decided too.
    """

    gap: float
    limit: float | None
    slack: float
    is_relative: bool = False

    def bounds(self, value: float) -> tuple[float, float]:
        """Return the bounds at which a box is closed, and at which the search ends, for the smallest value known."""
        gap = self.gap * max(abs(value), _NEAR_ZERO) if self.is_relative else self.gap
        met = value - gap if math.isfinite(value) else math.inf
        if self.limit is None or value < self.limit - self.slack:
            return met, met
        undecided = self.limit if value >= self.limit else self.limit - self.slack
        closing = max(met, undecided) if math.isfinite(met) else undecided
        return closing, closing if self.is_relative else undecided


class Value(NamedTuple):
    """A value, and the point that has it."""

    value: float
    at: FloatArray


class SmallestValue(Rule[Columns]):
    """Rule of the smallest value of a function over boxes; what is maximised is its negative.

    Args:
        goal: the bound that is to be reached.
        best: the smallest value known.
    """

    def __init__(self, goal: Goal, best: Value) -> None:
        self._goal, self.best = goal, best

    def verdicts(self, left: Boxes[Columns]) -> Verdicts[Columns]:
        """Close boxes whose bounds are good enough."""
        done = -left.bound >= self._goal.bounds(self.best.value)[0]
        return Verdicts(some(left, ~done), float(left.bound[done].max(initial=-math.inf)), len(left.split))

    def ending(self, search: Search[Any]) -> Callable[[], str | None]:
        """Return the function that ends a search: at its goal, or at a box that is too small for it."""

        def reason() -> str | None:
            state = search.state
            if -search.bound >= self._goal.bounds(self.best.value)[1]:
                return ""
            small = max((float(each.bound.max()) for each in state.small), default=-math.inf)
            return TOO_SMALL if state.small and small >= search.bound else None

        return reason


def searched(
    rule: SmallestValue[Columns], root: Boxes[Columns], whole: FloatArray, least: tuple[float, float]
) -> Minimum:
    """Return the smallest value that a rule finds from a root, the boxes with the smallest bounds first.

    Args:
        rule: the rule.
        root: one box.
        whole: (n,) its widths.
        least: parts of them below which a box is not bisected, and is put last.
    """
    effort = Effort()
    search = Search(rule, root, whole=whole, least=least, order=Order.LARGEST)
    reason = effort.run(search, rule.ending(search))
    value, at = rule.best
    return Minimum(min(-search.bound, value), value, at, search.boxes, search.left, effort.seconds, reason)


class _OracleRule(SmallestValue[tuple[()]]):
    """Rule of a function of the pose."""

    block = _BLOCK

    def __init__(self, oracle: Oracle, box: PoseBox, goal: Goal, recorder: TreeRecord | None) -> None:
        super().__init__(goal, _good_point(oracle, box))
        self._oracle, self._box, self._recorder = oracle, box, recorder

    @staticmethod
    def split(lower: FloatArray, upper: FloatArray, found: Bounds) -> NDArray[np.intp]:
        """Return the coordinates (B,) with the largest shares in the slack of the bounds of boxes."""
        return first_largest(np.where(upper > lower, found.shares, -1.0))

    def divided(self, boxes: Boxes[tuple[()]]) -> Boxes[tuple[()]]:
        """Return the halves of boxes."""
        if self._recorder is not None:
            self._recorder.cuts(boxes.lower, boxes.upper, boxes.split)
        return bisected(boxes)

    def examine(self, boxes: Boxes[tuple[()]]) -> Verdicts[tuple[()]]:
        """Return bounds of boxes, contracted to the workspace, and take note of small values in them."""
        parts = self._box.contracted(boxes.lower, boxes.upper)
        if self._recorder is not None:
            self._recorder.contractions((boxes.lower, boxes.upper), (parts.lower, parts.upper), parts.outside)
        kept = ~parts.outside
        lower, upper = parts.lower[kept], parts.upper[kept]
        found = self._oracle.bounds(lower, upper)
        centres = self._box.clipped(0.5 * lower + 0.5 * upper)
        values = self._oracle.values(centres)
        if len(values) and is_smaller(float(np.fmin.reduce(values)), self.best.value):
            best = first_smallest(values)
            self.best = Value(float(values[best]), centres[best])
        bound = np.fmin(-found.lower, boxes.bound[kept])
        return self.verdicts(Boxes(lower, upper, bound, self.split(lower, upper, found), ()))


def is_smaller(value: float, known: float) -> bool:
    """Return whether a value is smaller than a known one by more than rounding."""
    return value < (known - _TIE * abs(known) if math.isfinite(known) else known)


def first_smallest(values: FloatArray) -> int:
    """Return the place of the first of the smallest values (K,), up to rounding; NaN are left out."""
    least = float(np.fmin.reduce(values))
    return int(np.argmax(values <= least + _TIE * abs(least)))


def _good_point(oracle: Oracle, box: PoseBox) -> Value:
    """Return a small value."""
    rng = np.random.default_rng(_SEED)
    points = np.concatenate([box.random(_POINTS, rng), _corners(box)])
    values = oracle.values(points)
    best = first_smallest(values)
    y, value, step = points[best], float(values[best]), 0.3
    for _ in range(_STEPS):
        around = box.clipped(y + step * (box.upper - box.lower) * rng.normal(size=(_AROUND, 6)))
        values = oracle.values(around)
        best = first_smallest(values)
        if is_smaller(float(values[best]), value):
            y, value = around[best], float(values[best])
        else:
            step *= _SHRINK
    return Value(value, y)


def _corners(box: PoseBox) -> FloatArray:
    """Return the corners (64, 6) of the box, moved into the workspace."""
    sides = np.array(np.meshgrid(*[[0, 1]] * 6)).reshape(6, -1).T
    return box.clipped(box.lower + sides * (box.upper - box.lower))


class _NumberTest:
    """A number as a test of boxes: its bounds are their smallest values."""

    def __init__(self, number: Bounded) -> None:
        self.entries, self._number = number.entries, number

    def examine(self, forms: Forms, f: int) -> Tested:
        """Return the lower bounds of boxes; none is regular."""
        found = self._number.over(forms, f, forms.a.shape[2] - f)
        none = np.zeros(len(found.lower), dtype=np.int32)
        return Tested(none.astype(bool), np.nan_to_num(found.shares), found.lower, none)


class FollowedRule(LoopRule, SmallestValue[Followed]):
    """Rule of a number of a robot whose dependent coordinates are followed, or of all machines.

    Args:
        problem: the robot.
        family: all machines that are meant; None for the design alone.
        number: the number, in the coordinates of the problem or of the machines.
        smallest_in: returns the smallest value known at points of boxes.
        goal: the bound that is to be reached.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """

    block = _FOLLOWED_BLOCK

    def __init__(
        self,
        problem: Problem,
        family: ToleranceModel | None,
        number: Bounded,
        smallest_in: Callable[[LoopBoxes], Value | None],
        goal: Goal,
    ) -> None:
        LoopRule.__init__(self, problem, Examiner(problem, _NumberTest(number), family))
        SmallestValue.__init__(self, goal, Value(math.inf, problem.start if family is None else family.start))
        self._smallest_in = smallest_in

    def examine(self, boxes: Boxes[Followed]) -> Verdicts[Followed]:
        """Return bounds of boxes, and take note of small values in them."""
        found = self.examined(boxes)
        known = np.flatnonzero(found.boxes.is_known & np.isfinite(found.smallest))
        if known.size:
            order = np.argsort(found.smallest[known])[:_TRIED]
            best = self._smallest_in(some(found.boxes, known[order]))
            if best is not None and best.value < self.best.value:
                self.best = best
        width = self.widths(found)
        score = found.shares * np.sqrt(width / width.max(axis=1, keepdims=True))
        split = first_largest(np.where(width > 0, score, -1.0))
        # Nothing is known of a box in which dependent coordinates are not.
        bound = np.where(found.boxes.is_known, -found.smallest, np.inf)
        return self.verdicts(self.boxes_of(found, bound, split))

    def minimum(self) -> Minimum:
        """Return the smallest value over the workspace."""
        found = searched(self, self.root, self.whole, _LEAST_WIDTHS)
        if not math.isfinite(found.bound):
            return found._replace(bound=-math.inf)
        return found if self.is_one_assembly() else found._replace(bound=-math.inf, reason=APART)


def smallest_number(
    number: Number,
    problem: Problem,
    *,
    gap: float,
    limit: float | None = None,
    slack: float = 0.0,
    recorder: TreeRecord | None = None,
) -> Minimum:
    """Prove the smallest value of a number of a robot over its poses; the point found is that of a pose (6,).

    Args:
        number: the number.
        problem: the robot.
        gap: allowed distance of the bound from the best value known, in the number's unit.
        limit: the search ends once the bound is at least this.
        slack: how far a value may be below the limit and still count as on it.
        recorder: records the boxes for a proof, without dependent coordinates.

    Raises:
        UncoveredError: an expression holds an operation without a rule.
    """
    if not problem.dependent:
        over = OverPoses(number, problem)
        return prove_minimum(over, problem.box, gap=gap, limit=limit, slack=slack, recorder=recorder)
    loops, D, box = problem.loops, list(problem.dependent), problem.box

    def smallest_in(boxes: LoopBoxes) -> Value | None:
        """Return the smallest value of the design in the middle of boxes."""
        z = loops.all_closed(boxes.centre.T, D).T
        inside = are_between(z, boxes, D) & np.array([box.holds(each) for each in problem.pose_of(z)])
        values = np.where(inside, number.values(np.where(inside[:, None], z, problem.start)), np.nan)
        k = first_smallest(values) if np.isfinite(values).any() else -1
        return None if k < 0 else Value(float(values[k]), z[k])

    with one_search():
        found = FollowedRule(problem, number.family, number, smallest_in, Goal(gap, limit, slack)).minimum()
    return found._replace(at=problem.pose_of(found.at[: len(problem.start)]))
