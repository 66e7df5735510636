"""Results of the examination of boxes: verdicts, bounds, and the parts of the boxes that are left."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ....models import FloatArray

#: An end of a box that contraction did not move, and one that was moved to the opposite face by monotonicity.
UNMOVED, COLLAPSED = -2, -1


class Verdict(enum.IntEnum):
    """Verdict on a box: open, or closed by a rule. The numbers are those of ``kernel/examination.h``."""

    OPEN = 0
    BOUNDED = 1  # its bound does not exceed the threshold
    INFEASIBLE = 2  # a condition holds nowhere in it
    MONOTONE = 3  # the functions increase along a variable, in a direction in which the whole box goes on
    EMPTIED = 4  # contraction along a variable left nothing of it


@dataclass(frozen=True, eq=False)
class Examination:
    """Results for B boxes.

    Attributes:
        verdict: (B,) :class:`Verdict`.
        reason: (B,) index of the condition that cannot hold, or of the variable that is monotone or emptied.
        bound: (B,) upper bound over the feasible part of the box; infinite where a value may be undefined.
        lower, upper: (n, B) the part of the box left by contraction, or the face that it collapsed on.
        cut_lower, cut_upper: (n, B) index of the expression that moved that end, or ``UNMOVED`` or ``COLLAPSED``.
        split: (B,) the variable to bisect next.
        value: (B,) lower bound of the maximised value at the centre; -inf where a condition may be violated.
        centre: (n, B).
    """

    verdict: NDArray[np.int32]
    reason: NDArray[np.int32]
    bound: FloatArray
    lower: FloatArray
    upper: FloatArray
    cut_lower: NDArray[np.int32]
    cut_upper: NDArray[np.int32]
    split: NDArray[np.int32]
    value: FloatArray
    centre: FloatArray
