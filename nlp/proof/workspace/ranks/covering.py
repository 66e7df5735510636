"""Boxes of a robot that cover a workspace: the whole of it, boxes contracted to its poses, and how joints follow."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models.arrays import first_largest
from ...boxes.rows import Boxes, bisected, joined, some
from ...boxes.search import Rule
from ..robot.posed_robot import Problem
from .connected import is_connected
from .krawczyk import Relation
from .loop_boxes import Cells, Examined, Examiner

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray

#: Reason for which nothing is claimed although every box is closed.
APART = "the assemblies in two neighbouring boxes are not proved to be the same"


def whole_workspace(problem: Problem) -> Cells:
    """Return the whole workspace as one box; its dependent coordinates are not known."""
    box, n, free = problem.box, len(problem.start), list(problem.free)
    lower, upper = np.full((1, n), np.nan), np.full((1, n), np.nan)
    lower[0, : len(free)], upper[0, : len(free)] = box.lower[free], box.upper[free]
    dependent = list(problem.dependent)
    lower[0, dependent] = upper[0, dependent] = np.nan
    return Cells(lower, upper, problem.start[None].copy(), np.full(1, not dependent))


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


class Contracted(NamedTuple):
    """Boxes contracted to a workspace.

    Attributes:
        cells: (B,) boxes.
        kept: (B,) whether they hold poses of the workspace.
        beyond: (B,) whether a number of the pose that follows from others is outside of its range.
    """

    cells: Cells
    kept: NDArray[np.bool_]
    beyond: NDArray[np.bool_]


def contracted_cells(problem: Problem, cells: Cells) -> Contracted:
    """Return boxes contracted to the workspace."""
    box, free = problem.box, list(problem.free)
    ends = [problem.pose_of(each) for each in (cells.lower, cells.upper)]
    # Numbers of the pose that are not known yet may be any of the workspace.
    lower = np.where(np.isnan(ends[0]), box.lower, ends[0])
    upper = np.where(np.isnan(ends[1]), box.upper, ends[1])
    beyond = np.asarray((lower > box.upper).any(axis=1) | (upper < box.lower).any(axis=1))
    found = box.contracted(lower, upper)
    own = [j for j in problem.independent if j < len(free)]
    columns = [free[j] for j in own]
    new_lower, new_upper = cells.lower.copy(), cells.upper.copy()
    new_lower[:, own], new_upper[:, own] = found.lower[:, columns], found.upper[:, columns]
    return Contracted(cells._replace(lower=new_lower, upper=new_upper), ~(beyond | found.outside), beyond)


class Followed(NamedTuple):
    """Columns of boxes of a robot: those of :class:`.loop_boxes.Cells` beside their ends, and the relation."""

    near: FloatArray
    is_known: NDArray[np.bool_]
    relation: Relation


class LoopRule(Rule[Followed]):
    """Rule for boxes of a robot, in which dependent coordinates are followed.

    Args:
        problem: the robot.
        examiner: follows the dependent coordinates, and has the test.

    Attributes:
        whole: (n,) widths of the whole workspace along independent coordinates; 0 for others.
    """

    def __init__(self, problem: Problem, examiner: Examiner) -> None:
        self._problem, self._examiner, self._independent = problem, examiner, list(problem.independent)
        self._start = whole_workspace(problem)
        self.whole: FloatArray = np.zeros(len(problem.start))
        self.whole[self._independent] = (self._start.upper - self._start.lower)[0, self._independent]
        # The boxes in which dependent coordinates became known.
        self._roots: list[Cells] = []

    @property
    def root(self) -> Boxes[Followed]:
        """The whole workspace."""
        k, f = len(self._problem.dependent), len(self._independent)
        none = Relation(np.zeros((1, k)), np.zeros((1, k, f)), np.zeros((1, k)), np.zeros((1, k, 0)))
        lower, upper, near, is_known = self._start
        return Boxes(lower, upper, np.array([np.inf]), np.array([-1]), Followed(near, is_known, none))

    def divided(self, boxes: Boxes[Followed]) -> Boxes[Followed]:
        """Return the halves of boxes, with their dependent coordinates."""
        parts, count = bisected(boxes), len(boxes.split)
        sides = np.zeros(parts.lower.shape)
        sides[np.arange(2 * count), parts.split] = np.repeat([-1.0, 1.0], count)
        cells = Cells(parts.lower, parts.upper, parts.more.near, parts.more.is_known)
        found = self._examiner.narrowed(cells, parts.more.relation, sides[:, self._independent])
        return parts._replace(lower=found.lower, upper=found.upper)

    def examined(self, boxes: Boxes[Followed]) -> Examined:
        """Return the results for the boxes that hold poses of the workspace."""
        cells = self._contracted(Cells(boxes.lower, boxes.upper, boxes.more.near, boxes.more.is_known))
        found = self._examiner.examine(cells)
        new = np.flatnonzero(found.cells.is_known & ~cells.is_known)
        if new.size:
            self._roots.append(some(found.cells, new))
        return found

    def _contracted(self, cells: Cells) -> Cells:
        """Return boxes contracted to the workspace."""
        return in_workspace(self._problem, cells)

    def boxes_of(self, found: Examined, bound: FloatArray, split: NDArray[np.intp]) -> Boxes[Followed]:
        """Return examined boxes, with bounds (B,) and places (B,) among the independent coordinates to bisect."""
        lower, upper, near, is_known = found.cells
        columns = np.array(self._independent)[split]
        return Boxes(lower, upper, bound, columns, Followed(near, is_known, found.relation))

    def widths(self, found: Examined) -> FloatArray:
        """Return the widths (B, f) of boxes along independent coordinates, in parts of the whole workspace."""
        own, whole = self._independent, self.whole[self._independent]
        return (found.cells.upper - found.cells.lower)[:, own] / np.where(whole > 0, whole, np.inf)

    def is_one_assembly(self) -> bool:
        """Return whether the boxes surely belong to one assembly."""
        return not self._roots or is_connected(self._examiner, joined(self._roots), self._independent)


def in_workspace(problem: Problem, cells: Cells) -> Cells:
    """Return the boxes that hold poses of the workspace, contracted to them."""
    found = contracted_cells(problem, cells)
    return some(found.cells, found.kept)
