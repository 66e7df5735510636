"""Verdicts on a workspace: proved, refuted with a pose, or open with the reason."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from ....models import FloatArray
from ...evidence.singularities import SingularityKind
from ..statement.machine import JointErrors
from .robot.pose_box import PoseBox, PoseNumbers

#: Part of a limit by which a value may be beyond it and still count as on it: rounding.
_ON_LIMIT = 1e-9
#: How a singular pose of a structure is known that is singular at every pose.
EVERYWHERE = SingularityKind.ARCHITECTURE.clause


class Outcome(enum.Enum):
    """Verdict on a claim about every pose; each value is the word in results."""

    PROVED = "proved"
    REFUTED = "refuted"
    OPEN = "open"


@dataclass(frozen=True, eq=False)
class RankVerdict:
    """Verdict on the claim that J, or the constraint wrenches, keep their rank at every pose.

    Attributes:
        outcome: the verdict.
        box: the box of poses.
        y: (6,) coordinates of a singular pose where the claim is refuted, and of the centre of the widest open box
            where it is open; None where it is proved.
        sides: (2, 6) two poses of the workspace at which the determinant of the rows is proved to have opposite signs,
            where the claim is refuted so.
        engine: ``c``, or ``none`` where no search was made.
        boxes: number of boxes examined.
        open: number of boxes left.
        share: part of the box's volume, that of its coordinates, in boxes that are left.
        seconds: wall time.
        reason: for stopping before every box was closed; else empty.
        errors: of the joint centres of the machine that is singular at ``y``; None for the exact machine.
    """

    outcome: Outcome
    box: PoseBox
    y: FloatArray | None
    sides: FloatArray | None
    engine: str
    boxes: int
    open: int
    share: float
    seconds: float
    reason: str
    errors: JointErrors | None = None

    @property
    def pose(self) -> PoseNumbers | None:
        """The pose with the coordinates ``y``; None without them."""
        return None if self.y is None else self.box.pose(self.y)

    @property
    def fails(self) -> bool:
        """Whether the claim is not proved."""
        return self.outcome is not Outcome.PROVED


def slack_of(limit: float) -> float:
    """Return how far a value may be beyond a limit and still count as on it: a part of the limit, for rounding.

    It is a part of the limit and not of the value: a value far from its limit decides it without any slack.
    """
    return _ON_LIMIT * abs(limit)
