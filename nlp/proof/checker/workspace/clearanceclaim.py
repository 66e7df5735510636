"""The claim that two legs, as segments between their joints, are at least a distance apart at every pose of a box.

For any vector n the segments are at least ``n.(x - y) / |n|`` apart, for the least of it over their ends x and y. An
end on the platform is ``p + u / s``, so that times s every one of the four conditions is a sum without a division.
"""

from __future__ import annotations

import numpy as np

from .....models import FloatArray
from .ballrows import BallRows, Joints, ball_rows
from .ballslopes import UNIT
from .pieces import WRONG, Attempt
from .poseroot import PoseRoot

#: Steps in the search of the nearest points: any direction is allowed, a good one closes larger boxes.
_STEPS = 12


class ClearanceClaim:
    """The claim about two legs.

    Args:
        root: the whole box.
        joints: joint centres.
        pair: indices of the legs.
        least: the distance, length.
    """

    def __init__(self, root: PoseRoot, joints: Joints, pair: tuple[int, int], least: float) -> None:
        self._root, self._joints, self._pair, self._least = root, joints, pair, least

    def attempt(self, lower: FloatArray, upper: FloatArray) -> Attempt:
        """Try to show the claim on boxes (B, 6)."""
        found = ball_rows(self._root, self._joints, lower, upper)
        one, other = self._pair
        base = self._joints.base
        n = self._direction(found)
        with np.errstate(all="ignore"):
            needed = np.maximum(self._least, 0.0) * np.sqrt((n * n).sum(axis=1)) * (1 + 8 * UNIT)
        along = (found.position.times(n)).sum(1)
        first, second = (found.arm[:, leg].times(n).sum(1) for leg in self._pair)
        feet = [(n * base[leg]).sum(axis=1) for leg in self._pair]
        # Rounding of a dot product of three numbers.
        off = 8 * UNIT * np.abs(n) @ np.abs(base[[one, other]]).max(axis=0)
        both = found.scale.times(needed)
        conditions = (
            first + found.scale * along.plus(-feet[1]) - both,
            -second - found.scale * along.plus(-feet[0]) - both,
            first - second - both,
        )
        holds = feet[0] - feet[1] - needed >= 2 * off + 4 * UNIT * (np.abs(feet[0]) + np.abs(feet[1]) + needed)
        shares = np.zeros((len(n), 6))
        room = off * (np.abs(found.scale.c) + found.scale.spread)
        for each in conditions:
            least = each.c - each.spread * (1 + 4 * UNIT) - 4 * UNIT * np.abs(each.c)
            fine = least >= room * (1 + 8 * UNIT)
            holds = holds & fine
            shares = shares + np.where(fine[:, None], 0.0, (np.abs(each.s) + each.se) * each.h)
        # The distance is at most that of two points of the legs.
        is_wrong = np.sqrt((n * n).sum(axis=1)) < self._least * (1 - WRONG)
        return Attempt(holds, shares, np.asarray(is_wrong))

    def _direction(self, found: BallRows) -> FloatArray:
        """Return vectors (B, 3) from the nearest point of the second leg to that of the first, at the centres."""
        tips = found.position.c[:, None] + found.arm.c / found.scale.c[:, None, None]
        a, b = (self._joints.base[leg] for leg in self._pair)
        d, e = (tips[:, leg] - self._joints.base[leg] for leg in self._pair)
        dd, ee, de = (d * d).sum(axis=1), (e * e).sum(axis=1), (d * e).sum(axis=1)
        s = t = np.full(len(d), 0.5)
        with np.errstate(all="ignore"):
            # Newton's step for both, then one after the other within the segments.
            gap = a - b
            whole = dd * ee - de * de
            s = np.clip(np.nan_to_num((de * (e @ gap) - ee * (d @ gap)) / whole, nan=0.5), 0.0, 1.0)
            for _ in range(_STEPS):
                t = np.clip(np.nan_to_num((de * s + e @ gap) / ee), 0.0, 1.0)
                s = np.clip(np.nan_to_num((de * t - d @ gap) / dd), 0.0, 1.0)
        return np.asarray(gap + s[:, None] * d - t[:, None] * e)
