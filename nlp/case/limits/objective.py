"""A limit on F itself: what an exchange of poses demands of F at every pose, where its worst value is optimised."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from .constraint import NOT_NEGATIVE, BoundedConstraint, between
from .interval import IntervalLimit
from .limit import PosedRobot


@dataclass(frozen=True)
class ObjectiveLimit(IntervalLimit):
    """Smallest or largest F of a case's only task at every pose; no key of a case file."""

    key: ClassVar[str] = "F"
    description: ClassVar[str] = "of the task"

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return F."""
        yield between(
            f"{self.key}{pose.where}", pose.robot.F[0], NOT_NEGATIVE, self.key, lower=self.min, upper=self.max
        )
