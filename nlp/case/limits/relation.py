"""A limit in words of the user's own: relations between the case's numbers, such as ``x1 - 1.5*x2 >= 0``.

Numbers are in the case's units in a relation; :mod:`screwsynth.nlp.case.limits.grammar` has the language.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from pydantic import Field

from ....models import Dimension, Model
from ...errors import CaseError
from ...units import Units
from ..table import Table
from ..toml import TomlValue
from .constraint import NUMBER, BoundedConstraint, Constraint
from .grammar import SentenceError, expression, parse
from .limit import Design, Limit, LimitedCase, TableField, Written


@dataclass(frozen=True, init=False)
class Relations(Limit[list[str]]):
    """Relations between the case's own numbers.

    Attributes:
        texts: each relation as it is written.
    """

    texts: tuple[str, ...]

    key: ClassVar[str] = "custom"
    table: ClassVar[Any] = list[str]
    description: ClassVar[str] = 'relations such as "x1 - 1.5*x2 >= 0"'

    def __init__(self, *texts: str) -> None:
        object.__setattr__(self, "texts", texts)

    @classmethod
    def fields(cls) -> dict[str, TableField]:
        """Return the key of the list, which is empty if left out."""
        return {cls.key: TableField(cls.table, Field(default_factory=list, description=cls.description))}

    @classmethod
    def read(cls, limits: Table, model: Model, units: Units) -> Iterator[Self]:
        """Yield the relations that a case file states, if there are any."""
        return (each for each in super().read(limits, model, units) if each.texts)

    @classmethod
    def from_table(cls, written: Written[list[str]]) -> Self:
        """Return the relations that a case file writes."""
        return cls(*written.value)

    def to_keys(self, model: Model, units: Units) -> Mapping[str, TomlValue]:  # noqa: ARG002 - texts have no units
        """Return the keys of ``[limits]`` that state the relations."""
        return {self.key: list(self.texts)}

    def check(self, case: LimitedCase) -> None:
        """Refuse a relation that cannot be understood.

        Raises:
            CaseError: in the words of a case file.
        """
        for index, text in enumerate(self.texts):
            try:
                parse(text, case.scalars)
            except SentenceError as error:
                raise CaseError(f"limits.custom[{index}]", str(error), text) from None

    def of_design(self, design: Design) -> Iterator[BoundedConstraint]:
        """Return left side less right side of each relation."""
        dimensions = design.case.scalars
        unit = design.case.units.to_internal(1.0, Dimension.ANGLE)
        shown = {
            name: design.numbers[name] / (unit if dimension is Dimension.ANGLE else 1.0)
            for name, dimension in dimensions.items()
        }
        for k, text in enumerate(self.texts):
            relation = parse(text, dimensions)
            difference = expression(relation.left, shown, unit) - expression(relation.right, shown, unit)
            lower = -math.inf if relation.sign == "<=" else 0.0
            upper = math.inf if relation.sign == ">=" else 0.0
            key = f"custom[{k}]"
            keys = ("" if relation.sign == "<=" else key, "" if relation.sign == ">=" else key)
            yield BoundedConstraint(Constraint(f"custom: {text.strip()}", difference, NUMBER, keys), lower, upper)
