"""Limits with one side or two: their tables in a case file, their checks, and limits on any measure of a robot."""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar, Self

from pydantic import Field, FiniteFloat

from ....models import Dimension, Model, Quantity
from ...units import Units
from ..table import Table
from .constraint import BoundedConstraint, Reading, between
from .limit import Limit, NumberRange, PosedRobot, Ranges, TableField, Written


class IntervalTable(Table):
    """A limit with one side or two."""

    min: FiniteFloat | None = Field(default=None, description="smallest value")
    max: FiniteFloat | None = Field(default=None, description="largest value")


class AtLeast(Table):
    """A limit from below."""

    min: FiniteFloat = Field(description="smallest value")


class AtMost(Table):
    """A limit from above."""

    max: FiniteFloat = Field(description="largest value")


@dataclass(frozen=True)
class LowerLimit(Limit[AtLeast], abc.ABC):
    """A positive limit from below on a length.

    Attributes:
        min: smallest value, length.
    """

    min: float

    table: ClassVar[type[Table]] = AtLeast
    numbers: ClassVar[Ranges] = {"min": NumberRange()}


def two_sided(allowed: NumberRange) -> Ranges:
    """Return the ranges of the numbers of an interval, both the same."""
    return {"min": allowed, "max": allowed}


@dataclass(frozen=True)
class IntervalLimit(Limit[IntervalTable], abc.ABC):
    """A limit with one side or two.

    Attributes:
        min: smallest value; None where there is none.
        max: largest value; None where there is none.
    """

    _: KW_ONLY
    min: float | None = None
    max: float | None = None

    table: ClassVar[type[Table]] = IntervalTable
    numbers: ClassVar[Ranges] = two_sided(NumberRange())


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
