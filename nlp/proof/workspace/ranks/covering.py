"""Boxes of a robot that cover a workspace: the whole of it, and boxes contracted to its poses."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models.arrays import first_largest
from ..robot.posed_robot import Problem
from .loop_boxes import Cells

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .....models import FloatArray


def whole_workspace(problem: Problem) -> Cells:
    """Return the whole workspace as one box; its dependent coordinates are not known."""
    box, n, free = problem.box, len(problem.start), list(problem.free)
    lower, upper = np.full((1, n), np.nan), np.full((1, n), np.nan)
    lower[0, : len(free)], upper[0, : len(free)] = box.lower[free], box.upper[free]
    dependent = list(problem.dependent)
    lower[0, dependent] = upper[0, dependent] = np.nan
    return Cells(lower, upper, problem.start[None].copy(), np.full(1, not dependent))


def widths_of(cells: Cells, own: list[int], whole: FloatArray) -> FloatArray:
    """Return the widths (B, f) of boxes along f coordinates, in parts of those (f,) of the whole box."""
    return (cells.upper - cells.lower)[:, own] / np.where(whole > 0, whole, np.inf)


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


def in_workspace(problem: Problem, cells: Cells) -> Cells:
    """Return the boxes that hold poses of the workspace, contracted to them."""
    found = contracted_cells(problem, cells)
    return found.cells.some(np.flatnonzero(found.kept))
