"""The limits of a case together: from the table of its file, in the order of the registry, and their check."""

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

#: Likeness of names from which on one is a slip for the other, and no measure of another robot.
_SLIP = 0.85

LimitT = TypeVar("LimitT", bound=Limit[Any])


@dataclass(frozen=True, init=False)
class Limits:
    """The limits of a case, such as ``Limits(LegLength(min=28, max=40), LegClearance(min=2))``.

    Attributes:
        items: the limits, in the order of the registry.

    Raises:
        CaseError: one limit is given twice.
    """

    items: tuple[Limit[Any], ...]

    def __init__(self, *limits: Limit[Any]) -> None:
        names = [limit.name for limit in limits]
        for name in names:
            if names.count(name) > 1:
                raise CaseError(f"limits.{name}", "is given more than once")
        object.__setattr__(self, "items", tuple(sorted(limits, key=_rank)))

    @classmethod
    def from_table(cls, written: Table | None, model: Model, units: Units) -> Limits:
        """Return the limits that a case file states.

        Args:
            written: the table ``[limits]``; None where there is none.
            model: the robot.
            units: the file's units.

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
        """Return the limit of a type, the first where there are several, or None where there is none."""
        return next((limit for limit in self.items if isinstance(limit, kind)), None)

    def check(self, case: LimitedCase) -> None:
        """Refuse limits that the robot they are for cannot have, or whose numbers mean nothing.

        Raises:
            CaseError: a number is out of its range, two sides are crossed, or the robot has no such measure.
        """
        for limit in self.items:
            if not limit.exists_for(case.model):
                known = _measures(case.model)
                hint = did_you_mean(limit.name, known, _SLIP) if limit.name not in known else ""
                fault = f"is nothing that {case.model.name!r} has; {hint}it has {listing(known)}"
                raise CaseError(f"limits.{limit.name}", fault)
        for limit in self.items:
            limit.check(case)


def _rank(limit: Limit[Any]) -> int:
    """Return the place of a limit's type in the registry; types of the user's own come last."""
    from .registry import LIMIT_TYPES  # noqa: PLC0415 - a case without limits starts without their tables

    return LIMIT_TYPES.index(type(limit)) if type(limit) in LIMIT_TYPES else len(LIMIT_TYPES)


def _measures(model: Model) -> list[str]:
    """Return the keys of ``[limits]`` that mean something for a robot."""
    from .registry import LIMIT_TYPES  # noqa: PLC0415 - a case without limits starts without their tables

    of_legs = [kind.key for kind in LIMIT_TYPES if kind.needs_legs and kind.is_for(model)]
    own = [quantity.name for quantity in model.quantities]
    always = [kind.key for kind in LIMIT_TYPES if not kind.needs_legs and kind.fields() and kind.is_for(model)]
    return list(dict.fromkeys([*of_legs, *own, *always]))
