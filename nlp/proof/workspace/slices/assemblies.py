"""Boxes of a slice whose closed loops belong to the assembly of the middle.

Two boxes that touch belong together where they have the same closed point somewhere on their common face; see
:mod:`..ranks.connected`. Neighbours are found on the grid of the smallest boxes.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from .....models import FloatArray
from ..ranks.loop_boxes import Cells, Examiner
from ..robot.posed_robot import Problem
from .regions import LEAST

#: Pairs of boxes that are compared at once.
_BLOCK = 512
#: Smallest boxes to each side of a slice.
_SIDE = round(1 / LEAST)


def same_assembly(
    examiner: Examiner, problem: Problem, cells: Cells, places: list[int], ends: tuple[FloatArray, FloatArray]
) -> NDArray[np.bool_]:
    """Return for each box (B,) whether its closed points surely belong to the assembly of the middle.

    Args:
        examiner: of the robot.
        problem: the robot.
        cells: boxes that cover the slice.
        places: indices of its two coordinates.
        ends: (2,) lower and upper ends of the slice.
    """
    size = ends[1] - ends[0]
    low, high = (
        np.rint((each[:, places] - ends[0]) / size * _SIDE).astype(np.intp) for each in (cells.lower, cells.upper)
    )
    owner = np.empty((_SIDE, _SIDE), dtype=np.int64)
    for k, (begin, end) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        owner[begin[0] : end[0], begin[1] : end[1]] = k
    pairs = [(owner[1:].ravel(), owner[:-1].ravel()), (owner[:, 1:].ravel(), owner[:, :-1].ravel())]
    both = np.unique(np.sort(np.concatenate([np.stack(each, axis=1) for each in pairs]), axis=1), axis=0)
    both = both[(both[:, 0] != both[:, 1]) & cells.is_known[both].all(axis=1)]
    is_reached = cells.is_known & _holds(cells, problem.start)
    tried = np.zeros(len(both), dtype=bool)
    while True:
        # Pairs of a box that is reached and one that is not: the first of each that is left is tried.
        which = np.flatnonzero((is_reached[both[:, 0]] != is_reached[both[:, 1]]) & ~tried)
        if not which.size:
            return is_reached
        turned = is_reached[both[which, 1]]
        new = np.where(turned, both[which, 0], both[which, 1])
        _, order = np.unique(new, return_index=True)
        for begin, end in itertools.pairwise([*range(0, len(order), _BLOCK), len(order)]):
            some = order[begin:end]
            one = np.where(turned[some], both[which[some], 1], both[which[some], 0])
            tried[which[some]] = True
            tied = examiner.tied(cells.some(one), cells.some(new[some]))
            is_reached[new[some[tied]]] = True


def _holds(cells: Cells, z: FloatArray) -> NDArray[np.bool_]:
    """Return which boxes (B,) hold a point (n,)."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((cells.lower <= z) & (cells.upper >= z)).all(axis=1))
