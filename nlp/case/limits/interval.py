"""Limits with one side or two: their tables in a case file, and their checks."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar, NamedTuple, Self

from pydantic import Field, FiniteFloat

from ....models import Dimension, Model
from ...errors import CaseError
from ...units import Units
from ..table import Table
from ..toml import TomlValue
from .limit import Limit, LimitedCase, Written


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

    @classmethod
    def from_table(cls, written: Written[AtLeast]) -> Self:
        """Return the limit that a case file writes."""
        return cls(written.value.min)

    def check(self, case: LimitedCase) -> None:
        """Refuse a value that is not positive.

        Raises:
            CaseError: in the words of a case file.
        """
        case.check_number(f"{self.key}.min", self.min)


class Sides(NamedTuple):
    """The smallest and the largest value of an interval; None where a side is not limited."""

    min: float | None
    max: float | None


@dataclass(frozen=True)
class IntervalLimit(Limit[IntervalTable], abc.ABC):
    """A limit with one side or two.

    Attributes:
        min: smallest value; None where there is none.
        max: largest value; None where there is none.
        measured: dimension of both.
        above: both must be larger than this.
    """

    _: KW_ONLY
    min: float | None = None
    max: float | None = None

    table: ClassVar[type[Table]] = IntervalTable
    measured: ClassVar[Dimension] = Dimension.LENGTH
    above: ClassVar[float] = 0.0

    @classmethod
    def from_table(cls, written: Written[IntervalTable]) -> Self:
        """Return the limit that a case file writes."""
        smallest, largest = sides(written, cls.measured)
        return cls(min=smallest, max=largest)

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:
        """Return the keys of ``[limits]`` that state this limit."""
        dimension, ends = self.dimension(model), {"min": self.min, "max": self.max}
        return {self.name: {name: units.written(value, dimension) for name, value in ends.items() if value is not None}}

    def dimension(self, model: Model) -> Dimension:  # noqa: ARG002 - most limits measure the same on every robot
        """Return the dimension of the measured quantity."""
        return self.measured

    def check(self, case: LimitedCase) -> None:
        """Refuse an interval without sides, with a side out of its range, or with crossed sides.

        Raises:
            CaseError: in the words of a case file.
        """
        key, dimension = f"limits.{self.name}", self.dimension(case.model)
        case.check_number(f"{self.name}.min", self.min, dimension, above=self.above)
        case.check_number(f"{self.name}.max", self.max, dimension, above=self.above)
        if self.min is None and self.max is None:
            raise CaseError(key, "must have min, max, or both")
        if self.min is not None and self.max is not None and not self.min < self.max:
            fault = f"must be below max = {case.units.text(self.max, dimension)}"
            raise CaseError(f"{key}.min", fault, case.units.shown(self.min, dimension))


def sides(written: Written[IntervalTable], dimension: Dimension) -> Sides:
    """Return both sides of an interval that a case file writes, as computations use them."""
    lower, upper = (
        None if side is None else written.internal(side, dimension) for side in (written.value.min, written.value.max)
    )
    return Sides(lower, upper)
