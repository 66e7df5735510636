"""Boxes of a robot that cover a workspace: the whole of it, boxes contracted to its poses, and how joints follow.

Each pose of a box has one closed point between the ends of its dependent coordinates, which moves continuously with the
pose. Two boxes with a pose in common have one assembly of the robot's joints where the closed point of the one at that
pose is that of the other. All boxes have one where each is reached from the first.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .....models.arrays import first_largest
from ...boxes.rows import Boxes, bisected, joined, some
from ...boxes.search import Rule
from ..robot.posed_robot import Problem
from .krawczyk import Relation, no_relation
from .loop_boxes import Examined, Examiner, LoopBoxes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray
    from ...boxes.tree import TreeRecord

#: Reason for which nothing is claimed although every box is closed.
APART = "the assemblies in two neighbouring boxes are not proved to be the same"
#: Number of boxes beyond which pairs of them are too many, and number of pairs that are compared at once.
_MOST, _PAIRS = 6000, 512


def whole_workspace(problem: Problem) -> LoopBoxes:
    """Return the whole workspace as one box; its dependent coordinates are not known."""
    box, n, free, dependent = problem.box, len(problem.start), list(problem.free), list(problem.dependent)
    ends = np.full((2, n), np.nan)
    ends[:, : len(free)] = box.lower[free], box.upper[free]
    ends[:, dependent] = np.nan
    return LoopBoxes(ends[:1], ends[1:], problem.start[None].copy(), np.full(1, not dependent))


def coordinates_to_split(shares: FloatArray, width: FloatArray) -> NDArray[np.intp]:
    """Return the places (B,) of the coordinates to bisect.

    Args:
        shares: (B, f) share of each coordinate in what is missing.
        width: (B, f) widths in parts of the whole box.
    """
    score = np.where(width > 0, shares, -1.0)
    flat = ~(score > 0).any(axis=1)
    score[flat] = width[flat]
    # A coordinate that counts for little is divided where it is much wider than all others.
    score += 1e-3 * score.max(axis=1, keepdims=True, initial=0.0) * width
    return first_largest(score)


def contracted_boxes(problem: Problem, boxes: LoopBoxes) -> tuple[LoopBoxes, NDArray[np.bool_], NDArray[np.bool_]]:
    """Return boxes contracted to the workspace.

    Returns:
        (B,) the boxes; whether each holds poses of the workspace; whether a number of the pose that follows from others
        is outside of its range.
    """
    box, free = problem.box, list(problem.free)
    ends = [problem.pose_of(each) for each in (boxes.lower, boxes.upper)]
    # Numbers of the pose that are not known yet may be any of the workspace.
    lower = np.where(np.isnan(ends[0]), box.lower, ends[0])
    upper = np.where(np.isnan(ends[1]), box.upper, ends[1])
    beyond = np.asarray((lower > box.upper).any(axis=1) | (upper < box.lower).any(axis=1))
    found = box.contracted(lower, upper)
    own = [j for j in problem.independent if j < len(free)]
    columns = [free[j] for j in own]
    new_lower, new_upper = boxes.lower.copy(), boxes.upper.copy()
    new_lower[:, own], new_upper[:, own] = found.lower[:, columns], found.upper[:, columns]
    return boxes._replace(lower=new_lower, upper=new_upper), ~(beyond | found.outside), beyond


def in_workspace(problem: Problem, boxes: LoopBoxes) -> LoopBoxes:
    """Return the boxes that hold poses of the workspace, contracted to them."""
    found, kept, _ = contracted_boxes(problem, boxes)
    return some(found, kept)


class Followed(NamedTuple):
    """Columns of boxes of a robot.

    Attributes:
        near, is_known: those of :class:`.loop_boxes.LoopBoxes`.
        relation: of the dependent coordinates.
        more: further columns (B, ...) of a rule, as a tuple.
    """

    near: FloatArray
    is_known: NDArray[np.bool_]
    relation: Relation
    more: Any = ()


class LoopRule(Rule[Followed]):
    """Rule for boxes of a robot, in which dependent coordinates are followed.

    Args:
        problem: the robot.
        examiner: follows the dependent coordinates, and has the test.
        recorder: records the boxes for a proof.

    Attributes:
        whole: (n,) widths of the whole workspace along independent coordinates; 0 for others.
    """

    def __init__(self, problem: Problem, examiner: Examiner, recorder: TreeRecord | None = None) -> None:
        self._problem, self._examiner, self._independent = problem, examiner, list(problem.independent)
        self._recorder = recorder
        self._start = whole_workspace(problem)
        self.whole: FloatArray = np.zeros(len(problem.start))
        self.whole[self._independent] = (self._start.upper - self._start.lower)[0, self._independent]
        # The boxes in which dependent coordinates became known.
        self._roots: list[LoopBoxes] = []

    @property
    def root(self) -> Boxes[Followed]:
        """The whole workspace."""
        lower, upper, near, is_known = self._start
        columns = Followed(near, is_known, no_relation(1, self._examiner.of))
        return Boxes(lower, upper, np.array([np.inf]), np.array([-1]), columns)

    def divided(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the parts of boxes, with their dependent coordinates."""
        if self._recorder is not None:
            along = np.array(self._problem.free)[boxes.split]
            self._recorder.cuts(*self._poses(boxes.lower, boxes.upper), along)
        parts = self.parts(boxes)
        shape = (len(parts.split) // max(len(boxes.split), 1), 1)
        sides = 1.0 * (parts.lower > np.tile(boxes.lower, shape)) - 1.0 * (parts.upper < np.tile(boxes.upper, shape))
        found = self._examiner.narrowed(loop_boxes_of(parts), parts.more.relation, sides[:, self._independent])
        return parts._replace(lower=found.lower, upper=found.upper)

    def parts(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves of boxes, all lower ones first."""
        return bisected(boxes)

    def examined(self, boxes: Boxes[Followed]) -> Examined:
        """Return the results for the boxes that hold poses of the workspace."""
        inside = self._contracted(loop_boxes_of(boxes))
        found = self._examiner.examine(inside)
        new = np.flatnonzero(found.boxes.is_known & ~inside.is_known)
        if new.size:
            self._roots.append(some(found.boxes, new))
        return found

    def _contracted(self, boxes: LoopBoxes) -> LoopBoxes:
        """Return boxes contracted to the workspace, and record where they lead."""
        found, kept, beyond = contracted_boxes(self._problem, boxes)
        if self._recorder is not None:
            before, after = (self._poses(each.lower, each.upper) for each in (boxes, found))
            self._recorder.contractions(before, after, ~kept)
            self._recorder.lacks_boxes |= bool(beyond.any())
        return some(found, kept)

    def _poses(self, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return boxes by the ends of all six coordinates (B, 6): those that follow from others have their range."""
        box, free = self._problem.box, self._problem.free
        low, high = (np.broadcast_to(each, (len(lower), 6)).copy() for each in (box.lower, box.upper))
        for j in self._independent:
            if j < len(free):
                low[:, free[j]], high[:, free[j]] = lower[:, j], upper[:, j]
        return low, high

    def boxes_of(self, found: Examined, bound: FloatArray, split: NDArray[np.intp]) -> Boxes[Followed]:
        """Return examined boxes, with bounds (B,) and places (B,) among the independent coordinates to bisect."""
        lower, upper, near, is_known = found.boxes
        columns = np.array(self._independent)[split]
        return Boxes(lower, upper, bound, columns, Followed(near, is_known, found.relation))

    def widths(self, found: Examined) -> FloatArray:
        """Return the widths (B, f) of boxes along independent coordinates, in parts of the whole workspace."""
        own, whole = self._independent, self.whole[self._independent]
        return (found.boxes.upper - found.boxes.lower)[:, own] / np.where(whole > 0, whole, np.inf)

    def is_one_assembly(self) -> bool:
        """Return whether the boxes surely belong to one assembly."""
        if not self._roots:
            return True
        roots = joined(self._roots)
        count = len(roots.lower)
        if count > _MOST:
            return False
        lower, upper = roots.lower[:, self._independent], roots.upper[:, self._independent]
        touching = [
            np.flatnonzero((lower[k + 1 :] <= upper[k]).all(axis=1) & (upper[k + 1 :] >= lower[k]).all(axis=1)) + k + 1
            for k in range(count)
        ]
        pairs = np.stack([np.repeat(np.arange(count), [len(each) for each in touching]), np.concatenate(touching)])
        return bool(one_assembly(self._examiner, roots, pairs.T, np.arange(count) == 0).all())


def loop_boxes_of(boxes: Boxes[Followed]) -> LoopBoxes:
    """Return the boxes of a search without their bounds."""
    return LoopBoxes(boxes.lower, boxes.upper, boxes.more.near, boxes.more.is_known)


def one_assembly(
    examiner: Examiner, boxes: LoopBoxes, pairs: NDArray[np.intp], is_reached: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return for each box (B,) whether its closed points surely belong to the assembly of some boxes.

    Args:
        examiner: of the robot.
        boxes: with known dependent coordinates where they are in pairs.
        pairs: (P, 2) boxes that touch.
        is_reached: (B,) those boxes.
    """
    is_reached, tried = is_reached.copy(), np.zeros(len(pairs), dtype=bool)
    while True:
        # Pairs of a box that is reached and one that is not: the first of each that is left is tried.
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
