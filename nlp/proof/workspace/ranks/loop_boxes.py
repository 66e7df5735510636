"""Boxes of a search in which the independent coordinates determine the dependent coordinates, in one assembly mode.

Each pose of a box has exactly one point with closed loops within the bounds of the dependent coordinates. This point
moves continuously with the pose. Two boxes with a common pose are in the same assembly mode if both have the same
point at this pose. All boxes are in one assembly mode if a chain of such pairs connects each box with the first box.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import casadi as ca
import numpy as np
from casadi import SX

from .....models import FloatArray
from .....models.arrays import first_largest
from ....evidence.closed_loops import inverses
from ...boxes.search import SMALL, Boxes, Order, Rule, Search, bisected, joined, some
from ...boxes.tree import TreeRecord
from ...enclosure.forms import Encloser, Forms
from ..path_trees import record_halves
from ..robot.path_cover import PathCover
from ..robot.posed_model import RankMatrix
from ..robot.posed_robot import Problem
from .followed import closed_along
from .krawczyk import Coordinates, Relation, by_centres, no_relation, relation_of, with_relation
from .rank_rule import EntryChange, RankTest, Tested, is_polynomial, not_regular

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Factors that widen estimates of widths of dependent coordinates: the first estimate, from slopes at the middle of a
#: box, and later ones, from the relation of the attempt before.
_WIDER, _AGAIN = 1.1, 1.05
#: Relative widths of a box below which it is not bisected.
_LEAST_WIDTHS = 2.0**-24, 2.0**-24
#: Number of attempts to find widths of dependent coordinates that the operator proves.
_ATTEMPTS = 8
#: Smallest relative half width of a dependent coordinate, well above rounding.
_LEAST = 1e-10
#: Largest relative half width of a dependent coordinate; a wider box is bisected first.
_MOST = 1.0
#: Relative outward shift of a bound of a dependent coordinate, for rounding.
_ROUNDING = 1e-14
#: Outward factor of a sum, for rounding.
_UP = 1 + 1e-12
#: Relative width of a coordinate along a path (absolute for small rotations) that counts as 0.
_FIXED = 1e-11
#: Fraction of their width by which computed dependent coordinates may exceed their bounds, for rounding of Newton's
#: method.
_CLOSE = 1e-9
#: Number of contractions of the box about the point on the common face of two boxes; each contraction squares its
#: width.
_CONTRACTIONS = 3
#: Reason why a claim stays open although every box is closed.
APART = "neighbouring boxes are not proved to have the same assembly mode"
#: Largest number of independent coordinates with second-order forms: poses of a path, and their rates.
_MOST_SECOND = 14
#: Number of boxes above which not all pairs are compared, and number of pairs that are compared at once.
_MANY, _PAIRS = 6000, 512


class LoopBoxes(NamedTuple):
    """B boxes with bounds of their dependent coordinates.

    Attributes:
        lower, upper: (B, n) bounds of all coordinates; NaN for dependent coordinates that are not known yet.
        near: (B, n) point with closed loops in or near the box.
        is_known: (B,) whether each pose of the box provably has exactly one point with closed loops within these
            bounds.
    """

    lower: FloatArray
    upper: FloatArray
    near: FloatArray
    is_known: NDArray[np.bool_]

    @property
    def centre(self) -> FloatArray:
        """Centres (B, n)."""
        return np.clip(0.5 * self.lower + 0.5 * self.upper, self.lower, self.upper)


class Examined(NamedTuple):
    """Results of the examination of B boxes.

    Attributes:
        boxes: the boxes, with their dependent coordinates if known.
        relation: relation of the dependent coordinates; its remainder is infinite for boxes with unknown dependent
            coordinates.
        is_regular, shares, smallest, signs: fields of :class:`~.rank_rule.Tested`; an infinite ``smallest`` is
        unknown. For K quantities, ``smallest`` has their lower bounds (B, K).
        along: pieces of a path, as in :class:`Followed`.
    """

    boxes: LoopBoxes
    relation: Relation
    is_regular: NDArray[np.bool_]
    shares: FloatArray
    smallest: FloatArray
    signs: NDArray[np.int32]
    along: FloatArray = np.zeros((0, 0))


class Test(Protocol):
    """Interface of a test of expressions over boxes, such as the rank of a matrix.

    Attributes:
        entries: (R, 1) the expressions.
        unknown: value, or values (K,), of ``smallest`` for a box without a result.
    """

    entries: SX
    unknown: FloatArray

    def examine(self, forms: Forms, f: int, errors: int) -> Tested:
        """Test expressions over boxes.

        Args:
            forms: forms of the entries.
            f: number of independent coordinates, whose terms come first; products of two coordinates follow.
            errors: number of the last terms, which are joint-centre errors.
        """


class Examiner:
    """Examination of boxes of a robot by one test, such as the rank of a matrix.

    Args:
        problem: the robot.
        test: test with entries in the coordinates of the problem.

    Attributes:
        of: indices of the independent coordinates, of the dependent coordinates, and of the joint-centre errors.
        loops: the loop equations as functions.
        second: second-order forms of the entries; None if first-order forms are used.

    Raises:
        UncoveredError: an expression has an operation without an interval rule.
    """

    def __init__(self, problem: Problem, test: Test) -> None:
        self.problem, self.loops, self._test = problem, problem.loops, test
        self.of = Coordinates(list(problem.independent), list(problem.dependent), problem.of_errors)
        self.second: Encloser | None = None
        self._change: EntryChange | None = None
        is_short = not problem.dependent and len(problem.independent) <= _MOST_SECOND
        # With joint-centre errors, second-order forms exist only for matrices with polynomial entries.
        is_rank = isinstance(test, RankTest)
        if is_short and (not problem.names or (is_rank and is_polynomial(test.entries, problem.z))):
            self._change = EntryChange(problem, test.entries) if problem.names else None
            exact = test.entries if self._change is None else self._change.exact
            self.second = Encloser(problem.problem.z, exact)
        else:
            _ = self._encloser  # fails at once for an operation without a rule

    @cached_property
    def _single(self) -> RankTest:
        """Rank test of the derivatives of the loop equations.

        If passed, no pose has two points with closed loops in a box.
        """
        problem, D = self.problem, self.of.dependent
        # Powers of two make scaling exact.
        sizes = ca.diag(ca.DM(2.0 ** np.round(np.log2(problem.size[D]))))
        slopes = ca.jacobian(problem.equations, problem.z)[:, D] @ sizes
        return RankTest(RankMatrix(slopes, 0), problem.z, problem.start)

    @cached_property
    def _encloser(self) -> Encloser:
        """First-order forms: equations, their derivatives with respect to dependent coordinates, and entries."""
        # The last entry is not used; it keeps the vector nonconstant.
        entries = self.problem.equations, self._single.entries, self._test.entries, self.problem.z[0]
        return Encloser(self.problem.z, ca.vertcat(*entries))

    def examine(self, boxes: LoopBoxes) -> Examined:
        """Enclose the dependent coordinates over boxes, and test the entries."""
        B, f, k = len(boxes.lower), len(self.of.independent), len(self.of.dependent)
        relation = no_relation(B, self.of)
        if self.second is not None and B:
            ends = boxes.lower.T[:f], boxes.upper.T[:f]
            forms = self.second.second(*ends)
            if self._change is not None:
                forms = forms._replace(r=forms.r + self._change.over(*ends).T)
            return Examined(boxes, relation, *self._test.examine(forms, f, 0))
        slopes = slice(k, k + self._single.entries.numel())
        lower, upper, near, known = some(boxes, np.arange(B))
        smallest = np.tile(self._test.unknown, (B, *[1] * self._test.unknown.ndim))
        tested = not_regular(np.zeros((B, f)), smallest)
        columns: tuple[NDArray[Any], ...] = (*relation, *tested)
        new = np.flatnonzero(~known)
        if new.size:
            tested.shares[new] = self._guess(new, lower, upper, near)
        for attempt in range(1 + (_ATTEMPTS if k else 0)):
            # The first attempt is for boxes that are known already.
            rows = np.flatnonzero(known if attempt == 0 else ~known & np.isfinite(lower).all(axis=1))
            if not rows.size:
                continue
            forms = self._encloser(lower[rows].T, upper[rows].T)
            own = relation_of(forms.part(slice(0, k)), self.of)
            if attempt:
                good = (own.reach < 1).all(axis=1) & self._single.examine(forms.part(slopes), 0, 0).is_regular
                known[rows[good]] = True
                self._widen(rows[~good], own.reach[~good], lower, upper)
                rows, forms, own = rows[good], some(forms, good), some(own, good)
            if not rows.size:
                continue
            entries = with_relation(forms.part(slice(slopes.stop, -1)), own, self.of)
            found = self._test.examine(entries, f, len(self.of.errors))
            for whole, part in zip(columns, (*own, *found), strict=True):
                whole[rows] = part
        for j in self.of.dependent:
            lower[~known, j] = upper[~known, j] = np.nan
        finite = np.asarray(np.isfinite(near).all(axis=1))
        near = np.where(finite[:, None], near, boxes.near)
        return Examined(LoopBoxes(lower, upper, near, known), relation, *tested)

    def _guess(self, rows: NDArray[np.int64], lower: FloatArray, upper: FloatArray, near: FloatArray) -> FloatArray:
        """Set bounds of dependent coordinates about joint positions at the centres of boxes.

        Also return shares (rows, f) of the independent coordinates.
        """
        (own, D, errors), size = self.of, self.problem.size
        z = near[rows].copy()
        middle, half = 0.5 * (lower[rows] + upper[rows])[:, own], 0.5 * (upper[rows] - lower[rows])[:, own]
        with np.errstate(all="ignore"):
            before = self.loops.slopes(z.T) * size
            step = (middle - z[:, own]) / size[own]
            z[:, own] = middle
            z[:, D] -= size[D] * (inverses(before[:, :, D]) @ before[:, :, own] @ step[:, :, None])[:, :, 0]
            z = self.loops.all_closed(z.T, D).T
            slopes = self.loops.slopes(z.T) * size
            Y = inverses(slopes[:, :, D])
            reach = np.abs(Y @ slopes[:, :, own]) * (half / size[own])[:, None, :]
            # Joint-centre errors move dependent coordinates too, here to first order.
            whole = reach.sum(axis=2) + by_centres(Y @ slopes[:, :, errors])
        near[rows] = z
        self._set_widths(rows, z[:, D], _WIDER * whole, lower, upper)
        shares = np.nan_to_num(reach.sum(axis=1))
        return np.asarray(np.where(shares.any(axis=1, keepdims=True), shares, half / size[own]))

    def _set_widths(
        self, rows: NDArray[np.int64], middle: FloatArray, half: FloatArray, lower: FloatArray, upper: FloatArray
    ) -> None:
        """Set bounds of dependent coordinates from relative centres and half widths (rows, k)."""
        D, half = self.of.dependent, np.maximum(half, _LEAST)
        width = np.where(half <= _MOST, half, np.nan) * self.problem.size[D]
        lower[rows[:, None], D], upper[rows[:, None], D] = middle - width, middle + width

    def _widen(self, rows: NDArray[np.int64], reach: FloatArray, lower: FloatArray, upper: FloatArray) -> None:
        """Set the widths of dependent coordinates from the relation of the last attempt."""
        D = self.of.dependent
        low, high = lower[rows][:, D], upper[rows][:, D]
        half = 0.5 * (high - low) / self.problem.size[D]
        self._set_widths(rows, 0.5 * (low + high), half * np.maximum(_AGAIN * reach, 0.5), lower, upper)

    def tied(self, one: LoopBoxes, other: LoopBoxes) -> NDArray[np.bool_]:
        """Return whether neighbouring boxes have the same point with closed loops somewhere on their common face.

        Args:
            one: (B,) boxes with known dependent coordinates.
            other: (B,) neighbours of these boxes, with overlapping independent coordinates.
        """
        own = self.of.independent
        lower, upper = one.lower.copy(), one.upper.copy()
        place = 0.5 * np.maximum(one.lower, other.lower) + 0.5 * np.minimum(one.upper, other.upper)
        lower[:, own] = upper[:, own] = place[:, own]
        return self.leads(one._replace(lower=lower, upper=upper), other)

    def leads(self, part: LoopBoxes, other: LoopBoxes) -> NDArray[np.bool_]:
        """Return whether the points with closed loops in sub-boxes are provably inside other boxes.

        Args:
            part: (B,) sub-boxes: known dependent coordinates, and reduced ranges of the independent coordinates.
            other: (B,) boxes with known dependent coordinates.
        """
        D, (lower, upper) = self.of.dependent, (part.lower.copy(), part.upper.copy())
        for _ in range(_CONTRACTIONS):
            relation = relation_of(self._encloser(lower.T, upper.T).part(slice(0, len(D))), self.of)
            reach = np.abs(relation.T).sum(axis=2) * _UP + relation.rho + relation.of_errors
            lower[:, D], upper[:, D] = _parts(lower[:, D], upper[:, D], relation.off, reach)
        return np.asarray(((lower >= other.lower) & (upper <= other.upper))[:, D].all(axis=1))

    def narrowed(self, boxes: LoopBoxes, relation: Relation, sides: FloatArray) -> LoopBoxes:
        """Return sub-boxes with bounds of their dependent coordinates.

        Args:
            boxes: (B,) sub-boxes that still have the dependent coordinates of the whole boxes.
            relation: relation of the whole boxes.
            sides: (B, f) -1 or 1 for the lower or upper half of an independent coordinate, 0 for its whole range.
        """
        D, known = self.of.dependent, boxes.is_known[:, None]
        if not D or not known.any():
            return boxes
        (off, T, rho, _), size = relation, np.abs(relation.T)
        rho = rho + relation.of_errors
        total = size.sum(axis=2)
        # A half is [-1, 0] or [0, 1] of the whole box, plus rounding.
        reach = total - 0.5 * (size @ np.abs(sides)[:, :, None])[:, :, 0] + rho
        reach = reach + 1e-12 * (np.abs(off) + total + rho)
        centre = off - (T @ (0.5 * sides)[:, :, None])[:, :, 0]
        low, high = _parts(boxes.lower[:, D], boxes.upper[:, D], centre, reach)
        lower, upper = boxes.lower.copy(), boxes.upper.copy()
        lower[:, D], upper[:, D] = np.where(known, low, np.nan), np.where(known, high, np.nan)
        return boxes._replace(lower=lower, upper=upper)


def _parts(
    lower: FloatArray, upper: FloatArray, centre: FloatArray, reach: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return sub-ranges from relative centres and half widths, with bounds moved outwards."""
    middle, half = 0.5 * lower + 0.5 * upper, 0.5 * (upper - lower) * (1 + _ROUNDING)
    slack = _ROUNDING * np.abs(middle)
    with np.errstate(all="ignore"):
        low = middle + half * np.maximum(centre - reach, -1.0) - slack
        high = middle + half * np.minimum(centre + reach, 1.0) + slack
    return np.minimum(low, high), np.maximum(low, high)


