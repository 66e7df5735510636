"""Quantities of actuators that loads and motions demand: coordinate, force, speed and power."""

from __future__ import annotations

import enum
from typing import NamedTuple


class ActuatorQuantity(enum.Enum):
    """Kinds of quantities of an actuator; each value is the word in results."""

    COORDINATE = "coordinate"
    FORCE = "force"
    SPEED = "speed"
    POWER = "power"


class Motor(NamedTuple):
    """Quantity of one actuator under one load case.

    Attributes:
        number: kind of the quantity.
        place: index of the actuator.
        actuator: name of the actuator.
        load: name of the load case; empty for a quantity that does not depend on loads.
        is_backwards: If true, the power is that of negative forces.
    """

    number: ActuatorQuantity = ActuatorQuantity.FORCE
    place: int = 0
    actuator: str = ""
    load: str = ""
    is_backwards: bool = False

    @property
    def whose(self) -> tuple[int, str]:
        """Actuator and load case; quantities with the same pair are searched together."""
        return self.place, self.load
