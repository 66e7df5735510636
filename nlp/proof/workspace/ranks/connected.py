"""Whether the closed points in many boxes belong to one assembly of the robot's joints.

Each pose of a box has one closed point between the ends of its dependent coordinates, which moves continuously with the
pose. Two boxes with a pose in common belong together where the closed point of the one at that pose is that of the
other. All boxes belong together where each is reached from the first.
"""

from __future__ import annotations

import numpy as np

from .loop_boxes import Cells, Examiner

#: Number of boxes beyond which pairs of them are too many, and number of pairs that are compared at once.
_MOST, _BLOCK = 6000, 512


def is_connected(examiner: Examiner, cells: Cells, independent: list[int]) -> bool:
    """Return whether the closed points of boxes surely belong to one assembly.

    Args:
        examiner: of the robot.
        cells: boxes that cover a connected part of the poses, with known dependent coordinates.
        independent: indices of the independent coordinates.
    """
    count = len(cells.lower)
    if count > _MOST:
        return False
    lower, upper = cells.lower[:, independent], cells.upper[:, independent]
    is_reached = np.zeros(count, dtype=bool)
    is_reached[0] = True
    border = [0]
    while border:
        pairs = []
        for one in border:
            touching = ~is_reached & (lower <= upper[one]).all(axis=1) & (upper >= lower[one]).all(axis=1)
            pairs += [(one, int(other)) for other in np.flatnonzero(touching)]
        border = []
        for begin in range(0, len(pairs), _BLOCK):
            block = [pair for pair in pairs[begin : begin + _BLOCK] if not is_reached[pair[1]]]
            if not block:
                continue
            first, second = np.array(block).T
            new = np.unique(second[examiner.tied(cells.some(first), cells.some(second))])
            is_reached[new] = True
            border += new.tolist()
    return bool(is_reached.all())
