"""Units of a case: labels for lengths, and degrees or radians for people; inside, angles are always radians."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from ..models import Dimension

#: A twist whose size is within this of 1 is a unit screw: its motion is measured by its angle, or by its way.
_UNIT = 1e-9


@dataclass(frozen=True)
class Units:
    """The units a case is written in.

    Attributes:
        length: label of the length unit; numbers are never converted, it is carried to every output.
        angle: ``"deg"`` or ``"rad"``, the unit of angles in files, tables and messages.
    """

    length: str = "m"
    angle: Literal["deg", "rad"] = "deg"

    def to_internal(self, value: float, dimension: Dimension) -> float:
        """A number in the case's unit, as it is used in computations."""
        return math.radians(value) if self._is_degrees(dimension) else float(value)

    def shown(self, value: float, dimension: Dimension) -> float:
        """A number from a computation, in the case's unit.

        Degrees are rounded to 15 significant digits, so that 30 comes back as 30 and not as 29.999999999999996.
        """
        return float(f"{math.degrees(value):.15g}") if self._is_degrees(dimension) else float(value)

    def label(self, dimension: Dimension) -> str:
        """Label of the unit; empty for a plain number."""
        return {Dimension.LENGTH: self.length, Dimension.ANGLE: self.angle, Dimension.NUMBER: ""}[dimension]

    def text(self, value: float, dimension: Dimension) -> str:
        """A number with its unit, for messages."""
        return f"{self.shown(value, dimension):.10g} {self.label(dimension)}".strip()

    def _is_degrees(self, dimension: Dimension) -> bool:
        return dimension is Dimension.ANGLE and self.angle == "deg"


def rate_unit(twist: Iterable[float], units: Units) -> str:
    """Unit of a limb's rate in a twist (6,): length per radian of a unit screw, or else per unit of time."""
    parts = [float(part) for part in twist]
    omega, v = math.hypot(*parts[:3]), math.hypot(*parts[3:])
    if abs(omega - 1) <= _UNIT:
        return f"{units.length}/rad"
    if omega == 0 and abs(v - 1) <= _UNIT:
        return f"{units.length}/{units.length}"
    return f"{units.length} per unit of time"
