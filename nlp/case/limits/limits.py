"""All limits of a case: their reader, their order and their check."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from ....models import Model
from ...errors import CaseError, did_you_mean, listing
from ...units import Units
from .limit import Limit, LimitedCase

if TYPE_CHECKING:
    from ..table import Table

#: Smallest similarity at which an unknown name is taken for a spelling error, and not for a quantity of another robot.
_SLIP = 0.85

LimitT = TypeVar("LimitT", bound=Limit[Any])


@dataclass(frozen=True, init=False)
class Limits:
    """Limits of a case, such as ``Limits(LegLength(min=28, max=40), LegClearance(min=2))``.

    Attributes:
        items: limits, in the order of the registry.

    Raises:
        CaseError: a limit is given twice.
    """

    items: tuple[Limit[Any], ...]

    def __init__(self, *limits: Limit[Any]) -> None:
        names = [limit.name for limit in limits]
        for name in names:
            if names.count(name) > 1:
                raise CaseError(f"limits.{name}", f"must be given once, got {names.count(name)} limits with this name")
        object.__setattr__(self, "items", tuple(sorted(limits, key=_rank)))

    @classmethod
    def from_table(cls, written: Table | None, model: Model, units: Units) -> Limits:
        """Return the limits of a case file.

        Args:
            written: table ``[limits]``; None without a table.
            model: the robot.
            units: units of the file.

        Raises:
            CaseError: the table contradicts itself.
        """
        if written is None:
            return cls()
        from .registry import LIMIT_TYPES  # noqa: PLC0415 - a case without limits starts without their tables

        return cls(*(limit for kind in LIMIT_TYPES for limit in kind.read(written, model, units)))

    def __iter__(self) -> Iterator[Limit[Any]]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)

    def of(self, kind: type[LimitT]) -> LimitT | None:
        """Return the first limit of a type; None if there is none."""
        return next((limit for limit in self.items if isinstance(limit, kind)), None)

    def check(self, case: LimitedCase) -> None:
        """Check all limits against the case.

        Args:
            case: part of the case on which limits depend.

        Raises:
            CaseError: a value is outside of its range, min is not below max, or the robot has no such quantity.
        """
        for limit in self.items:
            if not limit.exists_for(case.model):
                known = _measures(case.model)
                hint = did_you_mean(limit.name, known, _SLIP) if limit.name not in known else ""
                fault = f"no such limit for the robot {case.model.name!r}; {hint}allowed: {listing(known)}"
                raise CaseError(f"limits.{limit.name}", fault)
        for limit in self.items:
            limit.check(case)


def _rank(limit: Limit[Any]) -> int:
    """Return the index of a limit's type in the registry; types outside of the registry come last."""
    from .registry import LIMIT_TYPES  # noqa: PLC0415 - a case without limits starts without their tables

    return LIMIT_TYPES.index(type(limit)) if type(limit) in LIMIT_TYPES else len(LIMIT_TYPES)


def _measures(model: Model) -> list[str]:
    """Return the keys of ``[limits]`` that a robot can have."""
    from .registry import LIMIT_TYPES  # noqa: PLC0415 - a case without limits starts without their tables

    of_legs = [kind.key for kind in LIMIT_TYPES if kind.needs_legs and kind.is_for(model)]
    measures = [quantity.name for quantity in model.quantities]
    always = [kind.key for kind in LIMIT_TYPES if not kind.needs_legs and kind.fields() and kind.is_for(model)]
    return list(dict.fromkeys([*of_legs, *measures, *always]))
