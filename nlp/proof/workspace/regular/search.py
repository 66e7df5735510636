"""Search of a box of poses for a singular one: bisection until every box is proved regular.

Boxes are searched depth first, in blocks. Where the determinant of the rows has one sign at the centre of a box and the
other at that of another, both signs are computed again without rounding. The workspace is connected, and convex in its
coordinates: on the segment between the two poses the determinant is 0, and the claim is refuted.

With a tolerance on joint centres a box is closed only if every machine within it is regular at every pose of the box. A
machine whose determinant at a pose has the other sign than that of the exact machine refutes the claim
(:mod:`..tolerance.legs.rank`).

Where the determinant is 0 without a change of sign, no box that holds the place is ever closed, and the claim stays
open.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .....models import FloatArray, frozen_array
from .....models.arrays import first_largest
from ....interruption import Milestone, one_search, reached, reason_of, reason_to_stop
from ...statement.machine import Legs
from ..robot.pose_box import PoseBox
from ..tolerance.legs.rank import SingularMachine, singular_machine
from ..verdict import Outcome, Regularity
from .engines import RankEngine, rank_engine
from .exact import determinant_sign, singular_between
from .regularity import Rank, RankExamination

if TYPE_CHECKING:
    from ..proof_record import TreeRecord

#: Width of a box, in parts of the whole box, below which it is not bisected: the rows over it differ by little more
#: than their rounding.
_LEAST_WIDTH = 2.0**-30
#: Seconds between two reports of progress.
REPORT_EVERY = 0.1

#: Callback with seconds, number of boxes examined, and number of boxes open.
RankProgress = Callable[[float, int, int], None]


def prove_regular(
    legs: Legs,
    box: PoseBox,
    *,
    engine: str | None = None,
    time_limit: float | None = None,
    most_boxes: int | None = None,
    progress: RankProgress | None = None,
    recorder: TreeRecord | None = None,
) -> Regularity:
    """Prove that J has full rank at every pose of a box, or find a pose at which it has not.

    Args:
        legs: joint centres of the robot.
        box: the poses.
        engine: ``"c"`` or ``"numpy"``; left out, the C kernel where it was built.
        time_limit: seconds after which the search stops.
        most_boxes: number of boxes after which it stops.
        progress: called about ten times a second.
        recorder: records the boxes for a proof.

    Raises:
        ValueError: there is no engine of that name here.
    """
    with one_search(time_limit):
        search = _Search(legs, box, rank_engine(legs, box, engine), recorder)
        return search.verdict(reason_of(lambda: search.run(most_boxes, progress)))


#: Lower and upper ends (B, 6) of boxes.
_Ends = tuple[FloatArray, FloatArray]


class _State(NamedTuple):
    """What is left of the whole box after a step: blocks to examine, those too small to bisect, and boxes examined."""

    stack: list[_Ends]
    small: list[_Ends]
    boxes: int

    @property
    def left(self) -> list[_Ends]:
        """All blocks that are left."""
        return [*self.stack, *self.small]

    @property
    def open(self) -> int:
        """Number of boxes that are left."""
        return sum(len(lower) for lower, _ in self.left)


class _Search:
    """The state of a search.

    Args:
        legs: joint centres.
        box: the whole box.
        engine: examines boxes.
        recorder: records them; None without a proof.
    """

    def __init__(self, legs: Legs, box: PoseBox, engine: RankEngine, recorder: TreeRecord | None = None) -> None:
        self._legs, self._box, self._engine, self._recorder = legs, box, engine, recorder
        self._began = time.perf_counter()
        self._state = _State([(box.lower[None], box.upper[None])], [], 0)
        self._points: dict[int, FloatArray] = {}
        self._sides: FloatArray | None = None
        self._built: SingularMachine | None = None

    def run(self, most_boxes: int | None, progress: RankProgress | None) -> str:
        """Search until no box is open; return the reason for stopping earlier, or an empty text."""
        reported = -math.inf
        reached(Milestone.BOUND)
        while self._state.stack:
            (*stack, (lower, upper)), small, boxes = self._state
            seconds = time.perf_counter() - self._began
            reason = reason_to_stop(seconds, boxes, most_boxes)
            if reason:
                return reason
            if progress is not None and seconds - reported >= REPORT_EVERY:
                reported = seconds
                progress(seconds, boxes, self._state.open)
            block = self._engine.block
            if len(lower) > block:
                stack.append((lower[block:], upper[block:]))
            found = self._engine.examine(lower[:block], upper[:block])
            if self._recorder is not None:
                self._recorder.ranks(lower[:block], upper[:block], found)
            halves, undivided = self._halves(found)
            self._state = _State(stack + halves, small + undivided, boxes + len(found.verdict))
            if self._is_refuted(found) or self._is_refuted_as_built(found):
                return ""
        return "boxes are left that are too small to bisect" if self._state.small else ""

    def _halves(self, found: RankExamination) -> tuple[list[_Ends], list[_Ends]]:
        """Return the halves of the open boxes, and those that are too small to bisect."""
        rows = np.flatnonzero(found.verdict == Rank.OPEN)
        lower, upper, split = found.lower[rows], found.upper[rows], found.split[rows]
        whole = np.where(self._box.upper > self._box.lower, self._box.upper - self._box.lower, np.inf)
        every = np.arange(rows.size)
        low, high = lower[every, split], upper[every, split]
        middle = 0.5 * low + 0.5 * high
        small = (((upper - lower) / whole).max(axis=1) < _LEAST_WIDTH) | ~((low < middle) & (middle < high))
        cut = ~small
        left, right = upper[cut].copy(), lower[cut].copy()
        columns = np.arange(len(left))
        left[columns, split[cut]] = right[columns, split[cut]] = middle[cut]
        halves = np.concatenate([lower[cut], right]), np.concatenate([left, upper[cut]])
        return [halves] * bool(len(left)), [(lower[small], upper[small])] * bool(small.any())

    def _is_refuted(self, found: RankExamination) -> bool:
        """Return whether two poses with determinants of opposite sign are known, from this block or an earlier one."""
        for sign in (-1, 1):
            if sign in self._points:
                continue
            for k in np.flatnonzero((found.sign == sign) & (found.verdict != Rank.OUTSIDE))[:4]:
                y = 0.5 * found.lower[k] + 0.5 * found.upper[k]
                if self._box.holds(y) and determinant_sign(self._legs, self._box, y) == sign:
                    self._points[sign] = y
                    break
        if len(self._points) < 2:
            return False
        self._sides = frozen_array([self._points[1], self._points[-1]], (2, 6))
        return True

    def _is_refuted_as_built(self, found: RankExamination) -> bool:
        """Return whether a machine within the tolerance is known that is singular in an open box of this block."""
        if self._legs.tolerance > 0:
            rows = found.verdict == Rank.OPEN
            self._built = singular_machine(self._legs, self._box, 0.5 * found.lower[rows] + 0.5 * found.upper[rows])
        return self._built is not None

    def verdict(self, reason: str) -> Regularity:
        """Return the verdict at this state of the search."""
        outcome, y, left = Outcome.OPEN if reason else Outcome.PROVED, None, self._state.left
        whole = self._box.upper - self._box.lower
        if self._sides is not None:
            outcome = Outcome.REFUTED
            y = singular_between(self._legs, self._box, *self._sides)
        elif self._built is not None:
            outcome, y = Outcome.REFUTED, self._built.y
        elif left:
            lower, upper = (np.concatenate(ends) for ends in zip(*left, strict=True))
            widths = ((upper - lower) / np.where(whole > 0, whole, np.inf)).max(axis=1)
            widest = int(first_largest(widths))
            y = 0.5 * lower[widest] + 0.5 * upper[widest]
        free = list(self._box.free)
        share = sum(float(((upper - lower)[:, free] / whole[free]).prod(axis=1).sum()) for lower, upper in left)
        return Regularity(
            outcome=outcome,
            box=self._box,
            y=None if y is None else frozen_array(y, (6,)),
            sides=self._sides,
            engine=self._engine.name,
            boxes=self._state.boxes,
            open=self._state.open,
            share=share,
            seconds=time.perf_counter() - self._began,
            reason="" if outcome is Outcome.PROVED else reason,
            errors=None if self._built is None else self._built.errors,
        )
