"""Closed loops along a path, followed from its first point; successive pieces are tied to each other.

A pose that a path visits twice may have two assembly modes, for example if joints turn through full revolutions. The
box of each piece must therefore contain the closed point at which it meets the preceding piece; other ties do not
count.
"""

from __future__ import annotations

import numpy as np
from casadi import SX

from .....models import FloatArray
from ..proof_file import ProofError
from .closed_loops import Assembly, ClosedBoxes, Enclosed, is_home
from .motion_matrix import PosedRobot

#: Steps from one knot of a path to the next one, and number of ties that are proved at once.
_STEPS, _BLOCK = 4, 512
#: Largest number of values of closed points that are stored for further claims.
_MOST_KNOWN = 2**22


class PathAssembly(Assembly):
    """Closed loops of a robot along a path that change continuously from those at its first point.

    Args:
        robot: expressions of the robot along the path.
        equations: (k, 1) independent loop equations.
        start: (n,) closed loops at the first point.
        segments: number of segments.

    Raises:
        UncoveredError: an equation has an operation without a rule.
        ProofError: the loops cannot be closed at the first point, or are singular there.
    """

    def __init__(self, robot: PosedRobot, equations: SX, start: FloatArray, segments: int) -> None:
        super().__init__(robot, equations, start)
        if not is_home(robot, self.start):
            raise ProofError(
                "found no solution of the loop equations in the home assembly mode at the first point of the path"
            )
        self._known, self._left = dict[bytes, Enclosed](), _MOST_KNOWN
        self._knots: FloatArray = np.tile(self.start, (segments + 1, 1))
        self._knots[:, 0] = np.arange(segments + 1)
        for k in range(segments if self.dependent else 0):
            to = self._knots[k + 1 : k + 2, self.independent]
            self._knots[k + 1] = self.points.closed(self._knots[k : k + 1], self.dependent, to=to, steps=_STEPS)[0]

    def near(self, to: FloatArray) -> FloatArray:
        """Return closed points (B, n) at independent coordinates (B, f), followed from the preceding knots."""
        k = np.clip(np.floor(to[:, 0]), 0, len(self._knots) - 1).astype(np.intp)
        return self.moved(self._knots[k], to)

    def refuse_apart(self, boxes: ClosedBoxes) -> None:
        """Refuse pieces whose closed loops are not proved to belong to the assembly mode of the first point."""
        boxes = ClosedBoxes(*(each[np.argsort(boxes.lower[:, 0], kind="stable")] for each in boxes))
        every, (lower, upper) = np.arange(len(boxes.lower)), (boxes.lower[:, 0], boxes.upper[:, 0])
        start = self.start[None]
        good = bool(lower[0] <= 0 <= upper[0] and self.holds(boxes, every[:1], start).all())
        for begin in range(0, len(every) - 1, _BLOCK):
            first = every[begin : begin + _BLOCK]
            first = first[first < len(every) - 1]
            common = boxes.near[first][:, self.independent]
            common[:, 0] = lower[first + 1]
            meets = np.asarray(lower[first + 1] <= upper[first])
            near = self.moved(boxes.near[first], common)
            tied = meets & self.holds(boxes, first, near) & self.holds(boxes, first + 1, near)
            good = good and bool(tied.all())
        if not good:
            raise ProofError("it is not proved that the joints stay in one assembly mode along the path")

    def enclosed(self, lower: FloatArray, upper: FloatArray, near: FloatArray | None = None) -> Enclosed:
        """Return the closed points over pieces; results for the same pieces from other claims are reused."""
        key = lower.tobytes() + upper.tobytes()
        if near is not None or not self.dependent:
            return super().enclosed(lower, upper, near)
        if key not in self._known:
            found = super().enclosed(lower, upper)
            self._left -= sum(each.size for each in vars(found).values())
            if self._left < 0:
                return found
            self._known[key] = found
        return self._known[key]
