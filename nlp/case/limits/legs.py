"""Limits on leg lengths: at each pose, and on stroke and retracted length over all poses.

The length of a leg is limited by its square, ``min^2 <= |d|^2 <= max^2``. Limits over all poses are constraints on
pairs of poses: ``longest - shortest <= s`` means ``l_i - l_j <= s`` for all pairs, and ``shortest >= e + stroke`` means
``2 l_i - l_j >= e``. This needs no additional variables.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import casadi as ca
from casadi import SX
from pydantic import Field, FiniteFloat

from ....models import Dimension, Model, RobotInstance
from ..table import Table
from .constraint import POSITIVE_LENGTH, SQUARED_LENGTH, BoundedConstraint, Call, Extent, Form, PairFamily, between
from .interval import IntervalLimit, LimitTable, QuantityLimit, quantity_named
from .limit import Design, Limit, Measures, NumberRange, PosedRobot, Ranges


@dataclass(frozen=True)
class LegLength(IntervalLimit):
    """Smallest and largest length of every leg at every pose."""

    key: ClassVar[str] = "leg_length"
    description: ClassVar[str] = "smallest and largest length of every leg, at every pose"
    needs_legs: ClassVar[bool] = True

    def exists_for(self, model: Model) -> bool:
        """Return whether a robot has legs, or defines a quantity ``leg_length``."""
        return super().exists_for(model) or quantity_named(self.key, model) is not None

    def measures(self, robot: RobotInstance) -> Measures | None:
        """Return the leg lengths of a robot given joint by joint; for other robots, the model's quantity has them."""
        if not (robot.legs and robot.joints):
            return None
        lengths = ca.vertcat(*[ca.norm_2(leg.span) for leg in robot.legs])
        return Measures(tuple(leg.name for leg in robot.legs), lengths, Dimension.LENGTH)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the squared length of each leg between its squared limits."""
        if not pose.model.legs:
            # A robot without legs may define a quantity with this name, which is then limited directly.
            yield from QuantityLimit(self.key, min=self.min, max=self.max).at_pose(pose)
        for leg in pose.robot.legs:
            name = f"leg_length limb {leg.name}{pose.where}"
            squared = Call(Form(ca.sumsqr), leg.span)
            yield between(name, squared, SQUARED_LENGTH, "leg_length", lower=self.min, upper=self.max)


class ActuatorTable(LimitTable):
    """Telescoping leg over all poses; its stroke is longest minus shortest length."""

    stroke_max: FiniteFloat | None = Field(
        default=None, description="largest stroke of a leg: longest minus shortest length over all poses"
    )
    dead_length: FiniteFloat | None = Field(
        default=None,
        description="length of a retracted leg minus its stroke; the shortest length must be at least "
        "dead_length + stroke",
    )


def _stroke(spans: SX) -> SX:
    """Return longer minus shorter length (1, 1) from the shorter and the longer span of a leg, stacked (6, 1)."""
    return ca.norm_2(spans[3:]) - ca.norm_2(spans[:3])


def _dead_length(spans: SX) -> SX:
    """Return shorter length minus stroke (1, 1) from the shorter and the longer span of a leg, stacked (6, 1)."""
    return 2 * ca.norm_2(spans[:3]) - ca.norm_2(spans[3:])


@dataclass(frozen=True)
class Actuator(Limit[ActuatorTable]):
    """Limits of telescoping legs over all poses: ``stroke = longest - shortest``.

    Attributes:
        stroke_max: largest stroke of a leg, length; None for no limit.
        dead_length: retracted length of a leg minus its stroke: ``shortest >= dead_length + stroke``; None for none.
    """

    stroke_max: float | None = None
    dead_length: float | None = None

    key: ClassVar[str] = "actuator"
    table: ClassVar[type[Table]] = ActuatorTable
    description: ClassVar[str] = "stroke and retracted length of every leg, over all poses"
    numbers: ClassVar[Ranges] = {"stroke_max": NumberRange(), "dead_length": NumberRange()}
    needs_legs: ClassVar[bool] = True
    order: ClassVar[int] = 1

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return the constraint on each leg length for a single pose, at which the stroke is 0."""
        if len(design.robots) == 1 and self.dead_length is not None:
            key = "actuator.dead_length"
            for leg in design.robots[0].legs:
                length = ca.norm_2(leg.span)
                yield between(f"{key} limb {leg.name}", length, POSITIVE_LENGTH, (key, ""), lower=self.dead_length)

    def on_pairs(self, design: Design) -> Iterator[PairFamily]:
        """Return the constraints on stroke and dead length of each leg, for all pairs of poses."""
        if len(design.robots) == 1:
            return
        for i, leg in enumerate(design.robots[0].legs):
            spans = ca.horzcat(*[robot.legs[i].span for robot in design.robots])
            lengths = ca.vertcat(*[ca.norm_2(spans[:, k]) for k in range(len(design.robots))])
            yield PairFamily(lengths, partial(self._pair, leg.name, spans), tuple(self._extents(leg.name)))

    def _pair(self, leg: str, spans: SX, a: int, b: int) -> tuple[BoundedConstraint, ...]:
        """Return the constraints on a leg with spans (3, N) that is shorter at pose ``a`` than at pose ``b``."""
        where, limits = f" limb {leg} poses {a + 1} and {b + 1}", []
        both = ca.vertcat(spans[:, a], spans[:, b])
        if self.stroke_max is not None:
            key = "actuator.stroke_max"
            stroke = Call(Form(_stroke), both)
            limits.append(between(f"{key}{where}", stroke, POSITIVE_LENGTH, ("", key), upper=self.stroke_max))
        if self.dead_length is not None:
            key, dead = "actuator.dead_length", Call(Form(_dead_length), both)
            limits.append(between(f"{key}{where}", dead, POSITIVE_LENGTH, (key, ""), lower=self.dead_length))
        return tuple(limits)

    def _extents(self, leg: str) -> Iterator[Extent]:
        """Yield the limits on the shortest and the longest length of a leg."""
        if self.stroke_max is not None:
            yield Extent(f"actuator.stroke_max limb {leg}", 1.0, self.stroke_max)
        if self.dead_length is not None:
            yield Extent(f"actuator.dead_length limb {leg}", 2.0, -self.dead_length)
