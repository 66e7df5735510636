"""Limits on the lengths of legs: at each pose, and of the actuator over all poses.

A leg's length is limited by its square, ``min^2 <= |d|^2 <= max^2``. An actuator's limits are written by pairs of
poses, because ``longest - shortest <= s`` means ``l_i - l_j <= s`` for all of them, and ``shortest >= e + stroke``
means ``2 l_i - l_j >= e``. No extra unknowns are needed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca
from pydantic import Field, FiniteFloat

from ....models import Model
from ...errors import CaseError
from ..table import Table
from .constraint import LENGTH, SQUARED_LENGTH, BoundedConstraint, between, bounded
from .interval import IntervalLimit
from .limit import Design, Limit, LimitedCase, PosedRobot, Written
from .quantity import QuantityLimit, quantity_named


@dataclass(frozen=True)
class LegLength(IntervalLimit):
    """Shortest and longest length of every leg at every pose."""

    key: ClassVar[str] = "leg_length"
    description: ClassVar[str] = "of every leg at every pose"
    needs_legs: ClassVar[bool] = True

    def exists_for(self, model: Model) -> bool:
        """Return whether a robot has legs, or a measure of this name without them."""
        return super().exists_for(model) or quantity_named(self.key, model) is not None

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the squared length of each leg between its squared limits."""
        if not pose.model.legs:
            # A robot without legs may have a measure of this name: that is limited as it is.
            yield from QuantityLimit(self.key, min=self.min, max=self.max).at_pose(pose)
        for leg in pose.robot.legs:
            name = f"leg_length limb {leg.name}{pose.where}"
            yield between(name, ca.sumsqr(leg.span), SQUARED_LENGTH, "leg_length", lower=self.min, upper=self.max)


class ActuatorTable(Table):
    """A telescoping leg over all poses; its stroke is its longest length less its shortest."""

    stroke_max: FiniteFloat | None = Field(default=None, description="largest stroke")
    dead_length: FiniteFloat | None = Field(
        default=None, description="what the leg has beside its stroke: shortest >= dead_length + stroke"
    )


@dataclass(frozen=True)
class Actuator(Limit[ActuatorTable]):
    """A telescoping leg over all poses: ``stroke = longest - shortest``.

    Attributes:
        stroke_max: the largest stroke.
        dead_length: length of the leg beside its stroke when retracted: ``shortest >= dead_length + stroke``.
    """

    stroke_max: float | None = None
    dead_length: float | None = None

    key: ClassVar[str] = "actuator"
    table: ClassVar[type[Table]] = ActuatorTable
    description: ClassVar[str] = "of every leg over all poses"
    needs_legs: ClassVar[bool] = True
    order: ClassVar[int] = 1

    @classmethod
    def from_table(cls, written: Written[ActuatorTable]) -> Self:
        """Return the limit that a case file writes."""
        return cls(written.value.stroke_max, written.value.dead_length)

    def check(self, case: LimitedCase) -> None:
        """Refuse an actuator without numbers, or with a number out of its range.

        Raises:
            CaseError: in the words of a case file.
        """
        case.check_number("actuator.stroke_max", self.stroke_max)
        case.check_number("actuator.dead_length", self.dead_length)
        if self.stroke_max is None and self.dead_length is None:
            raise CaseError("limits.actuator", "must have stroke_max or dead_length")

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return the stroke and the dead length of each leg, for each pair of poses."""
        robots = design.robots
        for i, leg in enumerate(robots[0].legs):
            lengths = [ca.norm_2(robot.legs[i].span) for robot in robots]
            for (a, shorter), (b, longer) in itertools.product(enumerate(lengths), repeat=2):
                pair = f" limb {leg.name}" + (f" poses {a + 1} and {b + 1}" if len(robots) > 1 else "")
                if self.stroke_max is not None and a != b:
                    key = "actuator.stroke_max"
                    yield bounded(f"{key}{pair}", longer - shorter, LENGTH, ("", key), upper=self.stroke_max)
                if self.dead_length is not None and (a != b or len(robots) == 1):
                    key = "actuator.dead_length"
                    yield bounded(f"{key}{pair}", 2 * shorter - longer, LENGTH, (key, ""), lower=self.dead_length)
