"""Units of a case: labels of lengths and forces, and degrees or radians in files and tables.

Computations use radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal

from ..models import Dimension
from ..models.values import dataclass

#: Largest difference from 1 of the magnitude of a unit screw, whose motion is measured by its angle or translation.
_UNIT = 1e-9


@dataclass(frozen=True)
class Units:
    """Units of a case.

    Attributes:
        length: label of the length unit for every output; lengths are never converted.
        angle: ``"deg"`` or ``"rad"``, the unit of angles in files, tables and messages.
        force: label of the unit of force; a torque is a force times a length, and speeds are per second.
    """

    length: str = "m"
    angle: Literal["deg", "rad"] = "deg"
    force: str = "N"

    def to_internal(self, value: float, dimension: Dimension) -> float:
        """Return a value in the case's unit as used in computations, in radians for an angle."""
        return math.radians(value) if self._is_degrees(dimension) else float(value)

    def shown(self, value: float, dimension: Dimension) -> float:
        """Return a computed value in the case's unit.

        Degrees are rounded to 15 significant digits, so that 30 stays 30 and does not become 29.999999999999996.
        """
        return float(f"{math.degrees(value):.15g}") if self._is_degrees(dimension) else float(value)

    def written(self, value: float, dimension: Dimension) -> float:
        """Return the value in the case's unit that :meth:`to_internal` converts back exactly, to the last bit.

        If no value in degrees does so, the result is the nearest one.
        """
        number = self.shown(value, dimension)
        if not self._is_degrees(dimension):
            return number
        exact = math.degrees(value)
        near = [number, exact, math.nextafter(exact, math.inf), math.nextafter(exact, -math.inf)]
        return min(near, key=lambda each: abs(math.radians(each) - value))

    def per_unit(self, derivative: float, dimension: Dimension) -> float:
        """Return a derivative with respect to a computed value, converted to the case's unit of the value.

        Args:
            derivative: derivative, per radian for an angle.
            dimension: dimension of the value.
        """
        return derivative * self.to_internal(1.0, dimension)

    def label(self, dimension: Dimension) -> str:
        """Return the label of the unit; empty for a dimensionless value."""
        return {
            Dimension.LENGTH: self.length,
            Dimension.ANGLE: self.angle,
            Dimension.NUMBER: "",
            Dimension.FORCE: self.force,
            Dimension.TORQUE: f"{self.force} {self.length}",
            Dimension.SPEED: f"{self.length}/s",
            Dimension.TURN_SPEED: f"{self.angle}/s",
            Dimension.POWER: f"{self.force} {self.length}/s",
        }[dimension]

    def text(self, value: float, dimension: Dimension) -> str:
        """Return a computed value with its unit, for messages."""
        return f"{self.shown(value, dimension):.10g} {self.label(dimension)}".strip()

    def _is_degrees(self, dimension: Dimension) -> bool:
        return dimension in (Dimension.ANGLE, Dimension.TURN_SPEED) and self.angle == "deg"


def rate_unit(twist: Iterable[float], units: Units, dimension: Dimension = Dimension.LENGTH) -> str:
    """Return the unit of a rate: per radian or length of a unit screw, else per unit of time.

    Args:
        twist: (6,) angular velocity, then velocity at the world origin.
        units: units of the case.
        dimension: dimension of the coordinate with the rate: length for a limb's wrench or a slide, angle for a hinge,
            with rates in radians.
    """
    own = "rad" if dimension is Dimension.ANGLE else units.length
    return own + _per_motion(twist, units)


def slope_unit(label: str | None) -> str:
    """Return the unit of the derivative of F with respect to a value with the given unit label, if any."""
    if not label:
        return "F per 1"
    return f"F/({label})" if "/" in label else f"F per {label}" if " " in label else f"F/{label}"


def twist_units(twist: Iterable[float], units: Units) -> tuple[str, ...]:
    """Return the units of a twist's six components: angular velocity, then velocity at the world origin.

    Args:
        twist: (6,) components of the twist.
        units: units of the case.
    """
    per = _per_motion(twist, units)
    return (*[f"rad{per}"] * 3, *[f"{units.length}{per}"] * 3)


def _per_motion(twist: Iterable[float], units: Units) -> str:
    """Return the denominator of a unit: per radian or length of a unit screw, else per unit of time."""
    parts = [float(part) for part in twist]
    omega, v = math.hypot(*parts[:3]), math.hypot(*parts[3:])
    if abs(omega - 1) <= _UNIT:
        return "/rad"
    if omega == 0 and abs(v - 1) <= _UNIT:
        return f"/{units.length}"
    return " per unit of time"


def objective_unit(twists: Iterable[Iterable[float]], units: Units) -> str:
    """Return the unit of F, the squared unit of the rates; empty if it differs between tasks.

    Args:
        twists: twists (6,) of the tasks in F.
        units: units of the case.
    """
    found = {rate_unit(twist, units) for twist in twists}
    return f"({found.pop()})²" if len(found) == 1 else ""
