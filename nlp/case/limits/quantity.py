"""A limit on any other measure that the robot itself has, by the measure's name."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Self

from ....models import Dimension, Model, Quantity
from ...units import Units
from ..table import Table
from .constraint import BoundedConstraint, Reading, between
from .interval import IntervalLimit, IntervalTable, two_sided
from .limit import NumberRange, PosedRobot, Ranges, TableField, Written


def quantity_named(name: str, model: Model) -> Quantity | None:
    """Return the measure of a robot that has a name, or None where there is none."""
    return next((quantity for quantity in model.quantities if quantity.name == name), None)


@dataclass(frozen=True)
class QuantityLimit(IntervalLimit):
    """Smallest and largest value of one of the robot's own measures, at every owner and every pose.

    Attributes:
        measure: name of the measure.
    """

    measure: str

    key: ClassVar[str] = ""
    order: ClassVar[int] = 1

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return nothing: every key of ``[limits]`` that belongs to no type is the name of a measure."""
        return {}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield a limit for each key of ``[limits]`` that belongs to no type, in the order of the robot's measures."""
        stated = limits.__pydantic_extra__ or {}
        names = [quantity.name for quantity in model.quantities if quantity.name in stated]
        for key in dict.fromkeys([*names, *stated]):
            yield cls.from_table(Written(key, stated[key], limits, model, units))

    @classmethod
    def from_table(cls, written: Written[IntervalTable]) -> Self:
        """Return the limit that a case file writes."""
        return cls(written.key, **written.numbers(cls(written.key).ranges(written.model)))

    @property
    def name(self) -> str:
        """Name of the measure."""
        return self.measure

    def ranges(self, model: Model) -> Ranges:
        """Return the range of both numbers; that of pure numbers where the robot lacks the measure."""
        quantity = quantity_named(self.measure, model)
        return two_sided(NumberRange(Dimension.NUMBER if quantity is None else quantity.dimension, above=-math.inf))

    def exists_for(self, model: Model) -> bool:
        """Return whether the robot has the measure."""
        return quantity_named(self.measure, model) is not None

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the measure of each of its owners."""
        for quantity, values in zip(pose.model.quantities, pose.robot.quantities, strict=True):
            if quantity.name == self.measure:
                for i, owner in enumerate(quantity.owners):
                    name, reading = f"{quantity.name} limb {owner}{pose.where}", Reading(quantity.dimension)
                    yield between(name, values[i], reading, quantity.name, lower=self.min, upper=self.max)
