"""Limit on F at every pose, which the exchange method uses to optimise the worst F over a workspace or path."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from .constraint import NOT_NEGATIVE, BoundedConstraint, between
from .interval import IntervalLimit
from .limit import PosedRobot


@dataclass(frozen=True)
class ObjectiveLimit(IntervalLimit):
    """Smallest or largest F of the only task at every pose; not available in case files."""

    key: ClassVar[str] = "F"
    description: ClassVar[str] = "F of the task"

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the constraint on F."""
        yield between(
            f"{self.key}{pose.where}", pose.robot.F[0], NOT_NEGATIVE, self.key, lower=self.min, upper=self.max
        )
