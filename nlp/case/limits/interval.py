"""Limits with one side or two: their tables in a case file, and their checks."""

from __future__ import annotations

import abc
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar, NamedTuple

from pydantic import Field, FiniteFloat

from ....models import Dimension, Model
from ...errors import CaseError
from ..table import Table
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
    """

    _: KW_ONLY
    min: float | None = None
    max: float | None = None

    table: ClassVar[type[Table]] = IntervalTable
    #: Both sides must be larger than this.
    above: ClassVar[float] = 0.0

    @abc.abstractmethod
    def dimension(self, model: Model) -> Dimension:
        """Return what is measured."""

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
