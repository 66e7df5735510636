"""All limits of a case: their reader, their order and their check."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from ....models import Model
from ...errors import CaseError, did_you_mean, listing, nearest
from ...units import Units
from .limit import Limit, LimitedCase

if TYPE_CHECKING:
    from ..table import Table

#: Smallest similarity at which an unknown name is taken for a spelling error, and not for a quantity of another robot.
_SLIP = 0.85

#: Value of a limit by its key: smallest and largest value, values by name, or one number for the largest angle.
LimitValue: TypeAlias = Sequence[float | None] | Mapping[str, object] | Sequence[str] | float

LimitT = TypeVar("LimitT", bound=Limit[Any])


@dataclass(frozen=True, init=False)
class Limits:
    """Limits of a case, such as ``Limits(LegLength(min=28, max=40), LegClearance(min=2))``.

    Limits can also be given by the keys of ``[limits]`` in a case file, as in ``Limits(leg_length=(28, 40),
    leg_clearance=(2, None))``. The value is the smallest and the largest value, with None for no limit; or a mapping of
    the limit's arguments, such as ``actuator={"stroke_max": 12}``. Lengths are in the case's unit, angles in radians.
    Any other key is the name of a quantity that the robot defines.

    Attributes:
        items: limits, in the order of the registry.

    Raises:
        CaseError: a limit is given twice, or the value of a key has a wrong form.
    """

    items: tuple[Limit[Any], ...]

    def __init__(self, *limits: Limit[Any], **by_key: LimitValue) -> None:
        limits = (*limits, *(_limit_of(key, value) for key, value in by_key.items()))
        for limit in limits:
            if not isinstance(limit, Limit):
                fault = "must be limits such as LegLength(min=28), or keys with values such as leg_length=(28, 40)"
                raise CaseError("limits", f"{fault}, got {type(limit).__name__} {limit!r:.60}")
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


def _limit_of(key: str, value: LimitValue) -> Limit[Any]:
    """Return the limit of a key in ``[limits]``.

    Raises:
        CaseError: the value has a wrong form, or a value is missing.
    """
    from .registry import LIMIT_TYPES  # noqa: PLC0415 - a case without limits starts without their tables

    kinds = {kind.key: kind for kind in LIMIT_TYPES}
    kind, name = kinds.get(key, kinds[""]), f"limits.{key}"
    if key == "joint":
        raise CaseError(name, "must be stated as JointMotion or JointCone, such as JointMotion('2:3', max=0.5)")
    known = {field.name: field for field in fields(kind) if field.name != "measure"}
    if key == "custom" and (isinstance(value, str) or (isinstance(value, list | tuple) and value)):
        return kind(*([value] if isinstance(value, str) else value))
    if key.endswith("_joint_angle") and isinstance(value, int | float) and not isinstance(value, bool):
        given: Mapping[str, Any] = {"max": value}
    elif isinstance(value, list | tuple) and len(value) == 2 and {"min", "max"} & known.keys():
        given = {end: part for end, part in zip(("min", "max"), value, strict=True) if part is not None}
    elif isinstance(value, Mapping) and key != "custom":
        given = value
    else:
        raise CaseError(name, f"must be {_forms(key, known)}, got {type(value).__name__} {value!r:.60}")
    for each in given:
        if each not in known:
            raise CaseError(f"{name}.{each}", f"no such key; {nearest(each, known)}")
    for each, field in known.items():
        if field.default is MISSING and each not in given:
            raise CaseError(f"{name}.{each}", "is missing")
    return kind(key, **given) if kind is kinds[""] else kind(**given)  # type: ignore[call-arg]


def _forms(key: str, known: Iterable[str]) -> str:
    """Return the allowed forms of a limit's value in words.

    Args:
        key: key of the limit.
        known: names of the limit's arguments.
    """
    if key == "custom":
        return 'a list of relations such as "x1 - 1.5*x2 >= 0"'
    ends = [end for end in ("min", "max") if end in known]
    pair = f"({', '.join(end if end in ends else 'None' for end in ('min', 'max'))})"
    mapping = f"a mapping with {', '.join(known)}"
    return f"{pair}, with None for no limit, or {mapping}" if ends else mapping


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
