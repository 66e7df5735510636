"""Limits with one side or two: their tables in a case file, and their checks."""

from __future__ import annotations

import abc
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar

from pydantic import Field, FiniteFloat

from ...errors import CaseError
from ..table import Table
from .limit import Limit, LimitedCase, NumberRange, Ranges


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

    def check(self, case: LimitedCase) -> None:
        """Refuse an interval without sides, with a side out of its range, or with crossed sides.

        Raises:
            CaseError: in the words of a case file.
        """
        key = f"limits.{self.name}"
        if self.min is None and self.max is None:
            raise CaseError(key, "must have min, max, or both")
        super().check(case)
        if self.min is not None and self.max is not None and not self.min < self.max:
            dimension = self.ranges(case.model)["min"].dimension
            fault = f"must be below max = {case.units.text(self.max, dimension)}"
            raise CaseError(f"{key}.min", fault, case.units.shown(self.min, dimension))