def are_between(z: FloatArray, boxes: LoopBoxes, dependent: Sequence[int]) -> NDArray[np.bool_]:
    """Return whether points (B, n) with closed loops lie in boxes; a point outside may be in another assembly mode."""
    lower, upper, own = boxes.lower[:, dependent], boxes.upper[:, dependent], z[:, dependent]
    room = _CLOSE * (upper - lower)
    return np.asarray(((own >= lower - room) & (own <= upper + room)).all(axis=1))


def whole_workspace(problem: Problem) -> LoopBoxes:
    """Return the whole workspace as one box, with unknown dependent coordinates."""
    box, free = problem.box, list(problem.free)
    if problem.cover is not None:
        return _whole_path(problem, problem.cover)
    ends = np.full((2, len(problem.start)), np.nan)
    ends[:, : len(free)] = box.lower[free], box.upper[free]
    ends[:, problem.of_errors] = np.array([[-problem.tolerance], [problem.tolerance]])
    ends[:, list(problem.dependent)] = np.nan
    return LoopBoxes(ends[:1], ends[1:], problem.start[None].copy(), np.full(1, not problem.dependent))


def _whole_path(problem: Problem, cover: PathCover) -> LoopBoxes:
    """Return boxes that cover the pieces of a path."""
    count = len(cover.pieces)
    ends = np.full((2, count, len(problem.start)), np.nan)
    for end, found in zip(ends, problem.path_boxes(cover, cover.pieces), strict=True):
        end[:, problem.of_path] = found
    ends[:, :, problem.of_errors] = np.array([[[-problem.tolerance]], [[problem.tolerance]]])
    ends[:, :, list(problem.dependent)] = np.nan
    return LoopBoxes(ends[0], ends[1], closed_along(problem, cover), np.full(count, not problem.dependent))


