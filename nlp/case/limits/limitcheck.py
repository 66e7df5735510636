"""Limits checked against the robot they are for, in the words of a case file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ....models import Dimension, Model
from ...errors import CaseError, listing
from ...units import Units
from .limits import Cone, Interval, Limits, MountingPose, Triple

#: Limits that need to know where a leg's joints are.
_OF_LEGS = (
    "leg_length",
    "actuator",
    "base_joint_angle",
    "platform_joint_angle",
    "joint_spacing",
    "footprint",
    "radius_ratio",
    "leg_clearance",
)


def checked_limits(limits: Limits, model: Model, units: Units) -> None:
    """Check limits against the robot they are for.

    Raises:
        CaseError: a number is out of its range, two sides are crossed, or the robot has no such measure.
    """
    _check_measures(limits, model)
    for number in _numbers(limits, model):
        number.check(units)
    dimensions = {quantity.name: quantity.dimension for quantity in model.quantities}
    for name, interval in _intervals(limits):
        _check_sides(f"limits.{name}", interval, dimensions.get(name, Dimension.NUMBER), units)
    for name in ("actuator", "footprint"):
        given = getattr(limits, name)
        if given is not None and all(getattr(given, part) is None for part in given.__dataclass_fields__):
            raise CaseError(f"limits.{name}", f"must have {' or '.join(given.__dataclass_fields__)}")
    for name in ("base_joint_angle", "platform_joint_angle"):
        cone = getattr(limits, name)
        if cone is not None:
            _check_axes(f"limits.{name}.about", cone, len(model.legs))


@dataclass(frozen=True)
class _Number:
    """A number of a limit: its key, and what it must be above and at most."""

    key: str
    value: float | None
    dimension: Dimension = Dimension.LENGTH
    above: float = 0.0
    most: float = math.inf

    def check(self, units: Units) -> None:
        if self.value is None or (math.isfinite(self.value) and self.above < self.value <= self.most):
            return
        allowed = f"above {units.text(self.above, self.dimension)}" if math.isfinite(self.above) else "finite"
        if math.isfinite(self.most):
            allowed += f" and at most {units.text(self.most, self.dimension)}"
        shown = units.shown(self.value, self.dimension) if math.isfinite(self.value) else self.value
        raise CaseError(f"limits.{self.key}", f"must be {allowed}", shown)


def _numbers(limits: Limits, model: Model) -> Iterator[_Number]:
    dimensions = {quantity.name: quantity.dimension for quantity in model.quantities}
    for name, interval in _intervals(limits):
        above = -math.inf if name in limits.quantities else 0.0
        dimension = dimensions.get(name, Dimension.NUMBER)
        yield _Number(f"{name}.min", interval.min, dimension, above)
        yield _Number(f"{name}.max", interval.max, dimension, above)
    for name, parts in (("actuator", ("stroke_max", "dead_length")), ("footprint", ("base", "platform"))):
        for part in parts:
            yield _Number(f"{name}.{part}", getattr(getattr(limits, name), part, None))
    for name in ("base_joint_angle", "platform_joint_angle"):
        yield _Number(f"{name}.max", getattr(getattr(limits, name), "max", None), Dimension.ANGLE, most=math.pi)
    yield _Number("joint_spacing.min", limits.joint_spacing)
    yield _Number("leg_clearance.min", limits.leg_clearance)
    for name, side, above in (("condition_number", "max", 1.0), ("smallest_singular_value", "min", 0.0)):
        given = getattr(limits, name)
        yield _Number(f"{name}.{side}", getattr(given, "limit", None), Dimension.NUMBER, above)
        yield _Number(f"{name}.length", getattr(given, "length", None))
    yield _Number("rate_share.max", limits.rate_share, Dimension.NUMBER, most=1.0)


def _check_sides(key: str, interval: Interval, dimension: Dimension, units: Units) -> None:
    if interval.min is None and interval.max is None:
        raise CaseError(key, "must have min, max, or both")
    if interval.min is not None and interval.max is not None and not interval.min < interval.max:
        fault = f"must be below max = {units.text(interval.max, dimension)}"
        raise CaseError(f"{key}.min", fault, units.shown(interval.min, dimension))


def _check_measures(limits: Limits, model: Model) -> None:
    known = [quantity.name for quantity in model.quantities]
    always = ["condition_number", "smallest_singular_value", "rate_share", "custom"]
    asked = [name for name in _OF_LEGS if getattr(limits, name) is not None and not model.legs]
    # Without legs, a measure of the same name that a model has itself is limited as it is.
    for name in [*limits.quantities, *asked]:
        if name not in known or (name in asked and name != "leg_length"):
            has = listing(dict.fromkeys([*(_OF_LEGS if model.legs else []), *known, *always]))
            raise CaseError(f"limits.{name}", f"is nothing that {model.name!r} has; it has {has}")


def _intervals(limits: Limits) -> Iterator[tuple[str, Interval]]:
    for name in ("leg_length", "radius_ratio"):
        if (given := getattr(limits, name)) is not None:
            yield name, given
    yield from limits.quantities.items()


def _check_axes(key: str, cone: Cone, legs: int) -> None:
    if cone.about is None:
        return
    axes: Sequence[Triple] = [cone.about.axis] if isinstance(cone.about, MountingPose) else cone.about
    if len(axes) not in (1, legs):
        raise CaseError(key, f"must be one direction, or one for each of the {legs} legs, got {len(axes)}")
    for axis in axes:
        if len(axis) != 3 or not all(map(math.isfinite, axis)) or not any(axis):
            raise CaseError(key, "must be three finite numbers that are not all zero", list(axis))
    if isinstance(cone.about, MountingPose) and not all(map(math.isfinite, (*cone.about.position, cone.about.angle))):
        raise CaseError(key, "must be a pose of finite numbers")
