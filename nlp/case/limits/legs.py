"""Limits on the lengths of legs: at each pose, and of the actuator over all poses.

A leg's length is limited by its square, ``min^2 <= |d|^2 <= max^2``. An actuator's limits are written by pairs of
poses, because ``longest - shortest <= s`` means ``l_i - l_j <= s`` for all of them, and ``shortest >= e + stroke``
means ``2 l_i - l_j >= e``. No extra unknowns are needed, and of many pairs only those that can bind become constraints.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import casadi as ca
from casadi import SX
from pydantic import Field, FiniteFloat

from ....models import Dimension, Model, RobotInstance
from ..table import Table
from .constraint import POSITIVE_LENGTH, SQUARED_LENGTH, BoundedConstraint, Call, Form, PairFamily, between
from .interval import IntervalLimit, QuantityLimit, quantity_named
from .limit import Design, Limit, Measures, NumberRange, PosedRobot, Ranges


@dataclass(frozen=True)
class LegLength(IntervalLimit):
    """Shortest and longest length of every leg at every pose."""

    key: ClassVar[str] = "leg_length"
    description: ClassVar[str] = "of every leg at every pose"
    needs_legs: ClassVar[bool] = True

    def exists_for(self, model: Model) -> bool:
        """Return whether a robot has legs, or a measure of this name without them."""
        return super().exists_for(model) or quantity_named(self.key, model) is not None

    def measures(self, robot: RobotInstance) -> Measures | None:
        """Return the lengths of a robot given joint by joint; the model's own quantity states those of other legs."""
        if not (robot.legs and robot.joints):
            return None
        lengths = ca.vertcat(*[ca.norm_2(leg.span) for leg in robot.legs])
        return Measures(tuple(leg.name for leg in robot.legs), lengths, Dimension.LENGTH)

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the squared length of each leg between its squared limits."""
        if not pose.model.legs:
            # A robot without legs may have a measure of this name: that is limited as it is.
            yield from QuantityLimit(self.key, min=self.min, max=self.max).at_pose(pose)
        for leg in pose.robot.legs:
            name = f"leg_length limb {leg.name}{pose.where}"
            squared = Call(Form(ca.sumsqr), leg.span)
            yield between(name, squared, SQUARED_LENGTH, "leg_length", lower=self.min, upper=self.max)


class ActuatorTable(Table):
    """A telescoping leg over all poses; its stroke is its longest length less its shortest."""

    stroke_max: FiniteFloat | None = Field(default=None, description="largest stroke")
    dead_length: FiniteFloat | None = Field(
        default=None, description="what the leg has beside its stroke: shortest >= dead_length + stroke"
    )


def _stroke(spans: SX) -> SX:
    """Return the longer length less the shorter, (1, 1), from a leg's shorter and longer span, (6, 1) together."""
    return ca.norm_2(spans[3:]) - ca.norm_2(spans[:3])


def _dead_length(spans: SX) -> SX:
    """Return the shorter length less the stroke, (1, 1), from a leg's shorter and longer span, (6, 1) together."""
    return 2 * ca.norm_2(spans[:3]) - ca.norm_2(spans[3:])


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
    numbers: ClassVar[Ranges] = {"stroke_max": NumberRange(), "dead_length": NumberRange()}
    needs_legs: ClassVar[bool] = True
    order: ClassVar[int] = 1

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return the dead length of each leg at a single pose, where it has no stroke."""
        if len(design.robots) == 1 and self.dead_length is not None:
            key = "actuator.dead_length"
            for leg in design.robots[0].legs:
                length = ca.norm_2(leg.span)
                yield between(f"{key} limb {leg.name}", length, POSITIVE_LENGTH, (key, ""), lower=self.dead_length)

    def on_pairs(self, design: Design) -> Iterator[PairFamily]:
        """Return the stroke and the dead length of each leg, for all pairs of poses."""
        if len(design.robots) == 1:
            return
        for i, leg in enumerate(design.robots[0].legs):
            spans = ca.horzcat(*[robot.legs[i].span for robot in design.robots])
            lengths = ca.vertcat(*[ca.norm_2(spans[:, k]) for k in range(len(design.robots))])
            yield PairFamily(lengths, partial(self._pair, leg.name, spans), self._slack)

    def _pair(self, leg: str, spans: SX, a: int, b: int) -> tuple[BoundedConstraint, ...]:
        """Return the constraints on a leg, with its spans (3, N), that is shorter at pose ``a`` than at ``b``."""
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

    def _slack(self, shorter: float, longer: float) -> float:
        """Return the least distance to the limits of two lengths of a leg, negative outside."""
        stroke = math.inf if self.stroke_max is None else self.stroke_max - (longer - shorter)
        dead = math.inf if self.dead_length is None else 2 * shorter - longer - self.dead_length
        return min(stroke, dead)