def contracted_boxes(problem: Problem, boxes: LoopBoxes) -> tuple[LoopBoxes, NDArray[np.bool_]]:
    """Return boxes contracted to the workspace, and whether each box contains poses of the workspace, (B,).

    Limits on dependent coordinates of the pose exclude no box.
    """
    box, free, following = problem.box, list(problem.free), list(problem.box.dependent)
    lower, upper = problem.pose_of(boxes.lower), problem.pose_of(boxes.upper)
    lower[:, following], upper[:, following] = box.lower[following], box.upper[following]
    lower, upper, outside = box.contracted(lower, upper)
    own = [j for j in problem.independent if j < len(free)]
    columns = [free[j] for j in own]
    found = boxes._replace(lower=boxes.lower.copy(), upper=boxes.upper.copy())
    found.lower[:, own], found.upper[:, own] = lower[:, columns], upper[:, columns]
    return found, ~outside


def coordinates_to_split(shares: FloatArray, width: FloatArray) -> NDArray[np.intp]:
    """Return the indices (B,) of the coordinates to bisect.

    Args:
        shares: (B, f) share of each coordinate in the overestimation.
        width: (B, f) widths relative to the whole box.
    """
    score = np.where(width > 0, shares, -1.0)
    flat = ~(score > 0).any(axis=1)
    score[flat] = width[flat]
    # A coordinate with a small share is bisected if it is much wider than all others.
    score += 1e-3 * score.max(axis=1, keepdims=True, initial=0.0) * width
    return first_largest(score)


