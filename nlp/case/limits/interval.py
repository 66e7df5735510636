"""Limits with a smallest or a largest value: tables, base classes, and limits on quantities that a robot defines."""

from __future__ import annotations

import abc
import math
from collections.abc import Iterator
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar, Self

from pydantic import Field, FiniteFloat, model_validator

from ....models import Dimension, Model, Quantity
from ....models.posesettings import value_name
from ...units import Units
from ..table import Table, fault_of
from .constraint import BoundedConstraint, Reading, between
from .limit import Limit, NumberRange, PosedRobot, Ranges, TableField, Written


class LimitTable(Table):
    """Table of a limit; a value of another type is refused with an example of the table."""

    @model_validator(mode="before")
    @classmethod
    def _refuse_no_table(cls, table: object) -> object:
        """Refuse a value that is not a table."""
        if isinstance(table, dict | Table):
            return table
        raise fault_of("", f"must be a table, such as {cls.example(table)}")

    @classmethod
    def example(cls, value: object = None) -> str:
        """Return an example of the table: with its required keys; without any, with min and max, or with all keys.

        Args:
            value: value in place of the table; a number becomes the value of ``min`` or ``max`` if one is required.
        """
        required = [name for name, field in cls.model_fields.items() if field.is_required()]
        keys = required or [key for key in cls.allowed_keys() if key in ("min", "max")] or cls.allowed_keys()
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        texts = {key: str(value) if is_number and key in ("min", "max") and required else "..." for key in keys}
        return f"{{ {', '.join(f'{key} = {text}' for key, text in texts.items())} }}"


class IntervalTable(LimitTable):
    """Limit with a smallest value, a largest value, or both."""

    min: FiniteFloat | None = Field(default=None, description="smallest allowed value")
    max: FiniteFloat | None = Field(default=None, description="largest allowed value")


class AtLeast(LimitTable):
    """Limit with a smallest value."""

    min: FiniteFloat = Field(description="smallest allowed value")


class AtMost(LimitTable):
    """Limit with a largest value."""

    max: FiniteFloat = Field(description="largest allowed value")


@dataclass(frozen=True)
class LowerLimit(Limit[AtLeast], abc.ABC):
    """Limit with a smallest length.

    Attributes:
        min: smallest allowed length, above 0.
    """

    min: float

    table: ClassVar[type[Table]] = AtLeast
    numbers: ClassVar[Ranges] = {"min": NumberRange()}


def two_sided(allowed: NumberRange) -> Ranges:
    """Return the allowed ranges of ``min`` and of ``max``: the same range for both."""
    return {"min": allowed, "max": allowed}


@dataclass(frozen=True)
class IntervalLimit(Limit[IntervalTable], abc.ABC):
    """Limit with a smallest value, a largest value, or both.

    Attributes:
        min: smallest allowed value; None for no lower limit.
        max: largest allowed value; None for no upper limit.
    """

    _: KW_ONLY
    min: float | None = None
    max: float | None = None

    table: ClassVar[type[Table]] = IntervalTable
    numbers: ClassVar[Ranges] = two_sided(NumberRange())


def quantity_named(name: str, model: Model) -> Quantity | None:
    """Return the quantity of a robot with a name; None if the robot has no such quantity."""
    return next((quantity for quantity in model.quantities if quantity.name == name), None)


def value_of(quantity: str, owner: str) -> str:
    """Return the name of one value of a quantity, with the limb or joint that owns it; a setting has no limb."""
    return quantity if quantity == value_name(owner) else f"{quantity} limb {owner}"


@dataclass(frozen=True)
class QuantityLimit(IntervalLimit):
    """Smallest and largest value of a quantity that the robot defines, for every limb and every pose.

    Attributes:
        measure: name of the quantity.
    """

    measure: str

    key: ClassVar[str] = ""
    order: ClassVar[int] = 1

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return no key: every key of ``[limits]`` that is not of another type is the name of a quantity."""
        return {}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield a limit for each key of ``[limits]`` that is not of another type, in the order of the quantities."""
        stated = limits.__pydantic_extra__ or {}
        names = [quantity.name for quantity in model.quantities if quantity.name in stated]
        for key in dict.fromkeys([*names, *stated]):
            yield cls.from_table(Written(key, stated[key], limits, model, units))

    @classmethod
    def from_table(cls, written: Written[IntervalTable]) -> Self:
        """Return the limit of a case file."""
        return cls(written.key, **written.numbers(cls(written.key).ranges(written.model)))

    @property
    def name(self) -> str:
        """Name of the quantity, which is the key of this limit."""
        return self.measure

    def ranges(self, model: Model) -> Ranges:
        """Return the allowed ranges of ``min`` and ``max``; those of plain numbers if the robot lacks the quantity."""
        quantity = quantity_named(self.measure, model)
        return two_sided(NumberRange(Dimension.NUMBER if quantity is None else quantity.dimension, above=-math.inf))

    def exists_for(self, model: Model) -> bool:
        """Return whether the robot has the quantity."""
        return quantity_named(self.measure, model) is not None

    def at_pose(self, pose: PosedRobot) -> Iterator[BoundedConstraint]:
        """Return the quantity of each limb."""
        for quantity, values in zip(pose.model.quantities, pose.robot.quantities, strict=True):
            if quantity.name == self.measure:
                for i, owner in enumerate(quantity.owners):
                    name, reading = value_of(quantity.name, owner) + pose.where, Reading(quantity.dimension)
                    yield between(name, values[i], reading, quantity.name, lower=self.min, upper=self.max)
