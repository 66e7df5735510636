"""Conventions of a controller: units, zero and sense of each actuator, and its world frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Literal

from ...models.values import dataclass

#: Metres in a unit of length, for units with a known size.
METRES: Mapping[str, float] = MappingProxyType(
    {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9, "km": 1e3}
    | {"in": 0.0254, "inch": 0.0254, "ft": 0.3048}
)


@dataclass(frozen=True, eq=False)
class Controller:
    """Conventions of a controller, which differ from those of the case.

    Attributes:
        length: unit of length; empty for that of the case.
        angle: unit of actuator angles and of roll, pitch and yaw.
        zero: value of an actuator coordinate of the controller where that of the case is 0, by actuator; radians or
            length of the case. An empty name stands for all other actuators.
        sign: 1 or -1, the sense of an actuator coordinate relative to the case, by actuator; an empty name as above.
        offset: origin of the controller's world frame in the world frame of the case, length of the case.
        turn: roll, pitch and yaw of the controller's world frame in the world frame of the case, radians.
    """

    length: str = ""
    angle: Literal["deg", "rad"] = "rad"
    zero: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    sign: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def zero_of(self, actuator: str) -> float:
        """Return the zero of an actuator by its name."""
        return self.zero.get(actuator, self.zero.get("", 0.0))

    def sign_of(self, actuator: str) -> int:
        """Return the sense of an actuator by its name."""
        return self.sign.get(actuator, self.sign.get("", 1))


#: The conventions of the case itself, with angles in radians.
SAME = Controller()