class Followed(NamedTuple):
    """Data that a search stores with each box of a robot with closed loops.

    Attributes:
        near, is_known: fields of :class:`LoopBoxes`.
        relation: relation of the dependent coordinates.
        more: further arrays (B, ...) of a rule, as a tuple.
        along: (B, 3) pieces of a path that the boxes cover: index of the segment, and both ends of the parameter;
            (B, 0) for boxes of a workspace.
    """

    near: FloatArray
    is_known: NDArray[np.bool_]
    relation: Relation
    more: Any = ()
    along: FloatArray = np.zeros((0, 0))


class LoopRule(Rule[Followed]):
    """Rule for boxes of a robot with dependent coordinates.

    Args:
        problem: the robot.
        examiner: examiner of boxes, with the test.
        recorder: recorder of the boxes for a proof.

    Attributes:
        whole: (n,) widths of the whole workspace along independent coordinates; 0 for dependent ones.
    """

    #: Further arrays of the whole workspace, as a tuple or an array.
    _more: Any = ()

    def __init__(self, problem: Problem, examiner: Examiner, recorder: TreeRecord | None = None) -> None:
        self._problem, self._examiner, self._independent = problem, examiner, list(problem.independent)
        self._recorder = recorder
        self._start = whole_workspace(problem)
        self.whole: FloatArray = np.zeros(len(problem.start))
        self.whole[self._independent] = (self._start.upper.max(axis=0) - self._start.lower.min(axis=0))[
            self._independent
        ]
        self._fixed: FloatArray = np.zeros(len(problem.start))
        if problem.cover is not None:
            # Fixed coordinates have a width by rounding, which bisection does not reduce.
            size = np.maximum(np.abs(self._start.lower).max(axis=0), np.abs(self._start.upper).max(axis=0))
            turns = [j for j, k in enumerate(problem.free) if k >= 3]
            size[turns] = np.maximum(size[turns], 1.0)
            self._fixed = np.nan_to_num(_FIXED * size)
            self.whole[~(self.whole > self._fixed)] = 0.0
        # Boxes in which dependent coordinates became known. All sub-boxes of such a box are in its assembly mode.
        self._roots: list[LoopBoxes] = []
        self._root_pieces: list[FloatArray] = []

    @property
    def root(self) -> Boxes[Followed]:
        """The whole workspace."""
        lower, upper, near, is_known = self._start
        count, cover = len(lower), self._problem.cover
        along = np.zeros((count, 0)) if cover is None else cover.pieces
        more = np.repeat(self._more, count, axis=0) if isinstance(self._more, np.ndarray) else self._more
        columns = Followed(near, is_known, no_relation(count, self._examiner.of), more, along)
        return Boxes(lower, upper, np.full(count, np.inf), np.full(count, -1), columns)

    def search(self, order: Order) -> Search[Rule[Followed]]:
        """Return the search of the whole workspace, with the given order of boxes."""
        return Search(self, self.root, whole=self.whole, least=_LEAST_WIDTHS, order=order)

    def divided(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves (or quarters) of boxes, with bounds of their dependent coordinates."""
        if self._recorder is not None and self._problem.cover is not None:
            record_halves(self._recorder, boxes.more.along)
        elif self._recorder is not None:
            along = np.array(self._problem.free)[boxes.split]
            self._recorder.cuts(*self._poses(boxes.lower, boxes.upper), along)
        parts = self.parts(boxes)
        shape = (len(parts.split) // max(len(boxes.split), 1), 1)
        if self._problem.cover is not None:
            return parts
        sides = 1.0 * (parts.lower > np.tile(boxes.lower, shape)) - 1.0 * (parts.upper < np.tile(boxes.upper, shape))
        found = self._examiner.narrowed(loop_boxes_of(parts), parts.more.relation, sides[:, self._independent])
        return parts._replace(lower=found.lower, upper=found.upper)

    def parts(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves of boxes, all lower halves first; along a path the halves of its pieces."""
        cover = self._problem.cover
        if cover is None:
            return bisected(boxes)
        every = np.arange(len(boxes.split))
        parts, count = some(boxes, np.concatenate([every, every])), len(every)
        middle = 0.5 * (boxes.more.along[:, 1] + boxes.more.along[:, 2])
        parts.more.along[:count, 2] = parts.more.along[count:, 1] = middle
        own = self._problem.of_path
        parts.lower[:, own], parts.upper[:, own] = self._problem.path_boxes(cover, parts.more.along)
        # Dependent coordinates are computed again from a near point with closed loops.
        D = list(self._problem.dependent)
        parts.lower[:, D] = parts.upper[:, D] = np.nan
        return parts._replace(more=parts.more._replace(is_known=np.full(2 * count, not D)))

    def examined(self, boxes: Boxes[Followed]) -> Examined:
        """Examine the boxes that contain poses of the workspace."""
        inside = self._contracted(loop_boxes_of(boxes))
        found = self._examiner.examine(inside)
        # Only boxes outside the ball of rotations are dropped; a path has no ball.
        along = boxes.more.along if self._problem.cover is not None else np.zeros((len(found.shares), 0))
        found = found._replace(along=along)
        new = np.flatnonzero(found.boxes.is_known & ~inside.is_known)
        if new.size:
            self._roots.append(some(found.boxes, new))
            self._root_pieces.append(some(found.along, new))
        return found

    def _contracted(self, boxes: LoopBoxes) -> LoopBoxes:
        """Return boxes contracted to the workspace, and record the contraction."""
        found, kept = contracted_boxes(self._problem, boxes)
        if self._recorder is not None and self._problem.cover is None:
            before, after = (self._poses(each.lower, each.upper) for each in (boxes, found))
            self._recorder.contractions(before, after, ~kept)
        return found if kept.all() else some(found, kept)

    def _poses(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the bounds (B, 6) of all six pose coordinates of boxes.

        Dependent coordinates have their whole range.
        """
        box, free = self._problem.box, self._problem.free
        low, high = (np.broadcast_to(each, (len(lower), 6)).copy() for each in (box.lower, box.upper))
        for j in self._independent:
            if j < len(free):
                low[:, free[j]], high[:, free[j]] = lower[:, j], upper[:, j]
        return low, high

    def boxes_of(
        self, found: Examined, bound: FloatArray, split: NDArray[np.intp], more: FloatArray
    ) -> Boxes[Followed]:
        """Return examined boxes as boxes of a search.

        They have bounds (B,), indices (B,) of the coordinates to bisect, and the arrays of the rule.
        """
        lower, upper, near, is_known = found.boxes
        columns = np.array(self._independent)[split]
        if self._problem.cover is not None:
            # If the platform stands still along a piece, except for rounding, its halves are as wide as the piece.
            own = list(self._problem.stated)
            stands = ((upper - lower)[:, own] <= self._fixed[own]).all(axis=1)
            columns = np.where(stands, SMALL, columns)
        return Boxes(lower, upper, bound, columns, Followed(near, is_known, found.relation, more, found.along))

    def widths(self, boxes: LoopBoxes | Boxes[Followed]) -> FloatArray:
        """Return the widths (B, f) of boxes along independent coordinates, relative to the whole workspace."""
        own, whole = self._independent, self.whole[self._independent]
        return (boxes.upper - boxes.lower)[:, own] / np.where(whole > 0, whole, np.inf)

    def is_one_assembly(self) -> bool:
        """Return whether the boxes are provably in one assembly mode."""
        if not self._roots:
            return True
        roots = joined(self._roots)
        count = len(roots.lower)
        if self._problem.cover is not None:
            return self.assembled_until() >= (math.inf, 0.0)
        if count > _MANY:
            return False
        lower, upper = roots.lower[:, self._independent], roots.upper[:, self._independent]
        touching = [
            np.flatnonzero((lower[k + 1 :] <= upper[k]).all(axis=1) & (upper[k + 1 :] >= lower[k]).all(axis=1)) + k + 1
            for k in range(count)
        ]
        pairs = np.stack([np.repeat(np.arange(count), [len(each) for each in touching]), np.concatenate(touching)])
        return bool(one_assembly(self._examiner, roots, pairs.T, np.arange(count) == 0).all())

    def assembled_until(self) -> tuple[float, float]:
        """Return the place on a path up to which all boxes are provably in the assembly mode of its start.

        The place is infinite if this holds for the whole path.
        """
        cover, start = self._problem.cover, self._problem.start
        if cover is None or not self._roots:
            return math.inf, 0.0
        # Pieces in the order of the path: each contains the start of the next one.
        roots, along = joined(self._roots), joined(self._root_pieces)
        order = np.lexsort(along.T[[1, 0]])
        ordered, along = some(roots, order), along[order]
        if not ((ordered.lower[0] <= start) & (start <= ordered.upper[0])).all():
            return 0.0, 0.0
        for begin in range(0, len(along) - 1, _PAIRS):
            k = np.arange(begin, min(begin + _PAIRS, len(along) - 1))
            tied = self._are_tied(cover, [some(ordered, k + j) for j in (0, 1)], [along[k + j] for j in (0, 1)])
            if not tied.all():
                last = along[k[int(np.argmin(tied))]]
                return float(last[0]), float(last[2])
        return math.inf, 0.0

    def _are_tied(
        self, cover: PathCover, boxes: Sequence[LoopBoxes], pieces: Sequence[FloatArray]
    ) -> NDArray[np.bool_]:
        """Return whether each box of a path has the same point with closed loops as the next box, at their common pose.

        Args:
            cover: boxes of the path.
            boxes: (B,) boxes of pieces, and (B,) boxes of the next pieces.
            pieces: (B, 3) pieces, and (B, 3) next pieces.
        """
        (one, other), (before, after) = boxes, pieces
        (k, low, high), (segment, s, _) = before.T, after.T
        is_next = (segment == k + 1) & (s == 0) & (high == 1)
        meet = is_next | ((segment == k) & (low <= s) & (s <= high))
        end = np.stack([k, np.where(is_next, 1.0, s), np.where(is_next, 1.0, s)], axis=1)
        start = np.stack([segment, s, s], axis=1)
        # Containment is only proved for the point of the smaller box in the larger box. The same pose may have
        # different coordinates in the two boxes.
        parts = self._at(cover, one, end, before), self._at(cover, other, start, after)
        return np.asarray(meet & (self._examiner.leads(parts[0], other) | self._examiner.leads(parts[1], one)))

    def _at(self, cover: PathCover, boxes: LoopBoxes, points: FloatArray, pieces: FloatArray) -> LoopBoxes:
        """Return boxes (B,) of pieces (B, 3) of a path, reduced to points: pieces of length 0."""
        own = [j for j in self._independent if j < len(self._problem.free)]
        low, high = (each[:, [self._problem.free[j] for j in own]] for each in cover.boxes(points, pieces))
        lower, upper = boxes.lower.copy(), boxes.upper.copy()
        lower[:, own], upper[:, own] = np.maximum(lower[:, own], low), np.minimum(upper[:, own], high)
        return boxes._replace(lower=lower, upper=upper)


def loop_boxes_of(boxes: Boxes[Followed]) -> LoopBoxes:
    """Return the boxes of a search without their bounds."""
    return LoopBoxes(boxes.lower, boxes.upper, boxes.more.near, boxes.more.is_known)


def one_assembly(
    examiner: Examiner, boxes: LoopBoxes, pairs: NDArray[np.intp], is_reached: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return whether each box (B,) is provably in the assembly mode of the boxes that ``is_reached`` marks.

    Args:
        examiner: examiner of the robot's boxes.
        boxes: (B,) boxes. Boxes that occur in ``pairs`` have known dependent coordinates.
        pairs: (P, 2) indices of neighbouring boxes.
        is_reached: (B,) whether a box is known to be in this assembly mode.
    """
    is_reached, tried = is_reached.copy(), np.zeros(len(pairs), dtype=bool)
    while True:
        # Pairs with exactly one reached box. For each box that is not reached, the first untested pair is tested.
        which = np.flatnonzero((is_reached[pairs[:, 0]] != is_reached[pairs[:, 1]]) & ~tried)
        if not which.size:
            return is_reached
        turned = is_reached[pairs[which, 1]]
        one = np.where(turned, pairs[which, 1], pairs[which, 0])
        new = np.where(turned, pairs[which, 0], pairs[which, 1])
        _, order = np.unique(new, return_index=True)
        for begin, end in itertools.pairwise([*range(0, len(order), _PAIRS), len(order)]):
            part = order[begin:end]
            tried[which[part]] = True
            tied = examiner.tied(some(boxes, one[part]), some(boxes, new[part]))
            is_reached[new[part[tied]]] = True
